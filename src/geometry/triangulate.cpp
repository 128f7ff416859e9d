#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/mesh.hpp"

namespace talus::geometry {
namespace {

using Vec2 = Eigen::Vector2d;

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }
double turn(const Vec2& a, const Vec2& b, const Vec2& c) { return cross(b - a, c - a); }

}  // namespace

std::vector<std::array<int, 3>> triangulate_polygon(const std::vector<Vec3>& vertices,
                                                    const std::vector<std::vector<int>>& loops,
                                                    const Vec3& normal) {
  std::vector<std::array<int, 3>> out;
  if (loops.empty() || loops[0].size() < 3) return out;
  // In-plane axes (u, v, normal), right-handed.
  const Vec3 n = normal.normalized();
  const Vec3 u = n.unitOrthogonal(), w = n.cross(u);
  const Vec3& o = vertices[loops[0][0]];
  const auto flat = [&](int i) { return Vec2((vertices[i] - o).dot(u), (vertices[i] - o).dot(w)); };
  struct Corner {
    int id;
    Vec2 p;
  };
  std::vector<Corner> ring;
  for (int i : loops[0]) ring.push_back({i, flat(i)});
  double scale_sq = 0;
  for (const Corner& c : ring) scale_sq = std::max(scale_sq, c.p.squaredNorm());
  const double tiny = 1e-14 * scale_sq;

  // A hole becomes part of the ring by a bridge from its rightmost corner to a corner of the ring that it
  // sees.
  std::vector<std::vector<Corner>> holes;
  for (std::size_t h = 1; h < loops.size(); ++h) {
    std::vector<Corner> hole;
    for (int i : loops[h]) hole.push_back({i, flat(i)});
    const auto right = std::max_element(hole.begin(), hole.end(), [](const Corner& a, const Corner& b) {
      return a.p.x() != b.p.x() ? a.p.x() < b.p.x() : a.p.y() < b.p.y();
    });
    std::rotate(hole.begin(), right, hole.end());
    holes.push_back(std::move(hole));
  }
  std::sort(holes.begin(), holes.end(), [](const auto& a, const auto& b) {
    return a[0].p.x() != b[0].p.x() ? a[0].p.x() > b[0].p.x() : a[0].id < b[0].id;
  });
  const auto crosses = [&](const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
    const double s1 = turn(a, b, c), s2 = turn(a, b, d), s3 = turn(c, d, a), s4 = turn(c, d, b);
    return ((s1 > tiny && s2 < -tiny) || (s1 < -tiny && s2 > tiny)) &&
           ((s3 > tiny && s4 < -tiny) || (s3 < -tiny && s4 > tiny));
  };
  for (std::size_t h = 0; h < holes.size(); ++h) {
    const auto& hole = holes[h];
    const Vec2 m = hole[0].p;
    std::vector<std::size_t> order(ring.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      const double da = (ring[a].p - m).squaredNorm(), db = (ring[b].p - m).squaredNorm();
      return da != db ? da < db : a < b;
    });
    std::size_t best = ring.size();
    for (std::size_t i : order) {
      const Vec2 q = ring[i].p;
      // The bridge must leave the ring's corner into the interior, and cross nothing.
      const Vec2 before = ring[(i + ring.size() - 1) % ring.size()].p, after = ring[(i + 1) % ring.size()].p;
      const bool reflex = turn(before, q, after) < 0;
      const bool left_of_in = turn(before, q, m) >= -tiny, left_of_out = turn(q, after, m) >= -tiny;
      if (!(reflex ? (left_of_in || left_of_out) : (left_of_in && left_of_out))) continue;
      bool blocked = false;
      for (std::size_t k = 0; k < ring.size() && !blocked; ++k) {
        const Vec2 &c = ring[k].p, &d = ring[(k + 1) % ring.size()].p;
        blocked = crosses(m, q, c, d);
        // A corner that lies on the bridge blocks it too.
        if (!blocked && k != i && std::abs(turn(m, q, c)) <= tiny && (c - m).dot(q - m) > tiny &&
            (c - q).dot(m - q) > tiny)
          blocked = true;
      }
      for (std::size_t g = h; g < holes.size() && !blocked; ++g)
        for (std::size_t k = 0; k < holes[g].size() && !blocked; ++k) {
          const Vec2 &c = holes[g][k].p, &d = holes[g][(k + 1) % holes[g].size()].p;
          blocked = crosses(m, q, c, d);
          if (!blocked && (g != h || k != 0) && std::abs(turn(m, q, c)) <= tiny &&
              (c - m).dot(q - m) > tiny && (c - q).dot(m - q) > tiny)
            blocked = true;
        }
      if (!blocked) {
        best = i;
        break;
      }
    }
    if (best == ring.size()) return {};
    std::vector<Corner> next(ring.begin(), ring.begin() + best + 1);
    next.insert(next.end(), hole.begin(), hole.end());
    next.push_back(hole[0]);
    next.insert(next.end(), ring.begin() + best, ring.end());
    ring = std::move(next);
  }

  // Ears: the best-shaped one first, so that thin triangles come only where the polygon forces them.
  while (ring.size() > 3) {
    const std::size_t n_ring = ring.size();
    double best_quality = -1;
    std::size_t best = n_ring;
    for (std::size_t i = 0; i < n_ring; ++i) {
      const std::size_t ia = (i + n_ring - 1) % n_ring, ic = (i + 1) % n_ring;
      const Vec2 &a = ring[ia].p, &b = ring[i].p, &c = ring[ic].p;
      const double area = turn(a, b, c);
      if (area <= tiny) continue;
      const double quality =
          area / std::max({(a - b).squaredNorm(), (b - c).squaredNorm(), (c - a).squaredNorm()});
      if (quality <= best_quality) continue;
      bool empty = true;
      for (std::size_t k = 0; k < n_ring && empty; ++k) {
        if (k == ia || k == i || k == ic) continue;
        const int id = ring[k].id;
        const Vec2& p = ring[k].p;
        if (id == ring[ia].id || id == ring[i].id || id == ring[ic].id) continue;  // twin of a bridge
        // Points on the new diagonal count as inside, or a later ear would have no area.
        empty = !(turn(a, b, p) >= -tiny && turn(b, c, p) >= -tiny && turn(c, a, p) >= -tiny);
      }
      if (empty) best_quality = quality, best = i;
    }
    if (best == n_ring) return {};
    out.push_back({ring[(best + n_ring - 1) % n_ring].id, ring[best].id, ring[(best + 1) % n_ring].id});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(best));
  }
  if (turn(ring[0].p, ring[1].p, ring[2].p) <= tiny) return {};
  out.push_back({ring[0].id, ring[1].id, ring[2].id});
  return out;
}

}  // namespace talus::geometry
