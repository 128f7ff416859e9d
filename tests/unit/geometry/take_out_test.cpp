#include "geometry/take_out.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>

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

/// The mass is closed, as large as the hollow, and has its corners; materials are those of before.
void check(const TriangleSurface& before, const TakenOut& out, int bed) {
  for (const Problem& p : closed_mesh_problems(out.mass, "")) ADD_FAILURE() << p.str();
  const double volume = signed_volume(out.mass.vertices, out.mass.triangles);
  EXPECT_GT(volume, 0);
  EXPECT_NEAR(volume_below(before) - volume_below(out.ground), volume, 1e-11 * volume_below(before));
  ASSERT_EQ(out.ground.material.size(), out.ground.triangles.size());
  std::set<std::array<double, 3>> corners;
  for (const Vec3& x : out.mass.vertices) corners.insert({x.x(), x.y(), x.z()});
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
      EXPECT_TRUE(corners.contains({x.x(), x.y(), x.z()}));
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
    const Mesh within = box({4.3, 0, -5}, {7.2, 12, 20});
    check(ground, take_out(ground, &slip, &within, 3), 3);
  }
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
