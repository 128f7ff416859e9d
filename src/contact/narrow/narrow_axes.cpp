#include "contact/narrow/narrow_axes.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact::narrow {
namespace {

/// Support edge of h parallel to d, highest along n.
int support_edge(const Hull& h, const Vec3& d, const Vec3& n) {
  int best = -1;
  double height = -infinity;
  const auto& edges = h.p->edges;
  for (int e = 0; e < static_cast<int>(edges.size()); ++e) {
    const Vec3 v = edge_vector(h, e);
    if (!along(v, d)) continue;
    const double at = n.dot(h.vertex(edges[e].v0) + h.vertex(edges[e].v1)) / 2;
    if (at > height) height = at, best = e;
  }
  return best;
}

/// True if edge e of h is the highest along n, up to round-off: n lies between the normals of its two faces,
/// or of a flat triangle beyond its side.
bool supports(const Hull& h, int e, const Vec3& n) {
  constexpr double round_off =
      1e-9;  // of the angle between a normal and the arc: an axis too many costs nothing but time
  const auto& edge = h.p->edges[e];
  if (h.count <= 3) {
    const Vec3 at = h.vertex(edge.v0), third = h.vertex(3 - edge.v0 - edge.v1);
    return n.dot(third - at) <= round_off * (third - at).norm();
  }
  const Vec3 d = edge_vector(h, e), &l = h.normal(edge.left), &r = h.normal(edge.right);
  const double turn = l.cross(r).dot(d) < 0 ? -1 : 1, slack = -round_off * d.norm();
  return turn * l.cross(n).dot(d) >= slack && turn * n.cross(r).dot(d) >= slack && n.dot(l + r) > 0;
}

/// The axis of two edges, if they are the highest and the lowest along it: no other parts two convex bodies
/// farther than their faces do.
void edge_axis_by_support(const Hull& A, const Hull& B, int ea, int eb, EdgeAxis& best) {
  const Vec3 da = edge_vector(A, ea), db = edge_vector(B, eb);
  Vec3 n = da.cross(db);
  const double nn = n.squaredNorm();
  if (nn <= square(tolerances().same_normal) * da.squaredNorm() * db.squaredNorm()) return;
  n /= std::sqrt(nn);
  const Vec3 between = B.vertex(B.p->edges[eb].v0) - A.vertex(A.p->edges[ea].v0);
  for (const double sign : {1.0, -1.0}) {
    const Vec3 out = sign * n;
    if (!(out.dot(between) > best.gap) || !supports(A, ea, out) || !supports(B, eb, -out)) continue;
    double low, high;
    A.extent(out, low, high);
    if (const double gap = B.min_height(out) - high; gap > best.gap) best = {gap, out, ea, eb};
  }
}

}  // namespace

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

EdgeAxis best_edges_small(const Hull& A, const Hull& B, double stop) {
  EdgeAxis best;
  int ka = -1, kb = -1;
  for (const int ea : A.p->axis_edges) {
    const Vec3 da = edge_vector(A, ea);
    for (const int eb : B.p->axis_edges) {
      const Vec3 db = edge_vector(B, eb);
      Vec3 n = da.cross(db);
      if (along(da, db)) continue;
      n.normalize();
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
  const auto realise = [&](int ea, int eb) {  // what the support edges along these directions leave apart
    best.edge_a = support_edge(A, edge_vector(A, ea), best.normal);
    best.edge_b = support_edge(B, edge_vector(B, eb), -best.normal);
    return best.normal.dot(B.vertex(B.p->edges[best.edge_b].v0) - A.vertex(A.p->edges[best.edge_a].v0));
  };
  // Several pairs of directions may have the same normal (tetrahedra turned alike): the one whose edges lie
  // there.
  const double close = best.gap + tolerances().same_place * std::min(A.p->radius, B.p->radius);
  if (realise(ka, kb) <= close) return best;
  for (const int ea : A.p->axis_edges)
    for (const int eb : B.p->axis_edges) {
      const Vec3 n = edge_vector(A, ea).cross(edge_vector(B, eb));
      if (n.squaredNorm() > 0 && along(n, best.normal) && realise(ea, eb) <= close) return best;
    }
  best.edge_a = best.edge_b = -1;  // a face's normal, met by edges that do not touch
  return best;
}

EdgeAxis best_edges_large(const Hull& A, const Hull& B, double grow) {
  thread_local std::vector<int> edges_a, edges_b;
  EdgeAxis best;
  Box3 overlap = A.box().intersection(B.box());
  overlap.min().array() -= grow;
  overlap.max().array() += grow;
  const auto collect = [&](const Hull& h, std::vector<int>& list) {
    list.clear();
    for (int e = 0; e < static_cast<int>(h.p->edges.size()); ++e) {
      const Vec3 a = h.vertex(h.p->edges[e].v0), b = h.vertex(h.p->edges[e].v1);
      if ((a.cwiseMin(b).array() <= overlap.max().array()).all() &&
          (a.cwiseMax(b).array() >= overlap.min().array()).all())
        list.push_back(e);
    }
  };
  collect(A, edges_a);
  collect(B, edges_b);
  if (A.count <= 3 || B.count <= 3) {  // the arcs of a flat triangle on the Gauss map are half circles
    for (const int ea : edges_a)
      for (const int eb : edges_b) edge_axis_by_support(A, B, ea, eb, best);
    return best;
  }
  for (const int ea : edges_a) {
    const auto& a = A.p->edges[ea];
    const Vec3 da = edge_vector(A, ea), na = A.normal(a.left), ma = A.normal(a.right);
    const Vec3 ba = ma.cross(na);
    for (const int eb : edges_b) {
      const auto& b = B.p->edges[eb];
      const Vec3 nb = -(B.cof * B.p->face_normals[b.left]), mb = -(B.cof * B.p->face_normals[b.right]);
      const double cba = nb.dot(ba), dba = mb.dot(ba);
      if (cba * dba >= 0) continue;
      const Vec3 dc = mb.cross(nb);
      const double adc = na.dot(dc), bdc = ma.dot(dc);
      if (adc * bdc >= 0 || cba * bdc <= 0) continue;
      const Vec3 db = edge_vector(B, eb);
      Vec3 n = da.cross(db);
      if (along(da, db)) continue;
      n.normalize();
      if (n.dot(na + ma) < 0) n = -n;
      const double gap = n.dot(B.vertex(b.v0) - A.vertex(a.v0));
      if (gap > best.gap) best = {gap, n, ea, eb};
    }
  }
  return best;
}

SignedAxis signed_axis(Hull& a, Hull& b) {
  a.compute_normals();
  b.compute_normals();
  const double touch = tolerances().same_place * std::min(a.p->radius, b.p->radius);
  const Axis of_a = best_face(a, b, infinity, touch), of_b = best_face(b, a, infinity, touch);
  const bool small = !a.p->axis_edges.empty() && !b.p->axis_edges.empty() &&
                     a.p->axis_edges.size() * b.p->axis_edges.size() <= 36;
  const EdgeAxis edge = small ? best_edges_small(a, b, infinity) : best_edges_large(a, b, 4 * touch);
  SignedAxis best{of_a.gap, a.normal(of_a.face)};
  if (of_b.gap > best.gap + touch) best = {of_b.gap, -b.normal(of_b.face)};
  if (edge.gap > best.gap + touch) best = {edge.gap, edge.normal};
  return best;
}

}  // namespace talus::contact::narrow
