/// Shapes for the contact tests.
#pragma once
#include <random>

#include "contact/detection/detect.hpp"
#include "helpers/shapes.hpp"

namespace talus::contact::testing {

using Triangles = std::vector<std::array<int, 3>>;

inline Polyhedron box(double x, double y, double z) { return talus::test::cuboid(Vec3(x, y, z)); }

inline const Polyhedron cube = box(1, 1, 1);

/// Area of contact in all [m^2].
inline double total_area(const std::vector<ContactPoint>& c) {
  double a = 0;
  for (const auto& p : c) a += p.area;
  return a;
}

/// Prism over a polygon given counter-clockwise with its triangulation, between z0 and z1.
inline Polyhedron prism(const std::vector<std::pair<double, double>>& outline, const Triangles& cap,
                        double z0, double z1) {
  const int n = static_cast<int>(outline.size());
  std::vector<Vec3> v;
  for (const double z : {z0, z1})
    for (const auto& [x, y] : outline) v.emplace_back(x, y, z);
  Triangles t;
  for (const auto& c : cap) {
    t.push_back({c[0], c[2], c[1]});
    t.push_back({c[0] + n, c[1] + n, c[2] + n});
  }
  for (int i = 0; i < n; ++i) {
    const int j = (i + 1) % n;
    t.push_back({i, j, j + n});
    t.push_back({i, j + n, i + n});
  }
  return make_polyhedron(v, t);
}

/// Convex hull of points by brute force: every triple whose plane has all others behind. For small
/// general-position sets.
inline Polyhedron hull(const std::vector<Vec3>& points) {
  Vec3 c = Vec3::Zero();
  for (const auto& p : points) c += p;
  c /= static_cast<double>(points.size());
  std::vector<Vec3> v;
  for (const auto& p : points) v.push_back(p - c);
  Triangles t;
  const int n = static_cast<int>(v.size());
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        if (i >= j || i >= k || j == k) continue;  // i smallest: each oriented triangle once
        const Vec3 m = (v[j] - v[i]).cross(v[k] - v[i]);
        bool all = true;
        for (int l = 0; l < n && all; ++l) all = l == i || l == j || l == k || m.dot(v[l] - v[i]) < 0;
        if (all) t.push_back({i, j, k});
      }
  return make_polyhedron(v, t);
}

inline std::vector<Vec3> sphere_points(int n, double radius, std::mt19937& rng) {
  std::normal_distribution<double> g;
  std::vector<Vec3> p;
  for (int i = 0; i < n; ++i) p.push_back(radius * Vec3(g(rng), g(rng), g(rng)).normalized());
  return p;
}

inline Mat3 random_rotation(std::mt19937& rng) {
  std::normal_distribution<double> g;
  return Quat(g(rng), g(rng), g(rng), g(rng)).normalized().toRotationMatrix();
}

inline Mat3 turn(const Vec3& axis, double angle) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

/// Flat n x n grid of squares of side `cell` centred on the origin, each split along an alternating diagonal,
/// tilted by R.
inline TriangleSurface grid(int n, double cell, const Mat3& R = Mat3::Identity()) {
  TriangleSurface s;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i)
      s.vertices.push_back(R * Vec3((i - n / 2.0) * cell, (j - n / 2.0) * cell, 0));
  const auto id = [&](int i, int j) { return j * (n + 1) + i; };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = id(i, j), b = id(i + 1, j), c = id(i + 1, j + 1), d = id(i, j + 1);
      if ((i + j) % 2) {
        s.triangles.push_back({a, b, c});
        s.triangles.push_back({a, c, d});
      } else {
        s.triangles.push_back({a, b, d});
        s.triangles.push_back({b, c, d});
      }
    }
  return s;
}

}  // namespace talus::contact::testing
