#include "sim/ground.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "contact/geometry/plumb.hpp"
#include "geometry/cut.hpp"
#include "geometry/random.hpp"
#include "geometry/raster.hpp"
#include "geometry/take_out.hpp"

namespace talus::sim {
namespace {

constexpr int most_tries = 2000;  // for the next place that is free, within the polygons and on the ground

/// Uniform over all orientations [Shoemake 1992].
Mat3 random_rotation(geometry::Random& random) {
  const double u = random.uniform(), a = 2 * M_PI * random.uniform(), b = 2 * M_PI * random.uniform();
  const double p = std::sqrt(1 - u), q = std::sqrt(u);
  return Quat(q * std::cos(b), p * std::sin(a), p * std::cos(a), q * std::sin(b))
      .normalized()
      .toRotationMatrix();
}

/// Highest ground within a rectangle: terrain and planes; -infinity without any.
double highest_ground(const geometry::Terrain* terrain, const std::vector<Plane>& planes,
                      const Eigen::AlignedBox2d& plan) {
  double z =
      terrain ? geometry::highest_within(terrain->surface, plan) : -std::numeric_limits<double>::infinity();
  for (const Plane& p : planes)
    if (p.normal.z() > 1e-9)
      for (int k = 0; k < 4; ++k) {
        const double x = k & 1 ? plan.max().x() : plan.min().x(), y = k & 2 ? plan.max().y() : plan.min().y();
        z = std::max(z, p.point.z() - (p.normal.x() * (x - p.point.x()) + p.normal.y() * (y - p.point.y())) /
                                          p.normal.z());
      }
  return z;
}

}  // namespace

namespace {

std::vector<geometry::Roughness> roughness_of(const scene::Site& site) {
  std::vector<geometry::Roughness> out;
  for (const auto& r : site.roughness)
    out.push_back({r.material, r.surface.amplitude, r.surface.length, r.surface.seed});
  return out;
}

/// `slip`: the surface that a rock mass is to be cut out along.
geometry::Terrain load_site(const scene::Site& site, const TriangleSurface* slip, bool rough) {
  geometry::TerrainOptions o;
  o.two_sided = site.two_sided;
  o.default_material = site.material;
  o.origin = site.origin;
  o.crop = site.crop;
  o.decimation_error = site.decimation_error;
  o.widen = site.widen;
  o.crs = site.crs;
  o.breaklines = site.breaklines;
  for (const auto& a : site.material_areas)
    o.material_areas.push_back({a.polygon_file, a.raster_file, a.value, a.material, a.part, a.mesh_file});
  o.up = site.up;
  o.beside = slip;
  if (rough) o.roughness = roughness_of(site);
  if (site.faces.empty()) return geometry::load_terrain(site.terrain, o);
  std::vector<geometry::SlopeFace> faces;
  for (const auto& f : site.faces) faces.push_back({f.dip, f.length});
  TriangleSurface slope = geometry::slope_from_faces(site.crest, site.dip_direction, faces, site.width);
  return geometry::make_terrain(std::move(slope.vertices), std::move(slope.triangles), o, "site.face");
}

/// Roughness of the ground beside a hollow, which keeps the shape of what was taken out.
void roughen_beside(TriangleSurface& ground, const std::vector<char>& hollow, const scene::Site& site) {
  if (site.roughness.empty()) return;
  int aside = ground.default_material;
  for (const int m : ground.material) aside = std::max(aside, m);
  for (const auto& r : site.roughness) aside = std::max(aside, r.material);
  ++aside;
  int bed = aside;
  for (std::size_t t = 0; t < hollow.size(); ++t)
    if (hollow[t] != 0) bed = std::exchange(ground.material[t], aside);
  geometry::roughen(ground, roughness_of(site), site.origin);
  std::replace(ground.material.begin(), ground.material.end(), aside, bed);
}

/// The sides of a box are where the modeller cuts, no joints: its hollow is wider by a hair. What fills the
/// space between two walls to the last digit can press on them as hard as it likes, and friction that nothing
/// asks for would hold it (docs/theory/contact.md, Limits).
Box3 with_play(const Box3& box) {
  constexpr double part = 1e-4;  // of its size in plan: beyond what positions drift by, far below a joint
  const Vec3 play = part * box.sizes().head<2>().norm() * Vec3(1, 1, 0);
  return {box.min() - play, box.max() + play};
}

/// The terrain without the rock mass.
geometry::Terrain load_without(const scene::RockMass& mass, const scene::Site& site,
                               const std::function<void(const std::string&)>& report) {
  std::optional<TriangleSurface> slip;
  std::string slip_crs;
  std::optional<geometry::Mesh> region;
  if (!mass.slip_surface.empty()) {
    geometry::TerrainOptions o;
    o.origin = site.origin;
    o.crs = site.crs;
    o.up = site.up;
    geometry::Terrain loaded = geometry::load_terrain(mass.slip_surface, o);
    slip = std::move(loaded.surface);
    slip_crs = std::move(loaded.crs);
  }
  if (mass.box || !mass.region.empty()) region = geometry::region_mesh(mass.region, mass.box);
  // Decimated together, slip surface and terrain go on coinciding where they do. The mass lies between the
  // surfaces as they are given; what stays is roughened.
  geometry::Terrain terrain = load_site(site, slip ? &*slip : nullptr, false);
  geometry::agree_on_crs(terrain.crs, slip_crs, site.origin.head<2>(), mass.slip_surface,
                         "rock_mass.slip_surface");
  if (terrain.beside) slip = std::move(terrain.beside);
  terrain.beside.reset();
  if (report)
    report(fmt::format("progress: rock mass: taking it out of a terrain of {} triangles",
                       terrain.surface.triangles.size()));
  geometry::TakenOut out =
      geometry::take_out(terrain.surface, slip ? &*slip : nullptr, region ? &*region : nullptr,
                         mass.bed_material, mass.least_volume);
  if (mass.box) {
    const geometry::Mesh around = geometry::region_mesh({}, with_play(*mass.box));
    geometry::TakenOut hollow = geometry::take_out(terrain.surface, slip ? &*slip : nullptr, &around,
                                                   mass.bed_material, mass.least_volume);
    out.ground = std::move(hollow.ground);
    out.hollow = std::move(hollow.hollow);
  }
  roughen_beside(out.ground, out.hollow, site);
  terrain.warnings.insert(terrain.warnings.end(), out.warnings.begin(), out.warnings.end());
  terrain.surface = std::move(out.ground);
  terrain.taken_out = std::move(out.mass);
  return terrain;
}

}  // namespace

std::optional<geometry::Terrain> load_ground(const scene::Scene& scene,
                                             const std::function<void(const std::string&)>& report) {
  if (!scene.site || !scene.site->given()) return std::nullopt;
  geometry::check_crs(scene.site->crs, scene.file, "site.crs");
  geometry::Terrain terrain = scene.rock_mass && scene.rock_mass->from_terrain
                                  ? load_without(*scene.rock_mass, *scene.site, report)
                                  : load_site(*scene.site, nullptr, true);
  Box3 box;
  for (const Vec3& v : terrain.surface.vertices) box.extend(v);
  geometry::check_lengths(terrain.crs, (box.center() + scene.site->origin).head<2>(), scene.file,
                          "site.terrain");
  return terrain;
}

std::vector<std::pair<Vec3, Mat3>> release_places(const scene::Release& release, const Polyhedron& body,
                                                  const scene::Scene& scene, const geometry::Terrain* terrain,
                                                  std::string& crs, Occupied& occupied) {
  const geometry::Area area = geometry::read_area(release.polygon, "release.polygon");
  geometry::agree_on_crs(crs, area.crs, area.limits().center(), release.polygon, "release.polygon");
  const Vec3 origin = scene.site ? scene.site->origin : Vec3::Zero();
  const Eigen::AlignedBox2d limits = area.limits().translate(-origin.head<2>());
  geometry::Random random(release.seed * 2654435761ull + 1);
  std::vector<std::pair<Vec3, Mat3>> places;
  bool over_ground = false;
  const std::string degrees = geometry::remedy_for_degrees(
      {Eigen::Vector2d(limits.min() + origin.head<2>()), Eigen::Vector2d(limits.max() + origin.head<2>())});
  for (int tries = 0; static_cast<int>(places.size()) < release.count; ++tries) {
    if (tries == most_tries)
      throw InputError(Problem{
          .file = release.polygon,
          .key = over_ground ? "release.count" : "release.polygon",
          .value = over_ground
                       ? fmt::format("{}", release.count)
                       : fmt::format("x {:.6g} to {:.6g}, y {:.6g} to {:.6g} in scene coordinates",
                                     limits.min().x(), limits.max().x(), limits.min().y(), limits.max().y()),
          .rule = over_ground ? fmt::format("only {} blocks find room in the area", places.size())
                              : "no place of the area lies over the terrain",
          .remedy = over_ground ? "enlarge the area, or release fewer or smaller blocks"
                    : degrees.empty()
                        ? "give the polygon in the terrain's coordinate system, and site.origin as well"
                        : degrees});
    const double x = limits.min().x() + random.uniform() * limits.sizes().x(),
                 y = limits.min().y() + random.uniform() * limits.sizes().y();
    const Mat3 rotation = release.turn ? random_rotation(random) : Mat3::Identity();
    if (!area.contains(x + origin.x(), y + origin.y())) continue;
    Box3 box;
    for (const Vec3& v : body.vertices) box.extend(rotation * v);
    const Eigen::Vector2d at(x, y);
    const double z =
        highest_ground(terrain, scene.planes, {at + box.min().head<2>(), at + box.max().head<2>()});
    if (!std::isfinite(z) || (terrain && terrain->over_hole(x, y))) continue;
    over_ground = true;
    const Vec3 c(x, y, z + release.height - box.min().z());
    const bool is_free = std::none_of(occupied.begin(), occupied.end(), [&](const auto& o) {
      return (o.first - c).norm() < o.second + body.radius;
    });
    if (!is_free) continue;
    occupied.emplace_back(c, body.radius);
    places.emplace_back(c, rotation);
    tries = 0;
  }
  return places;
}

Vec3 place_above(const scene::Release& release, const Polyhedron& body, const Mat3& rotation,
                 const scene::Scene& scene, const geometry::Terrain* terrain) {
  const Eigen::Vector2d at = *release.at;
  Box3 box;
  for (const Vec3& v : body.vertices) box.extend(rotation * v);
  const double z =
      highest_ground(terrain, scene.planes, {at + box.min().head<2>(), at + box.max().head<2>()});
  if (!std::isfinite(z) || (terrain && terrain->over_hole(at.x(), at.y())))
    throw InputError(Problem{.file = scene.file,
                             .key = "release.at",
                             .value = fmt::format("[{:g}, {:g}]", at.x(), at.y()),
                             .rule = "there is no ground below",
                             .remedy = "name a place over the terrain, in scene coordinates"});
  return {at.x(), at.y(), z + release.height - box.min().z()};
}

double ground_height(const contact::SurfaceIndex* terrain, const std::vector<Plane>& planes, const Vec3& at) {
  double z = terrain ? contact::plumb_at(*terrain, at).floor : std::numeric_limits<double>::quiet_NaN();
  for (const Plane& p : planes)
    if (p.normal.z() > 1e-9)
      z = std::fmax(
          z, p.point.z() - (p.normal.x() * (at.x() - p.point.x()) + p.normal.y() * (at.y() - p.point.y())) /
                               p.normal.z());
  return z;
}

double uppermost_ground(const contact::SurfaceIndex* terrain, const std::vector<Plane>& planes, double x,
                        double y) {
  constexpr double above_all = 1e9;  // [m]
  return ground_height(terrain, planes, Vec3(x, y, above_all));
}

InGround ground_of(const TriangleSurface* terrain, const std::vector<Plane>& planes) {
  const auto index = terrain ? std::make_shared<contact::SurfaceIndex>(*terrain) : nullptr;
  return [index, planes](const Vec3& x) {
    if (index && contact::plumb_at(*index, x).solid) return true;
    return std::any_of(planes.begin(), planes.end(),
                       [&](const Plane& p) { return p.normal.dot(x - p.point) < 0; });
  };
}

std::vector<Problem> ground_problems(const std::string& block, const Vec3& c,
                                     const geometry::Terrain* terrain, const Eigen::AlignedBox2d& limits,
                                     bool has_planes, double under) {
  constexpr double far_above = 1000;  // [m]
  const std::string key = "block." + block + ".position",
                    value = fmt::format("[{:g}, {:g}, {:g}]", c.x(), c.y(), c.z());
  if (terrain && terrain->over_hole(c.x(), c.y()))
    return {{.file = {},
             .key = key,
             .value = value,
             .rule = "the terrain has no data (NODATA) under the block",
             .remedy = "move the block, or fill the hole in the grid before use"}};
  if (c.z() - under > far_above)
    return {
        {.severity = Problem::Severity::warning,
         .file = {},
         .key = key,
         .value = value,
         .rule = fmt::format("starts {:.4g} m above the ground under it (z = {:.6g})", c.z() - under, under),
         .remedy = terrain ? "heights are scene coordinates: map heights less the third number of site.origin"
                           : "check the unit of its position: bare numbers are in m"}};
  if (!terrain || has_planes || std::isfinite(under)) return {};
  const bool inside = limits.contains(Eigen::Vector2d(c.head<2>()));
  return {{.severity = Problem::Severity::warning,
           .file = {},
           .key = key,
           .value = value,
           .rule = inside ? std::string("has no ground below: the terrain ends beside it, or has a gap there")
                          : fmt::format(
                                "lies beside the terrain, which spans x {:.6g} to {:.6g}, y {:.6g} to {:.6g}",
                                limits.min().x(), limits.max().x(), limits.min().y(), limits.max().y()),
           .remedy = inside ? "move the block over the ground, or complete the terrain"
                            : "give block positions in scene coordinates: map coordinates less site.origin"}};
}

}  // namespace talus::sim
