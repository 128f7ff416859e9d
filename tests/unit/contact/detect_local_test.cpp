#include <gtest/gtest.h>

#include <set>

#include "detect_shapes.hpp"

namespace talus::contact::testing {
namespace {

void check(const std::vector<ContactPoint>& contacts, double margin) {
  std::set<FeatureKey> keys;
  for (const auto& c : contacts) {
    EXPECT_NEAR(c.normal.norm(), 1, 1e-12);
    EXPECT_NEAR(c.gap, c.normal.dot(c.point_b - c.point_a), 1e-9);
    EXPECT_LE(c.gap, margin + 1e-12);
    EXPECT_GE(c.area, 0);
    EXPECT_TRUE(keys.insert(c.key).second) << "a key appears twice";
  }
}

std::vector<ContactPoint> on(const SurfaceIndex& s, const Polyhedron& b, const Pose& p, double margin) {
  std::vector<ContactPoint> out;
  surface_block(s, b, p, margin, out);
  check(out, margin);
  return out;
}

std::vector<ContactPoint> between(const Polyhedron& a, const Pose& pa, const Polyhedron& b, const Pose& pb,
                                  double margin) {
  std::vector<ContactPoint> out;
  block_block(a, pa, b, pb, margin, out);
  check(out, margin);
  return out;
}

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

/// A cube whose side edges lie on lines of the ground's mesh, a part of the way over an edge of that ground:
/// its edges cross the ridge in the ridge's own vertices.
TEST(SurfaceContact, CubeOnLinesOfTheMeshIsHeldAtALip) {
  TriangleSurface s;  // squares of 0.5 m on x < 0, z = 0; a cliff at x = 0
  for (const double z : {0.0, -2.0})
    for (int j = -4; j <= 4; ++j) s.vertices.emplace_back(0, 0.5 * j, z);
  for (int j = -4; j <= 4; ++j) s.vertices.emplace_back(-3, 0.5 * j, 0);
  for (int j = 0; j < 8; ++j) {
    s.triangles.insert(s.triangles.end(), {{j, j + 1, j + 19}, {j, j + 19, j + 18}});
    s.triangles.insert(s.triangles.end(), {{j, j + 9, j + 10}, {j, j + 10, j + 1}});
  }
  const SurfaceIndex index(s);
  for (const double aside : {0.0, 0.1, 0.25})
    for (const double over : {-0.2, 0.1, 0.4})
      for (const double lift : {0.0, 5e-5}) {
        const auto contacts = on(index, cube, {Vec3(over - 0.5, aside, 0.5 + lift), Mat3::Identity()}, 1e-4);
        double front = -9, left = 9, right = -9;
        for (const auto& c : contacts) {
          EXPECT_NEAR(c.normal.z(), 1, 1e-12);
          EXPECT_NEAR(c.gap, lift, 1e-12);
          front = std::max(front, c.point_a.x());
          left = std::min(left, c.point_a.y()), right = std::max(right, c.point_a.y());
        }
        EXPECT_NEAR(front, std::min(over, 0.0), 1e-9) << aside << " " << over;
        EXPECT_NEAR(left, aside - 0.5, 1e-9) << aside << " " << over;
        EXPECT_NEAR(right, aside + 0.5, 1e-9) << aside << " " << over;
        EXPECT_EQ(contacts.size(), 4u) << aside << " " << over << " " << lift;
      }
}

/// A channel 1 m wide along x whose floor ends at x = 0; its walls go on for `walls`.
TriangleSurface channel_with_an_end(double walls) {
  TriangleSurface s;
  for (const double x : {-3.0, 0.0})
    for (const Vec3& at : {Vec3(x, -3, 2), Vec3(x, -0.5, 2), Vec3(x, -0.5, 0), Vec3(x, 0.5, 0),
                           Vec3(x, 0.5, 2), Vec3(x, 3, 2)})
      s.vertices.push_back(at);
  for (int k = 0; k < 5; ++k) {
    s.triangles.push_back({k, k + 6, k + 7});
    s.triangles.push_back({k, k + 7, k + 1});
  }
  if (walls == 0) {  // the end, downwards
    s.vertices.insert(s.vertices.end(), {{0, -3, -2}, {0, 3, -2}});
    s.triangles.insert(s.triangles.end(),
                       {{6, 12, 7}, {7, 12, 8}, {8, 12, 9}, {9, 12, 13}, {9, 13, 10}, {10, 13, 11}});
  } else {  // 12, 13: below the floor's end; 14 to 17: the walls' further end
    s.vertices.insert(s.vertices.end(), {{0, -0.5, -2},
                                         {0, 0.5, -2},
                                         {walls, -0.5, 2},
                                         {walls, -0.5, -2},
                                         {walls, 0.5, 2},
                                         {walls, 0.5, -2}});
    s.triangles.insert(s.triangles.end(), {{8, 12, 9},
                                           {9, 12, 13},
                                           {7, 14, 8},
                                           {8, 15, 12},
                                           {8, 14, 15},
                                           {10, 9, 16},
                                           {9, 13, 17},
                                           {9, 17, 16}});
  }
  return s;
}

/// A channel that a cube fills from wall to wall, and whose floor ends, the walls with it or not: the cube
/// that has come a part of the way over its end is held by the floor's end and by both walls.
TEST(SurfaceContact, CubeThatFillsAChannelIsHeldAtItsEnd) {
  for (const double walls : {0.0, 1.0}) {  // how far they go on
    const SurfaceIndex index(channel_with_an_end(walls));
    for (const double over : {-0.2, 0.0, 0.1, 0.4}) {
      double front = -9, back = 9;
      int left = 0, right = 0;
      for (const auto& c : on(index, cube, {Vec3(over - 0.5, 0, 0.5), Mat3::Identity()}, 1e-4)) {
        EXPECT_NEAR(c.gap, 0, 1e-12);
        EXPECT_NEAR(c.normal.cwiseAbs().maxCoeff(), 1, 1e-12);
        EXPECT_NEAR(c.normal.x(), 0, 1e-12);
        if (c.normal.z() > 0.9) front = std::max(front, c.point_a.x()), back = std::min(back, c.point_a.x());
        left += c.normal.y() > 0.9, right += c.normal.y() < -0.9;
      }
      EXPECT_NEAR(front, std::min(over, 0.0), 1e-9) << walls << " " << over;
      EXPECT_NEAR(back, over - 1, 1e-9) << walls << " " << over;
      EXPECT_GE(left, 2) << walls << " " << over;
      EXPECT_GE(right, 2) << walls << " " << over;
    }
  }
}

/// The same cube as it tips over the end: the lip holds its floor from wall to wall, however the steps leave
/// it in the ground or above it.
TEST(SurfaceContact, CubeThatTipsOutOfAChannelItFillsLiesOnTheLip) {
  for (const double walls : {0.0, 1.0}) {
    const SurfaceIndex index(channel_with_an_end(walls));
    for (const double angle : {1e-3, 0.05, 0.5})
      for (const double lift : {-1e-5, -1e-8, 0.0, 1e-8, 1e-5}) {
        const Mat3 R = turn(Vec3::UnitY(), angle);
        const Vec3 n = R.col(2), c = R * Vec3(0.1, 0, 0.5) + lift * n;
        double left = 9, right = -9;
        for (const auto& p : on(index, cube, {c, R}, 1e-4)) {
          if (std::abs(p.normal.y()) > 0.5) {  // a wall
            EXPECT_NEAR(p.gap, 0, 1e-12);
            EXPECT_NEAR(std::abs(p.normal.y()), 1, 1e-12);
            continue;
          }
          EXPECT_NEAR((p.normal - n).norm(), 0, 1e-9);
          EXPECT_NEAR(p.gap, lift, 1e-12);
          EXPECT_NEAR(p.point_a.x(), 0, 1e-9);
          left = std::min(left, p.point_a.y()), right = std::max(right, p.point_a.y());
        }
        EXPECT_NEAR(left, -0.5, 1e-9) << walls << " " << angle << " " << lift;
        EXPECT_NEAR(right, 0.5, 1e-9) << walls << " " << angle << " " << lift;
      }
  }
}

/// A cube that has sunk into the floor of a pit as wide as itself: its lower corners are as near to the
/// walls' feet as to the floor, and bear the floor's name, not that of the walls on which they slide.
TEST(SurfaceContact, CubeBeneathTheFloorOfAPitItFillsIsInTheFloor) {
  TriangleSurface s;
  for (const double z : {2.0, 0.0})
    for (const Vec3& at : {Vec3(-0.5, -0.5, z), Vec3(0.5, -0.5, z), Vec3(0.5, 0.5, z), Vec3(-0.5, 0.5, z)})
      s.vertices.push_back(at);
  for (const Vec3& at : {Vec3(-3, -3, 2), Vec3(3, -3, 2), Vec3(3, 3, 2), Vec3(-3, 3, 2)})
    s.vertices.push_back(at);
  for (int k = 0; k < 4; ++k) {
    const int l = (k + 1) % 4;
    s.triangles.insert(s.triangles.end(),
                       {{8 + k, 8 + l, l}, {8 + k, l, k}, {k, l, 4 + l}, {k, 4 + l, 4 + k}});
  }
  s.triangles.insert(s.triangles.end(), {{4, 5, 6}, {4, 6, 7}});
  const SurfaceIndex index(s);
  for (const double aside : {-1e-12, 0.0, 1e-12})
    for (const double depth : {1e-6, 1e-3, 0.06, 0.2}) {
      int floor = 0;
      for (const auto& c : on(index, cube, {Vec3(aside, -aside, 0.5 - depth), Mat3::Identity()}, 1e-4)) {
        if (std::abs(c.normal.z()) < 0.5) continue;
        ++floor;
        EXPECT_NEAR(c.gap, -depth, 1e-9);
        EXPECT_GE(c.face_a, 16) << "a wall, at depth " << depth;
      }
      EXPECT_EQ(floor, 4) << depth;
    }
}

/// A wedge in a hollow of its own shape between two walls, its edges on those of the ground: held by bed and
/// walls alone, not by the level ground and the cliff that go on beside.
TEST(SurfaceContact, AWedgeInItsHollowIsNotHeldByTheGroundBeside) {
  const double bed = 35 * M_PI / 180;
  TriangleSurface s;  // a plateau z = 0 to y = 10, a cliff below; the bed from (y, z) = (2, 0) to the cliff
  const double drop = 8 * std::tan(bed);
  s.vertices = {
      {-5, 0, 0},    {5, 0, 0},    {-5, 10, 0}, {-1, 10, 0},      {1, 10, 0},
      {5, 10, 0},    {-1, 2, 0},   {1, 2, 0},   {-1, 10, -drop},  {1, 10, -drop},
      {-5, 10, -20}, {5, 10, -20}, {0.3, 2, 0}, {-0.2, 10, -drop}};  // the last two within ridge and lip
  s.triangles = {
      {0, 1, 6},  {1, 7, 12},  {1, 12, 6},  {0, 6, 2},   {6, 3, 2},   {1, 5, 7},  {7, 5, 4},    // plateau
      {6, 12, 8}, {12, 13, 8}, {12, 7, 13}, {7, 9, 13},                                         // bed
      {6, 8, 3},  {7, 4, 9},                                                                    // walls
      {2, 3, 10}, {3, 8, 10},  {8, 13, 10}, {13, 9, 10}, {9, 11, 10}, {9, 4, 11}, {4, 5, 11}};  // cliff
  const SurfaceIndex index(s);
  const Polyhedron wedge = make_polyhedron(
      {{-1, 10, 0}, {1, 10, 0}, {-1, 2, 0}, {1, 2, 0}, {-1, 10, -drop}, {1, 10, -drop}},
      {{2, 3, 1}, {2, 1, 0}, {2, 4, 5}, {2, 5, 3}, {0, 1, 5}, {0, 5, 4}, {0, 4, 2}, {1, 3, 5}});
  const Vec3 n(0, std::sin(bed), std::cos(bed)), down(0, std::cos(bed), -std::sin(bed));
  for (const double way : {0.0, 1e-3, 0.1, 1.0}) {
    int held = 0;
    for (const auto& c : on(index, wedge, {way * down, Mat3::Identity()}, 1e-5)) {
      EXPECT_NEAR(c.gap, 0, 1e-9) << way;
      EXPECT_NEAR(c.normal.dot(down), 0, 1e-9) << way << " at " << c.point_a.transpose();
      held += c.normal.dot(n) > 0.9;
    }
    EXPECT_GE(held, 4) << way;
  }
}

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

const Polyhedron ell = prism({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}},
                             {{0, 1, 2}, {0, 2, 3}, {0, 3, 5}, {3, 4, 5}}, 0, 1);

TEST(ConcaveContact, CubeInTheNotchOfAnL) {
  for (const double d : {-1e-12, 0.0, 1e-12}) {
    const auto c = between(ell, {Vec3::Zero()}, cube, {Vec3(1.5 + d, 1.5 - d, 0.5)}, 1e-3);
    EXPECT_EQ(c.size(), 8u);
    double x = 0, y = 0;
    for (const auto& p : c) (p.normal.x() > 0.5 ? x : y) += p.area;
    EXPECT_NEAR(x, 1, 1e-9);
    EXPECT_NEAR(y, 1, 1e-9);
  }
}

TEST(ConcaveContact, SameAsConvexWhereTheShapeIsConvex) {
  const auto c = between(ell, {Vec3::Zero()}, cube, {Vec3(0.4, 2.5, 0.6)}, 1e-3);
  ASSERT_EQ(c.size(), 4u);
  for (const auto& p : c) EXPECT_NEAR(p.normal.y(), 1, 1e-12);
  EXPECT_NEAR(total_area(c), 0.9 * 0.9, 1e-9);
}

TEST(ConcaveContact, MirrorsWhenTheRolesAreExchanged) {
  std::mt19937 rng(6);
  std::uniform_real_distribution<double> u(-1, 1);
  int met = 0;
  for (int i = 0; i < 400; ++i) {
    const Pose pa{Vec3::Zero(), random_rotation(rng)},
        pb{Vec3(u(rng), u(rng), u(rng)).normalized() * 2.2, random_rotation(rng)};
    const auto c = between(ell, pa, cube, pb, 0.1), r = between(cube, pb, ell, pa, 0.1);
    double g = 1, h = 1;
    for (const auto& p : c) g = std::min(g, p.gap);
    for (const auto& p : r) h = std::min(h, p.gap);
    EXPECT_NEAR(g, h, 1e-9);
    met += !c.empty();
  }
  EXPECT_GT(met, 20);
}

/// Away from overlap the least gap of the local features is the distance of the bodies: two convex parts of
/// the L.
TEST(ConcaveContact, LeastGapIsTheDistanceOfTheConvexParts) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> u(-1, 1), d(0.9, 2.4);
  const auto foot = prism({{0, 0}, {2, 0}, {2, 1}, {0, 1}}, {{0, 1, 2}, {0, 2, 3}}, 0, 1);
  const auto stem = prism({{0, 0}, {1, 0}, {1, 2}, {0, 2}}, {{0, 1, 2}, {0, 2, 3}}, 0, 1);
  int met = 0;
  for (int i = 0; i < 3000; ++i) {
    const Pose pa{Vec3::Zero()},
        pb{Vec3(1, 1, 0.5) + d(rng) * Vec3(u(rng), u(rng), u(rng)).normalized(), random_rotation(rng)};
    const double margin = 0.12;
    std::vector<ContactPoint> c;
    block_block(foot, pa, cube, pb, margin, c);
    block_block(stem, pa, cube, pb, margin, c);
    double exact = 1e300;
    for (const auto& p : c) exact = std::min(exact, p.gap);
    if (exact < 1e-6) continue;
    const auto local = between(ell, pa, cube, pb, margin);
    if (exact > margin) {
      EXPECT_TRUE(local.empty());
      continue;
    }
    ++met;
    ASSERT_FALSE(local.empty()) << i << " " << exact;
    double g = 1e300;
    for (const auto& p : local) g = std::min(g, p.gap);
    EXPECT_NEAR(g, exact, 1e-9) << i;
  }
  EXPECT_GT(met, 150);
}

TEST(ConcaveContact, DovetailTouchesOnItsFlanksOnly) {
  // Socket: a block with a trapezoidal groove, open at the top; tenon: the matching trapezoid, sliding along
  // z.
  const auto socket = prism({{-3, 0}, {3, 0}, {3, 2}, {1, 2}, {1.5, 1}, {-1.5, 1}, {-1, 2}, {-3, 2}},
                            {{0, 1, 4}, {0, 4, 5}, {1, 2, 4}, {2, 3, 4}, {0, 5, 7}, {5, 6, 7}}, -2, 2);
  const auto tenon = prism({{-1.5, 1}, {1.5, 1}, {1, 2}, {-1, 2}}, {{0, 1, 2}, {0, 2, 3}}, -1, 1);
  ASSERT_FALSE(socket.convex);
  const auto c = between(socket, {Vec3::Zero()}, tenon, {Vec3(0, 0, 0.3)}, 1e-3);
  double floor = 0, left = 0, right = 0;
  for (const auto& p : c) {
    EXPECT_NEAR(p.gap, 0, 1e-12);
    if (p.normal.y() > 0.9)
      floor += p.area;
    else if (p.normal.x() > 0)
      left += p.area;
    else
      right += p.area;
    EXPECT_NEAR(p.normal.z(), 0, 1e-12);
  }
  EXPECT_NEAR(floor, 6, 1e-9);
  EXPECT_NEAR(left, 2 * std::sqrt(1.25), 1e-9);
  EXPECT_NEAR(right, 2 * std::sqrt(1.25), 1e-9);
}

TEST(ConcaveContact, StandingFlushOnAnLTouchesTheTopOnly) {
  // On the foot of an L laid on its back, one side flush with the outer wall.
  const auto c = between(ell, {Vec3::Zero()}, box(0.5, 1, 0.5), {Vec3(1.75, 1.5, 0.25)}, 1e-3);
  for (const auto& p : c) EXPECT_NEAR(p.normal.y(), 1, 1e-12);
  EXPECT_NEAR(total_area(c), 0.25, 1e-9);
}

TEST(ConcaveContact, NeighboursCutFromOneRockDoNotOverlap) {
  // Two blocks of a rock mass, joined of several cells each: a corner of the first lies on an edge of the
  // second, none of whose near faces it could press on; it is not inside as deep as the far side.
  const Polyhedron first = make_polyhedron({{1.1474771797357812, -1.2482032889260846, 0.9156222100480989},
                                            {1.1474859978289915, -0.695994903240277, 1.4672418419815045},
                                            {1.1167588014252505, -1.261723446636522, 1.7812336855385666},
                                            {-0.9282941064244001, -1.0936567737642409, -1.7023708778664997},
                                            {1.0083168208820572, -1.1954813737979535, -1.6834269089681158},
                                            {-1.0511659154217567, -1.1477366545124204, 1.7600270002767786},
                                            {0.6776271546580261, 2.8671752546377416, -3.927625186447699},
                                            {-0.7092034741556379, 2.9400930886240753, -3.941191192881476},
                                            {-0.8320752831529941, 2.886013207875897, -0.47879331473819775},
                                            {0.8631751576530249, 2.796879042794977, -0.4622103392046455}},
                                           {{0, 1, 2},
                                            {2, 5, 3},
                                            {3, 4, 0},
                                            {0, 2, 3},
                                            {6, 4, 3},
                                            {3, 7, 6},
                                            {8, 7, 3},
                                            {3, 5, 8},
                                            {4, 6, 9},
                                            {4, 9, 1},
                                            {0, 4, 1},
                                            {8, 5, 2},
                                            {1, 9, 8},
                                            {1, 8, 2},
                                            {8, 9, 6},
                                            {6, 7, 8}});
  const Polyhedron second = make_polyhedron({{1.14746517446088, -2.0, 0.1646270498853113},
                                             {1.253628615736611, -2.0, 2.1875700064366868},
                                             {1.193864823877056, -1.265777585640718, 1.7819879382749377},
                                             {1.1474771797357812, -1.2482032889260846, 0.9156222100480989},
                                             {1.196594260114816, -2.0, -1.2413888614760396},
                                             {1.2396306104226067, -1.2076435658883424, -1.6811641926046974},
                                             {-1.0974560726185167, -2.0, 2.2330519910952376},
                                             {-0.9775215789407379, -2.0, -1.1993303581275256},
                                             {-0.9282941064244001, -1.0936567737642409, -1.7023708778664997},
                                             {-1.0511659154217567, -1.1477366545124204, 1.7600270002767786}},
                                            {{0, 1, 6},
                                             {0, 6, 7},
                                             {7, 4, 0},
                                             {1, 0, 3},
                                             {3, 2, 1},
                                             {9, 6, 1},
                                             {1, 2, 9},
                                             {3, 5, 8},
                                             {3, 8, 9},
                                             {2, 3, 9},
                                             {4, 7, 8},
                                             {4, 8, 5},
                                             {4, 5, 3},
                                             {0, 4, 3},
                                             {9, 8, 7},
                                             {6, 9, 7}});
  ASSERT_FALSE(second.convex);
  const auto c = between(first, {Vec3::Zero()}, second, {Vec3::Zero()}, 1e-3);
  EXPECT_FALSE(c.empty());
  for (const auto& p : c) EXPECT_GT(p.gap, -1e-9);
}

TEST(ConcaveContact, EdgesOnTheFarSidesOfNeighboursDoNotCross) {
  // Two slabs beside each other, of one rock as well: the lower edge of the first and the upper edge of the
  // second pass each other.
  const Polyhedron first = make_polyhedron(
      {{-1.994069006125947, 2.2337626817920304, -0.5},
       {-1.8245946852448531, -1.0, -0.5},
       {-1.730849147867512, -1.0, 1.286319963508646},
       {-0.19003211310794788, -1.0, -0.5},
       {-0.2514497924374015, -1.0, 1.257700824810314},
       {-0.07944144390477659, 2.1669024140291526, -0.5}},
      {{0, 1, 2}, {2, 1, 3}, {3, 4, 2}, {1, 0, 5}, {5, 3, 1}, {3, 5, 4}, {5, 0, 2}, {2, 4, 5}});
  const Polyhedron second = make_polyhedron({{1.9999440496232406, -0.503735614206037, -0.5},
                                             {2.025952164019965, -1.0, -0.5},
                                             {2.115792493004622, -1.0, 1.2119062697086633},
                                             {1.999958849469116, 0.42306327584658554, 0.42581075524992684},
                                             {2.0905585560952242, 2.0911243442320755, -0.5},
                                             {-0.07944144390477659, 2.1669024140291526, -0.5},
                                             {-0.19003211310794788, -1.0, -0.5},
                                             {-0.2514497924374015, -1.0, 1.257700824810314}},
                                            {{5, 4, 0},
                                             {6, 5, 0},
                                             {0, 1, 6},
                                             {3, 2, 1},
                                             {0, 3, 1},
                                             {2, 7, 6},
                                             {1, 2, 6},
                                             {3, 4, 5},
                                             {3, 5, 7},
                                             {2, 3, 7},
                                             {0, 4, 3},
                                             {5, 6, 7}});
  ASSERT_FALSE(second.convex);
  const auto c = between(first, {Vec3::Zero()}, second, {Vec3::Zero()}, 1e-3);
  EXPECT_GE(c.size(), 3u);
  for (const auto& p : c) EXPECT_GT(p.gap, -1e-9);
}

TEST(ConcaveContact, LeaningKnifeCrossesAnEdgeWithNeitherOnesPointInTheOther) {
  // Along z an edge of the L, across it the edge of a knife that leans by 40 degrees: what of the one is
  // straight below the other is not inside it.
  const Vec3 out = Vec3(-1, -1, 0).normalized(), up = Vec3::UnitZ();
  for (const double lean : {-1.0, 1.0}) {
    const Polyhedron knife = prism({{0, 0}, {1.0, 1.0}, {0.6, 1.0}}, {{0, 1, 2}}, -1, 1);
    Mat3 R;
    R.col(0) = lean * up, R.col(1) = out, R.col(2) = R.col(0).cross(R.col(1));
    for (const double overlap : {1e-6, 1e-4, 1e-2}) {
      const auto contacts = between(ell, {Vec3::Zero()}, knife, {Vec3(0, 0, 0.5) - overlap * out, R}, 1e-7);
      ASSERT_EQ(contacts.size(), 1u) << "overlap " << overlap;
      EXPECT_NEAR(contacts[0].gap, -overlap, 1e-12);
      EXPECT_NEAR((contacts[0].normal - out).norm(), 0, 1e-12);
    }
  }
}

TEST(ConcaveContact, NotchIsFilledWithoutOverlap) {
  // Of a rock mass whose slivers were merged: the second block has a notch that an edge of the first fills.
  // Its vertices there lie on the first one's surface, below the notch's roof, which runs over the first
  // block's lower edge; between them is no matter of both.
  const Polyhedron first = make_polyhedron({{-0.9317315163096964, -1.0, -1.0},
                                            {-0.7749965716118368, -0.8684837657114315, -1.0},
                                            {-4.59582254724279, -1.0, -1.0},
                                            {-4.266234645543278, -1.0, 1.5543775927122283},
                                            {-4.81746347813862, -1.0, 0.9406720441003245},
                                            {-5.407609028522074, -0.032550544515999036, -1.0},
                                            {-3.100697203194045, 1.9031783172752625, -1.0},
                                            {-2.3239278490308664, 0.6297889165867048, 1.5543775927122567}},
                                           {{2, 0, 3},
                                            {3, 4, 2},
                                            {5, 6, 1},
                                            {2, 5, 1},
                                            {2, 1, 0},
                                            {7, 3, 0},
                                            {0, 1, 7},
                                            {1, 6, 7},
                                            {2, 4, 5},
                                            {7, 6, 5},
                                            {3, 7, 5},
                                            {3, 5, 4}});
  const Polyhedron second =
      make_polyhedron({{-0.7749965716118368, -0.8684837657114315, -1.0},
                       {-0.9317315163096964, -1.0, -1.0},
                       {-1.0737013281155612, -1.0, -0.8912448145754865},
                       {-0.8409438727337317, -0.8046933050353289, -0.8912448145754865},
                       {-0.874015606288367, -0.7504774754005155, -1.0},
                       {1.4328962190396624, 1.1852513863907745, -1.0},
                       {3.0, -1.0, -1.0},
                       {3.0, -1.0, 0.6552904006764493},
                       {1.4096487468684415, -1.0, 1.873570140745187},
                       {3.0, -0.6823501745366798, -1.0},
                       {3.0, -0.9178558456986536, 0.7302827741672786},
                       {2.3067299187782737, -0.24725951951435832, 1.873570140745187}},
                      {{3, 0, 1},  {1, 2, 3},   {4, 5, 9},  {4, 9, 6},  {6, 1, 0},  {0, 4, 6},  {7, 8, 2},
                       {1, 6, 7},  {1, 7, 2},   {11, 5, 4}, {8, 11, 4}, {3, 2, 8},  {8, 4, 3},  {0, 3, 4},
                       {9, 5, 11}, {11, 10, 9}, {7, 6, 9},  {9, 10, 7}, {11, 8, 7}, {7, 10, 11}});
  ASSERT_FALSE(second.convex);
  const auto c = between(first, {Vec3::Zero()}, second, {Vec3::Zero()}, 1e-3);
  EXPECT_GE(c.size(), 3u);
  for (const auto& p : c) EXPECT_GT(p.gap, -1e-9);
  // Pushed into the first block it overlaps by some part of the way.
  for (const double way : {1e-6, 1e-4, 1e-3}) {
    double deepest = 0;
    for (const auto& p : between(first, {Vec3::Zero()}, second, {way * Vec3(-0.493, 0.587, -0.643)}, 1e-3))
      deepest = std::max(deepest, -p.gap);
    EXPECT_GT(deepest, 0.3 * way) << way;
    EXPECT_LT(deepest, 1.3 * way) << way;
  }
}

TEST(ConcaveContact, SpikesBesideAnLAreNotInIt) {
  // About a sharp corner the sum of its faces' normals does not tell before from behind; with a wide margin
  // corners far off are looked at as well.
  std::mt19937 rng(12);
  std::uniform_real_distribution<double> u(-1, 1);
  const Polyhedron left = box(1, 2, 1), right = box(1, 1, 1);  // what the L is made of
  int beside = 0;
  for (int i = 0; i < 4000; ++i) {
    const Polyhedron spike = hull({{0, 0, 0},
                                   {1, 0.1 * u(rng), 0.3 * u(rng)},
                                   {1, 0.3 + 0.2 * u(rng), 0.4 * u(rng)},
                                   {0.9, 0.1 * u(rng), 0.5 + 0.3 * u(rng)}});
    const Pose p{Vec3(1, 1, 0.5) + 1.4 * Vec3(u(rng), u(rng), u(rng)), random_rotation(rng)};
    std::vector<ContactPoint> parts;
    block_block(left, {Vec3(0.5, 1, 0.5)}, spike, p, 1e-3, parts);
    block_block(right, {Vec3(1.5, 0.5, 0.5)}, spike, p, 1e-3, parts);
    if (!parts.empty()) continue;
    ++beside;
    for (const auto& c : between(ell, {Vec3::Zero()}, spike, p, 0.4)) EXPECT_GT(c.gap, 0) << i;
  }
  EXPECT_GT(beside, 1000);
}

}  // namespace
}  // namespace talus::contact::testing
