// Blocks in valleys, notches and corners of the ground, and beside peaks.
#include <gtest/gtest.h>

#include "local_contacts.hpp"

namespace talus::contact::testing {
namespace {

/// A corner of a block at the foot of a slope, on the line where it meets gentler ground, in either or both
/// by little: it has to leave what it is behind, each along its own normal and by its own depth, and nothing
/// else.
TEST(SurfaceContact, ACornerInAValleyIsHeldByBothSides) {
  for (const double turn_by : {0.02, 0.176, 1.0, 2.0}) {  // the valley's sides
    const double steep = 0.5 * turn_by + 0.3, gentle = steep - turn_by;
    TriangleSurface s;  // descends along y to its foot at y = 0, and goes on
    for (const double x : {-4.0, 4.0})
      for (const Vec3& at : {Vec3(x, -4 * std::cos(steep), 4 * std::sin(steep)), Vec3(x, 0, 0),
                             Vec3(x, 4 * std::cos(gentle), -4 * std::sin(gentle))})
        s.vertices.push_back(at);
    s.triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
    for (auto& t : s.triangles) std::swap(t[1], t[2]);
    const SurfaceIndex index(s);
    const Vec3 n[2] = {Vec3(0, std::sin(steep), std::cos(steep)),
                       Vec3(0, std::sin(gentle), std::cos(gentle))};
    ASSERT_GT(index.impl().normal[0].dot(n[0]), 0.999);
    const Vec3 middle = (n[0] + n[1]).normalized();
    const Polyhedron tip = hull({{0, 0, 0}, {0.3, 0.1, 1}, {-0.3, 0.1, 1}, {0, -0.2, 1}});
    const Mat3 R = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), middle).toRotationMatrix();
    for (const double depth : {0.0, 1e-7, 1e-5, 1e-3})
      for (const double beside : {-2.0, -0.5, -1e-3, 0.0, 1e-3, 0.5, 2.0}) {
        const double aside = beside * std::max(depth, 1e-6);
        const Vec3 x = Vec3(0, aside, 0) - depth * middle;
        const auto lowest = std::ranges::min_element(tip.vertices, {}, [](const Vec3& v) { return v.z(); });
        const Vec3 c = x - R * *lowest;
        double gap[2] = {1, 1};
        for (const auto& p : on(index, tip, {c, R}, 1e-2)) {
          if ((p.point_b - x).norm() > 1e-9) continue;  // of its edges
          const int side = p.normal.dot(n[0]) > p.normal.dot(n[1]) ? 0 : 1;
          EXPECT_NEAR((p.normal - n[side]).norm(), 0, 1e-9) << turn_by << " " << depth << " " << aside;
          gap[side] = std::min(gap[side], p.gap);
        }
        for (int side : {0, 1})
          if (n[side].dot(x) < -1e-8)
            EXPECT_NEAR(gap[side], n[side].dot(x), 1e-12)
                << turn_by << " " << depth << " " << aside << " side " << side;
      }
  }
}

/// A boulder of many faces among peaks: of its faces only those near the ground are looked at, and a peak
/// that stands beside it, or an edge before it, must not be taken for one inside.
TEST(SurfaceContact, PeaksBesideABoulderOfManyFacesAreNotInIt) {
  std::mt19937 rng(12);
  std::uniform_real_distribution<double> u(-1, 1);
  const Polyhedron round = hull(sphere_points(120, 0.8, rng));
  std::vector<Vec3> corners = round.vertices;
  for (Vec3& x : corners) x *= 1 + 0.25 * u(rng);
  const Polyhedron boulder = make_polyhedron(corners, round.triangles);
  constexpr double margin = 1e-3;
  int touching = 0;
  for (int trial = 0; trial < 100; ++trial) {
    TriangleSurface s = grid(16, 0.3);
    for (Vec3& x : s.vertices) x.z() += 0.4 * u(rng);
    const SurfaceIndex index(s);
    const Mat3 Q = random_rotation(rng);
    Vec3 c(0.3 * u(rng), 0.3 * u(rng), 1.5);
    // Down until the first corner or peak is on the other.
    while (on(index, boulder, {c, Q}, 0.1).empty()) c.z() -= 0.09;
    while (on(index, boulder, {c, Q}, margin).empty()) c.z() -= 0.5 * margin;
    for (const ContactPoint& p : on(index, boulder, {c, Q}, margin)) {
      EXPECT_GT(p.gap, -margin) << "trial " << trial << ", form " << (p.key >> 60);
      touching += p.gap < margin;
    }
  }
  EXPECT_GE(touching, 100);
}

TEST(SurfaceContact, ValleyHoldsACubeOnBothSides) {
  // V-valley at 45 degrees: a cube turned by 45 degrees lies on two faces.
  TriangleSurface s = roof(-1);
  const SurfaceIndex index(s);
  const auto c = on(index, cube, {Vec3(0, 0, std::sqrt(0.5)), turn(Vec3::UnitY(), M_PI / 4)}, 1e-3);
  double left = 0, right = 0;
  for (const auto& p : c) {
    EXPECT_NEAR(std::abs(p.normal.x()), std::sqrt(0.5), 1e-12);
    EXPECT_NEAR(p.normal.z(), std::sqrt(0.5), 1e-12);
    (p.normal.x() > 0 ? left : right) += p.area;
  }
  EXPECT_NEAR(left, 1, 1e-9);
  EXPECT_NEAR(right, 1, 1e-9);
}

TEST(SurfaceContact, CornerBehindANotchIsInsideThoughItProjectsOnNeitherFace) {
  // A slope of 45 degrees meets level ground at x = 0; the block's edge lies 0.1 m below the notch, on its
  // bisector.
  TriangleSurface g;
  g.vertices = {{-5, -5, 5}, {-5, 5, 5}, {0, -5, 0}, {0, 5, 0}, {5, -5, 0}, {5, 5, 0}};
  g.triangles = {{0, 2, 3}, {0, 3, 1}, {2, 4, 5}, {2, 5, 3}};
  const SurfaceIndex index(g);
  const double bisector = M_PI / 8;  // of the normals, from the vertical
  Pose p;
  p.F = turn(Vec3::UnitY(), M_PI / 4);  // an edge down
  p.c = Vec3(-0.1 * std::sin(bisector), 0, -0.1 * std::cos(bisector) + std::sqrt(0.5));
  const auto c = on(index, cube, p, 1e-6);
  int inside[2] = {0, 0};
  for (const auto& x : c)
    if (std::abs(x.gap + 0.1 * std::cos(bisector)) < 1e-9) ++inside[x.normal.x() > 0.5 ? 1 : 0];
  EXPECT_EQ(inside[0], 2);  // both ends of the edge behind the level ground,
  EXPECT_EQ(inside[1], 4);  // and the face that it bounds behind the slope
}

TEST(SurfaceContact, CubeInACornerOfThreeWalls) {
  TriangleSurface s;
  s.vertices = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 4}, {4, 0, 4}, {0, 4, 4}};
  s.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 4, 5}, {0, 5, 1}, {0, 3, 6}, {0, 6, 4}};
  const SurfaceIndex index(s);
  for (const double d : {-1e-12, 0.0, 1e-12}) {
    const auto c = on(index, cube, {Vec3(0.5 + d, 0.5, 0.5 - d)}, 1e-3);
    EXPECT_EQ(c.size(), 12u);
    EXPECT_NEAR(total_area(c), 3, 1e-9);
  }
}

}  // namespace
}  // namespace talus::contact::testing
