// Vertex removal with a bound that holds everywhere, not just at the nodes: taking a vertex away changes the
// surface only within its star, by a piecewise linear function whose extremes lie at the vertex and where an
// old spoke crosses a new edge. What the triangles of the star had lost before is added, so the sum bounds
// the distance to the given surface. A second surface on the same triangles is kept within the bound
// likewise.
#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/terrain.hpp"

namespace talus::geometry {
namespace {

double plan_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

}  // namespace

void decimate(std::vector<Vec3>& vertices, std::vector<std::array<int, 3>>& triangles, double error,
              double& error_reached, const std::vector<char>& fixed, const std::vector<double>& beside) {
  const int n = static_cast<int>(vertices.size());
  std::vector<std::vector<int>> around(n);
  std::vector<char> steep(n, 0);  // of a face that overhangs or stands upright
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
    const auto& c = triangles[t];
    if (!(plan_area(vertices[c[0]], vertices[c[1]], vertices[c[2]]) > 0))
      for (int v : c) steep[v] = 1;
    for (int v : c) around[v].push_back(t);
  }
  std::vector<double> lost(triangles.size(),
                           0.0);  // bound of each triangle's vertical distance to the given surface
  std::vector<char> gone(triangles.size(), 0);

  const auto ring_of = [&](int v, std::vector<int>& ring) {  // counter-clockwise; false on the border
    ring.clear();
    std::vector<std::pair<int, int>> links;
    for (int t : around[v])
      for (int k = 0; k < 3; ++k)
        if (triangles[t][k] == v) links.emplace_back(triangles[t][(k + 1) % 3], triangles[t][(k + 2) % 3]);
    if (links.size() < 3) return false;
    for (int at = links[0].first; ring.size() <= links.size();) {
      ring.push_back(at);
      const auto it = std::find_if(links.begin(), links.end(), [&](const auto& l) { return l.first == at; });
      if (it == links.end()) return false;
      at = it->second;
      if (at == ring[0]) return ring.size() == links.size();
    }
    return false;
  };
  // Of the second surface: whether it has a triangle about a vertex, or could get one.
  const auto has_beside = [&](int v) { return !beside.empty() && !std::isnan(beside[v]); };
  std::vector<int> ring;
  // Flat places first: what they give up costs nothing, and leaves the allowance to the rest.
  for (const double share : {1e-9, 0.05, 0.15, 0.3, 0.5, 0.75, 1.0, 1.0}) {
    for (int v = 0; v < n; ++v) {
      if (steep[v] || (!fixed.empty() && fixed[v]) || around[v].size() < 3 || around[v].size() > 24 ||
          !ring_of(v, ring))
        continue;
      const int k = static_cast<int>(ring.size());
      const bool both = has_beside(v);
      if (std::any_of(ring.begin(), ring.end(), [&](int u) { return has_beside(u) != both; })) continue;
      const int layers = both ? 2 : 1;
      double before = 0, best = share * error;
      for (int t : around[v]) before = std::max(before, lost[t]);
      if (before > best) continue;
      int best_u = -1;
      const Vec3& p = vertices[v];
      const auto z = [&](int layer, int w) { return layer == 0 ? vertices[w].z() : beside[w]; };
      for (int s = 0; s < k; ++s) {
        const int iu = ring[s];
        const Vec3& u = vertices[iu];
        double change = 0;
        bool valid = true;
        for (int i = 1; i + 1 < k && valid; ++i) {
          const int ia = ring[(s + i) % k], ib = ring[(s + i + 1) % k];
          const Vec3 &a = vertices[ia], &b = vertices[ib];
          const double area = plan_area(u, a, b),
                       longest =
                           std::max({(a - u).squaredNorm(), (b - a).squaredNorm(), (u - b).squaredNorm()});
          valid = area > 1e-3 * longest;  // no slivers
          if (!valid) break;
          const double wa = plan_area(u, p, b) / area, wb = plan_area(u, a, p) / area, wu = 1 - wa - wb;
          if (wa >= 0 && wb >= 0 && wu >= 0)
            for (int l = 0; l < layers; ++l)
              change = std::max(change, std::abs(wu * z(l, iu) + wa * z(l, ia) + wb * z(l, ib) - z(l, v)));
          if (i == 1) continue;
          for (int j = 1; j < k; ++j) {  // spokes p - r_j against the new edge u - a
            const int ir = ring[(s + j) % k];
            const Vec3& r = vertices[ir];
            const double c1 = plan_area(u, a, p), c2 = plan_area(u, a, r), d1 = plan_area(p, r, u),
                         d2 = plan_area(p, r, a);
            if (c1 * c2 >= 0 || d1 * d2 >= 0) continue;
            const double f = c1 / (c1 - c2), g = d1 / (d1 - d2);
            for (int l = 0; l < layers; ++l)
              change = std::max(change, std::abs(z(l, v) + f * (z(l, ir) - z(l, v)) - z(l, iu) -
                                                 g * (z(l, ia) - z(l, iu))));
          }
        }
        // An edge u - a that exists already outside the star would be doubled.
        for (int i = 2; i + 1 < k && valid; ++i) {
          const int a = ring[(s + i) % k];
          for (int t : around[ring[s]])
            valid = valid && std::find(triangles[t].begin(), triangles[t].end(), a) == triangles[t].end();
        }
        if (valid && before + change <= best) best = before + change, best_u = s;
      }
      if (best_u < 0) continue;
      std::vector<int> free = around[v];
      std::sort(free.begin(), free.end());
      for (int t : free) {
        gone[t] = 1;
        for (int w : triangles[t]) around[w].erase(std::find(around[w].begin(), around[w].end(), t));
      }
      for (int i = 1; i + 1 < k; ++i) {
        const int t = free[i - 1];
        triangles[t] = {ring[best_u], ring[(best_u + i) % k], ring[(best_u + i + 1) % k]};
        gone[t] = 0;
        lost[t] = best;
        for (int w : triangles[t]) around[w].push_back(t);
      }
    }
  }
  error_reached = 0;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (gone[t]) continue;
    error_reached = std::max(error_reached, lost[t]);
    triangles[kept++] = triangles[t];
  }
  triangles.resize(kept);
}

}  // namespace talus::geometry
