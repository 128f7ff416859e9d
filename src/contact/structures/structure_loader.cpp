#include "contact/structures/structure.hpp"
#include "contact/structures/structure_plan.hpp"
#include "core/module.hpp"

namespace talus {
namespace {

void* symbol(const char* name) {
  return module_symbol("libtalus_fem.so", name, "structure",
                       "build the target talus_fem, or point TALUS_MODULE_DIR to its folder");
}

}  // namespace

std::unique_ptr<Structure> load_structure(const StructureSpec& spec, const Vec3& gravity,
                                          const std::function<void(const std::string&)>& report) {
  static const auto make = reinterpret_cast<MakeStructure>(symbol("talus_make_structure"));
  return std::unique_ptr<Structure>(make(spec, gravity, report));
}

StructurePlan plan_structure(const StructureSpec& spec, const Vec3& gravity) {
  static const auto plan = reinterpret_cast<PlanStructure>(symbol("talus_plan_structure"));
  StructurePlan out;
  plan(spec, gravity, out);
  return out;
}

}  // namespace talus
