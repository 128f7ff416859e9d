#include "contact/structures/node_surface.hpp"

#include <cmath>

#include "contact/geometry/surface_index.hpp"
#include "contact/geometry/surface_near.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact {

bool node_surface(const SurfaceIndex& index, const Vec3& x, const Vec3& outward, double margin,
                  ContactPoint& out) {
  constexpr double beside = 0.2;  // where a bent skin's normals part, a node lies over no triangle by as much
                                  // as this share of its distance
  const bool any_way = outward.isZero(0);
  const SurfaceIndex::Impl& s = index.impl();
  const Box3 box(x.array() - margin, x.array() + margin);
  int best = -1;
  double nearest = margin;
  s.tree.traverse(
      [&](const Vec3& lo, const Vec3& hi) {
        return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
      },
      [&](int t) {
        const Vec3& n = s.normal[static_cast<std::size_t>(t)];
        if (any_way ? n.isZero(0) : n.dot(outward) > node_faces) return true;
        const auto& v = s.surface.triangles[static_cast<std::size_t>(t)];
        const Vec3 &a = s.surface.vertices[static_cast<std::size_t>(v[0])],
                   &b = s.surface.vertices[static_cast<std::size_t>(v[1])],
                   &c = s.surface.vertices[static_cast<std::size_t>(v[2])];
        const double twice = n.dot((b - a).cross(c - a));
        const double gap = n.dot(x - a),
                     least = -(tolerances().same_place + beside * std::abs(gap) / std::sqrt(twice)) * twice;
        for (const auto& [p, q] : {std::pair(&b, &c), std::pair(&c, &a), std::pair(&a, &b)})
          if (n.dot((*p - x).cross(*q - x)) < least) return true;
        if (std::abs(gap) > nearest || (std::abs(gap) == nearest && best >= 0 && t > best)) return true;
        nearest = std::abs(gap);
        best = t;
        out.gap = gap;
        out.normal = n;
        return true;
      });
  if (best < 0) return false;
  out.point_b = x;
  out.point_a = x - out.gap * out.normal;
  out.face_a = best;
  out.face_b = -1;
  return true;
}

void nodes_near(const SurfaceIndex& nodes, const SurfaceIndex& faces, double reach,
                std::vector<int>& vertices) {
  Box3 near = faces.impl().tree.bounds();
  near.min().array() -= reach;
  near.max().array() += reach;
  near_vertices(nodes, near, vertices);
  const TriangleSurface& skin = nodes.surface();
  std::erase_if(vertices, [&](int v) {
    return skin.nodes[static_cast<std::size_t>(v)].count != 1 ||
           !near.contains(skin.vertices[static_cast<std::size_t>(v)]);
  });
}

Vec3 tributary_area(const SurfaceIndex& index, int vertex) {
  const SurfaceIndex::Impl& s = index.impl();
  const auto at = [&](int v) -> const Vec3& { return s.surface.vertices[static_cast<std::size_t>(v)]; };
  Vec3 four = Vec3::Zero();  // of four triangles about a face's centre, the third of their vertices, two are
                             // at each of its nodes: each has twice its area
  for (int i = s.vertex_offset[static_cast<std::size_t>(vertex)];
       i < s.vertex_offset[static_cast<std::size_t>(vertex) + 1]; ++i) {
    const auto& t =
        s.surface.triangles[static_cast<std::size_t>(s.vertex_triangle[static_cast<std::size_t>(i)])];
    if (t[2] != vertex) four += (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
  }
  return 0.25 * four;
}

}  // namespace talus::contact
