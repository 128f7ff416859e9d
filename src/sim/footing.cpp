#include "sim/footing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace talus::sim {
namespace {

constexpr double hanging = 0.02, least_hanging = 0.1, buried = 0.25, least_buried = 3;  // of the height; [m]

struct Foot {
  std::string name;
  Vec3 base;
  double height = 0;
  std::array<Vec3, 2> half{Vec3::Zero(), Vec3::Zero()};  // of the section, from its middle
};

bool stands(const StructureSpec& spec) {
  return std::any_of(spec.supports.begin(), spec.supports.end(),
                     [](const auto& s) { return s.face == "-z"; });
}

std::vector<Foot> feet_of(const StructureSpec& spec, std::span<const Member> members) {
  std::vector<Foot> feet;
  const Vec3 x = 0.5 * spec.size.x() * spec.rotation.col(0), y = 0.5 * spec.size.y() * spec.rotation.col(1),
             z = spec.size.z() * spec.rotation.col(2);
  if (spec.kind == "viaduct")
    for (const Member& m : members)
      if (!m.span) feet.push_back({" " + m.name, m.base, m.length, {Vec3::Zero(), Vec3::Zero()}});
  if (spec.kind == "column" && stands(spec)) feet.push_back({"", spec.position, spec.size.z(), {x, y}});
  if (spec.kind == "box" && stands(spec))
    feet.push_back({"", spec.position - 0.5 * z, spec.size.z(), {x, y}});
  return feet;
}

Problem warning(const StructureSpec& spec, const Foot& foot, std::string rule, std::string remedy) {
  Problem p;
  p.severity = Problem::Severity::warning;
  p.key = fmt::format("structure.{}.{}", spec.name, spec.kind == "column" ? "base" : "position");
  p.value = fmt::format("foot{} at [{:.6g}, {:.6g}, {:.6g}]", foot.name, foot.base.x(), foot.base.y(),
                        foot.base.z());
  p.rule = std::move(rule);
  p.remedy = std::move(remedy);
  return p;
}

}  // namespace

std::vector<Problem> footing_problems(const StructureSpec& spec, std::span<const Member> members,
                                      const GroundHeight& ground) {
  std::vector<Problem> found;
  for (const Foot& foot : feet_of(spec, members)) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (int k = 0; k < 5; ++k) {
      const Vec3 at = foot.base +
                      (k == 0  ? 0.0
                       : k & 1 ? 1.0
                               : -1.0) *
                          foot.half[0] +
                      (k == 0  ? 0.0
                       : k & 2 ? 1.0
                               : -1.0) *
                          foot.half[1];
      const double z = ground(at);
      if (std::isfinite(z)) low = std::min(low, z), high = std::max(high, z);
    }
    const std::string set = spec.kind == "viaduct" ? "give deck_level in place of pier_height, so that the "
                                                     "piers follow the terrain, or correct the position"
                                                   : "correct its height";
    if (!(high >= low)) {
      found.push_back(warning(
          spec, foot, "no ground lies under it",
          "positions are scene coordinates: map coordinates less site.origin; or enlarge the terrain"));
    } else if (const double gap = foot.base.z() - high;
               gap > std::max(hanging * foot.height, least_hanging)) {
      found.push_back(warning(
          spec, foot,
          fmt::format(
              "it hangs {:.3g} m above the ground under it (z = {:.6g}); it is held there, in the air", gap,
              high),
          set));
    } else if (const double depth = low - foot.base.z();
               depth > std::max(buried * foot.height, least_buried)) {
      found.push_back(
          warning(spec, foot,
                  fmt::format("it lies {:.3g} m below the ground (z = {:.6g}), of {:.3g} m of height; earth "
                              "around it is not modelled, it neither holds nor loads it",
                              depth, low, foot.height),
                  set));
    }
  }
  return found;
}

std::vector<Problem> map_coordinate_problems(const StructureSpec& spec, const Vec3& origin,
                                             const TriangleSurface& terrain) {
  constexpr double over_ground = 300;  // no pier is as high [m]
  std::vector<Problem> found;
  if (spec.kind == "mesh") return found;
  Box3 bounds;
  for (const Vec3& v : terrain.vertices) bounds.extend(v);
  if (bounds.isEmpty()) return found;
  const auto error = [&](const std::string& key, std::string value, double origin_taken, std::string remedy) {
    Problem p;
    p.key = fmt::format("structure.{}.{}", spec.name, key);
    p.value = std::move(value);
    p.rule = fmt::format("is in map coordinates; a scene's are these less site.origin ({:.10g} here)",
                         origin_taken);
    p.remedy = std::move(remedy);
    found.push_back(std::move(p));
  };
  const auto inside = [&](const Vec3& at) {
    return (at.head<2>().array() >= bounds.min().head<2>().array()).all() &&
           (at.head<2>().array() <= bounds.max().head<2>().array()).all();
  };
  const Vec3 less = spec.position - origin;
  if (!inside(spec.position) && inside(less)) {
    const bool height = spec.position.z() > bounds.max().z() + over_ground;
    error(spec.kind == "column" ? "base" : "position",
          fmt::format("[{:.10g}, {:.10g}, {:.10g}]", spec.position.x(), spec.position.y(), spec.position.z()),
          origin.x(),
          fmt::format("write [{:.10g}, {:.10g}, {:.10g}]", less.x(), less.y(),
                      height ? less.z() : spec.position.z()));
  }
  for (const auto& [name, value] : spec.parameters)
    if (name == "deck_level" && value > bounds.max().z() + over_ground &&
        value - origin.z() > bounds.min().z() && value - origin.z() < bounds.max().z() + over_ground)
      error(name, fmt::format("{:.10g}", value), origin.z(),
            fmt::format("write {:.10g}", value - origin.z()));
  return found;
}

}  // namespace talus::sim
