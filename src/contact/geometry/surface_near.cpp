#include "contact/geometry/surface_near.hpp"

#include <algorithm>

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

bool encloses(const BoxTree& tree, std::span<const Vec3> vertices,
              std::span<const std::array<int, 3>> triangles, const Vec3& x, double rounding) {
  // Along no direction that bodies have edges above each other in; which side of an edge the line passes is
  // asked the same way of both faces, so that it passes through one of them.
  static const Vec3 d = Vec3(0.41421, 0.73205, 0.54113).normalized(), u = d.unitOrthogonal(), v = d.cross(u);
  static const Vec3 per_way = d.cwiseInverse();
  int times = 0;
  tree.traverse(
      [&](const Vec3& lo, const Vec3& hi) {
        const double in = (lo - x).cwiseProduct(per_way).maxCoeff(),
                     out = (hi - x).cwiseProduct(per_way).minCoeff();
        return out >= std::max(in, 0.0) - rounding;
      },
      [&](int t) {
        const auto& corner = triangles[static_cast<std::size_t>(t)];
        Vec3 r[3];
        for (int k = 0; k < 3; ++k) r[k] = vertices[static_cast<std::size_t>(corner[k])] - x;
        const auto left = [&](int i, int j) {
          const bool turned = corner[i] > corner[j];
          const Vec3 &from = r[turned ? j : i], &to = r[turned ? i : j];
          return (u.dot(from) * v.dot(to) - v.dot(from) * u.dot(to) > 0) != turned;
        };
        const bool side = left(0, 1);
        if (left(1, 2) != side || left(2, 0) != side) return true;
        if ((r[0].dot((r[1] - r[0]).cross(r[2] - r[0])) > 0) == side) times += side ? 1 : -1;
        return true;
      });
  return times > 0;
}

bool encloses(const SurfaceIndex& index, const Vec3& x) {
  const SurfaceIndex::Impl& s = index.impl();
  return encloses(s.tree, s.surface.vertices, s.surface.triangles, x, 0);
}

}  // namespace talus::contact
