#include <dlfcn.h>
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

#include "contact/structure.hpp"
#include "core/error.hpp"

namespace talus {
namespace {

constexpr const char* module_name = "libtalus_fem.so";

MakeStructure find_module() {
  namespace fs = std::filesystem;
  std::vector<fs::path> places;
  if (const char* given = std::getenv("TALUS_MODULE_DIR")) places.emplace_back(given);
  std::error_code failed;
  const fs::path executable = fs::read_symlink("/proc/self/exe", failed);
  if (!failed) {
    places.push_back(executable.parent_path());
    places.push_back(executable.parent_path().parent_path() / "lib" / "talus");
  }
  std::string tried;
  for (const fs::path& place : places) {
    const fs::path file = place / module_name;
    if (!fs::exists(file, failed)) {
      tried += (tried.empty() ? "" : ", ") + file.string();
      continue;
    }
    // Lazy binding halves the time of loading two hundred libraries. Never closed: objects of the module live until the process ends.
    void* handle = dlopen(file.c_str(), RTLD_LAZY | RTLD_LOCAL);
    if (!handle) {
      Problem p;
      p.key = file.string();
      p.rule = dlerror();
      p.remedy = "install the packages of packages.txt (make setup) and build again";
      throw InputError(p);
    }
    if (auto* make = reinterpret_cast<MakeStructure>(dlsym(handle, "talus_make_structure"))) return make;
    Problem p;
    p.key = file.string();
    p.rule = "the module has no function talus_make_structure";
    p.remedy = "build the program and the module from the same source";
    throw InputError(p);
  }
  Problem p;
  p.key = "structure";
  p.rule = "the scene has a structure, and the structure module is not there (looked for " + tried + ")";
  p.remedy = "build the target talus_fem (it needs deal.II), or point TALUS_MODULE_DIR to its folder";
  throw InputError(p);
}

}  // namespace

std::unique_ptr<Structure> load_structure(const StructureSpec& spec, const Vec3& gravity, const std::function<void(const std::string&)>& report) {
  static const MakeStructure make = find_module();
  return std::unique_ptr<Structure>(make(spec, gravity, report));
}

}  // namespace talus
