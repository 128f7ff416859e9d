// talus impact: a structure alone, and the one block of [impact] on its way to it.
#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "geometry/shape.hpp"

namespace talus::app {
namespace {

/// The block's centroid at t = 0: its foremost point along the flight lies `clearance` before the impact point, and the
/// line of flight goes through centroid and impact point.
Vec3 starting_position(const scene::Scene& scene, const scene::Impact& impact) {
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
  const Polyhedron body = geometry::make_shape(spec);
  const Vec3 along = impact.velocity.normalized();
  double reach = 0;
  for (const Vec3& v : body.vertices) reach = std::max(reach, along.dot(impact.rotation * v));
  return impact.point - (reach + impact.clearance) * along;
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
  block.position = starting_position(scene, impact);
  block.rotation = impact.rotation;
  block.velocity = impact.velocity;
  block.spin = impact.spin;
  block.deformable = impact.deformable;
  const int struck = scene.structures[static_cast<std::size_t>(impact.structure)].material;

  scene.structures = {scene.structures[static_cast<std::size_t>(impact.structure)]};
  scene.blocks = {block};
  scene.impact.reset();
  scene.site.reset();
  scene.planes.clear();
  scene.rock_mass.reset();
  const std::set<int> here{impact.material, struck};
  std::erase_if(scene.law_pairs, [&](const auto& pair) { return here.count(pair.first) == 0 || here.count(pair.second) == 0; });
  scene.resolved_json = scene::resolved_json(scene);
  return run_scene(std::move(scene), options, false);   // an earlier impact's block is not this one
}

}  // namespace talus::app
