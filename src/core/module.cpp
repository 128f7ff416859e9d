#include "core/module.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <vector>

#include "core/error.hpp"

namespace talus {

void* module_symbol(const std::string& file, const std::string& symbol, const std::string& key, const std::string& remedy) {
  namespace fs = std::filesystem;
  std::vector<fs::path> places;
  if (const char* given = std::getenv("TALUS_MODULE_DIR")) places.emplace_back(given);
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
    // Lazy binding halves the time of loading two hundred libraries. Never closed: objects of the module live until the process ends.
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
