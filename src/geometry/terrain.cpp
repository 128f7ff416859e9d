#include "geometry/terrain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <set>

#include "contact/detection/detect.hpp"
#include "contact/geometry/plumb.hpp"
#include "contact/geometry/surface_order.hpp"
#include "core/disjoint_sets.hpp"
#include "geometry/mesh.hpp"
#include "geometry/mesh_terrain.hpp"
#include "geometry/raster.hpp"
#include "geometry/raster_outliers.hpp"
#include "geometry/terrain_sheets.hpp"

namespace talus::geometry {
namespace {

constexpr std::size_t fits_cache =
    32768;  // triangles; below, their order in memory makes no difference to a query

constexpr double highest = 1e6;  // height of a grid [m]: beyond, it is no number of metres

Problem too_high(const std::string& path, int row, int column, double z) {
  return {.file = path,
          .key = "site.terrain",
          .value = fmt::format("{:g} in row {}, column {} of the grid, from the north-west", z, row + 1,
                               column + 1),
          .rule = fmt::format("no height in metres; at most {:g}", highest),
          .remedy =
              "correct it there, or name the value as NODATA if it stands for none: NODATA_value in the "
              "header of an ASCII grid, gdal_edit.py -a_nodata for a GeoTIFF"};
}

/// Keeps the nodes within the crop box and one cell round it: what lies outside is no part of the scene, and
/// nothing is said of it. Returns the row and column of the file that the first kept node has.
std::pair<int, int> crop(Raster& r, const TerrainOptions& options, const std::string& path) {
  if (r.columns < 2 || r.rows < 2)
    throw InputError(Problem{.file = path,
                             .key = "site.terrain",
                             .value = fmt::format("{} columns, {} rows", r.columns, r.rows),
                             .rule = "is no grid of a surface, which has two of each at least",
                             .remedy = "give the grid of the whole slope"});
  const double dx = r.transform[1], dy = -r.transform[5];
  const double west = r.transform[0] + 0.5 * dx - options.origin.x(),
               north = r.transform[3] - 0.5 * dy - options.origin.y();
  const double south = north - (r.rows - 1) * dy;
  int j0 = 0, j1 = r.columns - 1, i0 = 0, i1 = r.rows - 1;  // kept nodes, i from the north
  if (options.crop) {
    const auto clamp = [](double x, int n) {
      return static_cast<int>(std::clamp(x, -1.0, static_cast<double>(n)));
    };
    j0 = std::max(0, clamp(std::floor((options.crop->min().x() - west) / dx + 1e-9), r.columns));
    j1 = std::min(r.columns - 1, clamp(std::ceil((options.crop->max().x() - west) / dx - 1e-9), r.columns));
    i0 = r.rows - 1 -
         std::min(r.rows - 1, clamp(std::ceil((options.crop->max().y() - south) / dy - 1e-9), r.rows));
    i1 = r.rows - 1 - std::max(0, clamp(std::floor((options.crop->min().y() - south) / dy + 1e-9), r.rows));
  }
  if (j1 - j0 < 1 || i1 - i0 < 1)
    throw InputError(
        Problem{.file = path,
                .key = "site.crop",
                .value = fmt::format("grid spans x {:.6g} to {:.6g}, y {:.6g} to {:.6g} in scene coordinates",
                                     west, west + (r.columns - 1) * dx, south, north),
                .rule = "keeps less than one cell of the grid",
                .remedy = "move the crop box or the origin"});
  if (j1 - j0 + 1 == r.columns && i1 - i0 + 1 == r.rows) return {0, 0};
  const int columns = j1 - j0 + 1, rows = i1 - i0 + 1;
  for (int i = 0; i < rows; ++i) {
    const auto from = r.values.begin() + static_cast<std::ptrdiff_t>(i + i0) * r.columns + j0;
    std::copy(from, from + columns, r.values.begin() + static_cast<std::ptrdiff_t>(i) * columns);
  }
  r.columns = columns, r.rows = rows;
  r.values.resize(static_cast<std::size_t>(columns) * rows);
  r.transform[0] += j0 * r.transform[1];
  r.transform[3] += i0 * r.transform[5];
  return {i0, j0};
}

/// Nodes of the raster as scene coordinates, with the triangles that all three corners have data for.
/// `first`: row and column of its first node in the file.
void triangulate_grid(const Raster& r, const std::pair<int, int>& first, const TerrainOptions& options,
                      const std::string& path, Terrain& out, std::vector<Vec3>& vertices,
                      std::vector<std::array<int, 3>>& triangles) {
  GridHoles& g = out.grid;
  g.columns = r.columns;
  g.rows = r.rows;
  g.dx = r.transform[1], g.dy = -r.transform[5];
  g.x0 = r.transform[0] + 0.5 * g.dx - options.origin.x();
  g.y0 = r.transform[3] - (r.rows - 0.5) * g.dy - options.origin.y();
  g.has_data.assign(static_cast<std::size_t>(g.columns) * g.rows, 0);
  std::vector<int> number(g.has_data.size(), -1);
  vertices.reserve(number.size());
  std::size_t missing = 0;
  for (int i = 0; i < g.rows; ++i)
    for (int j = 0; j < g.columns; ++j) {
      const double z = r.values[static_cast<std::size_t>(r.rows - 1 - i) * r.columns + j];
      const std::size_t k = static_cast<std::size_t>(i) * g.columns + j;
      if (!std::isfinite(z)) {
        ++missing;
        continue;
      }
      if (std::abs(z) > highest)
        throw InputError(too_high(path, first.first + r.rows - 1 - i, first.second + j, z));
      g.has_data[k] = 1;
      number[k] = static_cast<int>(vertices.size());
      vertices.emplace_back(g.x0 + j * g.dx, g.y0 + i * g.dy, z - options.origin.z());
    }
  triangles.reserve(2 * number.size());
  for (int i = 0; i + 1 < g.rows; ++i)
    for (int j = 0; j + 1 < g.columns; ++j) {
      const std::size_t k = static_cast<std::size_t>(i) * g.columns + j;
      const int ll = number[k], lr = number[k + 1], ul = number[k + g.columns],
                ur = number[k + g.columns + 1];
      if (ll >= 0 && lr >= 0 && ur >= 0) triangles.push_back({ll, lr, ur});
      if (ll >= 0 && ur >= 0 && ul >= 0) triangles.push_back({ll, ur, ul});
    }
  if (triangles.empty())
    throw InputError(Problem{.file = path,
                             .key = "site.terrain",
                             .value = fmt::format("{} of {} nodes are NODATA", missing, number.size()),
                             .rule = "the grid (after the crop) holds no surface",
                             .remedy = "move the crop box, or fill the grid"});
  if (missing > 0)
    out.warnings.push_back(
        {.severity = Problem::Severity::warning,
         .file = path,
         .key = "site.terrain",
         .value = fmt::format("{} of {} nodes", missing, number.size()),
         .rule = "NODATA, masked, or never written: the terrain has holes or a ragged edge there",
         .remedy = "the ground ends there in walls, and a block that gets there falls; "
                   "fill the grid if that matters"});
}

/// Warns of pieces of a grid that NODATA cuts off from the largest.
void warn_of_islands(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& triangles,
                     const TerrainOptions& options, const std::string& path, std::vector<Problem>& warnings) {
  DisjointSets sets(static_cast<int>(vertices.size()));
  for (const auto& t : triangles) sets.join(t[0], t[1]), sets.join(t[0], t[2]);
  std::vector<std::size_t> size(vertices.size(), 0);
  for (const auto& t : triangles) ++size[static_cast<std::size_t>(sets.root(t[0]))];
  std::vector<std::pair<std::size_t, std::size_t>> pieces;  // triangles, a vertex
  for (std::size_t v = 0; v < size.size(); ++v)
    if (size[v] > 0) pieces.emplace_back(size[v], v);
  if (pieces.size() < 2) return;
  std::sort(pieces.begin(), pieces.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  const Vec3 at = vertices[pieces.back().second] + options.origin;
  warnings.push_back({.severity = Problem::Severity::warning,
                      .file = path,
                      .key = "site.terrain",
                      .value = fmt::format("{} pieces", pieces.size()),
                      .rule = fmt::format("NODATA cuts the grid apart: beside the largest, of {} triangles, "
                                          "there are others, the smallest of {} at x = {:.10g}, y = {:.10g}",
                                          pieces[0].first, pieces.back().first, at.x(), at.y()),
                      .remedy = "fill the grid between them, or set what is loose to NODATA"});
}

/// Heights that stand out, in the grid as it is in the file.
std::vector<Problem> outliers(const Raster& r, const std::string& path) {
  std::vector<double> z(r.values.size());
  for (int i = 0; i < r.rows; ++i) {
    const auto row = r.values.begin() + static_cast<std::ptrdiff_t>(r.rows - 1 - i) * r.columns;
    std::copy(row, row + r.columns, z.begin() + static_cast<std::ptrdiff_t>(i) * r.columns);
  }
  const double dx = r.transform[1], dy = -r.transform[5];
  return outlier_warning(
      {z, r.columns, r.rows, r.transform[0] + 0.5 * dx, r.transform[3] - (r.rows - 0.5) * dy, dx, dy}, path);
}

/// Level strips of width w around the box of the surface: blocks that leave sideways stay on ground a little
/// longer.
void widen(std::vector<Vec3>& vertices, std::vector<std::array<int, 3>>& triangles, double w) {
  // Border edges have one triangle; each becomes a quad that reaches outward, level with the edge.
  std::vector<std::array<int, 3>> half;  // lower, higher, +-1
  for (const auto& t : triangles)
    for (int k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      half.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
    }
  std::sort(half.begin(), half.end());
  std::vector<Vec3> outward(vertices.size(), Vec3::Zero());
  std::vector<std::pair<int, int>> border;
  for (std::size_t i = 0; i < half.size();) {
    std::size_t j = i + 1;
    while (j < half.size() && half[j][0] == half[i][0] && half[j][1] == half[i][1]) ++j;
    if (j == i + 1) {
      auto [a, b, sign] = half[i];
      if (sign < 0) std::swap(a, b);
      border.emplace_back(a, b);
      const Vec3 e = vertices[b] - vertices[a];
      const Vec3 n = Vec3(e.y(), -e.x(), 0).normalized();  // the surface lies left of a -> b
      for (int v : {a, b}) outward[v] += n;
    }
    i = j;
  }
  std::vector<int> twin(vertices.size(), -1);
  for (const auto& [a, b] : border)
    for (int v : {a, b})
      if (twin[v] < 0 && outward[v].norm() > 0.3) {
        // Mitre: each side moves outward by w.
        const Vec3 n = outward[v].normalized();
        twin[v] = static_cast<int>(vertices.size());
        vertices.push_back(vertices[v] + n * (w * 2 / std::max(outward[v].norm(), 0.5)));
      }
  for (const auto& [a, b] : border)
    if (twin[a] >= 0 && twin[b] >= 0) {
      triangles.push_back({b, a, twin[a]});
      triangles.push_back({b, twin[a], twin[b]});
    }
}

/// Doubles resolve 1e-9 m up to some 4e6 m: contact needs that resolution.
void warn_of_far_origin(const TriangleSurface& surface, const Vec3& origin, const std::string& name,
                        std::vector<Problem>& warnings) {
  Box3 box;
  for (const Vec3& v : surface.vertices) box.extend(v);
  const std::string remedy = remedy_for_origin(box, origin);
  if (remedy.empty()) return;
  warnings.push_back({.severity = Problem::Severity::warning,
                      .file = name,
                      .key = "site.origin",
                      .value = {},
                      .rule = "the scene's origin is far away: positions lose digits that contact needs",
                      .remedy = remedy});
}

}  // namespace

std::string remedy_for_origin(const Box3& terrain, const Vec3& origin) {
  constexpr double far_away = 1e5, round = 100, round_height = 10;  // [m]
  if (std::max(std::abs(terrain.center().x()), std::abs(terrain.center().y())) < far_away) return {};
  const Vec3 c = terrain.center() + origin;
  const double low = terrain.min().z() + origin.z();
  return fmt::format(
      "the terrain's middle is at [{:.0f}, {:.0f}], its lowest ground at {:.0f} m: give a round point near "
      "it, "
      "site.origin = [{:.0f}, {:.0f}, {:.0f}], and positions less that",
      c.x(), c.y(), low, round * std::floor(c.x() / round), round * std::floor(c.y() / round),
      round_height * std::floor(low / round_height));
}

bool Terrain::over_hole(double x, double y) const {
  if (grid.has_data.empty()) return false;
  const double u = (x - grid.x0) / grid.dx, v = (y - grid.y0) / grid.dy;
  if (u < 0 || v < 0 || u > grid.columns - 1 || v > grid.rows - 1) return false;
  const int j = std::min(static_cast<int>(u), grid.columns - 2),
            i = std::min(static_cast<int>(v), grid.rows - 2);
  const auto data = [&](int a, int b) {
    return grid.has_data[static_cast<std::size_t>(a) * grid.columns + b] != 0;
  };
  if (!data(i, j) || !data(i + 1, j + 1)) return true;
  return u - j >= v - i ? !data(i, j + 1) : !data(i + 1, j);
}

namespace {

/// Overhanging and upright faces have no place in a triangulation in plan.
void refuse_lines_at_overhangs(const std::vector<Vec3>& vertices,
                               const std::vector<std::array<int, 3>>& triangles,
                               const TerrainOptions& options, const std::string& name) {
  std::size_t count = 0;
  Vec3 first = Vec3::Zero();
  for (const auto& t : triangles) {
    const Vec3 &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
    const Vec3 n = (b - a).cross(c - a);
    if (n.z() < 0 && count++ == 0) first = (a + b + c) / 3 + options.origin;
  }
  if (count == 0) return;
  throw InputError(Problem{.file = name,
                           .key = "site.breaklines",
                           .value = options.breaklines,
                           .rule = fmt::format("lines are put into a terrain in plan, and {} faces of this "
                                               "one overhang, one at [{:.8g}, {:.8g}, {:.6g}]",
                                               count, first.x(), first.y(), first.z()),
                           .remedy = "put the lines into the mesh itself, or leave site.breaklines out"});
}

using Triangles = std::vector<std::array<int, 3>>;

/// A second surface whose vertices are put upon these in plan where they lie there but for round-off, as
/// nodes of one grid in two files do.
TriangleSurface aligned(TriangleSurface s, const std::vector<Vec3>& vertices) {
  constexpr double round_off = 1e-10;  // of the size
  Box3 box;
  for (const Vec3& v : vertices) box.extend(v);
  const double reach = round_off * box.diagonal().norm();
  if (!(reach > 0)) return s;
  using Square = std::pair<std::int64_t, std::int64_t>;
  const auto square = [&](const Vec3& x) {
    return Square(std::llround(x.x() / (4 * reach)), std::llround(x.y() / (4 * reach)));
  };
  std::map<Square, std::size_t> at;
  for (std::size_t v = 0; v < vertices.size(); ++v) at.try_emplace(square(vertices[v]), v);
  for (Vec3& x : s.vertices) {
    const Square own = square(x);
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j)
        if (const auto it = at.find({own.first + i, own.second + j}); it != at.end())
          if (const Vec3& p = vertices[it->second]; (p - x).head<2>().norm() <= reach)
            x.head<2>() = p.head<2>();
  }
  return s;
}

/// Heights of a second surface at these vertices, NaN where it has none [m]; nothing unless each of its
/// triangles over them is one of theirs in plan, and the other way round.
std::vector<double> heights_beside(const std::vector<Vec3>& vertices, const Triangles& triangles,
                                   const TriangleSurface& beside) {
  std::map<std::array<double, 2>, int> place;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (!place.emplace(std::array{vertices[v].x(), vertices[v].y()}, static_cast<int>(v)).second) return {};
  std::vector<double> z(vertices.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<int> own(beside.vertices.size(), -1);
  for (std::size_t v = 0; v < own.size(); ++v)
    if (const auto it = place.find({beside.vertices[v].x(), beside.vertices[v].y()}); it != place.end()) {
      own[v] = it->second;
      z[static_cast<std::size_t>(it->second)] = beside.vertices[v].z();
    }
  std::set<std::array<int, 3>> in_common;
  const auto sorted = [](std::array<int, 3> t) {
    std::sort(t.begin(), t.end());
    return t;
  };
  for (const auto& t : beside.triangles) {
    const std::array corners{own[static_cast<std::size_t>(t[0])], own[static_cast<std::size_t>(t[1])],
                             own[static_cast<std::size_t>(t[2])]};
    if (std::none_of(corners.begin(), corners.end(), [](int v) { return v < 0; }))
      in_common.insert(sorted(corners));
  }
  std::size_t found = 0;
  for (const auto& t : triangles) {
    const bool has_all =
        std::none_of(t.begin(), t.end(), [&](int v) { return std::isnan(z[static_cast<std::size_t>(v)]); });
    if (has_all != in_common.contains(sorted(t))) return {};
    found += has_all;
  }
  return found == in_common.size() && found > 0 ? z : std::vector<double>{};
}

/// The second surface on what the triangles have become.
TriangleSurface surface_beside(const std::vector<Vec3>& vertices, const Triangles& triangles,
                               const std::vector<double>& z) {
  TriangleSurface s;
  s.vertices = vertices;
  for (std::size_t v = 0; v < z.size(); ++v)
    if (!std::isnan(z[v])) s.vertices[v].z() = z[v];
  for (const auto& t : triangles)
    if (std::none_of(t.begin(), t.end(), [&](int v) { return std::isnan(z[static_cast<std::size_t>(v)]); }))
      s.triangles.push_back(t);
  return s;
}

/// Lines whose heights are those of no place of the terrain: zeros where a program wrote none, or feet.
void warn_of_far_lines(const std::vector<Vec3>& vertices, const std::vector<std::vector<Vec3>>& lines,
                       const std::string& path, std::vector<Problem>& warnings) {
  Box3 ground, drawn;
  for (const Vec3& v : vertices) ground.extend(v);
  for (const auto& line : lines)
    for (const Vec3& p : line) drawn.extend(p);
  if (ground.isEmpty() || drawn.isEmpty()) return;
  const double below = ground.min().z() - drawn.max().z(), above = drawn.min().z() - ground.max().z();
  if (std::max(below, above) <= ground.sizes().z()) return;
  warnings.push_back(
      {.severity = Problem::Severity::warning,
       .file = path,
       .key = "site.breaklines",
       .value =
           fmt::format("{:.4g} m {} the terrain", std::max(below, above), below > above ? "below" : "above"),
       .rule = "is where its lines run, farther from the terrain than that is high: it is drawn "
               "up or down to them",
       .remedy = "give the lines the heights of the terrain, in metres: exported in plan they "
                 "have zeros"});
}

/// From faces that are oriented already: breaklines, crop, decimation, materials.
Terrain assemble(std::vector<Vec3> vertices, std::vector<std::array<int, 3>> triangles,
                 const TerrainOptions& options, const std::string& name) {
  Terrain out;
  out.crs = options.crs;
  std::vector<char> fixed;
  if (!options.breaklines.empty()) {
    BreakLines lines = read_breaklines(options.breaklines, "site.breaklines");
    agree_on_crs(out.crs, lines.crs, lines.lines.front().front().head<2>(), options.breaklines,
                 "site.breaklines");
    out.warnings = std::move(lines.warnings);
    if (!options.two_sided) refuse_lines_at_overhangs(vertices, triangles, options, name);
    for (auto& line : lines.lines)
      for (Vec3& p : line) p -= options.origin;
    warn_of_far_lines(vertices, lines.lines, options.breaklines, out.warnings);
    insert_lines(vertices, triangles, lines.lines, options.breaklines, fixed);
  }
  Box3 box;
  for (const Vec3& v : vertices) box.extend(v);
  const double size_sq = vertices.empty() ? 0 : box.diagonal().squaredNorm();
  std::size_t kept = 0, flat = 0;
  for (auto t : triangles) {
    const Vec3 &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
    if (options.crop) {
      const auto outside = [&](int k) {
        return std::max({a[k], b[k], c[k]}) < options.crop->min()[k] ||
               std::min({a[k], b[k], c[k]}) > options.crop->max()[k];
      };
      if (outside(0) || outside(1)) continue;
    }
    const Vec3 n = (b - a).cross(c - a);
    if (n.norm() <= 1e-16 * size_sq) {
      ++flat;
      continue;
    }
    triangles[kept++] = t;
  }
  triangles.resize(kept);
  if (kept == 0)
    throw InputError(
        Problem{.file = name,
                .key = options.crop ? "site.crop" : "site.terrain",
                .rule = "no triangle is left",
                .remedy = options.crop ? "move the crop box or the origin" : "give a surface mesh"});
  if (flat > 0)
    out.warnings.push_back({.severity = Problem::Severity::warning,
                            .file = name,
                            .key = "site.terrain",
                            .value = fmt::format("{}", flat),
                            .rule = "triangles of no area were left out",
                            .remedy = "none needed"});
  out.triangles_read = kept;
  if (options.beside != nullptr) out.beside = aligned(*options.beside, vertices);
  if (options.decimation_error > 0) {
    const std::vector<double> z =
        out.beside ? heights_beside(vertices, triangles, *out.beside) : std::vector<double>{};
    decimate(vertices, triangles, options.decimation_error, out.decimation_reached, fixed, z);
    if (!z.empty()) out.beside = surface_beside(vertices, triangles, z);
  }
  out.triangles_kept = triangles.size();
  if (options.widen > 0) widen(vertices, triangles, options.widen);
  // Vertices that no triangle uses any more would only slow the search down.
  std::vector<int> number(vertices.size(), -1);
  std::size_t used = 0;
  for (const auto& t : triangles)
    for (int v : t) number[v] = 0;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (number[v] == 0) {
      number[v] = static_cast<int>(used);
      vertices[used++] = vertices[v];
    }
  vertices.resize(used);
  for (auto& t : triangles)
    for (int& v : t) v = number[v];

  TriangleSurface& s = out.surface;
  s.vertices = std::move(vertices);
  s.triangles = std::move(triangles);
  s.two_sided = options.two_sided;
  s.default_material = options.default_material;
  assign_materials(s, options, out.crs, out.warnings);
  roughen(s, options.roughness, options.origin);
  if (s.triangles.size() > fits_cache) contact::put_in_search_order(s);
  warn_of_far_origin(s, options.origin, name, out.warnings);
  return out;
}

}  // namespace

Terrain make_terrain(std::vector<Vec3> vertices, std::vector<std::array<int, 3>> triangles,
                     const TerrainOptions& options, const std::string& name) {
  std::vector<Problem> warnings;
  if (!options.two_sided) warnings = orient_sheets(vertices, triangles, name, options.origin, options.crop);
  Terrain out = assemble(std::move(vertices), std::move(triangles), options, name);
  out.warnings.insert(out.warnings.begin(), warnings.begin(), warnings.end());
  return out;
}

namespace {

/// Turns a mesh whose axis `up` points up: the others keep their order, right-handed.
void turn_up(Mesh& mesh, char up) {
  for (Vec3& v : mesh.vertices) {
    if (up == 'y') v = Vec3(v.x(), -v.z(), v.y());
    if (up == 'x') v = Vec3(v.y(), v.z(), v.x());
  }
}

/// The terrain's mesh with those of its parts, turned up: every file's faces are a group, those of one with
/// groups of its own by these.
Mesh join_parts(const std::string& path, const TerrainOptions& options, char up,
                std::vector<Problem>& warnings) {
  Mesh mesh;
  const auto append = [&](const std::string& file) {
    Mesh part = read_mesh(file);
    turn_up(part, up);
    for (Problem& p :
         mesh_terrain_problems(part, file, file == path ? "site.terrain" : "site.area.mesh", options))
      warnings.push_back(std::move(p));
    const int vertices = static_cast<int>(mesh.vertices.size()),
              groups = static_cast<int>(mesh.group_names.size());
    mesh.vertices.insert(mesh.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (std::size_t t = 0; t < part.triangles.size(); ++t) {
      const auto& c = part.triangles[t];
      mesh.triangles.push_back({c[0] + vertices, c[1] + vertices, c[2] + vertices});
      mesh.group.push_back(groups + (part.group.empty() ? 0 : part.group[t]));
    }
    if (part.group.empty())
      mesh.group_names.push_back(file);
    else
      mesh.group_names.insert(mesh.group_names.end(), part.group_names.begin(), part.group_names.end());
  };
  if (!path.empty()) append(path);
  for (const auto& area : options.material_areas)
    if (!area.mesh_file.empty()) append(area.mesh_file);
  if (mesh.group_names.size() > 1) weld(mesh, 0);  // seams
  const std::vector<std::string>& known = mesh.group_names;
  for (const auto& area : options.material_areas)
    if (!area.part.empty() && std::find(known.begin(), known.end(), area.part) == known.end())
      throw InputError(Problem{.file = path,
                               .key = "site.area.part",
                               .value = area.part,
                               .rule = "is no solid, group or object of the terrain",
                               .remedy = fmt::format("name one of: {}", fmt::join(known, ", "))});
  return mesh;
}

void name_parts(const Mesh& mesh, TerrainOptions& options) {
  const bool asked = std::any_of(options.material_areas.begin(), options.material_areas.end(),
                                 [](const auto& a) { return !a.part.empty() || !a.mesh_file.empty(); });
  if (!asked) return;
  TriangleSurface surface;
  surface.vertices = mesh.vertices;
  for (Vec3& v : surface.vertices) v -= options.origin;
  surface.triangles = mesh.triangles;
  surface.two_sided = true;
  const auto index = std::make_shared<const contact::SurfaceIndex>(surface);
  options.part_at = [index, group = mesh.group,
                     names = mesh.group_names](const Vec3& x) -> const std::string& {
    static const std::string none;
    const int t = index->triangle_at(x);
    return t < 0 ? none : names[static_cast<std::size_t>(group[static_cast<std::size_t>(t)])];
  };
}

/// Meshes that stand in the ground of a grid (an embankment, a wall), but for their faces that look down into
/// it.
void stand_on_grid(TerrainOptions& options, std::vector<Vec3>& vertices,
                   std::vector<std::array<int, 3>>& triangles, std::vector<Problem>& warnings) {
  const auto stands = [](const auto& area) { return !area.mesh_file.empty(); };
  const auto first = std::find_if(options.material_areas.begin(), options.material_areas.end(), stands);
  if (first == options.material_areas.end()) return;
  Mesh mesh = join_parts("", options, 'z', warnings);
  name_parts(mesh, options);
  for (Vec3& v : mesh.vertices) v -= options.origin;
  for (Problem& p :
       orient_sheets(mesh.vertices, mesh.triangles, first->mesh_file, options.origin, options.crop))
    warnings.push_back(std::move(p));
  TriangleSurface ground;
  ground.vertices = vertices;
  ground.triangles = triangles;
  const contact::SurfaceIndex index(ground);
  const int base = static_cast<int>(vertices.size());
  std::vector<std::string> names;  // of the triangles that are added
  vertices.insert(vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
  for (const auto& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[static_cast<std::size_t>(t[0])],
               &b = mesh.vertices[static_cast<std::size_t>(t[1])],
               &c = mesh.vertices[static_cast<std::size_t>(t[2])];
    const Vec3 middle = (a + b + c) / 3;
    if ((b - a).cross(c - a).z() < 0 &&
        contact::plumb_at(index, Vec3(middle.x(), middle.y(), highest + 1)).floor >= middle.z())
      continue;
    triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    names.push_back(options.part_at(middle));
  }
  // What is nearest decides, as among the parts of a mesh.
  ground.vertices = vertices;
  ground.triangles = triangles;
  ground.two_sided = true;
  options.part_at = [whole = std::make_shared<const contact::SurfaceIndex>(ground),
                     first_part = static_cast<int>(triangles.size() - names.size()),
                     names](const Vec3& x) -> const std::string& {
    static const std::string none;
    const int t = whole->triangle_at(x);
    return t < first_part ? none : names[static_cast<std::size_t>(t - first_part)];
  };
}

}  // namespace

Terrain load_terrain(const std::string& path, const TerrainOptions& options) {
  if (options.decimation_error < 0 || !std::isfinite(options.decimation_error))
    throw InputError(Problem{.key = "site.decimation",
                             .value = fmt::format("{}", options.decimation_error),
                             .rule = "must not be negative",
                             .remedy = "give metres"});
  const bool parts_alone =
      path.empty() && std::any_of(options.material_areas.begin(), options.material_areas.end(),
                                  [](const auto& a) { return !a.mesh_file.empty(); });
  if (path.empty() && !parts_alone) return make_terrain({}, {}, options, options.breaklines);
  if (parts_alone || is_mesh_file(path)) {
    std::vector<Problem> said;
    Mesh mesh = join_parts(path, options, options.up, said);
    TerrainOptions with_parts = options;
    name_parts(mesh, with_parts);
    for (Vec3& v : mesh.vertices) v -= options.origin;
    Terrain out = make_terrain(std::move(mesh.vertices), std::move(mesh.triangles), with_parts,
                               path.empty() ? options.material_areas.front().mesh_file : path);
    out.warnings.insert(out.warnings.begin(), said.begin(), said.end());
    return out;
  }
  Terrain grid;
  Raster raster = read_heights(path, grid.warnings);
  TerrainOptions rest = options;
  const Eigen::Vector2d corner(raster.transform[0], raster.transform[3]);
  agree_on_crs(rest.crs, raster.crs, corner, path, "site.terrain");
  const std::pair<int, int> first = crop(raster, options, path);
  tell_of_missing_data(raster, path, grid.warnings);
  warn_of_size(raster, path, grid.warnings);
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;
  triangulate_grid(raster, first, options, path, grid, vertices, triangles);
  warn_of_islands(vertices, triangles, options, path, grid.warnings);
  rest.crop.reset();  // already done, on whole cells
  stand_on_grid(rest, vertices, triangles, grid.warnings);
  Terrain out = assemble(std::move(vertices), std::move(triangles), rest,
                         path);  // its triangles face up as they are made
  out.grid = std::move(grid.grid);
  out.warnings.insert(out.warnings.begin(), grid.warnings.begin(), grid.warnings.end());
  for (Problem& p : outliers(raster, path)) out.warnings.push_back(std::move(p));
  return out;
}

TriangleSurface slope_from_faces(const Vec3& crest, double dip_direction, const std::vector<SlopeFace>& faces,
                                 double width) {
  if (!(width > 0))
    throw InputError(Problem{.key = "width",
                             .value = fmt::format("{}", width),
                             .rule = "must be positive",
                             .remedy = "give metres"});
  TriangleSurface s;
  const Vec3 down(std::sin(dip_direction), std::cos(dip_direction), 0), side = Vec3::UnitZ().cross(down);
  Vec3 p = crest;
  const auto row = [&] {
    s.vertices.push_back(p - 0.5 * width * side);
    s.vertices.push_back(p + 0.5 * width * side);
  };
  row();
  for (const SlopeFace& f : faces) {
    if (!(f.length > 0) || !(std::abs(f.dip) < 1.5707))
      throw InputError(Problem{.key = "face",
                               .value = fmt::format("dip {} rad, length {} m", f.dip, f.length),
                               .rule = "needs a positive length and a dip between -90 and 90 degrees",
                               .remedy = "correct it"});
    p += f.length * (std::cos(f.dip) * down - std::sin(f.dip) * Vec3::UnitZ());
    const int a = static_cast<int>(s.vertices.size()) - 2;
    row();
    s.triangles.push_back({a, a + 2, a + 3});
    s.triangles.push_back({a, a + 3, a + 1});
  }
  return s;
}

}  // namespace talus::geometry
