#include "contact/narrow/narrow_manifold.hpp"

#include "contact/tolerances.hpp"

namespace talus::contact::narrow {
namespace {

constexpr int most_points = 8;

int side_edge(const Polyhedron& p, int face, int side) {
  const int e = p.face_edges[p.face_offset[face] + side];
  return e >= 0 ? e : static_cast<int>(p.edges.size()) + p.face_offset[face] + side;
}

/// Which two features a clipped corner stands for. R holds the clipping face, Q the clipped one.
FeatureKey clip_key(const Hull& R, int f, const Hull& Q, int g, const ClipVertex& v, bool reference_is_a) {
  const int n = Q.face_size(g), m = R.face_size(f);
  if (v.in < n && v.out < n) {
    const int q = Q.face_vertex(g, v.out);
    return reference_is_a ? make_key(Form::face_vertex, f, q) : make_key(Form::vertex_face, q, f);
  }
  if (v.in >= n && v.out >= n) {
    const int j = v.in - n, k = v.out - n;
    const int r = R.face_vertex(f, k == (j + 1) % m ? k : j);
    return reference_is_a ? make_key(Form::vertex_face, r, g) : make_key(Form::face_vertex, g, r);
  }
  const int eq = side_edge(*Q.p, g, v.in < n ? v.in : v.out);
  const int er = side_edge(*R.p, f, (v.in < n ? v.out : v.in) - n);
  return reference_is_a ? make_key(Form::edge_edge, er, eq) : make_key(Form::edge_edge, eq, er);
}

/// Leaves at most eight corners, dropping those that cost the least area; the deepest stays. Weights keep
/// their sum.
void thin_out(std::vector<ClipVertex>& polygon, std::vector<double>& weight, std::vector<double>& gaps,
              const Vec3& n) {
  double before = 0;
  for (const double w : weight) before += w;
  while (static_cast<int>(polygon.size()) > most_points) {
    const int count = static_cast<int>(polygon.size());
    const int deepest = static_cast<int>(std::min_element(gaps.begin(), gaps.end()) - gaps.begin());
    int drop = -1;
    double least = infinity;
    for (int i = 0; i < count; ++i) {
      if (i == deepest) continue;
      const Vec3 &p = polygon[(i + count - 1) % count].x, &q = polygon[i].x, &r = polygon[(i + 1) % count].x;
      const double cost = std::abs(n.dot((q - p).cross(r - p)));
      if (cost < least) least = cost, drop = i;
    }
    polygon.erase(polygon.begin() + drop);
    weight.erase(weight.begin() + drop);
    gaps.erase(gaps.begin() + drop);
  }
  double after = 0;
  for (const double w : weight) after += w;
  if (after > 0)
    for (double& w : weight) w *= before / after;
}

/// Of the faces at a vertex of Q the one most opposed to n; -1: none.
int incident_face(const Hull& Q, int vertex, const Vec3& n_body) {
  int g = -1;
  double opposed = infinity;
  const Polyhedron& q = *Q.p;
  for (int i = q.vertex_edge_offset[vertex]; i < q.vertex_edge_offset[vertex + 1]; ++i)
    for (const int face : {q.edges[q.vertex_edges[i]].left, q.edges[q.vertex_edges[i]].right}) {
      const double c = n_body.dot(q.face_normals[face]);
      if (c < opposed - tolerances().same_place || (c < opposed + tolerances().same_place && face < g))
        opposed = std::min(c, opposed), g = face;
    }
  return g;
}

/// Face g of Q clipped by the sides of face f of R, into s.polygon.
void clip_face(ManifoldScratch& s, const Hull& R, int f, const Hull& Q, int g, double touch) {
  const Vec3& n = R.normal(f);
  const int incident = Q.face_size(g), sides = R.face_size(f);
  s.polygon.clear();
  for (int k = 0; k < incident; ++k)
    s.polygon.push_back({Q.vertex(Q.face_vertex(g, k)), (k + incident - 1) % incident, k});
  for (int k = 0; k < sides && !s.polygon.empty(); ++k) {
    const Vec3 p0 = R.vertex(R.face_vertex(f, k)), p1 = R.vertex(R.face_vertex(f, (k + 1) % sides));
    clip_half_space(s.polygon, p0, (p1 - p0).cross(n).normalized(), touch, incident + k, s.clipped);
    s.polygon.swap(s.clipped);
  }
  // Merge corners that coincide; an incident vertex is kept before a crossing so that keys do not flicker.
  for (std::size_t i = 0; i < s.polygon.size() && s.polygon.size() > 1;) {
    const std::size_t j = (i + 1) % s.polygon.size();
    if ((s.polygon[i].x - s.polygon[j].x).squaredNorm() <= 16 * touch * touch) {
      const auto pure = [&](const ClipVertex& v) { return (v.in < incident) == (v.out < incident); };
      s.polygon.erase(s.polygon.begin() + static_cast<std::ptrdiff_t>(pure(s.polygon[i]) ? j : i));
    } else {
      ++i;
    }
  }
}

/// Area of s.polygon in the plane of n; where the faces are parallel its corners' shares go to s.weight.
double weigh_corners(ManifoldScratch& s, const Vec3& n, bool parallel) {
  const std::size_t count = s.polygon.size();
  s.weight.assign(count, 0.0);
  if (count < 3) return 0;
  // Areas in the reference plane; the incident polygon runs clockwise there.
  Vec3 centre = Vec3::Zero();
  double twice = 0;
  const Vec3 base = s.polygon[0].x;
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const double a = -n.dot((s.polygon[i].x - base).cross(s.polygon[i + 1].x - base));
    twice += a;
    centre += a * (s.polygon[i].x + s.polygon[i + 1].x + base) / 3;
  }
  if (parallel && twice > 0) {
    centre /= twice;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t j = (i + 1) % count;
      const double a = std::max(0.0, -0.5 * n.dot((s.polygon[i].x - centre).cross(s.polygon[j].x - centre)));
      s.weight[i] += a / 2;
      s.weight[j] += a / 2;
    }
  }
  return std::max(0.0, twice / 2);
}

/// True if vertex v of Q, not one of face g, may soon meet face f of R below it: a hull about to roll onto
/// its next facet.
bool over_face(const Hull& R, int f, const Hull& Q, int g, int v, const Vec3& x, const Vec3& n_body,
               double touch) {
  const Polyhedron& q = *Q.p;
  for (int k = 0; k < Q.face_size(g); ++k)
    if (Q.face_vertex(g, k) == v) return false;
  double facing = infinity;  // the far side of a thin body is no contact
  for (int i = q.vertex_edge_offset[v]; i < q.vertex_edge_offset[v + 1]; ++i) {
    const auto& e = q.edges[q.vertex_edges[i]];
    facing = std::min({facing, n_body.dot(q.face_normals[e.left]), n_body.dot(q.face_normals[e.right])});
  }
  if (facing > -tolerances().steep) return false;
  const Vec3& n = R.normal(f);
  const int sides = R.face_size(f);
  for (int k = 0; k < sides; ++k) {
    const Vec3 p0 = R.vertex(R.face_vertex(f, k)), p1 = R.vertex(R.face_vertex(f, (k + 1) % sides));
    const Vec3 m = (p1 - p0).cross(n);
    if (!(m.dot(x - p0) <= touch * m.norm())) return false;
  }
  return true;
}

}  // namespace

bool face_manifold(const HullPair& pair, bool reference_is_a, int f, std::vector<ContactPoint>& points,
                   double& area) {
  const Hull& R = reference_is_a ? pair.A : pair.B;
  const Hull& Q = reference_is_a ? pair.B : pair.A;
  ManifoldScratch& s = pair.s;
  points.clear();
  area = 0;
  const Vec3& n = R.normal(f);
  const double level = n.dot(R.vertex(R.face_vertex(f, 0)));
  const int deepest = Q.lowest(n);
  const double least_gap = n.dot(Q.vertex(deepest)) - level;
  const Vec3 n_body = Q.cof.transpose() * n;
  const int g = incident_face(Q, deepest, n_body);
  if (g < 0) return false;

  clip_face(s, R, f, Q, g, pair.touch);
  s.gaps.resize(s.polygon.size());
  for (std::size_t i = 0; i < s.polygon.size(); ++i) s.gaps[i] = n.dot(s.polygon[i].x) - level;
  area = weigh_corners(s, n, n.dot(Q.normal(g)) < -tolerances().parallel_cosine());
  if (static_cast<int>(s.polygon.size()) > most_points) thin_out(s.polygon, s.weight, s.gaps, n);

  bool realised = false;
  const auto emit = [&](const Vec3& x, double gap, double w, FeatureKey key) {
    if (gap <= least_gap + pair.touch) realised = true;
    if (gap > pair.margin) return;
    ContactPoint c;
    const Vec3 foot = x - gap * n;
    c.normal = reference_is_a ? n : Vec3(-n);
    c.point_a = reference_is_a ? foot : x;
    c.point_b = reference_is_a ? x : foot;
    c.gap = gap;
    c.area = w;
    c.key = key;
    c.face_a = reference_is_a ? f : g;
    c.face_b = reference_is_a ? g : f;
    points.push_back(c);
  };
  for (std::size_t i = 0; i < s.polygon.size(); ++i)
    emit(s.polygon[i].x, s.gaps[i], s.weight[i], clip_key(R, f, Q, g, s.polygon[i], reference_is_a));
  for (int v = 0; v < Q.count && static_cast<int>(points.size()) < most_points; ++v) {
    const Vec3 x = Q.vertex(v);
    const double gap = n.dot(x) - level;
    if (gap > pair.margin || Q.p->vertex_edge_offset[v] == Q.p->vertex_edge_offset[v + 1]) continue;
    if (!over_face(R, f, Q, g, v, x, n_body, pair.touch)) continue;
    emit(x, gap, 0.0, reference_is_a ? make_key(Form::face_vertex, f, v) : make_key(Form::vertex_face, v, f));
  }
  return realised;
}

bool tied_faces(const HullPair& pair, double gap, std::vector<ContactPoint>& points) {
  ManifoldScratch& s = pair.s;
  double best_area = -1;
  points.clear();
  Vec3 best_normal = Vec3::Zero();
  bool realised = false;
  for (const bool of_a : {true, false}) {
    const Hull& R = of_a ? pair.A : pair.B;
    for (int f = 0; f < R.p->faces(); ++f) {
      if (R.gaps[f] < gap - pair.touch) continue;
      const Vec3& n = R.normal(f);
      const Vec3 outward = of_a ? n : Vec3(-n);
      if (best_area >= 0 && outward.dot(best_normal) > tolerances().parallel_cosine())
        continue;  // the same two faces again
      double area = 0;
      const bool here = face_manifold(pair, of_a, f, s.best_points, area);
      if (s.best_points.empty()) continue;
      if (area > best_area + pair.touch * pair.touch) {
        best_area = area;
        best_normal = outward;
        points.swap(s.best_points);
        realised = here;
      }
    }
  }
  return realised;
}

void emit_edges(const HullPair& pair, const EdgeAxis& axis, std::vector<ContactPoint>& points) {
  const auto &a = pair.A.p->edges[axis.edge_a], &b = pair.B.p->edges[axis.edge_b];
  const auto c =
      closest_segments(pair.A.vertex(a.v0), pair.A.vertex(a.v1), pair.B.vertex(b.v0), pair.B.vertex(b.v1));
  ContactPoint p;
  p.point_a = c.a;
  p.point_b = c.b;
  p.normal = axis.normal;
  p.gap = axis.normal.dot(c.b - c.a);
  p.area = 0;
  p.key = make_key(Form::edge_edge, axis.edge_a, axis.edge_b);
  points.push_back(p);
}

bool nearly_flat(const HullPair& pair, const Axis& of_a, const Axis& of_b, const EdgeAxis& edge,
                 std::vector<ContactPoint>& points) {
  if (edge.edge_a < 0) return false;
  const double along_a = of_a.face >= 0 ? edge.normal.dot(pair.A.normal(of_a.face)) : -1;
  const double along_b = of_b.face >= 0 ? -edge.normal.dot(pair.B.normal(of_b.face)) : -1;
  if (std::max(along_a, along_b) < tolerances().nearly_flat_cosine()) return false;
  const bool by_a = along_a >= along_b;
  double area = 0;
  face_manifold(pair, by_a, by_a ? of_a.face : of_b.face, points, area);
  if (!(area > 0)) return false;
  const FeatureKey key = make_key(Form::edge_edge, edge.edge_a, edge.edge_b);
  double weight = 0;
  const auto crossed = [&](const ContactPoint& p) {
    if (p.key == key) weight += p.area;
    return p.key == key;
  };
  const std::size_t clipped = points.size();
  std::erase_if(points, crossed);
  if (points.size() == clipped) return false;  // they cross elsewhere than on the clipped area
  std::erase_if(points, [&](const ContactPoint& p) { return p.gap < edge.gap; });
  emit_edges(pair, edge, points);
  points.back().area = weight;
  return true;
}

bool crossing(const HullPair& pair, const EdgeAxis& axis) {
  if (axis.edge_a < 0 || axis.edge_b < 0) return false;
  const auto &a = pair.A.p->edges[axis.edge_a], &b = pair.B.p->edges[axis.edge_b];
  const auto c =
      closest_segments(pair.A.vertex(a.v0), pair.A.vertex(a.v1), pair.B.vertex(b.v0), pair.B.vertex(b.v1));
  return (c.b - c.a).norm() <= axis.gap + pair.touch;
}

}  // namespace talus::contact::narrow
