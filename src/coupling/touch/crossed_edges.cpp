#include "coupling/touch/crossed_edges.hpp"

#include <cmath>

#include "contact/narrow/narrow_math.hpp"
#include "contact/tolerances.hpp"

namespace talus::coupling {
namespace {

std::optional<Vec3> edge_of(const Polyhedron& shape, const Pose& pose, int edge) {
  if (edge >= static_cast<int>(shape.edges.size())) return {};  // a diagonal of a face
  const Polyhedron::Edge& e = shape.edges[static_cast<std::size_t>(edge)];
  return Vec3((pose.F * (shape.vertices[static_cast<std::size_t>(e.v1)] -
                         shape.vertices[static_cast<std::size_t>(e.v0)]))
                  .normalized());
}

/// Of a triangle, by its half-edge.
std::optional<Vec3> edge_of(const TriangleSurface& surface, int half_edge) {
  if (half_edge / 3 >= static_cast<int>(surface.triangles.size())) return {};
  const std::array<int, 3>& t = surface.triangles[static_cast<std::size_t>(half_edge / 3)];
  return Vec3((surface.vertices[static_cast<std::size_t>(t[(half_edge + 1) % 3])] -
               surface.vertices[static_cast<std::size_t>(t[half_edge % 3])])
                  .normalized());
}

}  // namespace

std::optional<CrossedEdges> crossed_edges(const Touch& t, const dda::Model& model, const Environment& env,
                                          const Pose& pose_a, const Pose& pose_b) {
  if (t.b < 0 || contact::form_of(t.at.key) != contact::Form::edge_edge) return {};
  const auto [of_a, of_b] = contact::features_of(t.at.key);
  std::optional<Vec3> a;
  if (t.a.kind == Partner::Kind::block)
    a = edge_of(*model.blocks[static_cast<std::size_t>(t.a.index)].shape, pose_a, of_a);
  if (t.a.kind == Partner::Kind::terrain) a = edge_of(env.terrain->surface(), of_a);
  const std::optional<Vec3> b = edge_of(*model.blocks[static_cast<std::size_t>(t.b)].shape, pose_b, of_b);
  if (!a || !b) return {};
  const Vec3 across = a->cross(*b);
  if (across.norm() < contact::tolerances().crossed ||
      across.normalized().cross(t.at.normal).norm() > contact::tolerances().same_normal)
    return {};  // of faces nearly parallel the normal is a face's
  return CrossedEdges{*a, *b};
}

EdgeMeeting meet(const Vec3& x_a, const Vec3& a, const Vec3& x_b, const Vec3& b, const Vec3& towards) {
  const Vec3 across = a.cross(b), apart = x_b - x_a;
  const double sq = across.squaredNorm();
  EdgeMeeting m;
  m.normal = across / (towards.dot(across) < 0 ? -std::sqrt(sq) : std::sqrt(sq));
  m.on_a = x_a + apart.cross(b).dot(across) / sq * a;
  m.on_b = x_b + apart.cross(a).dot(across) / sq * b;
  return m;
}

}  // namespace talus::coupling
