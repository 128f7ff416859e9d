#include "contact/geometry/surface_near.hpp"

#include <algorithm>
#include <array>

#include "contact/geometry/surface_index.hpp"

namespace talus::contact {

void near_vertices(const SurfaceIndex& index, const Box3& box, std::vector<int>& vertices) {
  const SurfaceIndex::Impl& s = index.impl();
  vertices.clear();
  s.tree.traverse(
      [&](const Vec3& lo, const Vec3& hi) {
        return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
      },
      [&](int t) {
        const auto& v = s.surface.triangles[static_cast<std::size_t>(t)];
        if (s.triangle_box(t).intersects(box)) vertices.insert(vertices.end(), v.begin(), v.end());
        return true;
      });
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
}

bool encloses(const SurfaceIndex& index, const Vec3& x) {
  // Along none of the directions that edges of drawn bodies have: it meets no edge but by chance.
  static const Vec3 along = Vec3(0.3141592653, 0.2718281828, 0.9096972).normalized();
  const SurfaceIndex::Impl& s = index.impl();
  int leaves = 0;
  s.tree.traverse(
      [&](const Vec3& lo, const Vec3& hi) {
        const Vec3 enters = ((along.array() > 0).select(lo, hi) - x).cwiseQuotient(along),
                   goes = ((along.array() > 0).select(hi, lo) - x).cwiseQuotient(along);
        return std::max(0.0, enters.maxCoeff()) <= goes.minCoeff();
      },
      [&](int t) {
        const auto& v = s.surface.triangles[static_cast<std::size_t>(t)];
        std::array<Vec3, 3> from;
        for (std::size_t i = 0; i < 3; ++i) from[i] = s.surface.vertices[static_cast<std::size_t>(v[i])] - x;
        const std::array<double, 3> sides{along.dot(from[0].cross(from[1])),
                                          along.dot(from[1].cross(from[2])),
                                          along.dot(from[2].cross(from[0]))};
        const bool out = std::ranges::all_of(sides, [](double d) { return d > 0; }),
                   in = std::ranges::all_of(sides, [](double d) { return d < 0; });
        if (!out && !in) return true;
        const Vec3 normal = (from[1] - from[0]).cross(from[2] - from[0]);
        if (normal.dot(from[0]) / normal.dot(along) > 0) leaves += out ? 1 : -1;
        return true;
      });
  return leaves > 0;
}

}  // namespace talus::contact
