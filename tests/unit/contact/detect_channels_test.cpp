// Blocks on lips, in channels, pits and hollows of the ground.
#include <gtest/gtest.h>

#include "local_contacts.hpp"

namespace talus::contact::testing {
namespace {

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

}  // namespace
}  // namespace talus::contact::testing
