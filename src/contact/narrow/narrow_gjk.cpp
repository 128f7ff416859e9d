#include "contact/narrow/narrow_gjk.hpp"

namespace talus::contact::narrow {
namespace {

struct Simplex {
  int n = 0;
  Vec3 w[4];
  int a[4], b[4];
  double l[4];  // barycentric weights
};

/// Closest point of a segment to the origin; weights in l.
Vec3 segment(const Vec3& p, const Vec3& q, double l[2]) {
  const Vec3 d = q - p;
  const double dd = d.squaredNorm();
  const double t = dd > 0 ? std::clamp(-p.dot(d) / dd, 0.0, 1.0) : 0.0;
  l[0] = 1 - t, l[1] = t;
  return p + t * d;
}

/// Closest point of a triangle to the origin; degenerate triangles fall back on their sides.
Vec3 triangle(const Vec3& a, const Vec3& b, const Vec3& c, double l[3]) {
  const Vec3 n = (b - a).cross(c - a);
  const double nn = n.squaredNorm();
  if (nn > 0) {
    const double u = n.dot(b.cross(c)), v = n.dot(c.cross(a)), w = n.dot(a.cross(b));
    if (u >= 0 && v >= 0 && w >= 0) {
      const double sum = u + v + w;
      l[0] = u / sum, l[1] = v / sum, l[2] = w / sum;
      return n * (n.dot(a + b + c) / (3 * nn));
    }
  }
  double best = std::numeric_limits<double>::infinity(), k[2];
  Vec3 point = a;
  const Vec3* p[3] = {&a, &b, &c};
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const Vec3 x = segment(*p[i], *p[j], k);
    if (x.squaredNorm() < best) {
      best = x.squaredNorm();
      point = x;
      l[0] = l[1] = l[2] = 0;
      l[i] = k[0], l[j] = k[1];
    }
  }
  return point;
}

/// Reduces the simplex to the face that carries the point nearest the origin. False if the origin is inside.
bool nearest(Simplex& s, Vec3& v) {
  double l[4] = {0, 0, 0, 0};
  if (s.n == 1) {
    s.l[0] = 1;
    v = s.w[0];
    return true;
  }
  if (s.n == 2) v = segment(s.w[0], s.w[1], l);
  if (s.n == 3) v = triangle(s.w[0], s.w[1], s.w[2], l);
  if (s.n == 4) {
    constexpr int faces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
    double best = std::numeric_limits<double>::infinity();
    bool outside = false;
    for (const auto& f : faces) {
      const Vec3 n = (s.w[f[1]] - s.w[f[0]]).cross(s.w[f[2]] - s.w[f[0]]);
      const double d = n.dot(s.w[f[3]] - s.w[f[0]]), o = -n.dot(s.w[f[0]]);
      const double flat = 1e-14 * n.norm() * ((s.w[f[3]] - s.w[f[0]]).norm() + s.w[f[0]].norm());
      if (std::abs(d) > flat && d * o > 0) continue;  // the origin lies on the inner side of this face
      outside = true;
      double k[3];
      const Vec3 x = triangle(s.w[f[0]], s.w[f[1]], s.w[f[2]], k);
      if (x.squaredNorm() < best) {
        best = x.squaredNorm();
        v = x;
        l[0] = l[1] = l[2] = l[3] = 0;
        l[f[0]] = k[0], l[f[1]] = k[1], l[f[2]] = k[2];
      }
    }
    if (!outside) return false;
  }
  Simplex r;
  for (int i = 0; i < s.n; ++i)
    if (l[i] > 0) {
      r.w[r.n] = s.w[i], r.a[r.n] = s.a[i], r.b[r.n] = s.b[i], r.l[r.n] = l[i];
      ++r.n;
    }
  s = r;
  return true;
}

}  // namespace

Separation gjk(const Hull& A, const Hull& B, const Vec3& start, double limit) {
  Separation out;
  Simplex s;
  Vec3 v = start.squaredNorm() > 0 ? start : Vec3::UnitX();
  const double size = A.p->radius + B.p->radius;
  const double zero = 1e-14 * size;
  double best = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < 64; ++iteration) {
    const int ib = B.lowest(v), ia = A.lowest(-v);
    const Vec3 w = B.vertex(ib) - A.vertex(ia);
    const double length = v.norm(), bound = v.dot(w) / length;
    if (bound > limit) {
      out.beyond = true;
      out.distance = bound;
      out.normal = v / length;
      return out;
    }
    if (s.n > 0) {
      bool repeated = false;
      for (int i = 0; i < s.n; ++i) repeated |= s.a[i] == ia && s.b[i] == ib;
      if (repeated || length <= bound) break;
    }
    Simplex trial = s;
    trial.w[trial.n] = w, trial.a[trial.n] = ia, trial.b[trial.n] = ib;
    ++trial.n;
    Vec3 closer = v;
    if (!nearest(trial, closer) || closer.norm() <= zero) {
      out.overlap = true;
      return out;
    }
    if (closer.norm() >= best) break;  // no progress but round-off
    s = trial;
    v = closer;
    best = v.norm();
  }
  out.distance = v.norm();
  out.normal = v / out.distance;
  out.a = out.b = Vec3::Zero();
  out.count = s.n;
  for (int i = 0; i < s.n; ++i) {
    out.a += s.l[i] * A.vertex(s.a[i]);
    out.b += s.l[i] * B.vertex(s.b[i]);
    out.ia[i] = s.a[i], out.ib[i] = s.b[i];
  }
  return out;
}

}  // namespace talus::contact::narrow
