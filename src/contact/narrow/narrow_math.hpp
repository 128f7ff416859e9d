/// Small pieces that every narrow-phase routine uses: world-space hull in structure-of-arrays form, feature
/// keys, polygon clipping with provenance, closest points of segments. Internal to src/contact.
///
///   lumped area weights:  w_i = (a_{i-1} + a_i) / 2,   a_i = area of the triangle (centroid, p_i, p_{i+1})
///
/// which sum to the polygon's area and keep its centroid: sum w_i p_i = A c.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "contact/detection/detect.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact::narrow {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// How near points of two bodies of these radii are one, where `pose` is [m]: far out the round-off of its
/// coordinates.
inline double same_point(double ra, double rb, const Pose& pose) {
  return tolerances().same_place * std::min(ra, rb) +
         tolerances().far_off * (std::max(ra, rb) + pose.c.cwiseAbs().maxCoeff());
}

/// True if a and b have one direction.
inline bool along(const Vec3& a, const Vec3& b) {
  return a.cross(b).squaredNorm() <= square(tolerances().same_normal) * a.squaredNorm() * b.squaredNorm();
}

/// Cofactor matrix: area vectors (hence normals) transform by it.
inline Mat3 cofactor(const Mat3& F) {
  Mat3 c;
  c.col(0) = F.col(1).cross(F.col(2));
  c.col(1) = F.col(2).cross(F.col(0));
  c.col(2) = F.col(0).cross(F.col(1));
  return c;
}

/// Upper bound on the largest singular value of F; exactly 1 for a rotation up to round-off.
inline double stretch_bound(const Mat3& F) {
  return std::sqrt((F.transpose() * F).cwiseAbs().rowwise().sum().maxCoeff());
}

/// Vertices of a posed polyhedron relative to an origin, padded to a multiple of four by repeating the first.
struct Hull {
  static constexpr int width = 4;
  using Packet = Eigen::Array<double, width, 1>;
  const Polyhedron* p = nullptr;
  Mat3 F, cof;
  std::vector<double> x, y, z;
  std::vector<Vec3> normals;  // of all faces, once compute_normals() was called for this pose
  std::vector<double>
      gaps;  // per face: gap of the other hull along it, filled by the search for the best axis
  int count = 0, padded = 0;

  void set(const Polyhedron& poly, const Vec3& origin, const Mat3& deformation) {
    p = &poly;
    F = deformation;
    cof = cofactor(F);
    count = static_cast<int>(poly.vertices.size());
    padded = (count + width - 1) / width * width;
    if (static_cast<int>(x.size()) < padded) x.resize(padded), y.resize(padded), z.resize(padded);
    for (int i = 0; i < count; ++i) {
      const Vec3& X = poly.vertices[i];
      x[i] = origin.x() + F(0, 0) * X.x() + F(0, 1) * X.y() + F(0, 2) * X.z();
      y[i] = origin.y() + F(1, 0) * X.x() + F(1, 1) * X.y() + F(1, 2) * X.z();
      z[i] = origin.z() + F(2, 0) * X.x() + F(2, 1) * X.y() + F(2, 2) * X.z();
    }
    for (int i = count; i < padded; ++i) x[i] = x[0], y[i] = y[0], z[i] = z[0];
  }
  void move(const Vec3& way) {
    for (int i = 0; i < padded; ++i) x[i] += way.x(), y[i] += way.y(), z[i] += way.z();
  }
  Vec3 vertex(int i) const { return {x[i], y[i], z[i]}; }
  void compute_normals() {
    const std::size_t faces = p->face_normals.size();
    if (normals.size() < faces) normals.resize(faces), gaps.resize(faces);
    for (std::size_t f = 0; f < faces; ++f) normals[f] = (cof * p->face_normals[f]).normalized();
  }
  const Vec3& normal(int f) const { return normals[f]; }
  int face_size(int f) const { return p->face_offset[f + 1] - p->face_offset[f]; }
  int face_vertex(int f, int k) const { return p->face_vertices[p->face_offset[f] + k]; }
  Packet heights(int i, const Vec3& n) const {
    return n.x() * Packet::Map(&x[i]) + n.y() * Packet::Map(&y[i]) + n.z() * Packet::Map(&z[i]);
  }
  double min_height(const Vec3& n) const {
    Packet m = heights(0, n);
    for (int i = width; i < padded; i += width) m = m.min(heights(i, n));
    return m.minCoeff();
  }
  void extent(const Vec3& n, double& lo, double& hi) const {
    Packet a = heights(0, n), b = a;
    for (int i = width; i < padded; i += width) {
      const Packet h = heights(i, n);
      a = a.min(h), b = b.max(h);
    }
    lo = a.minCoeff(), hi = b.maxCoeff();
  }
  /// Index of the lowest vertex along n; the first of equals.
  int lowest(const Vec3& n) const {
    const double m = min_height(n);
    for (int i = 0; i < padded; i += width) {
      const Packet h = heights(i, n);
      if (h.minCoeff() <= m)
        for (int k = 0; k < width; ++k)
          if (h[k] <= m) return std::min(i + k, count - 1);
    }
    return 0;
  }
  Box3 box() const {
    Box3 b;
    Packet lx = Packet::Map(&x[0]), ly = Packet::Map(&y[0]), lz = Packet::Map(&z[0]), hx = lx, hy = ly,
           hz = lz;
    for (int i = width; i < padded; i += width) {
      const Packet px = Packet::Map(&x[i]), py = Packet::Map(&y[i]), pz = Packet::Map(&z[i]);
      lx = lx.min(px), ly = ly.min(py), lz = lz.min(pz);
      hx = hx.max(px), hy = hy.max(py), hz = hz.max(pz);
    }
    b.min() = Vec3(lx.minCoeff(), ly.minCoeff(), lz.minCoeff());
    b.max() = Vec3(hx.maxCoeff(), hy.maxCoeff(), hz.maxCoeff());
    return b;
  }
};

/// The nearest point of the triangle a, b, c.
inline Vec3 closest_on(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x) {
  const Vec3 n = (b - a).cross(c - a);
  const double square = n.squaredNorm();
  const Vec3 l =
      Vec3(n.dot((b - x).cross(c - x)), n.dot((c - x).cross(a - x)), n.dot((a - x).cross(b - x))) / square;
  if (l.minCoeff() >= 0) return l[0] * a + l[1] * b + l[2] * c;
  Vec3 best = a;
  double least = infinity;
  const Vec3* p[3] = {&a, &b, &c};
  for (int k = 0; k < 3; ++k) {
    const Vec3 e = *p[(k + 1) % 3] - *p[k];
    const Vec3 y = *p[k] + std::clamp(e.dot(x - *p[k]) / e.squaredNorm(), 0.0, 1.0) * e;
    if (const double d = (x - y).squaredNorm(); d < least) least = d, best = y;
  }
  return best;
}

/// Closest points of segments p + s d, q + t e, s and t in [0, 1].
struct SegmentPair {
  double s, t;
  Vec3 a, b;
};
inline SegmentPair closest_segments(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1) {
  const Vec3 d = p1 - p0, e = q1 - q0, r = p0 - q0;
  const double dd = d.squaredNorm(), ee = e.squaredNorm(), er = e.dot(r), dr = d.dot(r), de = d.dot(e);
  double s = 0, t = 0;
  if (dd <= 0 && ee <= 0) return {0, 0, p0, q0};
  if (dd <= 0) {
    t = std::clamp(er / ee, 0.0, 1.0);
  } else if (ee <= 0) {
    s = std::clamp(-dr / dd, 0.0, 1.0);
  } else {
    const double den = dd * ee - de * de;
    s = den > 0 ? std::clamp((de * er - dr * ee) / den, 0.0, 1.0) : 0.0;
    t = (de * s + er) / ee;
    if (t < 0) {
      t = 0;
      s = std::clamp(-dr / dd, 0.0, 1.0);
    } else if (t > 1) {
      t = 1;
      s = std::clamp((de - dr) / dd, 0.0, 1.0);
    }
  }
  return {s, t, p0 + s * d, q0 + t * e};
}

/// A corner of a clipped polygon. The two sides that meet here: incident sides are 0..n-1, clip sides are n +
/// k.
struct ClipVertex {
  Vec3 x;
  int in, out;  // side that ends here, side that starts here; both incident sides: the incident vertex `out`
};

/// Clips a convex polygon by one half space m . (x - o) <= tolerance; the new side is called `side`.
inline void clip_half_space(const std::vector<ClipVertex>& in, const Vec3& o, const Vec3& m, double tolerance,
                            int side, std::vector<ClipVertex>& out) {
  out.clear();
  const std::size_t n = in.size();
  if (n == 0) return;
  const ClipVertex* a = &in[n - 1];
  double ha = m.dot(a->x - o);
  for (std::size_t i = 0; i < n; ++i) {
    const ClipVertex* b = &in[i];
    const double hb = m.dot(b->x - o);
    const bool a_in = ha <= tolerance, b_in = hb <= tolerance;
    if (a_in != b_in) {
      const double t = ha / (ha - hb);
      const Vec3 x = a->x + std::clamp(t, 0.0, 1.0) * (b->x - a->x);
      // a->out is the side from a to b
      out.push_back(b_in ? ClipVertex{x, side, a->out} : ClipVertex{x, a->out, side});
    }
    if (b_in) out.push_back(*b);
    a = b;
    ha = hb;
  }
}

/// Area vector of a planar polygon (twice the signed area along n is 2 n . result).
template <class Points, class At>
double polygon_area(const Points& points, const Vec3& n, At at) {
  Vec3 s = Vec3::Zero();
  const std::size_t count = points.size();
  for (std::size_t i = 1; i + 1 < count; ++i)
    s += (at(points[i]) - at(points[0])).cross(at(points[i + 1]) - at(points[0]));
  return 0.5 * n.dot(s);
}

}  // namespace talus::contact::narrow
