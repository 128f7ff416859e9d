/// Convex against convex: separating axes for the normal, clipping for the points.
#include "contact/narrow/narrow_convex.hpp"

#include <algorithm>

#include "contact/narrow/narrow_manifold.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact::narrow {
namespace {

struct ConvexScratch {
  Hull a, b, moved;
  ManifoldScratch clip;
  std::vector<ContactPoint> points, corners;
};
thread_local ConvexScratch convex_scratch;

/// What two that touch or overlap by `gap` along the axis n of least overlap would meet by, moved apart along
/// it: their closest points.
void meet_apart(const HullPair& pair, const Vec3& n, double gap, Hull& moved,
                std::vector<ContactPoint>& points) {
  constexpr double touches = 1e3;  // that they are then apart: a millionth of the size, which gjk() tells
  const Vec3 shift = (touches * pair.touch - gap) * n;
  moved = pair.B;
  moved.move(shift);
  const Separation sep = gjk(pair.A, moved, n, 2 * touches * pair.touch);
  if (sep.beyond || sep.overlap) return;
  emit_closest({pair.s, pair.A, moved, 2 * touches * pair.touch, pair.touch}, sep, points);
  for (ContactPoint& c : points) {
    c.point_b -= shift;
    c.gap = c.normal.dot(c.point_b - c.point_a);
  }
}

/// Touching or overlapping: the crossing edges, the faces' manifold, or what meets first.
void meet(const HullPair& pair, const Axis& of_a, const Axis& of_b, const EdgeAxis& edge, Hull& moved,
          std::vector<ContactPoint>& points) {
  const bool first = of_b.gap <= of_a.gap + pair.touch;
  const double face_gap = std::max(of_a.gap, of_b.gap);
  const bool edges = edge.edge_a >= 0 && edge.gap > face_gap + pair.touch;
  const bool crossed =
      edges && crossing({pair.s, pair.A, pair.B, pair.margin, pair.touch + 2 * std::abs(edge.gap)}, edge);
  // Edges that cross along a face stand for an edge lying on it: the face's manifold holds both of its ends.
  const Vec3 face_normal = first ? pair.A.normal(of_a.face) : Vec3(-pair.B.normal(of_b.face));
  if (crossed && edge.normal.dot(face_normal) < tolerances().parallel_cosine())
    return emit_edges(pair, edge, points);
  if (tied_faces(pair, face_gap, points)) return;
  points.clear();
  if (crossed) return emit_edges(pair, edge, points);
  meet_apart(pair, edges ? edge.normal : face_normal, edges ? edge.gap : face_gap, moved, points);
}

/// Faces near to parallel that are apart, their closest points on the rim of what they share: with them its
/// corners, which a turn about the closest points would bring in unseen. None is nearer than the two are; the
/// closest points stand for those that would be.
void complete_flat(const HullPair& pair, const Axis& of_a, const Axis& of_b, const Separation& sep,
                   std::vector<ContactPoint>& corners, std::vector<ContactPoint>& points) {
  const bool by_a = of_a.gap >= of_b.gap;
  const Vec3 n = by_a ? pair.A.normal(of_a.face) : Vec3(-pair.B.normal(of_b.face));
  if (points.empty() || n.dot(sep.normal) < tolerances().parallel_cosine()) return;
  double area = 0, closest = 0;
  face_manifold(pair, by_a, by_a ? of_a.face : of_b.face, corners, area);
  if (!(area > 0)) return;
  const std::size_t first = points.size();
  const auto stands_for = [&](const ContactPoint& c) {
    return c.gap <= sep.distance + pair.touch ||
           std::any_of(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(first),
                       [&](const ContactPoint& p) { return p.key == c.key; });
  };
  for (const ContactPoint& c : corners)
    if (stands_for(c))
      closest += c.area;
    else
      points.push_back(c);
  points.front().area = closest;
}

/// True if the line of the centres separates the two by more than the margin, as for most candidates of a
/// pile.
bool apart_along(const Hull& a, const Hull& b, const Vec3& between, double margin) {
  double low, high, unused;
  a.extent(between, unused, high);
  b.extent(between, low, unused);
  return low - high > margin * between.norm();
}

}  // namespace

int convex_convex(const Polyhedron& a, const Pose& pose_a, const Polyhedron& b, const Pose& pose_b,
                  double margin, std::vector<ContactPoint>& out) {
  ConvexScratch& s = convex_scratch;
  const Vec3 between = pose_b.c - pose_a.c;
  const double ra = a.radius * stretch_bound(pose_a.F), rb = b.radius * stretch_bound(pose_b.F);
  const double reach = ra + rb + margin;
  if (between.squaredNorm() > reach * reach) return 0;
  s.a.set(a, Vec3::Zero(), pose_a.F);
  s.b.set(b, between, pose_b.F);
  if (apart_along(s.a, s.b, between, margin)) return 0;
  const double touch = same_point(ra, rb, pose_a);
  const HullPair pair{s.clip, s.a, s.b, margin, touch};
  const bool small = a.axis_edges.size() * b.axis_edges.size() <= 36 && !a.axis_edges.empty() &&
                     !b.axis_edges.empty() && a.vertices.size() <= 16 && b.vertices.size() <= 16;
  auto& points = s.points;
  points.clear();

  Separation sep;
  if (!small) {
    sep = gjk(s.a, s.b, between, margin);
    if (sep.beyond) return 0;
  }
  s.a.compute_normals();
  const Axis of_a = best_face(s.a, s.b, margin, touch);
  if (of_a.gap > margin) return 0;
  s.b.compute_normals();
  const Axis of_b = best_face(s.b, s.a, margin, touch);
  if (of_b.gap > margin) return 0;
  const bool first = of_b.gap <= of_a.gap + touch;
  const double face_gap = std::max(of_a.gap, of_b.gap);
  double area = 0;
  bool done = false;

  // Touching faces whose manifold realises the gap: no other axis can do better than the true distance.
  if (std::abs(face_gap) <= touch && tied_faces(pair, face_gap, points)) done = true;

  if (!done && face_gap > touch && face_manifold(pair, first, first ? of_a.face : of_b.face, points, area))
    done = true;

  if (!done && (small || sep.overlap || sep.distance <= touch)) {
    const EdgeAxis edge = small ? best_edges_small(s.a, s.b, margin) : best_edges_large(s.a, s.b, 4 * touch);
    if (edge.gap > margin) return 0;
    done = edge.gap > face_gap + touch && nearly_flat(pair, of_a, of_b, edge, points);
    if (!done) points.clear();
    if (!done && std::max(face_gap, edge.gap) <= touch) {
      meet(pair, of_a, of_b, edge, s.moved, points);
      done = true;
    } else if (!done && edge.edge_a >= 0 && edge.gap > face_gap + touch && crossing(pair, edge)) {
      emit_edges(pair, edge, points);
      done = true;
    }
  }
  if (!done) {
    // Separated, and no axis of a face or a crossing realises the distance.
    points.clear();
    if (small) sep = gjk(s.a, s.b, between, margin);
    if (sep.beyond) return 0;
    if (sep.overlap)
      tied_faces(pair, face_gap, points);
    else if (sep.distance <= margin) {
      emit_closest(pair, sep, points);
      complete_flat(pair, of_a, of_b, sep, s.corners, points);
    }
  }
  for (auto& c : points) {
    c.point_a += pose_a.c;
    c.point_b += pose_a.c;
    out.push_back(c);
  }
  return static_cast<int>(points.size());
}

}  // namespace talus::contact::narrow
