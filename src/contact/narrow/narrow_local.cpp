#include "contact/narrow/narrow_local.hpp"

#include "contact/narrow/narrow_features.hpp"
#include "contact/narrow/narrow_gjk.hpp"
#include "contact/narrow/narrow_near.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact::narrow {
namespace {

struct LocalScratch {
  Patch a, b;
  std::vector<ContactPoint> points;
  Hull hull_a, hull;
  NearTriangles near;
  std::vector<int> facing;
};
thread_local LocalScratch local_scratch;

/// Where all lies of two bodies that is nearer to the other than `reach`, or in it: within the boxes of both,
/// and between the planes that touch their convex hulls across some direction. Across that in which the hulls
/// lie least in each other these planes leave little but what touches; it is near that of the closest points
/// once one has been moved off the other. Moves `b`.
Common shared(const Hull& a, Hull& b, const Vec3& from_a_to_b, double reach) {
  const Vec3 grow = Vec3::Constant(reach);
  const Box3 box_a = a.box(), box_b = b.box();
  Common best{
      Box3(box_a.min() - grow, box_a.max() + grow).intersection(Box3(box_b.min() - grow, box_b.max() + grow)),
      Vec3::UnitX(), -infinity, infinity};
  if (best.box.isEmpty()) return best;
  constexpr int rounds = 2;
  Vec3 n = from_a_to_b.squaredNorm() > 0 ? Vec3(from_a_to_b.normalized()) : Vec3::UnitX(),
       moved = Vec3::Zero();
  for (int round = 0;; ++round) {
    double lowest, high;
    a.extent(n, lowest, high);
    const double low = b.min_height(n) - n.dot(moved), lie_in = high - low;
    if (lie_in + 2 * reach < best.high - best.low)
      best.n = n, best.low = low - reach, best.high = high + reach;
    if (round == rounds || lie_in < -reach) return best;
    const Vec3 way = (lie_in + reach) * n - moved;
    b.move(way);
    moved += way;
    const Separation sep = gjk(a, b, n, infinity);
    if (sep.overlap) return best;
    n = sep.normal;
  }
}

/// A vertex on a vertex is found from both sides, a crossing at a corner from two edges: the first one stays.
void remove_doubles(const Search& s, std::vector<ContactPoint>& points) {
  std::size_t kept = 0;
  const double close = 16 * s.touch * s.touch;
  for (std::size_t i = 0; i < points.size(); ++i) {
    bool known = false;
    for (std::size_t j = 0; j < kept && !known; ++j)
      known = (points[i].point_b - points[j].point_b).squaredNorm() <= close &&
              (points[i].normal - points[j].normal).squaredNorm() <= square(tolerances().same_normal);
    if (!known) points[kept++] = points[i];
  }
  points.resize(kept);
}

int finish(const Search& s, const Polyhedron& b, const Vec3& origin, LocalScratch& w,
           std::vector<ContactPoint>& out) {
  auto& points = w.points;
  points.clear();
  vertex_face(s, s.A, s.B, true, points);
  vertex_face(s, s.B, s.A, false, points);
  edge_edge(s, points);
  vertex_edge(s, s.A, s.B, true, points);
  vertex_edge(s, s.B, s.A, false, points);
  vertex_vertex(s, points);
  remove_doubles(s, points);
  press_areas(s, b, points);
  for (auto& c : points) {
    c.point_a += origin;
    c.point_b += origin;
    out.push_back(c);
  }
  return static_cast<int>(points.size());
}

}  // namespace

int concave_concave(const Polyhedron& a, const Pose& pose_a, const Polyhedron& b, const Pose& pose_b,
                    double margin, std::vector<ContactPoint>& out) {
  const Vec3 between = pose_a.c - pose_b.c;
  const double ra = a.radius * stretch_bound(pose_a.F), rb = b.radius * stretch_bound(pose_b.F);
  const double reach = ra + rb + margin;
  if (between.squaredNorm() > reach * reach) return 0;
  LocalScratch& w = local_scratch;
  w.hull_a.set(a, between, pose_a.F);
  w.hull.set(b, Vec3::Zero(), pose_b.F);
  const double touch = same_point(ra, rb, pose_a);
  const Common common = shared(w.hull_a, w.hull, -between, margin + touch);
  if (common.box.isEmpty() || common.low > common.high) return 0;
  gather(a, between, pose_a.F, common, w.a);
  gather(b, Vec3::Zero(), pose_b.F, common, w.b);
  if (w.a.triangles.empty() || w.b.triangles.empty()) return 0;
  const Whole whole_a{a, between, pose_a.F}, whole_b{b, Vec3::Zero(), pose_b.F};
  const Search s{w.a, w.b, margin, touch, std::min(a.radius, b.radius), &whole_a, &whole_b, &common};
  return finish(s, b, pose_b.c, w, out);
}

int surface_polyhedron(const SurfaceIndex::Impl& surface, const Polyhedron& b, const Pose& pose_b,
                       double margin, std::vector<ContactPoint>& out) {
  const double rb = b.radius * stretch_bound(pose_b.F);
  const double touch = 1e-9 * rb + 1e-15 * (rb + pose_b.c.cwiseAbs().maxCoeff());
  Box3 box;
  for (const auto& x : b.vertices) box.extend(pose_b.F * x);
  box.min().array() -= margin + touch;
  box.max().array() += margin + touch;
  LocalScratch& w = local_scratch;
  gather(surface, pose_b.c, box, w.a);
  if (w.a.triangles.empty()) return 0;
  // An edge or vertex of a triangle whose plane the whole block clears by the margin is out of reach. (The
  // triangles stay: a vertex behind another one asks for the nearest of all.)
  w.hull.set(b, Vec3::Zero(), pose_b.F);
  const auto clears = [&](const Vec3& n, const Vec3& x) {
    return w.hull.min_height(n) - n.dot(x) > margin + touch;
  };
  std::erase_if(w.a.edges, [&](const Patch::Edge& e) { return clears(e.left, e.a) || clears(e.right, e.a); });
  std::erase_if(w.a.vertices, [&](const Patch::Vertex& v) {
    for (int i = v.first_face; i < v.first_face + v.faces; ++i)
      if (clears(w.a.face_normals[i], v.x)) return true;
    return false;
  });
  w.near.set(w.a);
  w.facing.clear();
  for (std::size_t k = 0; k < w.a.triangles.size(); ++k)
    if (!clears(w.a.triangles[k].n, w.a.triangles[k].a)) w.facing.push_back(static_cast<int>(k));
  gather(b, Vec3::Zero(), pose_b.F, w.near, w.facing, margin, touch, w.b);
  // Of a vertex of the surface that only faces farther than the margin are near to, the patch does not tell
  // whether it is in the block.
  const Whole whole{b, Vec3::Zero(), pose_b.F};
  Search s{w.a, w.b, margin, touch, b.radius, nullptr, &whole};
  s.surface = &surface, s.origin = pose_b.c;
  return finish(s, b, pose_b.c, w, out);
}

}  // namespace talus::contact::narrow

namespace talus::contact {

int surface_block(const SurfaceIndex& index, const Polyhedron& B, const Pose& pose_b, double margin,
                  std::vector<ContactPoint>& out) {
  return narrow::surface_polyhedron(index.impl(), B, pose_b, margin, out);
}

}  // namespace talus::contact
