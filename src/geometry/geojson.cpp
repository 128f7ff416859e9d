#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <nlohmann/json.hpp>

#include "core/text_file.hpp"
#include "geometry/layers.hpp"
#include "geometry/terrain.hpp"

namespace talus::geometry {
namespace {

using nlohmann::json;

/// False for a ring whose corners lie on one line: nothing is inside of it. By the triangles of its edges
/// with its first corner.
bool encloses_area(const std::vector<Eigen::Vector2d>& ring) {
  double twice = 0, longest_sq = 0;
  for (std::size_t i = 1; i < ring.size(); ++i) {
    const Eigen::Vector2d a = ring[i - 1] - ring[0], b = ring[i] - ring[0];
    twice += std::abs(a.x() * b.y() - a.y() * b.x());
    longest_sq = std::max(longest_sq, b.squaredNorm());
  }
  return twice > 1e-12 * longest_sq;  // round-off of map coordinates
}

void add_polygon(const json& rings, Area& area) {
  Area::Polygon polygon;
  for (const json& ring : rings) {
    std::vector<Eigen::Vector2d> points;
    for (const json& p : ring) points.emplace_back(p.at(0).get<double>(), p.at(1).get<double>());
    if (encloses_area(points))
      polygon.push_back(std::move(points));
    else if (polygon.empty())
      return;
  }
  if (!polygon.empty()) area.polygons.push_back(std::move(polygon));
}

/// False for a geometry of another type, which is left out.
bool add_geometry(const std::string& type, const json& node, Area& area) {
  if (type == "Polygon")
    add_polygon(node.at("coordinates"), area);
  else if (type == "MultiPolygon")
    for (const json& p : node.at("coordinates")) add_polygon(p, area);
  else
    return false;
  return true;
}

/// The coordinate system that a member "crs" [GeoJSON 2008] or "coordRefSys" [JSON-FG] names.
std::string crs_named(const json& crs) {
  const std::string type = crs.is_object() ? crs.value("type", "") : "";
  std::string name;
  if (crs.is_string())
    name = crs;
  else if (type == "name")
    name = crs.at("properties").at("name");
  else if (type == "EPSG")
    name = fmt::format("EPSG:{}", crs.at("properties").at("code").get<int>());
  else if (type == "Reference")
    name = crs.at("href");
  if (name.size() > 2 && name.front() == '[' && name.back() == ']') name = name.substr(1, name.size() - 2);
  if (name.empty())
    throw json::other_error::create(
        501, "the coordinate system it names is in a form that is not read: " + crs.dump().substr(0, 80),
        &crs);
  return name;
}

void add_line(const json& points, PlanLines& out) {
  std::vector<Eigen::Vector2d> line;
  for (const json& p : points)
    if (const Eigen::Vector2d at(p.at(0).get<double>(), p.at(1).get<double>());
        line.empty() || at != line.back())
      line.push_back(at);
  if (line.size() >= 2) out.lines.push_back(std::move(line));
}

void add_line(const json& points, BreakLines& out) {
  std::vector<Vec3> line;
  for (const json& p : points)
    line.emplace_back(p.at(0).get<double>(), p.at(1).get<double>(), p.at(2).get<double>());
  if (line.size() >= 2) out.lines.push_back(std::move(line));
}

template <class Lines>
bool add_geometry(const std::string& type, const json& node, Lines& out) {
  if (type == "LineString")
    add_line(node.at("coordinates"), out);
  else if (type == "MultiLineString")
    for (const json& l : node.at("coordinates")) add_line(l, out);
  else
    return false;
  return true;
}

/// The one coordinate system that a node may name, as those before it.
void take_crs(const json& node, std::string& found) {
  for (const char* member : {"crs", "coordRefSys"}) {
    if (!node.contains(member) || node[member].is_null()) continue;
    const std::string name = crs_named(node[member]);
    if (!found.empty() && name != found)
      throw json::other_error::create(502, "it names two coordinate systems, " + found + " and " + name,
                                      &node);
    found = name;
  }
}

/// All geometries of a file, in its order and however deep they are nested; what is not of the type that is
/// wanted is counted in `beside`.
template <class Found>
void add(const json& root, Found& out, std::map<std::string, int>& beside) {
  std::vector<const json*> open{&root};
  while (!open.empty()) {
    const json& node = *open.back();
    open.pop_back();
    if (node.is_null()) continue;  // a feature without a place
    const std::string type = node.at("type");
    take_crs(node, out.crs);
    if (type == "Feature") {
      open.push_back(&node.at("geometry"));
    } else if (type == "FeatureCollection" || type == "GeometryCollection") {
      const json& parts = node.at(type == "FeatureCollection" ? "features" : "geometries");
      for (auto part = parts.rbegin(); part != parts.rend(); ++part) open.push_back(&*part);
    } else if (!add_geometry(type, node, out)) {
      ++beside[type];
    }
  }
}

/// A message of the library without its own number, "[json.exception.parse_error.101] ".
std::string plain(std::string message) {
  if (message.starts_with('[')) message.erase(0, message.find("] ") + 2);
  return message;
}

template <class Found>
Found read_features(const std::string& path, const std::string& key, const std::string& expected) {
  const std::string text = is_layer_file(path) ? layer_as_geojson(path, key) : read_text(path);
  if (text.find_first_not_of(" \t\r\n") == std::string::npos)
    throw InputError(
        Problem{.file = path, .key = key, .rule = "is empty: a file without text", .remedy = expected});
  Found found;
  std::map<std::string, int> beside;
  try {
    add(json::parse(text), found, beside);
  } catch (const json::exception& e) {
    throw InputError(Problem{.file = path,
                             .key = key,
                             .value = plain(e.what()),
                             .rule = "is not GeoJSON as needed here",
                             .remedy = expected});
  }
  std::string types;
  for (const auto& [type, count] : beside)
    types += fmt::format("{}{} {}", types.empty() ? "" : ", ", count, type.substr(0, 80));
  if (!types.empty())
    found.warnings.push_back({.severity = Problem::Severity::warning,
                              .file = path,
                              .key = key,
                              .value = types,
                              .rule = "are in the file too, and are not used here",
                              .remedy = "if they are meant: " + expected});
  return found;
}

using Ring = std::vector<Eigen::Vector2d>;

double twice_area(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const Eigen::Vector2d u = b - a, v = c - a;
  return u.x() * v.y() - u.y() * v.x();
}

/// By the even-odd rule.
bool is_within(const Ring& ring, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const auto &a = ring[i], &b = ring[j];
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x())
      inside = !inside;
  }
  return inside;
}

/// Where two sides of a ring cross: each has its ends on both sides of the other, farther off than files
/// round coordinates to. Sides that touch do not cross.
std::optional<Eigen::Vector2d> crossing(const Ring& ring) {
  constexpr double rounding = 1e-3;  // [m]
  struct Side {
    Eigen::Vector2d a, b;
  };
  std::vector<Side> sides;
  for (std::size_t i = 0; i < ring.size(); ++i) sides.push_back({ring[i], ring[(i + 1) % ring.size()]});
  const auto west = [](const Side& s) { return std::min(s.a.x(), s.b.x()); };
  std::ranges::sort(sides, {}, west);
  const auto parts = [](const Side& s, const Side& of) {
    const double far = rounding * (s.b - s.a).norm();
    const double a = twice_area(s.a, s.b, of.a), b = twice_area(s.a, s.b, of.b);
    return std::min(a, b) < -far && std::max(a, b) > far;
  };
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const Side& s = sides[i];
    const double east = std::max(s.a.x(), s.b.x());
    for (std::size_t j = i + 1; j < sides.size() && west(sides[j]) <= east; ++j)
      if (const Side& t = sides[j]; parts(s, t) && parts(t, s)) {
        const double a = twice_area(s.a, s.b, t.a), b = twice_area(s.a, s.b, t.b);
        return Eigen::Vector2d(t.a + a / (a - b) * (t.b - t.a));
      }
  }
  return {};
}

/// Tells of rings that cross themselves by their place; throws InputError for a hole that lies outside.
void check_rings(const Area::Polygon& polygon, const std::string& path, const std::string& key,
                 const std::string& name, std::vector<Problem>& warnings) {
  const auto problem = [&](const Eigen::Vector2d& at, const std::string& rule, const std::string& remedy) {
    return Problem{.file = path,
                   .key = key,
                   .value = fmt::format("{} at {:.10g}, {:.10g}", name, at.x(), at.y()),
                   .rule = rule,
                   .remedy = remedy};
  };
  for (const Ring& ring : polygon)
    if (const auto at = crossing(ring)) {
      warnings.push_back(
          problem(*at, "its sides cross there; what they go around an odd number of times is taken as inside",
                  "mend it in the GIS (QGIS: Fix geometries), or ogr2ogr -makevalid out.geojson in.geojson"));
      warnings.back().severity = Problem::Severity::warning;
    }
  for (std::size_t k = 1; k < polygon.size(); ++k) {
    bool within = false;
    for (std::size_t i = 0; i < polygon[k].size(); ++i) {
      const Eigen::Vector2d &a = polygon[k][i], &b = polygon[k][(i + 1) % polygon[k].size()];
      within |= is_within(polygon.front(), a) || is_within(polygon.front(), 0.5 * (a + b));
    }
    if (!within)
      throw InputError(
          problem(polygon[k].front(), "begins a hole that lies outside of its polygon",
                  "a further part is a polygon of its own (MultiPolygon); remove a hole that is none"));
  }
}

}  // namespace

std::string remedy_for_degrees(const Eigen::AlignedBox2d& limits) {
  if (limits.isEmpty() || limits.min().x() < -180 || limits.max().x() > 180 || limits.min().y() < -90 ||
      limits.max().y() > 90)
    return {};
  return "these look like degrees of longitude and latitude, which GIS programs write into GeoJSON by "
         "default: export it again in the terrain's coordinate system, or ogr2ogr -t_srs EPSG:... "
         "out.geojson "
         "in.geojson";
}

bool Area::contains(double x, double y) const {
  return std::ranges::any_of(polygons, [&](const Polygon& polygon) {
    const auto holds = [&](const Ring& ring) { return is_within(ring, {x, y}); };
    return holds(polygon.front()) && std::none_of(polygon.begin() + 1, polygon.end(), holds);
  });
}

Eigen::AlignedBox2d Area::limits() const {
  Eigen::AlignedBox2d box;
  for (const Polygon& polygon : polygons)
    for (const auto& ring : polygon)
      for (const Eigen::Vector2d& p : ring) box.extend(p);
  return box;
}

std::string AreaExtent::span() const {
  return fmt::format("x {:.6g} to {:.6g}, y {:.6g} to {:.6g}", limits.min().x(), limits.max().x(),
                     limits.min().y(), limits.max().y());
}

AreaExtent extent_of(const Area& area, const Vec3& origin,
                     const std::function<bool(double x, double y)>& over_ground) {
  constexpr int cells = 100;
  AreaExtent extent{.limits = area.limits().translate(-origin.head<2>())};
  long inside = 0, over = 0;
  for (int i = 0; i < cells; ++i)
    for (int j = 0; j < cells; ++j) {
      const double x = extent.limits.min().x() + (i + 0.5) / cells * extent.limits.sizes().x(),
                   y = extent.limits.min().y() + (j + 0.5) / cells * extent.limits.sizes().y();
      if (!area.contains(x + origin.x(), y + origin.y())) continue;
      ++inside;
      if (over_ground(x, y)) ++over;
    }
  if (inside == 0) return extent;
  extent.area = extent.limits.sizes().prod() * static_cast<double>(inside) / (cells * cells);
  extent.over_ground = static_cast<double>(over) / static_cast<double>(inside);
  return extent;
}

std::vector<Problem> beside_ground(const AreaExtent& extent, const std::string& key) {
  constexpr double mostly = 0.98;  // a cell of the terrain at the area's edge is no mistake
  if (extent.over_ground >= mostly) return {};
  return {{.severity = Problem::Severity::warning,
           .key = key,
           .value = extent.span(),
           .rule = fmt::format("{:.0f} % of the area has no ground below: no block starts there",
                               100 * (1 - extent.over_ground)),
           .remedy = "compare the polygon with the extent of the terrain"}};
}

Area read_area(const std::string& path, const std::string& key) {
  Area area = read_features<Area>(path, key, "export the polygons as GeoJSON, shapefile or GeoPackage");
  if (area.polygons.empty())
    throw InputError(Problem{.file = path,
                             .key = key,
                             .rule = "holds no polygon that encloses an area",
                             .remedy = "give Polygon or MultiPolygon geometries"});
  for (std::size_t k = 0; k < area.polygons.size(); ++k)
    check_rings(area.polygons[k], path, key, fmt::format("polygon {}", k + 1), area.warnings);
  return area;
}

BreakLines read_breaklines(const std::string& path, const std::string& key) {
  BreakLines found = read_features<BreakLines>(
      path, key, "export the lines as GeoJSON with a height at each point: [x, y, z]");
  if (found.lines.empty())
    throw InputError(Problem{.file = path,
                             .key = key,
                             .rule = "holds no line",
                             .remedy = "give LineString or MultiLineString geometries with [x, y, z]"});
  return found;
}

PlanLines read_plan_lines(const std::string& path, const std::string& key) {
  PlanLines found =
      read_features<PlanLines>(path, key, "export the lines as GeoJSON, shapefile or GeoPackage");
  if (found.lines.empty())
    throw InputError(Problem{.file = path,
                             .key = key,
                             .rule = "holds no line",
                             .remedy = "give LineString or MultiLineString geometries"});
  return found;
}

}  // namespace talus::geometry
