#include "fem/structure_fem.hpp"
#include "fem/structure_plan.hpp"

extern "C" __attribute__((visibility("default"))) talus::Structure* talus_make_structure(
    const talus::StructureSpec& spec, const talus::Vec3& gravity,
    const std::function<void(const std::string&)>& report) {
  return new talus::fem::FemStructure(
      spec, gravity, report ? report : [](const std::string&) {});
}

extern "C" __attribute__((visibility("default"))) void talus_plan_structure(const talus::StructureSpec& spec,
                                                                            const talus::Vec3& gravity,
                                                                            talus::StructurePlan& plan) {
  plan = talus::fem::plan_of(spec, gravity);
}
