#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "contact/detection/detect.hpp"
#include "contact/geometry/surface_order.hpp"
#include "detect_shapes.hpp"

namespace talus::contact {
namespace {

/// n x n cells of one metre, rough; the material of a triangle is the row of its cell.
TriangleSurface rough_ground(int n) {
  TriangleSurface s;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) s.vertices.emplace_back(j, i, 0.3 * std::sin(12.9898 * i + 78.233 * j));
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int k = i * (n + 1) + j;
      s.triangles.push_back({k, k + 1, k + n + 2});
      s.triangles.push_back({k, k + n + 2, k + n + 1});
      s.material.insert(s.material.end(), {i, i});
    }
  return s;
}

double area(const TriangleSurface& s, int t) {
  const auto& v = s.triangles[static_cast<std::size_t>(t)];
  return 0.5 * (s.vertices[v[1]] - s.vertices[v[0]]).cross(s.vertices[v[2]] - s.vertices[v[0]]).norm();
}

TEST(SurfaceOrder, KeepsTheSurfaceAndItsContacts) {
  const int n = 40;
  const TriangleSurface plain = rough_ground(n);
  TriangleSurface sorted = plain;
  put_in_search_order(sorted);
  ASSERT_EQ(sorted.triangles.size(), plain.triangles.size());
  ASSERT_EQ(sorted.vertices.size(), plain.vertices.size());
  ASSERT_NE(sorted.triangles, plain.triangles);
  double sum = 0, sum_plain = 0;
  for (int t = 0; t < static_cast<int>(plain.triangles.size()); ++t) {
    const auto& v = sorted.triangles[static_cast<std::size_t>(t)];
    const Vec3 m = (sorted.vertices[v[0]] + sorted.vertices[v[1]] + sorted.vertices[v[2]]) / 3;
    ASSERT_EQ(sorted.material[static_cast<std::size_t>(t)], static_cast<int>(m.y()));
    sum += area(sorted, t), sum_plain += area(plain, t);
  }
  EXPECT_NEAR(sum, sum_plain, 1e-9 * sum_plain);

  const SurfaceIndex a(plain), b(sorted);
  EXPECT_EQ(a.bounds().min(), b.bounds().min());
  EXPECT_EQ(a.bounds().max(), b.bounds().max());
  const Polyhedron box = testing::box(1.5, 1.0, 0.8);
  long contacts = 0;
  for (int k = 0; k < 300; ++k) {
    const double x = 3 + std::fmod(7.13 * k, n - 6.0), y = 3 + std::fmod(11.71 * k, n - 6.0);
    EXPECT_EQ(a.height(x, y), b.height(x, y));
    Pose pose;
    pose.c = Vec3(x, y, a.height(x, y) + 0.5);
    pose.F = Eigen::AngleAxisd(0.1 * k, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    std::vector<ContactPoint> from_a, from_b;
    contacts += surface_block(a, box, pose, 0.05, from_a);
    surface_block(b, box, pose, 0.05, from_b);
    ASSERT_EQ(from_a.size(), from_b.size()) << k;
    const auto by_place = [](const ContactPoint& p, const ContactPoint& q) {
      return std::tie(p.point_b[0], p.point_b[1], p.gap) < std::tie(q.point_b[0], q.point_b[1], q.gap);
    };
    std::sort(from_a.begin(), from_a.end(), by_place);
    std::sort(from_b.begin(), from_b.end(), by_place);
    for (std::size_t i = 0; i < from_a.size(); ++i) {
      EXPECT_NEAR((from_a[i].point_b - from_b[i].point_b).norm(), 0, 1e-12);
      EXPECT_NEAR(from_a[i].gap, from_b[i].gap, 1e-12);
    }
  }
  EXPECT_GT(contacts, 300);
}

/// Boxes of the tree are rounded to single precision: none of the triangles that a box meets may be lost by
/// it, far from the origin above all.
TEST(SurfaceOrder, FarFromTheOriginNothingIsLost) {
  TriangleSurface s = rough_ground(20);
  const Vec3 far(4.1e6 + 0.3, -2.7e6 - 0.7, 1234.5);
  for (Vec3& v : s.vertices) v += far;
  const SurfaceIndex index(s);
  for (int k = 0; k < 400; ++k) {
    const Vec3 x = far + Vec3(std::fmod(0.713 * k, 19.0) + 0.5, std::fmod(1.171 * k, 19.0) + 0.5, 0);
    const double z = index.height(x.x(), x.y());
    ASSERT_TRUE(std::isfinite(z)) << k;
    EXPECT_TRUE(index.overlaps(Box3(Vec3(x.x(), x.y(), z - 1e-6), Vec3(x.x(), x.y(), z + 1e-6))));
  }
}

}  // namespace
}  // namespace talus::contact
