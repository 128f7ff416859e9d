#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "geometry/terrain.hpp"

namespace talus::geometry {
namespace {

using nlohmann::json;

void add_polygon(const json& rings, Area& area) {
  for (const json& ring : rings) {
    std::vector<Eigen::Vector2d> points;
    for (const json& p : ring) points.emplace_back(p.at(0).get<double>(), p.at(1).get<double>());
    if (points.size() >= 3) area.rings.push_back(std::move(points));
  }
}

void add(const json& node, Area& area) {
  const std::string type = node.at("type");
  if (type == "FeatureCollection") {
    for (const json& f : node.at("features")) add(f, area);
  } else if (type == "Feature") {
    if (!node.at("geometry").is_null()) add(node.at("geometry"), area);
  } else if (type == "GeometryCollection") {
    for (const json& g : node.at("geometries")) add(g, area);
  } else if (type == "Polygon") {
    add_polygon(node.at("coordinates"), area);
  } else if (type == "MultiPolygon") {
    for (const json& p : node.at("coordinates")) add_polygon(p, area);
  }
}

}  // namespace

bool Area::contains(double x, double y) const {
  bool inside = false;
  for (const auto& ring : rings)
    for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
      const auto &a = ring[i], &b = ring[j];
      if ((a.y() > y) != (b.y() > y) && x < (b.x() - a.x()) * (y - a.y()) / (b.y() - a.y()) + a.x()) inside = !inside;
    }
  return inside;
}

Area read_area(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw InputError(Problem{.file = path, .key = "file", .rule = "cannot be read", .remedy = "check the path"});
  Area area;
  try {
    add(json::parse(in), area);
  } catch (const json::exception& e) {
    throw InputError(Problem{.file = path, .key = "geojson", .value = e.what(), .rule = "is not GeoJSON", .remedy = "export the polygons as GeoJSON"});
  }
  if (area.rings.empty())
    throw InputError(Problem{.file = path, .key = "geojson", .rule = "holds no polygon", .remedy = "give Polygon or MultiPolygon geometries"});
  return area;
}

}  // namespace talus::geometry
