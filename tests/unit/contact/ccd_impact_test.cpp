#include <gtest/gtest.h>

#include <ctime>

#include "detect_shapes.hpp"

namespace talus::contact::testing {
namespace {

constexpr double tolerance = 1e-6;
double gap_at(const Polyhedron& a, const Pose& pa, const Polyhedron& b, const Pose& pb) {
  std::vector<ContactPoint> c;
  block_block(a, pa, b, pb, 10.0, c);
  double g = 1e300;
  for (const auto& p : c) g = std::min(g, p.gap);
  return g;
}

TEST(TimeOfImpact, FallingCubeMeetsSlabPlaneAndTerrainAtTheClosedForm) {
  const auto slab = box(10, 10, 1);
  Motion still, fall;
  still.start.c = {0, 0, -0.5};
  fall.start.c = {0.3, 0.2, 3.5};
  fall.displacement = {0, 0, -6};
  const SurfaceIndex ground(grid(10, 1.0));
  const double expected = (3.0 - tolerance) / 6;
  EXPECT_NEAR(time_of_impact(slab, still, cube, fall, tolerance), expected, 1e-7);
  EXPECT_NEAR(time_of_impact(Plane{}, cube, fall, tolerance), expected, 1e-7);
  EXPECT_NEAR(time_of_impact(ground, cube, fall, tolerance), expected, 1e-7);
}

TEST(TimeOfImpact, ParabolaIsFollowedExactly) {
  // c(s) = 1 + 0 s + (s^2 - s) q, q_z = -2: falls by... z = 1 + 2 s - 2 s^2 + d s with d = -3.
  Motion m;
  m.start.c = {0, 0, 1};
  m.displacement = {0, 0, -3};
  m.half_gravity_step = {0, 0, -2};
  const double target = 0.5 + tolerance;  // 1 - 3 s + 2 s - 2 s^2 = target
  const double s = (-1 + std::sqrt(1 + 8 * (1 - target))) / 4;
  EXPECT_NEAR(time_of_impact(Plane{}, cube, m, tolerance), s, 1e-6);
  const SurfaceIndex ground(grid(4, 1.0));
  EXPECT_NEAR(time_of_impact(ground, cube, m, tolerance), s, 1e-6);
}

TEST(TimeOfImpact, RandomSpinningPairsAgreeWithDenseSampling) {
  std::mt19937 rng(5);
  std::normal_distribution<double> g;
  const auto h = hull(sphere_points(14, 0.6, rng));
  int hits = 0;
  for (int i = 0; i < 120; ++i) {
    const auto &A = i % 2 ? cube : h, &B = i % 3 ? cube : h;
    Motion a, b;
    a.start.F = random_rotation(rng);
    b.start.F = random_rotation(rng);
    a.rotation = 0.7 * Vec3(g(rng), g(rng), g(rng));
    b.rotation = 1.5 * Vec3(g(rng), g(rng), g(rng));
    b.start.c = 3 * random_rotation(rng).col(0);
    b.displacement = -1.6 * b.start.c + Vec3(g(rng), g(rng), g(rng));
    a.displacement = 0.3 * Vec3(g(rng), g(rng), g(rng));
    b.half_gravity_step = {0, 0, -0.5};
    if (gap_at(A, a.at(0), B, b.at(0)) <= tolerance) continue;
    const double s = time_of_impact(A, a, B, b, tolerance);
    double sampled = 2;
    for (int k = 0; k <= 500 && sampled > 1; ++k)
      if (gap_at(A, a.at(k / 500.0), B, b.at(k / 500.0)) <= tolerance) sampled = k / 500.0;
    if (sampled <= 1) {
      ++hits;
      EXPECT_LE(s, sampled + 1e-9) << i;
    }
    if (s <= 1) {
      const double gap = gap_at(A, a.at(s), B, b.at(s));
      EXPECT_LE(gap, 1.01 * tolerance) << i;
      EXPECT_GE(gap, 0.5 * tolerance) << i;
    } else {
      EXPECT_GT(sampled, 1) << i;
    }
  }
  EXPECT_GT(hits, 40);
}

TEST(TimeOfImpact, FastCubeCannotTunnelThroughASheetWithoutThickness) {
  auto sheet = grid(8, 0.5);
  for (const bool two_sided : {false, true}) {
    sheet.two_sided = two_sided;
    const SurfaceIndex index(sheet);
    std::mt19937 rng(3);
    std::uniform_real_distribution<double> u(-1, 1);
    for (int i = 0; i < 200; ++i) {
      Motion m;  // 1000 m/s over 0.01 s: 10 m, through the sheet somewhere
      m.start.F = random_rotation(rng);
      m.start.c = {0.8 * u(rng), 0.8 * u(rng), 1 + 3 * std::abs(u(rng))};
      m.displacement = {0.5 * u(rng), 0.5 * u(rng), -10};
      m.rotation = 10 * Vec3(u(rng), u(rng), u(rng));
      const double s = time_of_impact(index, cube, m, 1e-9);
      ASSERT_LE(s, 1.0);
      double low = 1e300;
      for (const auto& x : cube.vertices) low = std::min(low, m.at(s).world(x).z());
      EXPECT_NEAR(low, 1e-9, 2e-10);
    }
  }
}

TEST(TimeOfImpact, NeedlesMeetTipFirstAndCrossing) {
  const auto needle = box(1e-4, 1e-4, 1.0);  // aspect 1e4
  Motion still, m;
  still.start.F = turn(Vec3::UnitX(), M_PI / 2);  // along y
  m.start.F = turn(Vec3::UnitY(), M_PI / 2);      // along x
  m.start.c = {0.2, 0.3, 5};
  m.displacement = {0, 0, -10};
  EXPECT_NEAR(time_of_impact(needle, still, needle, m, 1e-9), (5 - 1e-4 - 1e-9) / 10, 1e-9);
  m.start.c.x() = 0.6;  // passes beside
  EXPECT_GT(time_of_impact(needle, still, needle, m, 1e-9), 1);
  Motion dart;  // tip first at a plane of triangles
  dart.start.c = {0.21, 0.13, 3};
  dart.displacement = {0, 0, -10};
  const SurfaceIndex ground(grid(4, 1.0));
  EXPECT_NEAR(time_of_impact(ground, needle, dart, 1e-9), (2.5 - 1e-9) / 10, 1e-9);
}

TEST(TimeOfImpact, SpinOfAThousandRadiansPerSecondIsResolved) {
  // A bar 2 m long turning at 1000 rad/s, centre 0.9 m above the ground: the tip comes down at cos(theta) =
  // 0.9.
  const auto bar = box(0.01, 0.01, 2.0);
  Motion m;
  m.start.F = turn(Vec3::UnitX(), M_PI / 2);  // along y
  m.start.c = {0.2, 0.1, 0.9};
  m.rotation = {10, 0, 0};
  const SurfaceIndex ground(grid(6, 1.0));
  const double s = time_of_impact(ground, bar, m, 1e-9), p = time_of_impact(Plane{}, bar, m, 1e-9);
  ASSERT_LE(s, 1);
  EXPECT_NEAR(s, p, 1e-8);
  double low = 1e300;
  for (const auto& x : bar.vertices) low = std::min(low, m.at(s).world(x).z());
  EXPECT_NEAR(low, 1e-9, 2e-10);
  // first time: the tip at half length 1, half thickness 0.005 reaches sin(10 s + atan(0.005)) r = 0.9
  const double r = std::hypot(1.0, 0.005);
  EXPECT_NEAR(s, (std::asin((0.9 - 1e-9) / r) - std::atan(0.005)) / 10, 1e-8);
}

TEST(TimeOfImpact, SpinCloseOverAPlaneIsNoImpact) {
  Motion m;
  m.start.c = {0.1, 0.2, 0.5 + 1e-4};
  m.rotation = {0, 0, 10};
  EXPECT_GT(time_of_impact(Plane{}, cube, m, 1e-9), 1);
  const SurfaceIndex ground(grid(6, 0.7));
  EXPECT_GT(time_of_impact(ground, cube, m, 1e-9), 1);
}

TEST(TimeOfImpact, SlidingContactReportsNothingUntilItMeetsAWall) {
  // Ground z = 0 of triangles and a wall at x = 3.
  TriangleSurface s = grid(10, 1.0);
  const int n = static_cast<int>(s.vertices.size());
  for (const double z : {0.0, 3.0})
    for (const double y : {-5.0, 5.0}) s.vertices.emplace_back(3, y, z);
  s.triangles.push_back({n, n + 2, n + 1});
  s.triangles.push_back({n + 1, n + 2, n + 3});
  const SurfaceIndex index(s);
  Motion m;
  m.start.c = {0, 0.2, 0.5};
  m.displacement = {2, 0.3, 0};
  EXPECT_GT(time_of_impact(index, cube, m, tolerance), 1);
  m.displacement.x() = 5;
  EXPECT_NEAR(time_of_impact(index, cube, m, tolerance), 0.5, 1e-5);
  m.start.c.z() -= 1e-4;  // a compliant contact, pressed in already: only what comes deeper counts
  m.displacement.x() = 2;
  EXPECT_GT(time_of_impact(index, cube, m, tolerance), 1);
}

TEST(TimeOfImpact, TouchingPairsThatSeparateOrRestAreNotHits) {
  const auto slab = box(10, 10, 1);
  Motion still, m;
  m.start.c = {0, 0, 1};
  for (const double lift : {0.0, 0.5 * tolerance, -0.5 * tolerance}) {
    m.start.c.z() = 1 + lift;
    m.displacement = {0, 0, 0};
    EXPECT_GT(time_of_impact(slab, still, cube, m, tolerance), 1);
    m.displacement = {0, 0, 0.3};
    EXPECT_GT(time_of_impact(slab, still, cube, m, tolerance), 1);
    m.displacement = {0.4, -0.2, 0};
    EXPECT_GT(time_of_impact(slab, still, cube, m, tolerance), 1);
    m.displacement = {0, 0, -0.1};  // presses in: reported where the gap is ten tolerances below
    const double s = time_of_impact(slab, still, cube, m, tolerance);
    EXPECT_NEAR(s, (10 * tolerance + std::max(lift, 0.0)) / 0.1, 2 * tolerance / 0.1);
  }
}

TEST(TimeOfImpact, ConcaveBodiesMeetWithTheirTrueShape) {
  const auto ell = prism({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}},
                         {{0, 1, 2}, {0, 2, 3}, {0, 3, 5}, {3, 4, 5}}, 0, 1);
  Motion still, m;
  m.start.c = {1.6, 4, 0.5};
  m.displacement = {0, -4, 0};  // into the notch: stops on the foot at y = 1, not on the hull
  EXPECT_NEAR(time_of_impact(ell, still, cube, m, tolerance), (2.5 - tolerance) / 4, 1e-6);
  m.start.c.x() = 1.4;  // catches the stem at y = 2
  EXPECT_NEAR(time_of_impact(ell, still, cube, m, tolerance), (1.5 - tolerance) / 4, 1e-6);
  Motion drop;
  drop.start.c = {0, 0, 3};
  drop.displacement = {0, 0, -4};
  const SurfaceIndex ground(grid(8, 1.0));
  EXPECT_NEAR(time_of_impact(ground, ell, drop, tolerance), (3 - tolerance) / 4, 1e-6);
}

/// Rock with dents: a ball of rings of points whose radii go up and down by a third.
Polyhedron dented(double radius, int rings, int around) {
  std::vector<Vec3> v{{0, 0, -radius}};
  Triangles t;
  const auto at = [&](int i, int j) { return 1 + i * around + j % around; };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      const double up = M_PI * ((i + 1.0) / (rings + 1) - 0.5), along = 2 * M_PI * j / around,
                   r = radius * ((i + j) % 3 == 0 ? 0.67 : 1);
      v.push_back(r * Vec3(std::cos(up) * std::cos(along), std::cos(up) * std::sin(along), std::sin(up)));
    }
  const int top = static_cast<int>(v.size());
  v.emplace_back(0, 0, radius);
  for (int j = 0; j < around; ++j) {
    t.push_back({0, at(0, j + 1), at(0, j)});
    t.push_back({top, at(rings - 1, j), at(rings - 1, j + 1)});
    for (int i = 0; i + 1 < rings; ++i) {
      t.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
      t.push_back({at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return make_polyhedron(v, t);
}

TEST(TimeOfImpact, HollowRocksThatSpinPastEachOtherAgreeWithDenseSampling) {
  std::mt19937 rng(3);
  std::normal_distribution<double> g;
  const auto rock = dented(0.6, 3, 5);
  int hits = 0, passes = 0;
  for (int i = 0; i < 40; ++i) {
    Motion a, b;
    a.start.F = random_rotation(rng);
    b.start.F = random_rotation(rng);
    a.rotation = 2 * Vec3(g(rng), g(rng), g(rng));
    b.rotation = 2 * Vec3(g(rng), g(rng), g(rng));
    b.start.c = 2 * random_rotation(rng).col(0);
    b.displacement = -1.6 * b.start.c + Vec3(g(rng), g(rng), g(rng));
    b.half_gravity_step = {0, 0, -0.5};
    if (gap_at(rock, a.at(0), rock, b.at(0)) <= tolerance) continue;
    const double s = time_of_impact(rock, a, rock, b, tolerance);
    double sampled = 2;
    for (int k = 0; k <= 200 && sampled > 1; ++k)
      if (gap_at(rock, a.at(k / 200.0), rock, b.at(k / 200.0)) <= tolerance) sampled = k / 200.0;
    EXPECT_LE(s, sampled + 1e-9) << i;
    if (s > 1) {
      ++passes;
      continue;
    }
    ++hits;
    const double gap = gap_at(rock, a.at(s), rock, b.at(s));
    EXPECT_LE(gap, 1.01 * tolerance) << i;
    EXPECT_GE(gap, 0.5 * tolerance) << i;
  }
  EXPECT_GT(hits, 10);
  EXPECT_GT(passes, 5);
}

/// Every pair of triangles was followed through the whole of the motion, 0.1 s for a pair of rocks that turn
/// by five radians.
TEST(TimeOfImpact, HollowRocksThatSpinPastEachOtherCostLittle) {
  const auto rock = dented(0.6, 9, 18);  // 324 triangles
  Motion a, b;
  a.rotation = {3, 0, 4}, b.rotation = {-4, 3, 0};
  b.start.c = {1.25, -1, 0}, b.displacement = {0, 2, 0};
  const std::clock_t start = std::clock();
  for (int i = 0; i < 20; ++i) {
    b.start.c.z() = 0.01 * i;
    EXPECT_EQ(time_of_impact(rock, a, rock, b, tolerance), 2);
  }
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 0.5);
}

/// The box about a cube grows by up to the root of three as it turns onto its corner, however short the part
/// of the motion: a channel that turns about what is within it, and does not touch it.
TEST(TimeOfImpact, AChannelThatTurnsAboutWhatIsWithinCostsLittle) {
  const auto channel = [](double l) {
    const double out = 0.5 * l, in = 0.4 * l;
    return prism(
        {{-out, -out}, {out, -out}, {out, out}, {in, out}, {in, -in}, {-in, -in}, {-in, out}, {-out, out}},
        {{0, 1, 4}, {0, 4, 5}, {1, 2, 3}, {1, 3, 4}, {5, 6, 7}, {5, 7, 0}}, -out, out);
  };
  const auto large = channel(1), small = channel(0.1);
  Motion a, b;
  a.rotation = 2 * Vec3(1, -1, 0).normalized();
  ASSERT_GT(gap_at(large, a.at(0), small, b.at(0)), 0.1);
  const std::clock_t start = std::clock();
  EXPECT_EQ(time_of_impact(large, a, small, b, tolerance), 2);
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 0.5);
}

TEST(TimeOfImpact, SweptBoxHoldsTheWholeMotion) {
  std::mt19937 rng(13);
  std::normal_distribution<double> g;
  for (int i = 0; i < 200; ++i) {
    Motion m;
    m.start.c = {g(rng), g(rng), g(rng)};
    m.start.F = random_rotation(rng);
    m.displacement = Vec3(g(rng), g(rng), g(rng));
    m.rotation = (i % 4) * Vec3(g(rng), g(rng), g(rng));
    m.half_gravity_step = Vec3(g(rng), g(rng), g(rng));
    const Box3 all = swept_bounds(cube, m, 1e-12);
    for (int k = 0; k <= 40; ++k) EXPECT_TRUE(all.contains(bounds(cube, m.at(k / 40.0))));
  }
}

}  // namespace
}  // namespace talus::contact::testing
