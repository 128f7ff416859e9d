#include "geometry/mesh_terrain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "geometry/precision.hpp"
#include "geometry/raster.hpp"
#include "geometry/stated_unit.hpp"

namespace talus::geometry {
namespace {

/// True for a surface that level ground would be with its y axis up: all of its area looks to one side along
/// y, half of it within 30 degrees, and it is less thick along y than it is high and wide.
bool lies_along_y(const Mesh& mesh) {
  const double near = std::cos(30 * M_PI / 180);
  double area = 0, sum = 0, near_y = 0, whole = 0;
  for (const auto& t : mesh.triangles) {
    const auto at = [&](std::size_t k) { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    const Vec3 n = (at(1) - at(0)).cross(at(2) - at(0));
    area += std::abs(n.y());
    sum += n.y();
    whole += n.norm();
    if (std::abs(n.y()) >= near * n.norm()) near_y += n.norm();
  }
  const Vec3 size = mesh.bounds().sizes();
  return whole > 0 && std::abs(sum) >= (1 - 1e-9) * area && 2 * near_y > whole && size.y() < size.x() &&
         size.y() < size.z();
}

}  // namespace

std::vector<Problem> mesh_terrain_problems(const Mesh& mesh, const std::string& path, const std::string& key,
                                           const TerrainOptions& options) {
  std::vector<Problem> out = rounding_warning(mesh.vertices, mesh.triangles, path, key == "site.terrain");
  for (Problem& p : out) p.key = key;
  const auto warn = [&](std::string value, std::string rule, std::string remedy) {
    out.push_back({.severity = Problem::Severity::warning,
                   .file = path,
                   .key = key,
                   .value = std::move(value),
                   .rule = std::move(rule),
                   .remedy = std::move(remedy)});
  };
  if (const StatedUnit unit = stated_unit(path); !unit.name.empty())
    warn(unit.name, "is the unit that the head of the file names, and its numbers are taken as metres",
         fmt::format("scale it by {:g} in the program that made it, or correct what it says", unit.metres));
  const auto kept = [&](const Vec3& v) {
    const Vec3 x = v - options.origin;
    return !options.crop || ((x - options.crop->min()).head<2>().minCoeff() >= 0 &&
                             (options.crop->max() - x).head<2>().minCoeff() >= 0);
  };
  std::vector<double> heights;
  for (const Vec3& v : mesh.vertices)
    if (kept(v)) heights.push_back(v.z());
  if (heights.empty()) return out;
  for (const FarValue& far : values_far_from_others(heights))
    if (stands_for_none(far.value))
      throw InputError(Problem{
          .file = path,
          .key = key,
          .value =
              fmt::format("{} {} at z = {:g}", far.count, far.count == 1 ? "vertex" : "vertices", far.value),
          .rule = far.where + ": such a height stands for places without data",
          .remedy = "delete these vertices with their faces, or give the grid that the mesh was made of"});
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  if (*high > highest_ground)
    warn(fmt::format("heights of {:.6g} to {:.6g}", *low, *high), "no ground on Earth is that high in metres",
         fmt::format(
             "in feet they would be {:.6g} to {:.6g} m, in millimetres {:.6g} to {:.6g} m: scale it in the "
             "program that made it",
             0.3048 * *low, 0.3048 * *high, 1e-3 * *low, 1e-3 * *high));
  const Vec3 size = mesh.bounds().sizes();
  if (options.up == 'z' && key == "site.terrain" && lies_along_y(mesh))
    warn(fmt::format("{:.4g} x {:.4g} x {:.4g} m", size.x(), size.y(), size.z()),
         "stands upright, as terrain does whose y axis points up",
         "if it does, write up = \"y\" in [site] (site.up); a wall of rock that looks north or south is as "
         "it is");
  return out;
}

}  // namespace talus::geometry
