// Contact points of blocks with a surface: flat ground, rims, ridges, cliffs.
#include <gtest/gtest.h>

#include "local_contacts.hpp"

namespace talus::contact::testing {
namespace {

/// Lowest height of a posed block along n.
double lowest(const Polyhedron& p, const Mat3& R, const Vec3& n) {
  double low = 1e300;
  for (const auto& x : p.vertices) low = std::min(low, n.dot(R * x));
  return low;
}

void slide(const Polyhedron& block, bool flat_faces, double perturbation, int slides,
           double normal_tolerance) {
  std::mt19937 rng(4);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int plane = 0; plane < 20; ++plane) {
    const Mat3 R = turn(Vec3(u(rng), u(rng), 0.01), 0.6 * u(rng)) * turn(Vec3::UnitZ(), 3 * u(rng));
    auto g = grid(12, 0.71, R);
    for (auto& v : g.vertices) {
      v += 10 * Vec3(1, 2, 3);
      if (perturbation > 0) v.z() += perturbation * u(rng);
    }
    const SurfaceIndex index(g);
    const Vec3 n = R.col(2);
    for (int i = 0; i < slides / 20; ++i) {
      const Mat3 Q = flat_faces ? Mat3(R * turn(Vec3::UnitZ(), 3.2 * u(rng))) : random_rotation(rng);
      const double gap = (i % 3 - 1) * 1e-10;
      const Vec3 c =
          10 * Vec3(1, 2, 3) + R * Vec3(2 * u(rng), 2 * u(rng), 0) + (gap - lowest(block, Q, n)) * n;
      const auto contacts = on(index, block, {c, Q}, 1e-4);
      ASSERT_FALSE(contacts.empty());
      for (const auto& p : contacts) {
        EXPECT_NEAR((p.normal - n).norm(), 0, normal_tolerance);
        EXPECT_NEAR(p.gap, gap, flat_faces ? 2e-9 + 4 * perturbation : 1e-4 + 4 * perturbation);
      }
      if (flat_faces) { EXPECT_NEAR(total_area(contacts), 1.0, 1e-7); }
    }
  }
}

TEST(SurfaceContact, CubeSlidingOverFlatTrianglesMeetsNoInternalEdge) { slide(cube, true, 0, 10000, 1e-12); }

TEST(SurfaceContact, HullOverFlatTrianglesMeetsNoInternalEdge) {
  std::mt19937 rng(9);
  slide(hull(sphere_points(32, 0.8, rng)), false, 0, 10000, 1e-12);
}

TEST(SurfaceContact, WideCubeOnBeamCrossesItsEdgesHoweverDeepSpringsLetIt) {
  const Polyhedron beam = box(8, 1, 1), wide = box(1.5, 1.5, 1.5);
  TriangleSurface skin;
  skin.vertices = beam.vertices;
  skin.triangles = beam.triangles;
  const SurfaceIndex index(skin);
  for (const double overlap : {1e-9, 1e-5, 4e-3, 5e-2}) {
    const auto contacts = on(index, wide, {Vec3(0.1, 0, 1.25 - overlap), Mat3::Identity()}, 1e-4);
    ASSERT_EQ(contacts.size(), 4u) << "overlap " << overlap;
    for (const auto& c : contacts) {
      EXPECT_NEAR(c.gap, -overlap, 1e-12);
      EXPECT_NEAR(c.area, 1.5 / 4, 1e-9);
    }
  }
}

TEST(SurfaceContact, RoundedTerrainPlaneGivesItsOwnNormals) {
  slide(cube, true, 1e-12, 2000, 1e-10);
  slide(cube, true, 1e-7, 2000, 2e-6);
}

TEST(SurfaceContact, CubeOnFlatGroundHasFourEqualPoints) {
  const SurfaceIndex g(grid(10, 1.0));
  for (const double dx : {-1e-12, 0.0, 1e-12})
    for (const double dz : {-1e-12, 0.0, 1e-12}) {
      const auto c = on(g, cube, {Vec3(0.5 + dx, 0.5, 0.5 + dz)}, 1e-3);  // corners exactly on grid vertices
      ASSERT_EQ(c.size(), 4u);
      for (const auto& p : c) EXPECT_NEAR(p.area, 0.25, 1e-9);
    }
}

TEST(SurfaceContact, OverhangingTheRimHasTheSupportedAreaOnly) {
  const SurfaceIndex g(grid(10, 1.0));
  const auto c = on(g, cube, {Vec3(5.2, 0.3, 0.5)}, 1e-3);
  ASSERT_EQ(c.size(), 4u);
  EXPECT_NEAR(total_area(c), 0.3, 1e-12);
  Vec3 m = Vec3::Zero();
  for (const auto& p : c) m += p.area * p.point_b;
  EXPECT_NEAR((m / 0.3 - Vec3(4.85, 0.3, 0)).norm(), 0, 1e-9);
}

TriangleSurface roof(double slope) {  // ridge along y through the origin
  TriangleSurface s;
  for (const double y : {-5., 5.})
    for (const double x : {-5., 0., 5.}) s.vertices.emplace_back(x, y, -slope * std::abs(x));
  s.triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
  return s;
}

TEST(SurfaceContact, PlateOnARidgeTouchesWhereItsEdgesCross) {
  const SurfaceIndex s(roof(0.5));
  for (const double lift : {-1e-6, -1e-12, 0.0, 1e-12, 1e-4}) {
    const auto c = on(s, box(2, 1, 0.2), {Vec3(0.1, 0.3, 0.1 + lift), turn(Vec3::UnitZ(), 0.2)}, 1e-3);
    ASSERT_EQ(c.size(), 2u) << lift;
    for (const auto& p : c) {
      EXPECT_NEAR((p.normal - Vec3::UnitZ()).norm(), 0, 1e-9);
      EXPECT_NEAR(p.gap, lift, 1e-12);
      EXPECT_NEAR(p.point_a.x(), 0, 1e-9);
    }
  }
}

TEST(SurfaceContact, TerrainPeakAgainstABlockFace) {
  TriangleSurface s;
  s.vertices = {{0, 0, 0}, {2, 0, -1}, {0, 2, -1}, {-2, 0, -1}, {0, -2, -1}};
  s.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}};
  const SurfaceIndex index(s);
  for (const double lift : {-1e-5, 0.0, 1e-4}) {
    const auto c = on(index, cube, {Vec3(0.1, 0.05, 0.5 + lift), turn(Vec3::UnitZ(), 0.3)}, 1e-3);
    ASSERT_EQ(c.size(), 1u) << lift;
    EXPECT_NEAR(c[0].normal.z(), 1, 1e-12);
    EXPECT_NEAR(c[0].gap, lift, 1e-12);
    EXPECT_NEAR(c[0].point_a.head<2>().norm(), 0, 1e-12);
  }
}

TEST(SurfaceContact, FlushWithACliffTouchesTheTopOnly) {
  // Plateau x < 0 at z = 0, cliff face at x = 0 down to z = -3: a cube on the plateau, its side flush with
  // the cliff.
  TriangleSurface s;
  s.vertices = {{-4, -4, 0}, {0, -4, 0}, {0, 4, 0}, {-4, 4, 0}, {0, -4, -3}, {0, 4, -3}};
  s.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}};
  const SurfaceIndex index(s);
  for (const double d : {-1e-12, 0.0, 1e-12}) {
    const auto c = on(index, cube, {Vec3(-0.5 + d, 0.3, 0.5)}, 1e-3);
    ASSERT_EQ(c.size(), 4u);
    for (const auto& p : c) EXPECT_NEAR(p.normal.z(), 1, 1e-12);
    EXPECT_NEAR(total_area(c), 1, 1e-9);
  }
}

TEST(SurfaceContact, DeepOverlapPushesOutOfTheSurface) {
  const SurfaceIndex g(grid(10, 1.0));
  for (const double depth : {1e-6, 1e-3, 0.05, 0.3}) {
    const auto c = on(g, cube, {Vec3(0.2, 0.3, 0.5 - depth), turn(Vec3::UnitZ(), 0.4)}, 1e-3);
    ASSERT_GE(c.size(), 4u);
    for (const auto& p : c) {
      EXPECT_NEAR(p.normal.z(), 1, 1e-12);
      EXPECT_NEAR(p.gap, -depth, 1e-12);
    }
  }
}

TEST(SurfaceContact, TwoSidedSheetPushesToTheSideOfTheBlock) {
  auto g = grid(6, 1.0);
  g.two_sided = true;
  const SurfaceIndex index(g);
  const auto above = on(index, cube, {Vec3(0.2, 0.3, 0.5)}, 1e-3),
             below = on(index, cube, {Vec3(0.2, 0.3, -0.5)}, 1e-3);
  ASSERT_EQ(above.size(), 4u);
  ASSERT_EQ(below.size(), 4u);
  for (const auto& p : above) EXPECT_NEAR(p.normal.z(), 1, 1e-12);
  for (const auto& p : below) EXPECT_NEAR(p.normal.z(), -1, 1e-12);
  EXPECT_NEAR(total_area(below), 1, 1e-9);
}

TEST(SurfaceContact, VertexPastTheRimSeesTheTrueDistance) {
  const SurfaceIndex s(roof(1.0));
  // A cube with an edge along y, displaced off the ridge diagonally.
  const auto c = on(s, cube, {Vec3(0, 0, std::sqrt(0.5) + 0.01), turn(Vec3::UnitY(), M_PI / 4)}, 0.05);
  ASSERT_FALSE(c.empty());
  for (const auto& p : c) EXPECT_NEAR(p.gap, 0.01, 1e-9);
}

TEST(SurfaceContact, MovedSkinIsFollowedByRefit) {
  auto g = grid(8, 1.0);
  SurfaceIndex index(g);
  for (auto& v : g.vertices) v.z() += 0.25;
  index.refit(g);
  const auto c = on(index, cube, {Vec3(0.2, 0.3, 0.75)}, 1e-3);
  ASSERT_GE(c.size(), 4u);
  EXPECT_NEAR(total_area(c), 1, 1e-9);
  EXPECT_NEAR(index.height(0.3, -0.4), 0.25, 1e-15);
  EXPECT_TRUE(std::isnan(index.height(9, 0)));
  EXPECT_FALSE(index.overlaps(Box3(Vec3(-1, -1, -1), Vec3(1, 1, 0.2))));
  EXPECT_TRUE(index.overlaps(Box3(Vec3(-1, -1, -1), Vec3(1, 1, 0.3))));
}

}  // namespace
}  // namespace talus::contact::testing
