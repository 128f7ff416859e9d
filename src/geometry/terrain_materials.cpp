// Materials of the ground by polygons and by rasters of classes, and the check that all are in one coordinate
// system.
#include <fmt/format.h>

#include <cmath>
#include <functional>

#include "geometry/raster.hpp"
#include "geometry/terrain.hpp"

namespace talus::geometry {
namespace {

using Limits = Eigen::AlignedBox2d;

std::string text(const Limits& b) {
  return fmt::format("x {:.8g} to {:.8g}, y {:.8g} to {:.8g}", b.min().x(), b.max().x(), b.min().y(),
                     b.max().y());
}

/// Whether a place, in map coordinates, belongs to an area; and the area's limits.
struct Cover {
  std::function<bool(double, double)> holds;
  Limits limits;
};

Cover polygon_cover(const std::string& path, std::string& crs, std::vector<Problem>& warnings) {
  const Area area = read_area(path, "site.area.polygon");
  warnings.insert(warnings.end(), area.warnings.begin(), area.warnings.end());
  const Limits limits = area.limits();
  agree_on_crs(crs, area.crs, limits.center(), path, "site.area.polygon");
  return {[area](double x, double y) { return area.contains(x, y); }, limits};
}

Cover raster_cover(const std::string& path, double value, std::string& crs) {
  const Raster r = read_raster(path);
  const double dx = r.transform[1], dy = -r.transform[5], west = r.transform[0], north = r.transform[3];
  const Limits limits(Eigen::Vector2d(west, north - r.rows * dy),
                      Eigen::Vector2d(west + r.columns * dx, north));
  agree_on_crs(crs, r.crs, limits.center(), path, "site.area.raster");
  return {[=](double x, double y) {
            const double j = std::floor((x - west) / dx), i = std::floor((north - y) / dy);
            if (j < 0 || i < 0 || j >= r.columns || i >= r.rows) return false;
            return r.values[static_cast<std::size_t>(i) * r.columns + static_cast<std::size_t>(j)] == value;
          },
          limits};
}

}  // namespace

void agree_on_crs(std::string& known, const std::string& file_crs, const Eigen::Vector2d& place,
                  const std::string& file, const std::string& key) {
  if (file_crs.empty()) return;
  if (known.empty()) {
    const std::string name = check_crs(file_crs, file, key);
    check_lengths(name, place, file, key);
    known = name;
    return;
  }
  const int same = same_crs(known, file_crs);
  if (same > 0) return;
  throw InputError(Problem{
      .file = file,
      .key = key,
      .value = file_crs.substr(0, 80),
      .rule = same < 0 ? "is no coordinate system that is known, so that it cannot be compared with that of "
                         "site.crs, the terrain or a file before it: " +
                             known.substr(0, 80)
                       : "is in another coordinate system than site.crs, the terrain or a file before it: " +
                             known.substr(0, 80),
      .remedy = "transform it (gdalwarp -t_srs for rasters, ogr2ogr -t_srs for polygons and lines), or "
                "correct site.crs"});
}

void assign_materials(TriangleSurface& s, const TerrainOptions& options, std::string& crs,
                      std::vector<Problem>& warnings) {
  if (options.material_areas.empty()) return;
  s.material.assign(s.triangles.size(), options.default_material);
  std::vector<Vec3> middle;
  Limits terrain;
  for (const auto& c : s.triangles)
    middle.push_back((s.vertices[c[0]] + s.vertices[c[1]] + s.vertices[c[2]]) / 3 + options.origin);
  for (const Vec3& v : s.vertices) terrain.extend((v + options.origin).head<2>());
  for (const auto& area : options.material_areas) {
    if (const std::string& name = area.part.empty() ? area.mesh_file : area.part; !name.empty()) {
      std::size_t covered = 0;
      for (std::size_t t = 0; t < middle.size() && options.part_at; ++t)
        if (options.part_at(middle[t] - options.origin) == name) s.material[t] = area.material, ++covered;
      if (covered == 0)
        warnings.push_back({.severity = Problem::Severity::warning,
                            .file = name,
                            .key = area.part.empty() ? "site.area.mesh" : "site.area.part",
                            .value = name,
                            .rule = "is no part of the terrain as it is kept",
                            .remedy = "check the crop, or leave the area out"});
      continue;
    }
    const bool is_polygon = !area.polygon_file.empty();
    const std::string& file = is_polygon ? area.polygon_file : area.raster_file;
    const std::string key = is_polygon ? "site.area.polygon" : "site.area.raster";
    const Cover cover = is_polygon ? polygon_cover(file, crs, warnings) : raster_cover(file, area.value, crs);
    const std::string degrees = remedy_for_degrees(cover.limits);
    if (!cover.limits.intersects(terrain))
      throw InputError(Problem{
          .file = file,
          .key = key,
          .value = text(cover.limits),
          .rule = fmt::format("lies off the terrain, which spans {} on the map", text(terrain)),
          .remedy = degrees.empty() ? "give both in one coordinate system, and site.origin in it as well"
                                    : degrees});
    std::size_t covered = 0;
    for (std::size_t t = 0; t < middle.size(); ++t)
      if (cover.holds(middle[t].x(), middle[t].y())) s.material[t] = area.material, ++covered;
    if (covered == 0)
      warnings.push_back({.severity = Problem::Severity::warning,
                          .file = file,
                          .key = key,
                          .value = is_polygon ? "" : fmt::format("class {:g}", area.value),
                          .rule = "covers the middle of no triangle of the terrain",
                          .remedy = "check the area, or leave it out"});
  }
}

}  // namespace talus::geometry
