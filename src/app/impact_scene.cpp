#include "app/impact_scene.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "geometry/free_path.hpp"
#include "geometry/mass_properties.hpp"
#include "geometry/shape.hpp"
#include "scene/document.hpp"
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

/// A viaduct whose piers reach from the terrain up to a given level of its deck.
bool follows_terrain(const StructureSpec& spec) {
  const auto has = [&](const char* name) {
    return std::any_of(spec.parameters.begin(), spec.parameters.end(),
                       [&](const auto& p) { return p.first == name; });
  };
  return spec.kind == "viaduct" && has("deck_level") && !has("pier_height");
}

/// The surface of the structure alone, as it stands before the blow: under its permanent load, or as an
/// earlier run left it.
TriangleSurface standing_skin(scene::Scene scene) {
  sim::Simulation alone(std::move(scene));
  carry_over(alone, false);
  return alone.world().system->environment().structures[0].index->surface();
}

/// What the block's line of flight, which goes through centroid and impact point, has to do with the
/// structure.
enum class Flight { meets, passes_by, has_left };

/// The block's centroid at t = 0: `clearance` before its first touch on the line of flight, which is looked
/// for from where the block stands free of the structure, at least four radii before the impact point, the
/// farther the deeper that lies inside. Where the line meets nothing, the foremost point along the flight
/// lies `clearance` before the impact point. A block whose only touch lies behind the impact point
/// `has_left`.
Vec3 starting_position(const scene::Scene& scene, const scene::Impact& impact, const TriangleSurface& skin,
                       Flight& flight) {
  const Polyhedron body = body_of(scene, impact);
  const Vec3 along = impact.velocity.normalized();
  double reach = 0;
  for (const Vec3& v : body.vertices) reach = std::max(reach, along.dot(impact.rotation * v));
  double run_up = 4 * body.radius;  // in front of all that the body's sides may meet first
  const auto behind = [&] { return Pose{impact.point - (reach + run_up) * along, impact.rotation}; };
  while (geometry::corner_inside(body, behind(), skin)) run_up += body.radius;
  const Pose there{impact.point, impact.rotation};
  const double way = geometry::free_path(body, behind(), skin, along),
               beyond = way - run_up;  // of the impact point, at the first touch
  const bool none_ahead = !std::isfinite(geometry::free_path(body, there, skin, along)),
             leaves = beyond < -0.1 * body.radius ||
                      (!std::isfinite(way) && std::isfinite(geometry::free_path(body, there, skin, -along)));
  flight = none_ahead && leaves ? Flight::has_left : std::isfinite(way) ? Flight::meets : Flight::passes_by;
  return behind().c + ((std::isfinite(way) ? way : run_up) - impact.clearance) * along;
}

std::set<int> materials_of(const scene::Site& site) {
  std::set<int> materials{site.material};
  for (const scene::Site::MaterialArea& area : site.material_areas) materials.insert(area.material);
  return materials;
}

/// Throws InputError where nothing says how the block meets the ground that the structure stands on.
void require_law_with_ground(const scene::Scene& scene, const scene::Impact& impact) {
  for (const int ground : materials_of(*scene.site)) {
    const auto pair = std::pair(std::min(ground, impact.material), std::max(ground, impact.material));
    if (std::find(scene.law_pairs.begin(), scene.law_pairs.end(), pair) != scene.law_pairs.end()) continue;
    const std::string &a = scene.materials[static_cast<std::size_t>(impact.material)].name,
                      &b = scene.materials[static_cast<std::size_t>(ground)].name;
    throw InputError(
        Problem{.file = scene.file,
                .key = "interface",
                .value = {},
                .rule = fmt::format("the structure stands on the terrain, \"{}\" and \"{}\" can meet, and no "
                                    "[[interface]] covers them",
                                    a, b),
                .remedy = fmt::format("add [[interface]] with between = [\"{}\", \"{}\"]", a, b)});
  }
}

/// A problem of the place that the block flies through, by the scene's key or the row of its trajectories.
Problem problem_of_flight(const scene::Scene& scene, const scene::Impact& impact, Problem::Severity severity,
                          std::string rule, std::string remedy) {
  const std::string point =
      fmt::format("[{:g}, {:g}, {:g}]", impact.point.x(), impact.point.y(), impact.point.z());
  const bool row = !impact.trajectory.empty();
  Problem p{.severity = severity,
            .file = scene.file,
            .key = row ? "impact.trajectories" : "impact.point",
            .value = row ? fmt::format("{}, x, y, z = {}", impact.trajectory, point) : point,
            .rule = std::move(rule),
            .remedy = std::move(remedy)};
  if (const scene::Where* place = scene::place_of(scene, p.key))
    p.file = place->file, p.line = place->line, p.column = place->column;
  return p;
}

}  // namespace

scene::Scene impact_scene(scene::Scene scene) {
  const scene::Impact impact = *scene.impact;
  scene::Block block;
  block.name = "block";
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
  // The feet of a viaduct follow the terrain, which then is there for the block, too.
  const bool on_terrain = follows_terrain(scene.structures[0]) && scene.site && scene.site->given();
  if (on_terrain) {
    if (scene.rock_mass && scene.rock_mass->from_terrain)
      throw InputError(Problem{
          .file = scene.file,
          .key = "rock_mass",
          .value = {},
          .rule =
              fmt::format("is cut out of the terrain that {} stands on; talus impact takes the terrain as it "
                          "is, without the hollow",
                          scene.structures[0].name),
          .remedy = "leave rock_mass out, or give the terrain with its hollow as site.terrain"});
    require_law_with_ground(scene, impact);
    scene.notes.push_back(
        fmt::format("The piers of {} follow the terrain (deck_level), which is therefore part of this run.",
                    scene.structures[0].name));
  } else {
    scene.site.reset();
  }
  scene.planes.clear();
  scene.rock_mass.reset();
  std::set<int> here{impact.material, struck};
  if (on_terrain) here.merge(materials_of(*scene.site));
  std::erase_if(scene.law_pairs, [&](const auto& pair) {
    return here.count(pair.first) == 0 || here.count(pair.second) == 0;
  });
  Flight flight = Flight::meets;
  block.position = starting_position(scene, impact, standing_skin(scene), flight);
  if (flight == Flight::passes_by)
    scene.warnings.push_back(
        problem_of_flight(scene, impact, Problem::Severity::warning,
                          fmt::format("on its line of flight through this point the block passes {} by",
                                      scene.structures[0].name),
                          impact.trajectory.empty()
                              ? "move the point to the structure's surface, or turn the velocity towards it"
                              : "choose another row, or move the structure into its way"));
  if (flight == Flight::has_left)
    throw InputError(problem_of_flight(
        scene, impact, Problem::Severity::error,
        fmt::format("the block flies away: {} lies behind it there", scene.structures[0].name),
        impact.trajectory.empty() ? "move the point to the side that it strikes, or turn the velocity"
                                  : "choose a row before the blow"));
  scene.blocks = {block};
  scene.prescribed_impact = true;
  scene.resolved_json = scene::resolved_json(scene);
  return scene;
}

std::string impact_line(const scene::Scene& scene) {
  const scene::Block& block = scene.blocks.front();
  const auto rounded = [](double x) { return std::abs(x) < 5e-4 ? 0.0 : x; };  // no "-0.000"
  const Vec3 at = block.position.value_or(Vec3::Zero()).unaryExpr(rounded);
  scene::Impact impact;
  impact.material = block.material;
  impact.shape = block.shape;
  const double mass = geometry::volume(body_of(scene, impact)) *
                      scene.materials[static_cast<std::size_t>(block.material)].density,
               speed = block.velocity.norm();
  return fmt::format(
      "talus impact: the block is aimed at {} with {:.4g} m/s, {:.4g} kJ; it starts at [{:.3f}, {:.3f}, "
      "{:.3f}].",
      scene.structures.front().name, speed, 0.5e-3 * mass * speed * speed, at.x(), at.y(), at.z());
}

}  // namespace talus::app
