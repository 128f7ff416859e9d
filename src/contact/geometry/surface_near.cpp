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

}  // namespace talus::contact
