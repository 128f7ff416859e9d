/// Edges against edges, and what separated vertices are nearest to.
#include <optional>

#include "contact/narrow/narrow_features.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact::narrow {
namespace {

/// Eight edges that follow each other, which lie beside each other for the most part, and the box about them.
constexpr std::size_t edges_together = 8;
constexpr double as_deep = 0.1;   // of the overlap of crossed edges, how deep one lies in the other body,
constexpr double between = 0.05;  // and the point midway, over half of the overlap

void enclose(const std::vector<Patch::Edge>& edges, std::vector<Box3>& own, std::vector<Box3>& bunches) {
  own.clear();
  bunches.clear();
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (i % edges_together == 0) bunches.emplace_back();
    own.emplace_back(Vec3(edges[i].a.cwiseMin(edges[i].b)), Vec3(edges[i].a.cwiseMax(edges[i].b)));
    bunches.back().extend(own.back());
  }
}

/// How far beside an edge its body is, at a depth below it: as little as may be, and half of the depth within
/// it, or midway between its faces where it is thin. `left`, `right`: from the edge into its faces, across
/// it; down: positive.
double beside(const Eigen::Vector2d& left, const Eigen::Vector2d& right, double depth) {
  const auto at = [&](const Eigen::Vector2d& ray) {
    return ray[1] > 0 ? depth * ray[0] / ray[1]
                      : std::copysign(std::numeric_limits<double>::infinity(), ray[0]);
  };
  const auto [low, high] = std::minmax({at(left), at(right)});
  const double within = 0.5 * std::min(depth, high - low);
  return std::clamp(0.0, low + within, high - within);
}

/// Of edges crossed along n, out of A: true if a point midway between them is inside both bodies. Sharp ones
/// that lean have none straight between.
bool share(const Search& s, const Patch::Edge& a, const Patch::Edge& b, const Vec3& n, const Vec3& at_a,
           const Vec3& at_b) {
  const Vec3 da = (a.b - a.a).normalized(), db = (b.b - b.a).normalized(), ta = n.cross(da), tb = n.cross(db);
  const double half = 0.5 * n.dot(at_a - at_b);  // of the overlap
  const double ya =
      beside({ta.dot(a.into_left), -n.dot(a.into_left)}, {ta.dot(a.into_right), -n.dot(a.into_right)}, half);
  const double yb =
      beside({tb.dot(b.into_left), n.dot(b.into_left)}, {tb.dot(b.into_right), n.dot(b.into_right)}, half);
  const Vec3 x = 0.5 * (at_a + at_b) + ya / ta.dot(db) * db +
                 yb / tb.dot(da) * da;  // along the one edge, beside the other
  return x.allFinite() && inside_by(s, true, x, between * half) && inside_by(s, false, x, between * half);
}

/// Where two edges cross; none where one of them ends before. An edge that goes on beyond its end inside its
/// own body is crossed there by what has gone into that body, as far as it does not leave it: of surfaces
/// that are plane but for their digits the one stands out of the other far from where they meet. Corners that
/// touch have contacts of their own; but what an edge has sunk into beside its end it crosses, however near
/// that is. `gap`: along the normal of both, below 0 where they overlap.
std::optional<SegmentPair> crossing(const Search& s, const Patch::Edge& a, const Patch::Edge& b, double gap,
                                    double reach) {
  const auto c = closest_segments(a.a, a.b, b.a, b.b);
  const Vec3 da = a.b - a.a, db = b.b - b.a;
  const double beside = std::max(0.0, s.touch + std::min(0.0, gap)), end_a = beside / da.norm(),
               end_b = beside / db.norm();
  const auto within = [](double at, double end) { return at >= end && at <= 1 - end; };
  const bool ends = std::min(c.s, c.t) <= 0 || std::max(c.s, c.t) >= 1;  // or cross beyond
  if (!ends && within(c.s, end_a) && within(c.t, end_b)) return c;
  const auto goes_on = [](const Patch::Edge& e, double at) { return at < 0.5 ? e.on_at_a : e.on_at_b; };
  const Vec3 across = da.cross(db), r = b.a - a.a;
  SegmentPair m{
      r.cross(db).dot(across) / across.squaredNorm(), r.cross(da).dot(across) / across.squaredNorm(), {}, {}};
  m.a = a.a + m.s * da, m.b = b.a + m.t * db;
  if ((m.a - c.a).norm() > reach || (m.b - c.b).norm() > reach) return {};
  // Where they are apart, both are at the end if they are no farther from it than from each other. Where they
  // overlap, what goes on beyond the end is asked for: the place where they cross is in both bodies.
  const double at_end = gap > 0 ? std::max(s.touch, (m.b - m.a).norm()) : s.touch;
  const auto crossed = [&](const Patch::Edge& e, const Vec3& on_edge, double at, double end, bool first,
                           const Vec3& other) {
    return within(at, end) ||
           (goes_on(e, at) && (std::min((on_edge - e.a).norm(), (on_edge - e.b).norm()) <= at_end ||
                               (in_body(s, first, other) && in_body(s, first, on_edge))));
  };
  if (!crossed(a, m.a, m.s, end_a, true, m.b) || !crossed(b, m.b, m.t, end_b, false, m.a)) return {};
  return m;
}

bool beyond(const Box3& box, const Vec3& lo, const Vec3& hi) {
  return (box.min().array() > hi.array()).any() || (box.max().array() < lo.array()).any();
}

}  // namespace

void edge_edge(const Search& s, std::vector<ContactPoint>& out) {
  // Crossed edges lie apart by the gap or the overlap; springs overlap by a small part of the block at most.
  const double reach = std::max(s.margin, crossed_overlap * s.depth);
  thread_local std::vector<Box3> boxes, bunches;
  enclose(s.B.edges, boxes, bunches);
  for (const auto& a : s.A.edges) {
    const Vec3 lo = a.a.cwiseMin(a.b).array() - reach, hi = a.a.cwiseMax(a.b).array() + reach;
    const Vec3 da = a.b - a.a;
    for (std::size_t i = 0; i < s.B.edges.size(); ++i) {
      if (i % edges_together == 0 && beyond(bunches[i / edges_together], lo, hi)) {
        i += edges_together - 1;
        continue;
      }
      if (beyond(boxes[i], lo, hi)) continue;
      const auto& b = s.B.edges[i];
      const Vec3 db = b.b - b.a;
      if (along(da, db)) continue;  // their ends are vertex-edge contacts
      Vec3 n = da.cross(db).normalized();
      if (n.dot(a.left + a.right) < 0) n = -n;
      double gap = n.dot(b.a - a.a);
      if (gap > s.margin || gap < -s.depth) continue;
      const double al = n.dot(a.into_left), ar = n.dot(a.into_right), bl = -n.dot(b.into_left),
                   br = -n.dot(b.into_right);
      if (std::max({al, ar, bl, br}) > tolerances().lean) continue;
      const std::optional<SegmentPair> met = crossing(s, a, b, gap, reach);
      if (!met) continue;
      const SegmentPair& c = *met;
      const Vec3 across = n;
      ContactPoint p;
      // Nearly parallel faces: outside the arc the face itself gives the normal.
      p.face_a = p.face_b = -1;
      if (al > 0 || ar > 0)
        n = al >= ar ? a.left : a.right;
      else if (bl > 0 || br > 0)
        n = -(bl >= br ? b.left : b.right);
      gap = n.dot(c.b - c.a);
      if (gap > s.margin || gap < -s.depth) continue;
      // Edges far behind a rim are not crossed, and those on the far sides of two neighbours look it, or on
      // the sides of a notch and of what fills it: if they are crossed, one of them runs inside the other
      // body about as deep as they overlap (both but for sharp ones), or the bodies share a point between
      // them. Those of a skin that bends need not.
      if (gap < -16 * s.touch &&
          ((c.b - c.a).squaredNorm() > reach * reach ||
           (s.told() && !inside_by(s, true, c.b, -as_deep * gap) &&
            !inside_by(s, false, c.a, -as_deep * gap) && !share(s, a, b, across, c.a, c.b))))
        continue;
      p.point_a = c.a, p.point_b = c.b, p.normal = n, p.gap = gap, p.area = 0;
      p.key = make_key(Form::edge_edge, a.id, b.id);
      out.push_back(p);
    }
  }
}

void vertex_edge(const Search& s, const Patch& E, const Patch& V, bool first,
                 std::vector<ContactPoint>& out) {
  for (const auto& e : E.edges) {
    const Vec3 lo = e.a.cwiseMin(e.b).array() - s.margin, hi = e.a.cwiseMax(e.b).array() + s.margin;
    const Vec3 d = e.b - e.a;
    const double l = d.norm();
    for (const auto& v : V.vertices) {
      if (v.straight || (v.x.array() > hi.array()).any() || (v.x.array() < lo.array()).any()) continue;
      const double t = d.dot(v.x - e.a) / (l * l);
      if (t * l <= s.touch || (1 - t) * l <= s.touch) continue;
      const Vec3 foot = e.a + t * d, r = v.x - foot;
      const double gap = r.norm();
      if (gap <= s.touch || gap > s.margin) continue;
      const Vec3 n = r / gap;
      if (r.dot(e.into_left) >= -s.touch || r.dot(e.into_right) >= -s.touch)
        continue;  // over a face, or behind
      if (n.dot(e.left + e.right) <= 0 && e.right_face >= 0) continue;
      if (falling(V, v, n) < -tolerances().steep) continue;
      ContactPoint c = vertex_contact(first, foot, v.x, n, gap);
      c.key = first ? make_key(Form::edge_vertex, e.id, v.id) : make_key(Form::vertex_edge, v.id, e.id);
      out.push_back(c);
    }
  }
}

void vertex_vertex(const Search& s, std::vector<ContactPoint>& out) {
  for (const auto& a : s.A.vertices)
    for (const auto& b : s.B.vertices) {
      const Vec3 r = b.x - a.x;
      const double sq = r.squaredNorm();
      if (a.straight || sq > s.margin * s.margin || sq <= s.touch * s.touch) continue;
      const double gap = std::sqrt(sq);
      const Vec3 n = r / gap;
      if (falling(s.A, a, -n) * gap <= s.touch || falling(s.B, b, n) * gap <= s.touch) continue;
      ContactPoint c;
      c.point_a = a.x, c.point_b = b.x, c.normal = n, c.gap = gap, c.area = 0;
      c.key = make_key(Form::vertex_vertex, a.id, b.id);
      out.push_back(c);
    }
}

}  // namespace talus::contact::narrow
