#include "fem/output/place_in_words.hpp"

#include <fmt/format.h>

#include <limits>

#include "core/place.hpp"
#include "fem/discretisation/viaduct.hpp"
#include "fem/members/members.hpp"

namespace talus::fem {
namespace {

std::string part_of(const StructureSpec& spec, int component, const Vec3& at) {
  const ViaductPlan plan = viaduct_plan(spec);
  const auto part = static_cast<std::size_t>(component);
  if (part < plan.parts.size() && plan.parts[part].deck >= 0)
    return fmt::format("deck of span {} ", plan.parts[part].deck + 1);
  const Pier* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Pier& pier : plan.piers) {
    const Vec3 axis = pier.axis(), from = at - pier.shape.base;
    if (const double aside = (from - axis.dot(from) * axis).norm(); aside < least)
      least = aside, nearest = &pier;
  }
  if (nearest == nullptr) return "";
  return (nearest->axis().dot(at - nearest->shape.base) > nearest->clear ? "cap beam over " : "pier ") +
         nearest->name + " ";
}

}  // namespace

std::string place_in_words(const StructureSpec& spec, const HexMesh& mesh, int cell) {
  const bool parts = spec.kind == "viaduct" && static_cast<std::size_t>(cell) < mesh.component.size();
  return place_in_words(spec, cell_centre(mesh, cell),
                        parts ? mesh.component[static_cast<std::size_t>(cell)] : -1);
}

std::string place_in_words(const StructureSpec& spec, const Vec3& at, int component) {
  return (component >= 0 ? part_of(spec, component, at) : "") + "at " + place_text(at);
}

}  // namespace talus::fem
