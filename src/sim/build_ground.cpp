#include "sim/builder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>

#include "contact/geometry/plumb.hpp"
#include "geometry/mass_properties.hpp"
#include "geometry/terrain_walls.hpp"

namespace talus::sim {

void Builder::add_terrain() {
  if (shared_ && shared_->ground()) {
    terrain_ = shared_->ground();
    return;
  }
  try {
    if (auto loaded = load_ground(world_->scene, world_->report))
      terrain_ = std::make_shared<const geometry::Terrain>(std::move(*loaded));
  } catch (const InputError& e) {
    add_problems(e.problems());
    ground_failed_ = true;  // what would stand on it cannot be told
    return;
  }
  if (!terrain_) return;
  for (const Problem& w : terrain_->warnings) world_->scene.warnings.push_back(w);
  if (terrain_->decimation_reached > 0)
    world_->notes.push_back(
        fmt::format("Terrain: {} of {} triangles are kept, within {:.3g} m of the given height everywhere.",
                    terrain_->triangles_kept, terrain_->triangles_read, terrain_->decimation_reached));
}

namespace {

/// Where walls end below ground whose lowest point is `low`, for blocks of this radius: so that scenes with
/// other blocks have the same walls, the radius is taken as 8 m, or a multiple of that by a power of 4.
double wall_bottom(double low, double radius) {
  double step = 8;
  while (step < radius) step *= 4;
  return low - 4 * step;
}

}  // namespace

void Builder::index_terrain() {
  if (!terrain_) return;
  // The walls reach below all that a block may touch before it has left the model.
  double lowest = std::numeric_limits<double>::infinity(), radius = 0;
  Eigen::AlignedBox2d plan;
  for (const Vec3& v : terrain_->surface.vertices) {
    lowest = std::min(lowest, v.z());
    plan.extend(Eigen::Vector2d(v.head<2>()));
  }
  for (const Plane& p : world_->scene.planes)
    for (int k = 0; k < 4 && p.normal.z() > 1e-3; ++k) {
      const Eigen::Vector2d corner = plan.corner(static_cast<Eigen::AlignedBox2d::CornerType>(k));
      lowest =
          std::min(lowest, p.point.z() - p.normal.head<2>().dot(corner - p.point.head<2>()) / p.normal.z());
    }
  const double ground_low = lowest;
  for (std::size_t i = 0; i < model_.blocks.size(); ++i) {
    radius = std::max(radius, model_.blocks[i].shape->radius);
    lowest = std::min(lowest, state_.blocks.c[i].z() - model_.blocks[i].shape->radius);
  }
  const double bottom = std::min(wall_bottom(ground_low, radius), lowest - 4 * radius);
  env_.terrain = shared_ && shared_->ground()
                     ? shared_->index(bottom, world_->scene.planes)
                     : std::make_shared<const contact::SurfaceIndex>(
                           geometry::with_border_walls(terrain_->surface, world_->scene.planes, bottom));
}

/// Terrain of a mesh that spans farther than rocks fall, with faces of hundreds of metres, is one in
/// millimetres or centimetres.
void Builder::check_span() {
  constexpr double farthest = 20e3, coarsest = 200;  // [m]
  if (!terrain_ || terrain_->grid.columns > 0) return;
  const Vec3 span = env_.terrain->bounds().sizes();
  double sum = 0;
  for (const auto& t : terrain_->surface.triangles)
    sum += (terrain_->surface.vertices[static_cast<std::size_t>(t[1])] -
            terrain_->surface.vertices[static_cast<std::size_t>(t[0])])
               .norm();
  const double side = sum / static_cast<double>(std::max<std::size_t>(1, terrain_->surface.triangles.size()));
  if (std::max(span.x(), span.y()) < farthest || side < coarsest) return;
  add_warnings(
      {{.severity = Problem::Severity::warning,
        .file = world_->scene.site ? world_->scene.site->terrain : "",
        .key = "site.terrain",
        .value = fmt::format("{:.4g} x {:.4g} m, faces of {:.4g} m", span.x(), span.y(), side),
        .rule = "spans farther than rocks fall, in faces larger than they are",
        .remedy = fmt::format("lengths of mesh files are metres: in millimetres it would be {:.4g} x "
                              "{:.4g} m; scale it in the program that made it",
                              1e-3 * span.x(), 1e-3 * span.y())}});
}

/// A rock larger than any, or than the ground that it is to roll on, is one in millimetres or centimetres.
void Builder::check_size(std::size_t i) {
  constexpr double largest = 100;  // [m]
  const dda::Model::Block& b = model_.blocks[i];
  Box3 box;
  for (const Vec3& x : b.shape->vertices) box.extend(x);
  const double size = box.sizes().maxCoeff();
  std::string rule;
  if (b.fixed) return;
  if (terrain_) {
    const Vec3 ground = env_.terrain->bounds().sizes();
    if (const double side = std::min(ground.x(), ground.y()); size > side)
      rule = fmt::format("is larger than the terrain, which spans {:.4g} x {:.4g} m", ground.x(), ground.y());
  }
  if (rule.empty() && size > largest)
    rule = fmt::format("is larger than {:g} m: no rock falls as one piece of that size", largest);
  if (rule.empty()) return;
  add_warnings(
      {{.severity = Problem::Severity::warning,
        .file = {},
        .key = "block." + b.name,
        .value = fmt::format("{:.4g} x {:.4g} x {:.4g} m", box.sizes().x(), box.sizes().y(), box.sizes().z()),
        .rule = rule,
        .remedy = size > 10 * largest
                      ? fmt::format("lengths are metres, those of mesh files too: in millimetres it would be "
                                    "{:.3g} m; volume or mass scale a shape",
                                    1e-3 * size)
                      : "lengths are metres, those of mesh files too: check the unit; volume or mass scale a "
                        "shape"}});
}

void Builder::check_buried(std::size_t i) {
  const Vec3& c = state_.blocks.c[i];
  const contact::Plumb plumb = contact::plumb_at(*env_.terrain, c);
  if (model_.blocks[i].ndof() == 0 || !plumb.solid) return;
  const double above = plumb.above;
  problem(fmt::format("block.{}.position", model_.blocks[i].name),
          fmt::format("[{:g}, {:g}, {:g}]", c.x(), c.y(), c.z()),
          fmt::format(
              "its centroid lies {:.6g} m below the terrain, which is solid and stands at z = {:.6g} there",
              above - c.z(), above),
          fmt::format(
              "raise it to about z = {:.6g}, then correct it by the height that talus check reports; or set "
              "site.two_sided for a sheet that has nothing below",
              above + model_.blocks[i].shape->radius));
}

void Builder::check_buried_mass() {
  int buried = 0;
  std::size_t deepest = 0;
  double most = 0;
  for (std::size_t i = single_blocks_; i < model_.blocks.size(); ++i) {
    // Of a block that is not convex the centroid may lie beside it, in the ground that it embraces.
    const Vec3 at = state_.blocks.c[i] + dda::pose(state_.blocks, static_cast<int>(i)).F *
                                             geometry::place_within(*model_.blocks[i].shape);
    const contact::Plumb plumb = contact::plumb_at(*env_.terrain, at);
    if (!plumb.solid) continue;
    const double depth = plumb.above - at.z();
    if (buried++ == 0 || depth > most) most = depth, deepest = i;
  }
  if (buried == 0) return;
  const bool cut = world_->scene.rock_mass && world_->scene.rock_mass->blocks.empty();
  problem(
      "rock_mass", "",
      fmt::format("{} of its blocks lie in the ground, {} the deepest, with its middle {:.6g} m below "
                  "the terrain",
                  buried, model_.blocks[deepest].name, most),
      cut ? "from_terrain = true cuts the region out of the terrain; else end it at the ground"
          : "give region or slip_surface with from_terrain in place of blocks, or a terrain without them");
}

/// Copies start where there is ground: what lies beside it of their area would be missed in silence.
void Builder::check_release_areas() {
  const scene::Scene& s = world_->scene;
  for (const scene::Block& b : s.blocks) {
    const bool placed = names_.count(b.name + "-1") > 0;  // else an error has told that none finds a place
    if (!b.release || b.release->at || !placed) continue;
    const std::string key = fmt::format("block.{}.release.polygon", b.name);
    const geometry::Area area = geometry::read_area(b.release->polygon, key);
    add_warnings(area.warnings);
    const geometry::AreaExtent extent = geometry::extent_of(area, s.site->origin, [&](double x, double y) {
      return std::isfinite(uppermost_ground(env_.terrain.get(), s.planes, x, y)) &&
             !terrain_->over_hole(x, y);
    });
    add_warnings(geometry::beside_ground(extent, key));
  }
}

void Builder::check_ground() {
  for (std::size_t i = 0; i < single_blocks_; ++i) check_size(i);
  check_span();
  Eigen::AlignedBox2d limits;
  if (terrain_) {
    check_release_areas();
    const Box3 box = env_.terrain->bounds();
    limits = {Eigen::Vector2d(box.min().head<2>()), Eigen::Vector2d(box.max().head<2>())};
    for (std::size_t i = 0; i < single_blocks_; ++i) check_buried(i);
    check_buried_mass();
  }
  const auto report = [&](Problem p) {
    p.file = world_->scene.file;
    (p.severity == Problem::Severity::error ? problems_ : world_->scene.warnings).push_back(std::move(p));
  };
  const std::vector<Plane>& planes = world_->scene.planes;
  std::map<std::string, std::vector<Problem>> of_mass;  // by what is to be done: one fault of its place each
  for (std::size_t i = 0; i < model_.blocks.size(); ++i)
    for (Problem& p :
         ground_problems(model_.blocks[i].name, state_.blocks.c[i], terrain_.get(), limits, !planes.empty(),
                         ground_height(env_.terrain.get(), planes, state_.blocks.c[i]))) {
      if (i < single_blocks_)
        report(std::move(p));
      else
        of_mass[p.remedy].push_back(std::move(p));
    }
  for (auto& [remedy, found] : of_mass) {
    Problem p = found.front();
    p.value = fmt::format("{} of its blocks, one at {}", found.size(), p.value);
    p.key = "rock_mass";
    report(std::move(p));
  }
}

}  // namespace talus::sim
