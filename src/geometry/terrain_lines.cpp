// Breaklines: lines of known height that become edges of the terrain.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "contact/detection/detect.hpp"
#include "geometry/exact_plan.hpp"
#include "geometry/terrain.hpp"

namespace talus::geometry {
namespace {

/// Points of all lines and the edges between them.
struct LineGraph {
  std::vector<Vec3> points;
  std::vector<std::pair<int, int>> edges;
};

LineGraph graph_of(const std::vector<std::vector<Vec3>>& lines) {
  LineGraph g;
  for (const auto& line : lines)
    for (std::size_t k = 0; k < line.size(); ++k) {
      if (k > 0)
        g.edges.emplace_back(static_cast<int>(g.points.size()) - 1, static_cast<int>(g.points.size()));
      g.points.push_back(line[k]);
    }
  return g;
}

double mean_plan_edge(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& triangles) {
  double sum = 0;
  for (const auto& t : triangles)
    for (int k = 0; k < 3; ++k) sum += (vertices[t[k]] - vertices[t[(k + 1) % 3]]).head<2>().norm();
  return triangles.empty() ? 0 : sum / (3 * static_cast<double>(triangles.size()));
}

/// Marks the vertices nearer than `reach` to an edge of the graph, in plan. Edges are entered in cells of
/// that size.
std::vector<char> near_lines(const std::vector<Vec3>& vertices, const LineGraph& g, double reach) {
  std::map<std::pair<long, long>, std::vector<int>> cells;
  const auto cell = [&](const Eigen::Vector2d& p) {
    return std::pair{static_cast<long>(std::floor(p.x() / reach)),
                     static_cast<long>(std::floor(p.y() / reach))};
  };
  for (std::size_t e = 0; e < g.edges.size(); ++e) {
    const Eigen::Vector2d a = g.points[g.edges[e].first].head<2>(), b = g.points[g.edges[e].second].head<2>();
    const int steps = static_cast<int>(std::ceil((b - a).norm() / (0.5 * reach))) + 1;
    for (int k = 0; k <= steps; ++k) {
      auto& list = cells[cell(a + (b - a) * (static_cast<double>(k) / steps))];
      if (list.empty() || list.back() != static_cast<int>(e)) list.push_back(static_cast<int>(e));
    }
  }
  std::vector<char> near(vertices.size(), 0);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Eigen::Vector2d p = vertices[v].head<2>();
    const auto [i, j] = cell(p);
    for (long di = -2; di <= 2 && !near[v]; ++di)
      for (long dj = -2; dj <= 2 && !near[v]; ++dj) {
        const auto found = cells.find({i + di, j + dj});
        if (found == cells.end()) continue;
        for (const int e : found->second) {
          const Eigen::Vector2d a = g.points[g.edges[e].first].head<2>(),
                                d = g.points[g.edges[e].second].head<2>() - a;
          const double s = d.squaredNorm() > 0 ? std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
          if ((p - a - s * d).norm() < reach) near[v] = 1;
        }
      }
  }
  return near;
}

InputError at_place(const std::string& name, const Vec3& p, const std::string& rule,
                    const std::string& remedy) {
  return InputError(
      Problem{.file = name,
              .key = "site.breaklines",
              .value = fmt::format("near [{:.6g}, {:.6g}, {:.6g}] in scene coordinates", p.x(), p.y(), p.z()),
              .rule = rule,
              .remedy = remedy});
}

}  // namespace

void insert_lines(std::vector<Vec3>& vertices, std::vector<std::array<int, 3>>& triangles,
                  const std::vector<std::vector<Vec3>>& lines, const std::string& name,
                  std::vector<char>& fixed) {
  const LineGraph g = graph_of(lines);
  for (const Vec3& p : g.points)
    if (!p.allFinite()) throw at_place(name, p, "a point is not finite", "correct the file");
  std::vector<Vec3> points = g.points;
  std::optional<contact::SurfaceIndex> ground;  // to leave holes and what lies beside the terrain open
  if (!triangles.empty()) {
    const std::vector<char> near = near_lines(vertices, g, 0.5 * mean_plan_edge(vertices, triangles));
    std::vector<char> used(vertices.size(), 0);
    for (const auto& t : triangles)
      for (const int v : t) used[v] = 1;
    for (std::size_t v = 0; v < vertices.size(); ++v)
      if (used[v] && !near[v]) points.push_back(vertices[v]);
    TriangleSurface surface;
    surface.vertices = vertices;
    surface.triangles = triangles;
    ground.emplace(surface);
  }
  const PlanTriangulation plan = constrained_delaunay(points, g.edges);
  if (plan.crossing)
    throw at_place(name, g.points[g.edges[plan.crossing->first].first],
                   "two lines cross between their points", "give both lines the point where they meet");
  for (std::size_t i = 0; i < points.size(); ++i)
    if (std::abs(points[i].z() - points[plan.same[i]].z()) > 1e-6)
      throw at_place(name, points[i],
                     fmt::format("two points lie above each other, {:.6g} m apart",
                                 std::abs(points[i].z() - points[plan.same[i]].z())),
                     "move the upper one back: a terrain has one height at each place");
  triangles.clear();
  for (const auto& t : plan.triangles) {
    const Vec3 m = (points[t[0]] + points[t[1]] + points[t[2]]) / 3;
    if (!ground || std::isfinite(ground->height(m.x(), m.y()))) triangles.push_back(t);
  }
  vertices = std::move(points);
  fixed.assign(vertices.size(), 0);
  std::fill_n(fixed.begin(), g.points.size(), 1);
}

double highest_within(const TriangleSurface& s, const Eigen::AlignedBox2d& rectangle) {
  double best = -std::numeric_limits<double>::infinity();
  std::vector<Vec3> polygon, kept;
  for (const auto& t : s.triangles) {
    polygon = {s.vertices[t[0]], s.vertices[t[1]], s.vertices[t[2]]};
    Eigen::AlignedBox2d box;
    for (const Vec3& p : polygon) box.extend(Eigen::Vector2d(p.head<2>()));
    if (!box.intersects(rectangle)) continue;
    for (int side = 0; side < 4 && !polygon.empty(); ++side) {  // Sutherland and Hodgman
      const int axis = side / 2;
      const double sign = side % 2 ? -1 : 1, limit = side % 2 ? rectangle.max()[axis] : rectangle.min()[axis];
      kept.clear();
      for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Vec3 &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
        const double da = sign * (a[axis] - limit), db = sign * (b[axis] - limit);
        if (da >= 0) kept.push_back(a);
        if ((da > 0 && db < 0) || (da < 0 && db > 0)) kept.push_back(a + da / (da - db) * (b - a));
      }
      polygon.swap(kept);
    }
    for (const Vec3& p : polygon) best = std::max(best, p.z());
  }
  return best;
}

}  // namespace talus::geometry
