#include "geometry/take_out.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "geometry/cut.hpp"
#include "geometry/terrain.hpp"

namespace talus::geometry {
namespace {

/// A slope of n x n squares of 1 m that falls by 1/2 along x, rough by `rough`; west half of material 1.
TriangleSurface slope(int n, double rough, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  TriangleSurface s;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) s.vertices.emplace_back(i, j, 0.5 * (n - i) + rough * u(rng));
  const auto id = [&](int i, int j) { return j * (n + 1) + i; };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      s.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      s.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
      s.material.insert(s.material.end(), 2, 2 * i < n ? 1 : 2);
    }
  return s;
}

/// What lies between the surface and z = 0, by its triangles in plan [m^3].
double volume_below(const TriangleSurface& s) {
  double sum = 0;
  for (const auto& t : s.triangles) {
    const Vec3 &a = s.vertices[t[0]], &b = s.vertices[t[1]], &c = s.vertices[t[2]];
    sum += (b - a).cross(c - a).z() / 2 * (a.z() + b.z() + c.z()) / 3;
  }
  return sum;
}

Mesh box(const Vec3& low, const Vec3& high) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z());
  return convex_hull(corners);
}

CutResult blocks_of(const TakenOut& out, std::vector<CutJointSet> joints = {}) {
  CutSpec spec;
  spec.mass = out.mass;
  spec.joint_sets = std::move(joints);
  return cut(spec);
}

double volume_of(const CutResult& cut) {
  double sum = 0;
  for (const CutBlock& b : cut.blocks) sum += b.volume;
  return sum;
}

/// From the nearest face of a block.
double distance(const CutResult& cut, const Vec3& place) {
  double nearest = 1e300;
  for (const CutBlock& block : cut.blocks)
    for (const auto& t : block.body.triangles) {
      const Vec3 x = place - block.centroid, &a = block.body.vertices[t[0]], &b = block.body.vertices[t[1]],
                 &c = block.body.vertices[t[2]];
      const Vec3 n = (b - a).cross(c - a);
      const double beyond = std::max(
          {0.0, n.dot((b - a).cross(a - x)), n.dot((c - b).cross(b - x)), n.dot((a - c).cross(c - x))});
      nearest =
          std::min(nearest, std::abs(n.normalized().dot(x - a)) + beyond / std::pow(n.squaredNorm(), 0.75));
    }
  return nearest;
}

/// The mass is as large as the hollow, and is bounded by its faces; materials are those of before.
void check(const TriangleSurface& before, const TakenOut& out, int bed) {
  const CutResult mass = blocks_of(out);
  const double volume = volume_of(mass);
  EXPECT_GT(volume, 0);
  EXPECT_NEAR(volume_below(before) - volume_below(out.ground), volume, 1e-11 * volume_below(before));
  ASSERT_EQ(out.ground.material.size(), out.ground.triangles.size());
  double bed_volume = 0;
  for (std::size_t t = 0; t < out.ground.triangles.size(); ++t) {
    const auto& v = out.ground.triangles[t];
    const Vec3 &a = out.ground.vertices[v[0]], &b = out.ground.vertices[v[1]], &c = out.ground.vertices[v[2]];
    if (out.ground.material[t] != bed) {
      EXPECT_EQ(out.ground.material[t], 2 * ((a.x() + b.x() + c.x()) / 3) < 12 ? 1 : 2);
      continue;
    }
    bed_volume += (b - a).cross(c - a).z();
    for (const int i : v) {
      const Vec3& x = out.ground.vertices[i];
      EXPECT_LE(distance(mass, x), 1e-9);  // what one plane of several triangles may be off, times the size
    }
  }
  EXPECT_GT(bed_volume, 0);
}

TEST(TakeOut, ABoxLeavesAHollowOfItsShape) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const TriangleSurface ground = slope(12, seed > 1 ? 0.3 : 0, seed);
    const double shift = 0.037 * seed;
    const Mesh anywhere = box({2 + shift, 3.2, 0}, {7.5, 8.1 + shift, 9}),
               on_lines = box({2, 3, 0.25}, {8, 9, 9});  // of the ground's own mesh
    check(ground, take_out(ground, nullptr, &anywhere, 3), 3);
    check(ground, take_out(ground, nullptr, &on_lines, 3), 3);
  }
}

TEST(TakeOut, ASlipSurfaceThatIsTheGroundElsewhere) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const TriangleSurface ground = slope(12, 0.2, seed);
    TriangleSurface slip = ground;
    for (Vec3& x : slip.vertices)
      if (x.x() > 2.5 && x.x() < 9.5 && x.y() > 3.5 && x.y() < 8.5) x.z() -= 1;
    const TakenOut out = take_out(ground, &slip, nullptr, 3);
    check(ground, out, 3);
    EXPECT_NEAR(volume_below(out.ground), volume_below(slip), 1e-11 * volume_below(ground));
    EXPECT_EQ(blocks_of(out).blocks.size(), 1u);
    const Mesh within = box({4.3, 0, -5}, {7.2, 12, 20});
    check(ground, take_out(ground, &slip, &within, 3), 3);
  }
}

/// A hollow of 2 m depth at (7, 7) that tapers out at 5 m.
TriangleSurface with_spoon(TriangleSurface s, double size = 1) {
  for (Vec3& x : s.vertices) {
    const double r_sq = ((x - Vec3(7, 7, 0)) / size).head<2>().squaredNorm() / 25;
    if (r_sq < 1) x.z() -= 2 * (1 - r_sq);
  }
  return s;
}

CutJointSet joint_set(double dip_direction, double dip, double spacing) {
  CutJointSet s;
  s.name = "J";
  s.dip_direction = dip_direction * M_PI / 180;
  s.dip = dip * M_PI / 180;
  s.spacing = spacing;
  return s;
}

TEST(TakeOut, ANaturalSlopeIsCutByAnyJoints) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const TriangleSurface ground = slope(14, 0.3, seed), slip = with_spoon(ground);
    const TakenOut out = take_out(ground, &slip, nullptr, 3);
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> u(0, 1);
    // The last set stands on the lines of the grid.
    const CutResult cut =
        blocks_of(out, {joint_set(360 * u(rng), 90 * u(rng), 1 + 2 * u(rng)),
                        joint_set(360 * u(rng), 60 + 30 * u(rng), 1 + 2 * u(rng)), joint_set(90, 90, 1)});
    EXPECT_GT(cut.blocks.size(), 10u);
    EXPECT_NEAR(volume_of(cut), volume_below(ground) - volume_below(slip), 1e-11 * volume_below(ground));
    for (const CutBlock& b : cut.blocks) EXPECT_GT(b.volume, 0);
  }
}

TEST(TakeOut, SurfacesOnDifferentGridsLeaveNoGap) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const TriangleSurface ground = slope(14, 0.3, seed);
    TriangleSurface slip = with_spoon(slope(20, 0, seed));  // 0.7 m wide squares, turned, below and above it
    for (Vec3& x : slip.vertices)
      x = Vec3(0.7 * x.x() + 0.1 * x.y() + 0.3, 0.7 * x.y() - 0.1 * x.x() + 1.2, 0.6 * x.z() + 0.2);
    const TakenOut out = take_out(ground, &slip, nullptr, 3);
    const CutResult cut = blocks_of(out, {joint_set(80, 70, 2)});
    EXPECT_NEAR(volume_of(cut), volume_below(ground) - volume_below(out.ground),
                1e-11 * volume_below(ground));
  }
}

TEST(TakeOut, ATerrainThatIsDecimatedTakesItsSlipSurfaceWithIt) {
  const double error = 0.2;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const TriangleSurface ground = slope(14, 0.1, seed), slip = with_spoon(ground);
    TerrainOptions o;
    o.decimation_error = error;
    o.beside = &slip;
    const Terrain thin = make_terrain(ground.vertices, ground.triangles, o, "ground");
    ASSERT_TRUE(thin.beside.has_value());
    EXPECT_LT(thin.surface.triangles.size(), ground.triangles.size() * 2 / 3);  // borders stay
    EXPECT_EQ(thin.beside->triangles.size(), thin.surface.triangles.size());
    const TakenOut out = take_out(thin.surface, &*thin.beside, nullptr, 3);
    const CutResult cut = blocks_of(out);
    EXPECT_EQ(cut.blocks.size(), 1u);
    const double area = M_PI * 25;
    EXPECT_NEAR(volume_of(cut), volume_below(ground) - volume_below(slip), 2 * error * area);
  }
}

TEST(TakeOut, WhatHangsTogetherInAnEdgeOrACornerIsTwoPieces) {
  const TriangleSurface ground = slope(12, 0, 1);
  const auto id = [](int i, int j) { return j * 13 + i; };
  // Hollows of one lowered node each: at (4, 4) and (5, 6) they have an edge in common, at (4, 4) and (6, 4)
  // a corner, at (4, 4) and (8, 8) nothing.
  for (const int other : {id(5, 6), id(6, 4), id(8, 8)}) {
    TriangleSurface slip = ground;
    slip.vertices[static_cast<std::size_t>(id(4, 4))].z() -= 1;
    slip.vertices[static_cast<std::size_t>(other)].z() -= 1;
    const TakenOut out = take_out(ground, &slip, nullptr, 3);
    check(ground, out, 3);
    const CutResult cut = blocks_of(out);
    ASSERT_EQ(cut.blocks.size(), 2u);
    EXPECT_NEAR(cut.blocks[0].volume, 1, 1e-12);  // a pyramid over six triangles of 0.5 m^2
    ASSERT_EQ(out.warnings.size(), 1u);
    EXPECT_EQ(out.warnings[0].value, "2 pieces");
  }
}

TEST(TakeOut, SmallPiecesStayInTheGround) {
  const TriangleSurface ground = slope(12, 0, 1);
  TriangleSurface slip = ground;
  slip.vertices[4 * 13 + 4].z() -= 1;
  slip.vertices[8 * 13 + 8].z() -= 0.5;
  const TakenOut out = take_out(ground, &slip, nullptr, 3, 0.6);
  check(ground, out, 3);
  ASSERT_EQ(blocks_of(out).blocks.size(), 1u);
  EXPECT_NEAR(volume_of(blocks_of(out)), 1, 1e-12);
  ASSERT_EQ(out.warnings.size(), 1u);
  EXPECT_EQ(out.warnings[0].key, "rock_mass.least_volume");
  // The ground above the piece that stays is what it was.
  EXPECT_EQ(std::count(out.hollow.begin(), out.hollow.end(), 1), 6);
  EXPECT_THROW(take_out(ground, &slip, nullptr, 3, 2), InputError);
}

TEST(TakeOut, WhatCannotBeIsTold) {
  const TriangleSurface ground = slope(12, 0, 1);
  const Mesh above = box({2, 3, 20}, {4, 5, 22}), beside = box({20, 3, 0}, {24, 5, 22}),
             within = box({3, 3, 0}, {8, 8, 9});
  EXPECT_THROW(take_out(ground, nullptr, &above, 3), InputError);
  EXPECT_THROW(take_out(ground, nullptr, &beside, 3), InputError);
  EXPECT_THROW(take_out(ground, &ground, nullptr, 3), InputError);  // nowhere below
  TriangleSurface overhanging = ground;
  overhanging.vertices[13 * 5 + 5].x() += 1.5;
  EXPECT_THROW(take_out(overhanging, nullptr, &within, 3), InputError);
}

}  // namespace
}  // namespace talus::geometry
