/// Convex against convex: separating axes for the normal, clipping for the points.
#include <limits>

#include "contact/narrow_convex.hpp"
#include "contact/narrow_gjk.hpp"

namespace talus::contact::narrow {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double parallel_cosine = 0.9998;  // 1.15 degrees: faces closer than this to parallel press on an area
constexpr double nearly_flat_cosine = 0.9962;  // 5 degrees
constexpr int most_points = 8;

struct Scratch {
  Hull a, b;
  std::vector<ClipVertex> polygon, clipped;
  std::vector<double> weight, gaps, axis_gap;
  std::vector<char> taken;
  std::vector<int> edges_a, edges_b;
  std::vector<ContactPoint> points, best_points;
};
thread_local Scratch scratch;

struct Pair {
  Scratch& s;
  const Hull &A, &B;
  Vec3 origin;      // added to every point on output
  double margin;
  double touch;     // below this two things touch [m]
};

struct Axis {
  double gap = -infinity;
  int face = -1;
};

struct EdgeAxis {
  double gap = -infinity;
  Vec3 normal;      // out of A
  int edge_a = -1, edge_b = -1;
};

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

/// Leaves at most eight corners, dropping those that cost the least area; the deepest stays. Weights keep their sum.
void thin_out(std::vector<ClipVertex>& polygon, std::vector<double>& weight, std::vector<double>& gaps, const Vec3& n) {
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

/// Contacts on face f of R along its normal; true if a point realises `least_gap`, the gap of this axis. The points go to
/// `points`, relative to the local origin. `area` receives the clipped area.
bool face_manifold(const Pair& pair, bool reference_is_a, int f, std::vector<ContactPoint>& points, double& area) {
  const Hull& R = reference_is_a ? pair.A : pair.B;
  const Hull& Q = reference_is_a ? pair.B : pair.A;
  Scratch& s = pair.s;
  points.clear();
  area = 0;
  const Vec3& n = R.normal(f);
  const Vec3 r0 = R.vertex(R.face_vertex(f, 0));
  const double level = n.dot(r0);
  const int deepest = Q.lowest(n);
  const double least_gap = n.dot(Q.vertex(deepest)) - level;

  // Incident face: of those at the deepest vertex the one most opposed.
  int g = -1;
  double opposed = infinity;
  const Polyhedron& q = *Q.p;
  const Vec3 n_body = Q.cof.transpose() * n;
  for (int i = q.vertex_edge_offset[deepest]; i < q.vertex_edge_offset[deepest + 1]; ++i)
    for (const int face : {q.edges[q.vertex_edges[i]].left, q.edges[q.vertex_edges[i]].right}) {
      const double c = n_body.dot(q.face_normals[face]);
      if (c < opposed - 1e-9 || (c < opposed + 1e-9 && face < g)) opposed = std::min(c, opposed), g = face;
    }
  if (g < 0) return false;
  const bool parallel = n.dot(Q.normal(g)) < -parallel_cosine;

  const int incident = Q.face_size(g), sides = R.face_size(f);
  s.polygon.clear();
  for (int k = 0; k < incident; ++k)
    s.polygon.push_back({Q.vertex(Q.face_vertex(g, k)), (k + incident - 1) % incident, k});
  for (int k = 0; k < sides && !s.polygon.empty(); ++k) {
    const Vec3 p0 = R.vertex(R.face_vertex(f, k)), p1 = R.vertex(R.face_vertex(f, (k + 1) % sides));
    clip_half_space(s.polygon, p0, (p1 - p0).cross(n).normalized(), pair.touch, incident + k, s.clipped);
    s.polygon.swap(s.clipped);
  }
  // Merge corners that coincide; an incident vertex is kept before a crossing so that keys do not flicker.
  for (std::size_t i = 0; i < s.polygon.size() && s.polygon.size() > 1;) {
    const std::size_t j = (i + 1) % s.polygon.size();
    if ((s.polygon[i].x - s.polygon[j].x).squaredNorm() <= 16 * pair.touch * pair.touch) {
      const auto pure = [&](const ClipVertex& v) { return (v.in < incident) == (v.out < incident); };
      s.polygon.erase(s.polygon.begin() + static_cast<std::ptrdiff_t>(pure(s.polygon[i]) ? j : i));
    } else {
      ++i;
    }
  }
  const std::size_t count = s.polygon.size();
  s.gaps.resize(count);
  for (std::size_t i = 0; i < count; ++i) s.gaps[i] = n.dot(s.polygon[i].x) - level;
  s.weight.assign(count, 0.0);
  if (count >= 3) {
    // Areas in the reference plane; the incident polygon runs clockwise there.
    Vec3 centre = Vec3::Zero();
    double twice = 0;
    const Vec3 base = s.polygon[0].x;
    for (std::size_t i = 1; i + 1 < count; ++i) {
      const double a = -n.dot((s.polygon[i].x - base).cross(s.polygon[i + 1].x - base));
      twice += a;
      centre += a * (s.polygon[i].x + s.polygon[i + 1].x + base) / 3;
    }
    area = std::max(0.0, twice / 2);
    if (parallel && twice > 0) {
      centre /= twice;
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t j = (i + 1) % count;
        const double a = std::max(0.0, -0.5 * n.dot((s.polygon[i].x - centre).cross(s.polygon[j].x - centre)));
        s.weight[i] += a / 2;
        s.weight[j] += a / 2;
      }
    }
  }
  if (static_cast<int>(count) > most_points) thin_out(s.polygon, s.weight, s.gaps, n);

  const auto emit = [&](const Vec3& x, double gap, double w, FeatureKey key) {
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
  bool realised = false;
  for (std::size_t i = 0; i < s.polygon.size(); ++i) {
    if (s.gaps[i] <= least_gap + pair.touch) realised = true;
    if (s.gaps[i] <= pair.margin)
      emit(s.polygon[i].x, s.gaps[i], s.weight[i], clip_key(R, f, Q, g, s.polygon[i], reference_is_a));
  }
  // Other vertices within the margin over the face: a hull about to roll onto its next facet.
  for (int v = 0; v < Q.count && static_cast<int>(points.size()) < most_points; ++v) {
    const Vec3 x = Q.vertex(v);
    const double gap = n.dot(x) - level;
    if (gap > pair.margin || q.vertex_edge_offset[v] == q.vertex_edge_offset[v + 1]) continue;
    bool use = true;
    for (int k = 0; k < incident && use; ++k) use = Q.face_vertex(g, k) != v;
    if (!use) continue;
    double facing = infinity;  // the far side of a thin body is no contact
    for (int i = q.vertex_edge_offset[v]; i < q.vertex_edge_offset[v + 1]; ++i) {
      const auto& e = q.edges[q.vertex_edges[i]];
      facing = std::min({facing, n_body.dot(q.face_normals[e.left]), n_body.dot(q.face_normals[e.right])});
    }
    if (facing > -0.1) continue;
    for (int k = 0; k < sides && use; ++k) {
      const Vec3 p0 = R.vertex(R.face_vertex(f, k)), p1 = R.vertex(R.face_vertex(f, (k + 1) % sides));
      const Vec3 m = (p1 - p0).cross(n);
      use = m.dot(x - p0) <= pair.touch * m.norm();
    }
    if (!use) continue;
    if (gap <= least_gap + pair.touch) realised = true;
    emit(x, gap, 0.0, reference_is_a ? make_key(Form::face_vertex, f, v) : make_key(Form::vertex_face, v, f));
  }
  return realised;
}

/// The best face axis of R against Q; writes the gap of every face into R. Stops at the first gap above `stop`.
Axis best_face(Hull& R, const Hull& Q, double stop, double touch) {
  Axis best;
  const Polyhedron& p = *R.p;
  const auto take = [&](int f, double gap) {
    R.gaps[f] = gap;
    if (gap > best.gap + touch) best = {gap, f};
  };
  if (!p.axis_faces.empty()) {
    for (std::size_t i = 0; i < p.axis_faces.size(); ++i) {
      const int f = p.axis_faces[i], o = p.axis_opposite[i];
      const Vec3& n = R.normal(f);
      double lo, hi;
      Q.extent(n, lo, hi);
      take(f, lo - n.dot(R.vertex(R.face_vertex(f, 0))));
      if (o >= 0) take(o, n.dot(R.vertex(R.face_vertex(o, 0))) - hi);
      if (best.gap > stop) return best;
    }
    return best;
  }
  for (int f = 0; f < p.faces(); ++f) {
    const Vec3& n = R.normal(f);
    take(f, Q.min_height(n) - n.dot(R.vertex(R.face_vertex(f, 0))));
    if (best.gap > stop) return best;
  }
  return best;
}

Vec3 edge_vector(const Hull& h, int e) { return h.vertex(h.p->edges[e].v1) - h.vertex(h.p->edges[e].v0); }

/// Support edge of h parallel to d, highest along n.
int support_edge(const Hull& h, const Vec3& d, const Vec3& n) {
  int best = -1;
  double height = -infinity;
  const auto& edges = h.p->edges;
  for (int e = 0; e < static_cast<int>(edges.size()); ++e) {
    const Vec3 v = edge_vector(h, e);
    if (v.cross(d).squaredNorm() > 1e-16 * v.squaredNorm() * d.squaredNorm()) continue;
    const double at = n.dot(h.vertex(edges[e].v0) + h.vertex(edges[e].v1)) / 2;
    if (at > height) height = at, best = e;
  }
  return best;
}

/// Edge-edge axes by distinct directions (small polyhedra).
EdgeAxis best_edges_small(const Hull& A, const Hull& B, double stop) {
  EdgeAxis best;
  int ka = -1, kb = -1;
  for (const int ea : A.p->axis_edges) {
    const Vec3 da = edge_vector(A, ea);
    for (const int eb : B.p->axis_edges) {
      const Vec3 db = edge_vector(B, eb);
      Vec3 n = da.cross(db);
      const double nn = n.squaredNorm();
      if (nn <= 1e-12 * da.squaredNorm() * db.squaredNorm()) continue;
      n /= std::sqrt(nn);
      double a0, a1, b0, b1;
      A.extent(n, a0, a1);
      B.extent(n, b0, b1);
      const double up = b0 - a1, down = a0 - b1;
      if (std::max(up, down) > best.gap) {
        best.gap = std::max(up, down);
        best.normal = up >= down ? n : Vec3(-n);
        ka = ea, kb = eb;
        if (best.gap > stop) return best;
      }
    }
  }
  if (ka < 0) return best;
  const auto realise = [&](int ea, int eb) {   // what the support edges along these directions leave apart
    best.edge_a = support_edge(A, edge_vector(A, ea), best.normal);
    best.edge_b = support_edge(B, edge_vector(B, eb), -best.normal);
    return best.normal.dot(B.vertex(B.p->edges[best.edge_b].v0) - A.vertex(A.p->edges[best.edge_a].v0));
  };
  // Several pairs of directions may have the same normal (tetrahedra turned alike): the one whose edges lie there.
  const double close = best.gap + 1e-9 * std::min(A.p->radius, B.p->radius);
  if (realise(ka, kb) <= close) return best;
  for (const int ea : A.p->axis_edges)
    for (const int eb : B.p->axis_edges) {
      const Vec3 n = edge_vector(A, ea).cross(edge_vector(B, eb));
      if (n.cross(best.normal).squaredNorm() <= 1e-16 * n.squaredNorm() && n.squaredNorm() > 0 && realise(ea, eb) <= close) return best;
    }
  best.edge_a = best.edge_b = -1;   // a face's normal, met by edges that do not touch
  return best;
}

void edge_axis_by_projection(const Hull& A, const Hull& B, int ea, int eb, EdgeAxis& best) {
  const Vec3 da = edge_vector(A, ea), db = edge_vector(B, eb);
  Vec3 n = da.cross(db);
  const double nn = n.squaredNorm();
  if (nn <= 1e-12 * da.squaredNorm() * db.squaredNorm()) return;
  n /= std::sqrt(nn);
  double a0, a1, b0, b1;
  A.extent(n, a0, a1);
  B.extent(n, b0, b1);
  const double up = b0 - a1, down = a0 - b1;
  if (std::max(up, down) > best.gap) best = {std::max(up, down), up >= down ? n : Vec3(-n), ea, eb};
}

/// Edge-edge axes of large hulls: only edges in the overlap of the boxes, only pairs that form a face of B - A
/// (arcs that cross on the Gauss map).
EdgeAxis best_edges_large(Scratch& s, const Hull& A, const Hull& B, double grow) {
  EdgeAxis best;
  Box3 overlap = A.box().intersection(B.box());
  overlap.min().array() -= grow;
  overlap.max().array() += grow;
  const auto collect = [&](const Hull& h, std::vector<int>& list) {
    list.clear();
    for (int e = 0; e < static_cast<int>(h.p->edges.size()); ++e) {
      const Vec3 a = h.vertex(h.p->edges[e].v0), b = h.vertex(h.p->edges[e].v1);
      if ((a.cwiseMin(b).array() <= overlap.max().array()).all() && (a.cwiseMax(b).array() >= overlap.min().array()).all())
        list.push_back(e);
    }
  };
  collect(A, s.edges_a);
  collect(B, s.edges_b);
  if (A.count <= 3 || B.count <= 3) {  // a triangle has no arcs on the Gauss map: project
    for (const int ea : s.edges_a)
      for (const int eb : s.edges_b) edge_axis_by_projection(A, B, ea, eb, best);
    return best;
  }
  for (const int ea : s.edges_a) {
    const auto& a = A.p->edges[ea];
    const Vec3 da = edge_vector(A, ea), na = A.normal(a.left), ma = A.normal(a.right);
    const Vec3 ba = ma.cross(na);
    for (const int eb : s.edges_b) {
      const auto& b = B.p->edges[eb];
      const Vec3 nb = -(B.cof * B.p->face_normals[b.left]), mb = -(B.cof * B.p->face_normals[b.right]);
      const double cba = nb.dot(ba), dba = mb.dot(ba);
      if (cba * dba >= 0) continue;
      const Vec3 dc = mb.cross(nb);
      const double adc = na.dot(dc), bdc = ma.dot(dc);
      if (adc * bdc >= 0 || cba * bdc <= 0) continue;
      const Vec3 db = edge_vector(B, eb);
      Vec3 n = da.cross(db);
      const double nn = n.squaredNorm();
      if (nn <= 1e-12 * da.squaredNorm() * db.squaredNorm()) continue;
      n /= std::sqrt(nn);
      if (n.dot(na + ma) < 0) n = -n;
      const double gap = n.dot(B.vertex(b.v0) - A.vertex(a.v0));
      if (gap > best.gap) best = {gap, n, ea, eb};
    }
  }
  return best;
}

void emit_edges(const Pair& pair, const EdgeAxis& axis, std::vector<ContactPoint>& points) {
  const auto &a = pair.A.p->edges[axis.edge_a], &b = pair.B.p->edges[axis.edge_b];
  const auto c = closest_segments(pair.A.vertex(a.v0), pair.A.vertex(a.v1), pair.B.vertex(b.v0), pair.B.vertex(b.v1));
  ContactPoint p;
  p.point_a = c.a;
  p.point_b = c.b;
  p.normal = axis.normal;
  p.gap = axis.normal.dot(c.b - c.a);
  p.area = 0;
  p.key = make_key(Form::edge_edge, axis.edge_a, axis.edge_b);
  points.push_back(p);
}

bool crossing(const Pair& pair, const EdgeAxis& axis) {
  if (axis.edge_a < 0 || axis.edge_b < 0) return false;
  const auto &a = pair.A.p->edges[axis.edge_a], &b = pair.B.p->edges[axis.edge_b];
  const auto c = closest_segments(pair.A.vertex(a.v0), pair.A.vertex(a.v1), pair.B.vertex(b.v0), pair.B.vertex(b.v1));
  return (c.b - c.a).norm() <= axis.gap + pair.touch;
}

/// Separated, nothing flat about it: the closest points, or the two ends of the overlap of parallel edges.
void emit_closest(const Pair& pair, const Separation& sep, std::vector<ContactPoint>& points) {
  const Vec3& n = sep.normal;
  const auto distinct = [](const int* v, int count, int* out) {
    int k = 0;
    for (int i = 0; i < count; ++i) {
      bool known = false;
      for (int j = 0; j < k; ++j) known |= out[j] == v[i];
      if (!known) out[k++] = v[i];
    }
    for (int i = 1; i < k; ++i)
      for (int j = i; j > 0 && out[j] < out[j - 1]; --j) std::swap(out[j], out[j - 1]);
    return k;
  };
  int va[4] = {0}, vb[4] = {0};
  const int ka = distinct(sep.ia, sep.count, va), kb = distinct(sep.ib, sep.count, vb);
  // Edges across the normal at the closest vertices of each, nearly parallel to one another and within the margin.
  const double flat = 0.02;
  int ea = -1, eb = -1;
  double straightest = infinity;
  const Polyhedron &pa = *pair.A.p, &pb = *pair.B.p;
  for (int i = 0; i < ka; ++i)
    for (int k = pa.vertex_edge_offset[va[i]]; k < pa.vertex_edge_offset[va[i] + 1]; ++k) {
      const int e = pa.vertex_edges[k];
      const Vec3 d = edge_vector(pair.A, e).normalized();
      if (std::abs(d.dot(n)) > flat) continue;
      for (int j = 0; j < kb; ++j)
        for (int l = pb.vertex_edge_offset[vb[j]]; l < pb.vertex_edge_offset[vb[j] + 1]; ++l) {
          const int f = pb.vertex_edges[l];
          const Vec3 u = edge_vector(pair.B, f).normalized();
          if (std::abs(u.dot(n)) > flat) continue;
          const double sine = d.cross(u).norm();
          if (sine > flat) continue;
          const double measure = sine + std::abs(d.dot(n)) + std::abs(u.dot(n));
          if (measure < straightest - 1e-9) straightest = measure, ea = e, eb = f;
        }
    }
  const auto emit = [&](const Vec3& a, const Vec3& b, FeatureKey key) {
    const double gap = n.dot(b - a);
    if (gap > pair.margin) return;
    ContactPoint c;
    c.point_a = a, c.point_b = b, c.normal = n, c.gap = gap, c.area = 0, c.key = key;
    points.push_back(c);
  };
  if (ea >= 0) {
    const Vec3 a0 = pair.A.vertex(pa.edges[ea].v0), a1 = pair.A.vertex(pa.edges[ea].v1);
    const Vec3 b0 = pair.B.vertex(pb.edges[eb].v0), b1 = pair.B.vertex(pb.edges[eb].v1);
    const Vec3 d = (a1 - a0).normalized();
    const double la = (a1 - a0).norm(), t0 = d.dot(b0 - a0), t1 = d.dot(b1 - a0);
    const double lo = std::max(0.0, std::min(t0, t1)), hi = std::min(la, std::max(t0, t1));
    if (hi - lo > 4 * pair.touch) {
      const auto at = [&](double t) { return Vec3(b0 + (t - t0) / (t1 - t0) * (b1 - b0)); };
      // Ends are named by the vertex that bounds them.
      const auto key = [&](double t, bool low) {
        const bool from_a = low ? t <= 0 : t >= la;
        if (from_a) return make_key(Form::vertex_edge, low ? pa.edges[ea].v0 : pa.edges[ea].v1, eb);
        return make_key(Form::edge_vertex, ea, (t1 > t0) == low ? pb.edges[eb].v0 : pb.edges[eb].v1);
      };
      emit(a0 + lo * d, at(lo), key(lo, true));
      emit(a0 + hi * d, at(hi), key(hi, false));
      return;
    }
  }
  FeatureKey key;
  const auto edge_of = [](const Polyhedron& p, int v, int w) {
    for (int i = p.vertex_edge_offset[v]; i < p.vertex_edge_offset[v + 1]; ++i) {
      const auto& e = p.edges[p.vertex_edges[i]];
      if (e.v0 == w || e.v1 == w) return p.vertex_edges[i];
    }
    return static_cast<int>(p.edges.size()) + v;  // a diagonal of a face
  };
  if (ka == 1 && kb == 1)
    key = make_key(Form::vertex_vertex, va[0], vb[0]);
  else if (ka == 1)
    key = kb == 2 ? make_key(Form::vertex_edge, va[0], edge_of(pb, vb[0], vb[1])) : make_key(Form::vertex_face, va[0], vb[0]);
  else if (kb == 1)
    key = ka == 2 ? make_key(Form::edge_vertex, edge_of(pa, va[0], va[1]), vb[0]) : make_key(Form::face_vertex, va[0], vb[0]);
  else
    key = make_key(Form::edge_edge, edge_of(pa, va[0], va[1]), edge_of(pb, vb[0], vb[1]));
  emit(sep.a, sep.b, key);
}

/// Among the face axes that tie with the best one, the manifold of largest area (first A's faces, then B's). True if it
/// holds a point at the gap of its axis.
bool tied_faces(const Pair& pair, double gap, std::vector<ContactPoint>& points) {
  Scratch& s = pair.s;
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
      if (best_area >= 0 && outward.dot(best_normal) > parallel_cosine) continue;  // the same two faces again
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

/// Crossing edges of faces close to parallel: the crossing as it is, and the rest of the clipped area, which is about to touch.
bool nearly_flat(const Pair& pair, const Axis& of_a, const Axis& of_b, const EdgeAxis& edge, std::vector<ContactPoint>& points) {
  if (edge.edge_a < 0) return false;
  const double along_a = of_a.face >= 0 ? edge.normal.dot(pair.A.normal(of_a.face)) : -1;
  const double along_b = of_b.face >= 0 ? -edge.normal.dot(pair.B.normal(of_b.face)) : -1;
  if (std::max(along_a, along_b) < nearly_flat_cosine) return false;
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
  if (points.size() == clipped) return false;   // they cross elsewhere than on the clipped area
  std::erase_if(points, [&](const ContactPoint& p) { return p.gap < edge.gap; });
  emit_edges(pair, edge, points);
  points.back().area = weight;
  return true;
}

}  // namespace

SignedAxis signed_axis(Hull& a, Hull& b) {
  a.compute_normals();
  b.compute_normals();
  const double touch = 1e-12 * std::min(a.p->radius, b.p->radius);
  const Axis of_a = best_face(a, b, infinity, touch), of_b = best_face(b, a, infinity, touch);
  const bool small = !a.p->axis_edges.empty() && !b.p->axis_edges.empty() &&
                     a.p->axis_edges.size() * b.p->axis_edges.size() <= 36;
  const EdgeAxis edge = small ? best_edges_small(a, b, infinity) : best_edges_large(scratch, a, b, 1e-6 * std::min(a.p->radius, b.p->radius));
  SignedAxis best{of_a.gap, a.normal(of_a.face), 0};
  if (of_b.gap > best.gap + touch) best = {of_b.gap, -b.normal(of_b.face), 1};
  if (edge.gap > best.gap + touch) best = {edge.gap, edge.normal, 2};
  return best;
}

int convex_convex(const Polyhedron& a, const Pose& pose_a, const Polyhedron& b, const Pose& pose_b, double margin,
                  std::vector<ContactPoint>& out) {
  Scratch& s = scratch;
  const Vec3 between = pose_b.c - pose_a.c;
  const double ra = a.radius * stretch_bound(pose_a.F), rb = b.radius * stretch_bound(pose_b.F);
  const double reach = ra + rb + margin;
  if (between.squaredNorm() > reach * reach) return 0;
  s.a.set(a, Vec3::Zero(), pose_a.F);
  s.b.set(b, between, pose_b.F);
  const double touch = 1e-9 * std::min(ra, rb) + 1e-15 * (std::max(ra, rb) + pose_a.c.cwiseAbs().maxCoeff());
  const Pair pair{s, s.a, s.b, pose_a.c, margin, touch};
  const bool small = a.axis_edges.size() * b.axis_edges.size() <= 36 && !a.axis_edges.empty() && !b.axis_edges.empty() &&
                     a.vertices.size() <= 16 && b.vertices.size() <= 16;
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

  if (!done && face_gap > touch && face_manifold(pair, first, first ? of_a.face : of_b.face, points, area)) done = true;

  if (!done && (small || sep.overlap || sep.distance <= touch)) {
    const EdgeAxis edge = small ? best_edges_small(s.a, s.b, margin) : best_edges_large(s, s.a, s.b, 4 * touch);
    if (edge.gap > margin) return 0;
    done = edge.gap > face_gap + touch && nearly_flat(pair, of_a, of_b, edge, points);
    if (!done) points.clear();
    if (!done && std::max(face_gap, edge.gap) <= touch) {  // touching or overlapping
      // Edges that cross along a face stand for an edge lying on it: the face's manifold holds both of its ends.
      const Vec3 face_normal = first ? s.a.normal(of_a.face) : Vec3(-s.b.normal(of_b.face));
      const bool by_edge = edge.edge_a >= 0 && edge.gap > face_gap + touch + 0.02 * std::abs(face_gap) &&
                           edge.normal.dot(face_normal) < parallel_cosine;
      if (by_edge && crossing({s, s.a, s.b, pose_a.c, margin, touch + 2 * std::abs(edge.gap)}, edge)) {
        emit_edges(pair, edge, points);
      } else {
        const bool realised = tied_faces(pair, face_gap, points);
        if ((points.empty() || (!realised && edge.gap > face_gap + touch)) && edge.edge_a >= 0) {
          points.clear();
          emit_edges(pair, edge, points);
        }
        if (points.empty()) {  // the deepest vertex along the best face axis, wherever it projects
          const Hull &R = first ? s.a : s.b, &Q = first ? s.b : s.a;
          const int f = first ? of_a.face : of_b.face;
          const Vec3 n = R.normal(f);
          const int q = Q.lowest(n);
          ContactPoint c;
          const Vec3 x = Q.vertex(q), foot = x - face_gap * n;
          c.normal = first ? n : Vec3(-n);
          c.point_a = first ? foot : x;
          c.point_b = first ? x : foot;
          c.gap = face_gap;
          c.area = 0;
          c.key = first ? make_key(Form::face_vertex, f, q) : make_key(Form::vertex_face, q, f);
          points.push_back(c);
        }
      }
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
    else if (sep.distance <= margin)
      emit_closest(pair, sep, points);
  }
  for (auto& c : points) {
    c.point_a += pose_a.c;
    c.point_b += pose_a.c;
    out.push_back(c);
  }
  return static_cast<int>(points.size());
}

}  // namespace talus::contact::narrow
