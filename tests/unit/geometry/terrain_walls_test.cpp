#include "geometry/terrain_walls.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

using namespace talus;
using namespace talus::geometry;

namespace {

/// n x n squares of 1 m from the origin at height z, without those in `missing` (numbered along x first).
TriangleSurface sheet(int n, double z, const std::vector<int>& missing = {}) {
  TriangleSurface s;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) s.vertices.emplace_back(i, j, z);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      if (std::find(missing.begin(), missing.end(), j * n + i) != missing.end()) continue;
      const int a = j * (n + 1) + i, b = a + 1, c = b + n + 1, d = a + n + 1;
      s.triangles.push_back({a, b, c});
      s.triangles.push_back({a, c, d});
    }
  return s;
}

/// Sums over the triangles from `first` on: area, and the flux of (x, y, 0), twice the plan area within walls
/// that face outward.
std::pair<double, double> area_and_flux(const TriangleSurface& s, std::size_t first) {
  double area = 0, flux = 0;
  for (std::size_t t = first; t < s.triangles.size(); ++t) {
    const Vec3 &a = s.vertices[s.triangles[t][0]], &b = s.vertices[s.triangles[t][1]],
               &c = s.vertices[s.triangles[t][2]];
    const Vec3 n = 0.5 * (b - a).cross(c - a), middle = (a + b + c) / 3;
    EXPECT_NEAR(n.z(), 0, 1e-12);
    area += n.norm();
    flux += n.dot(Vec3(middle.x(), middle.y(), 0));
  }
  return {area, flux};
}

}  // namespace

TEST(TerrainWalls, StandRoundTheBorderAndRoundHoles) {
  const TriangleSurface s = sheet(3, 2, {4});
  const TriangleSurface walled = with_border_walls(s, {}, -3);
  EXPECT_EQ(walled.triangles.size(), s.triangles.size() + 2 * (12 + 4));
  const auto [area, flux] = area_and_flux(walled, s.triangles.size());
  EXPECT_NEAR(area, 5.0 * (12 + 4), 1e-12);
  EXPECT_NEAR(flux, 5.0 * 2 * (9 - 1), 1e-12);  // out of the solid: into the hole as well
}

TEST(TerrainWalls, AreOfTheMaterialAboveThem) {
  TriangleSurface s = sheet(1, 0);
  s.material = {4, 7};
  const TriangleSurface walled = with_border_walls(s, {}, -1);
  EXPECT_EQ(walled.material, (std::vector<int>{4, 7, 4, 4, 7, 7, 4, 4, 7, 7}));
}

TEST(TerrainWalls, NoneWhereGroundGoesOnBeyond) {
  const Plane level{Vec3::Zero(), Vec3::UnitZ(), 0};
  EXPECT_EQ(with_border_walls(sheet(2, 0), std::array{level}, -1).triangles.size(),
            sheet(2, 0).triangles.size());
  EXPECT_EQ(with_border_walls(sheet(2, 0.1), std::array{level}, -1).triangles.size(),
            sheet(2, 0.1).triangles.size() + 2 * 8);
  // Two sheets side by side that share no vertices, one of them lower: the step between them is a wall of the
  // upper one alone.
  for (const double step : {0.0, 0.5}) {
    TriangleSurface two = sheet(2, 0);
    const TriangleSurface other = sheet(2, -step);
    for (const Vec3& v : other.vertices) two.vertices.push_back(v + Vec3(2, 0, 0));
    for (const auto& t : other.triangles) two.triangles.push_back({t[0] + 9, t[1] + 9, t[2] + 9});
    EXPECT_EQ(with_border_walls(two, {}, -1).triangles.size(),
              two.triangles.size() + 2 * (12 + (step > 0 ? 2 : 0)));
  }
}

TEST(TerrainWalls, NoneOfATwoSidedSheet) {
  TriangleSurface s = sheet(2, 0);
  s.two_sided = true;
  EXPECT_EQ(with_border_walls(s, {}, -1).triangles.size(), s.triangles.size());
}

/// Below the border of a plateau that overhangs the walls end at the underside: with a floor in front the
/// solid is a closed prism, the leaning cliff its front.
TEST(TerrainWalls, EndAtTheUndersideOfAnOverhang) {
  TriangleSurface s;
  s.vertices = {{-10, -10, 10}, {-10, 10, 10}, {1, -10, 10}, {1, 10, 10},
                {0, -10, 0},    {0, 10, 0},    {30, -10, 0}, {30, 10, 0}};
  s.triangles = {{0, 2, 3}, {0, 3, 1}, {2, 4, 5}, {2, 5, 3}, {4, 6, 7}, {4, 7, 5}};
  const TriangleSurface walled = with_border_walls(s, {}, -3);
  double area = 0, flux = 0;
  for (std::size_t t = s.triangles.size(); t < walled.triangles.size(); ++t) {
    const Vec3 &a = walled.vertices[walled.triangles[t][0]], &b = walled.vertices[walled.triangles[t][1]],
               &c = walled.vertices[walled.triangles[t][2]];
    const Vec3 n = 0.5 * (b - a).cross(c - a), middle = (a + b + c) / 3;
    if (std::abs(n.y()) < 1e-9) continue;
    EXPECT_GT(n.y() * middle.y(), 0);  // outward
    area += n.norm();
    flux += n.y() * middle.y();
  }
  const double side =
      10 * 10 + 0.5 * 10 * 1 + 3 * 40;  // plateau's rock above the floor, the lean, and below the floor
  EXPECT_NEAR(area, 2 * side, 1e-3);
  EXPECT_NEAR(flux, 20 * side, 1e-2);
}

TEST(TerrainWalls, NoneAtTheTopOfAnUprightSheet) {
  TriangleSurface s;
  s.vertices = {{0, 0, 0}, {0, 5, 0}, {0, 5, 8}, {0, 0, 8}};
  s.triangles = {{0, 1, 2}, {0, 2, 3}};
  const TriangleSurface walled = with_border_walls(s, {}, -3);
  EXPECT_EQ(walled.triangles.size(), 4u);  // it goes on below its foot
  for (const auto& t : walled.triangles) {
    const Vec3 n =
        (walled.vertices[t[1]] - walled.vertices[t[0]]).cross(walled.vertices[t[2]] - walled.vertices[t[0]]);
    EXPECT_GT(n.x(), 0);
    EXPECT_NEAR(n.y(), 0, 1e-12);
  }
}
