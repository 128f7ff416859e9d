#include "contact/structure.hpp"
#include "core/module.hpp"

namespace talus {

std::unique_ptr<Structure> load_structure(const StructureSpec& spec, const Vec3& gravity, const std::function<void(const std::string&)>& report) {
  static const auto make = reinterpret_cast<MakeStructure>(module_symbol("libtalus_fem.so", "talus_make_structure", "structure",
                                                                         "build the target talus_fem, or point TALUS_MODULE_DIR to its folder"));
  return std::unique_ptr<Structure>(make(spec, gravity, report));
}

}  // namespace talus
