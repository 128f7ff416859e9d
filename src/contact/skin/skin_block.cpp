#include "contact/skin/skin_block.hpp"

#include <algorithm>
#include <cmath>

#include "contact/skin/skin_near.hpp"
#include "contact/skin/skin_patch.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact {
namespace {

constexpr double facing =
    -0.3;  // skin's normal against the direction of a vertex: a cube's corner faces three planes by -0.58

/// Contacts of the block's vertices on the skin, and which vertices have theirs.
class Vertices {
 public:
  explicit Vertices(const SkinNear& at) : at_(at) {}

  /// Vertices of the block over faces of the skin that they face: the nearest one, and others of another
  /// direction that are as near (inner corners). Not vertices of a face that lies flat on the skin.
  void add(const std::vector<SkinPatch>& patches, std::vector<ContactPoint>& out) {
    struct Candidate {
      int triangle;
      double gap;
    };
    std::vector<Candidate> found;
    for (std::size_t v = 0; v < at_.corner.size(); ++v) {
      const int first = at_.block.vertex_edge_offset[v], last = at_.block.vertex_edge_offset[v + 1];
      Vec3 outward = Vec3::Zero();
      bool flat = false;
      for (int i = first; i < last; ++i) {
        const auto& e =
            at_.block.edges[static_cast<std::size_t>(at_.block.vertex_edges[static_cast<std::size_t>(i)])];
        for (const int f : {e.left, e.right}) {
          outward += at_.normal[static_cast<std::size_t>(f)];
          for (const SkinPatch& p : patches)
            flat = flat || (p.face == f && p.straightest > tolerances().parallel_cosine());
        }
      }
      if (flat || first == last || outward.isZero(0)) continue;
      outward.normalize();
      found.clear();
      bool below = false;
      for (const int t : at_.triangles) {
        const double gap = at_.gap(t, at_.corner[v]);
        if (at_.skin.normal[static_cast<std::size_t>(t)].dot(outward) > facing || gap > at_.margin ||
            gap < -at_.deepest)
          continue;
        // Below an edge of the skin the faces' normals part: a vertex inside may lie over none of them by as
        // much as it is deep.
        if (at_.barycentric(t, at_.corner[v]).minCoeff() <
            -tolerances().same_place - 0.2 * std::max(0.0, -gap) / at_.size(t))
          continue;
        found.push_back({t, gap});
        below = below || gap < 0;
      }
      if (below && at_.outside(at_.corner[v]))
        std::erase_if(found, [](const Candidate& q) { return q.gap < 0; });
      std::stable_sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
        return std::abs(a.gap) < std::abs(b.gap);
      });
      std::vector<Vec3> taken;
      for (const Candidate& q : found) {
        const Vec3& n = at_.skin.normal[static_cast<std::size_t>(q.triangle)];
        if (!taken.empty() &&
            std::abs(q.gap) > 2 * std::abs(found[0].gap) + tolerances().same_place * at_.block.radius)
          break;
        if (std::any_of(taken.begin(), taken.end(), [&](const Vec3& m) { return m.dot(n) > 0.8; })) continue;
        ContactPoint c;
        c.face_a = q.triangle;
        c.point_a = at_.on_triangle(q.triangle, at_.corner[v]);
        c.point_b = at_.corner[v];
        c.normal = n;
        c.gap = n.dot(c.point_b - c.point_a);
        c.area = 0;
        c.key = make_key(Form::skin_corner, static_cast<int>(taken.size()), static_cast<int>(v));
        taken.push_back(n);
        out.push_back(c);
      }
      if (!taken.empty()) handled_.push_back(static_cast<int>(v));
    }
  }

  /// True if a contact of the general search is at a vertex that has been dealt with.
  bool at_handled_vertex(const ContactPoint& c) const {
    for (const int v : handled_)
      if ((c.point_b - at_.corner[static_cast<std::size_t>(v)]).norm() <
          2 * std::max(0.0, -c.gap) + tolerances().same_place * at_.block.radius)
        return true;
    return false;
  }

 private:
  const SkinNear& at_;
  std::vector<int> handled_;
};

/// True if a vertex or edge contact says nothing that the patch does not.
bool contained(const SkinNear& at, const SkinPatch& p, const ContactPoint& c) {
  const double deep = std::max(0.0, -c.gap) + tolerances().same_place * at.block.radius;
  if (std::abs(p.normal.dot(c.point_b - p.point)) > deep) return false;  // not of this face
  const double aligned = c.normal.dot(p.normal);
  if (aligned > 0.866) return p.straightest > tolerances().parallel_cosine();
  if (std::abs(aligned) > 0.5) return false;
  // Beside the face: an obstacle only if it rises above the skin that the face lies on.
  const auto& tri =
      at.skin.surface
          .triangles[static_cast<std::size_t>(c.face_a >= 0 ? c.face_a : at.index.triangle_at(c.point_a))];
  for (const int v : tri)
    if (p.normal.dot(at.skin.surface.vertices[static_cast<std::size_t>(v)] - p.point) > 2 * deep)
      return false;
  return true;
}

}  // namespace

int skin_block(const SurfaceIndex& index, const Polyhedron& B, const Pose& pose_b, double margin,
               std::vector<ContactPoint>& out) {
  const std::size_t before = out.size();
  const SkinNear near(index, B, pose_b, margin);
  if (near.triangles.empty()) return 0;
  thread_local std::vector<ContactPoint> points;
  points.clear();
  surface_block(index, B, pose_b, margin, points);
  std::vector<SkinPatch> patches;
  cover_skin(near, patches);
  press_on_nodes(near, patches, out);
  Vertices vertices(near);
  vertices.add(patches, out);
  for (const ContactPoint& c : points) {
    bool said = c.area == 0 && vertices.at_handled_vertex(c);
    for (const SkinPatch& p : patches)
      said = said || (c.area > 0 ? c.face_b < 0 || c.face_b == p.face : contained(near, p, c));
    if (!said) out.push_back(c);
  }
  return static_cast<int>(out.size() - before);
}

}  // namespace talus::contact
