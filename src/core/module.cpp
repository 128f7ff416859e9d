#include "core/module.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <vector>

#include "core/error.hpp"

namespace talus {

namespace {
std::vector<std::filesystem::path>& further_places() {
  static std::vector<std::filesystem::path> places;
  return places;
}
}  // namespace

void add_module_directory(const std::filesystem::path& directory) { further_places().push_back(directory); }

void* module_symbol(const std::string& file, const std::string& symbol, const std::string& key,
                    const std::string& remedy) {
  namespace fs = std::filesystem;
  std::vector<fs::path> places;
  if (const char* given = std::getenv("TALUS_MODULE_DIR")) places.emplace_back(given);
  places.insert(places.end(), further_places().begin(), further_places().end());
  // Beside the object that this code is in: a module finds the others whatever program has loaded it.
  // Never a name without a directory, which the working directory would answer.
  if (Dl_info own; dladdr(reinterpret_cast<const void*>(&module_symbol), &own) != 0 && own.dli_fname)
    if (const fs::path object = own.dli_fname; object.is_absolute()) places.push_back(object.parent_path());
  std::error_code failed;
  const fs::path executable = fs::read_symlink("/proc/self/exe", failed);
  if (!failed) {
    places.push_back(executable.parent_path());
    places.push_back(executable.parent_path().parent_path() / "lib" / "talus");
  }
  Problem p;
  p.key = key;
  p.remedy = remedy;
  std::string tried;
  for (const fs::path& place : places) {
    const fs::path path = place / file;
    if (!fs::exists(path, failed)) {
      tried += (tried.empty() ? "" : ", ") + path.string();
      continue;
    }
    // Lazy binding halves the time of loading two hundred libraries. Never closed: objects of the module live
    // until the process ends.
    void* handle = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
    if (!handle) {
      p.rule = dlerror();
      throw InputError(p);
    }
    if (void* address = dlsym(handle, symbol.c_str())) return address;
    p.rule = path.string() + " has no function " + symbol;
    p.remedy = "build the program and its modules from the same source";
    throw InputError(p);
  }
  p.rule = "the module " + file + " is not there (looked for " + tried + ")";
  throw InputError(p);
}

}  // namespace talus
