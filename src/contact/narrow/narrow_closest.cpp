#include <algorithm>

#include "contact/narrow/narrow_manifold.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact::narrow {

void emit_closest(const HullPair& pair, const Separation& sep, std::vector<ContactPoint>& points) {
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
  // Edges across the normal at the closest vertices of each, nearly parallel to one another and within the
  // margin.
  const double flat = 0.02;
  int ea = -1, eb = -1;
  double straightest = std::numeric_limits<double>::infinity();
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
          if (measure < straightest - tolerances().same_place) straightest = measure, ea = e, eb = f;
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
      // Edges that are not quite parallel may be closest elsewhere, or those beside them.
      if (std::any_of(points.begin(), points.end(),
                      [&](const ContactPoint& c) { return c.gap <= sep.distance + pair.touch; }))
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
    key = kb == 2 ? make_key(Form::vertex_edge, va[0], edge_of(pb, vb[0], vb[1]))
                  : make_key(Form::vertex_face, va[0], vb[0]);
  else if (kb == 1)
    key = ka == 2 ? make_key(Form::edge_vertex, edge_of(pa, va[0], va[1]), vb[0])
                  : make_key(Form::face_vertex, va[0], vb[0]);
  else
    key = make_key(Form::edge_edge, edge_of(pa, va[0], va[1]), edge_of(pb, vb[0], vb[1]));
  emit(sep.a, sep.b, key);
}

}  // namespace talus::contact::narrow
