// talus impact: a structure alone, and the one block of [impact] on its way to it.
#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "geometry/free_path.hpp"
#include "geometry/shape.hpp"
#include "sim/simulation.hpp"
#include "sim/world.hpp"

namespace talus::app {
namespace {

Polyhedron body_of(const scene::Scene& scene, const scene::Impact& impact) {
  geometry::ShapeSpec spec;
  const scene::Shape& s = impact.shape;
  spec.kind = s.kind;
  spec.size = s.size;
  spec.diameter = s.diameter;
  spec.longitudes = s.longitudes;
  spec.latitudes = s.latitudes;
  spec.vertices = s.vertices;
  spec.file = s.file;
  spec.volume = s.volume;
  spec.mass = s.mass;
  spec.density = scene.materials[static_cast<std::size_t>(impact.material)].density;
  spec.seed = s.seed;
  spec.aspect = s.aspect;
  return geometry::make_shape(spec);
}

/// The skin of the structure alone, as it stands before the blow: under its permanent load, or as an earlier run left it.
TriangleSurface standing_skin(scene::Scene scene) {
  sim::Simulation alone(std::move(scene));
  carry_over(alone, false);
  return alone.world().system->environment().structures[0].index->surface();
}

/// The block's centroid at t = 0: `clearance` before its first touch on the line of flight, which goes through centroid and impact point. Where that line
/// meets nothing (`meets` tells), the foremost point along the flight lies `clearance` before the impact point.
Vec3 starting_position(const scene::Scene& scene, const scene::Impact& impact, const TriangleSurface& skin, bool& meets) {
  const Polyhedron body = body_of(scene, impact);
  const Vec3 along = impact.velocity.normalized();
  double reach = 0;
  for (const Vec3& v : body.vertices) reach = std::max(reach, along.dot(impact.rotation * v));
  constexpr double run_up = 4;   // radii: in front of all that the body's sides may meet first
  const Pose behind{impact.point - (reach + run_up * body.radius) * along, impact.rotation};
  const double way = geometry::free_path(body, behind, skin, along);
  meets = std::isfinite(way);
  return behind.c + ((std::isfinite(way) ? way : run_up * body.radius) - impact.clearance) * along;
}

}  // namespace

int command_impact(const Options& options) {
  scene::Scene scene = scene::read_scene(options.input, options.overrides());
  // scene.resolved.json of an impact run holds the block itself.
  if (!scene.impact) {
    Problem problem;
    problem.file = options.input;
    problem.key = "impact";
    problem.rule = "the scene has no [impact]";
    problem.remedy = "add [impact] with material, shape, velocity and point: see talus explain impact";
    throw InputError(problem);
  }
  const scene::Impact impact = *scene.impact;
  scene::Block block;
  block.name = "impact";
  block.material = impact.material;
  block.shape = impact.shape;
  block.rotation = impact.rotation;
  block.velocity = impact.velocity;
  block.spin = impact.spin;
  block.deformable = impact.deformable;
  const int struck = scene.structures[static_cast<std::size_t>(impact.structure)].material;

  scene.structures = {scene.structures[static_cast<std::size_t>(impact.structure)]};
  scene.impact.reset();
  scene.blocks.clear();
  scene.site.reset();
  scene.planes.clear();
  scene.rock_mass.reset();
  const std::set<int> here{impact.material, struck};
  std::erase_if(scene.law_pairs, [&](const auto& pair) { return here.count(pair.first) == 0 || here.count(pair.second) == 0; });
  bool meets = true;
  block.position = starting_position(scene, impact, standing_skin(scene), meets);
  if (!meets)
    scene.warnings.push_back({.severity = Problem::Severity::warning, .file = scene.file, .key = "impact.point", .value = fmt::format("[{:g}, {:g}, {:g}]", impact.point.x(), impact.point.y(), impact.point.z()),
                              .rule = fmt::format("on its line of flight through this point the block passes {} by", scene.structures[0].name),
                              .remedy = "move the point to the structure's surface, or turn the velocity towards it"});
  scene.blocks = {block};
  scene.prescribed_impact = true;
  scene.resolved_json = scene::resolved_json(scene);
  return run_scene(std::move(scene), options, false);   // an earlier impact's block is not this one
}

}  // namespace talus::app
