#include "geometry/slivers.hpp"

#include <gtest/gtest.h>

#include <map>

#include "geometry/mesh.hpp"

namespace talus::geometry {
namespace {

Mesh unit_cube() {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i) corners.emplace_back(i & 1, i >> 1 & 1, i >> 2);
  return convex_hull(corners);
}

void expect_closed(const std::vector<std::array<int, 3>>& triangles) {
  std::map<std::pair<int, int>, int> sides;
  for (const auto& t : triangles)
    for (int k = 0; k < 3; ++k) ++sides[{t[k], t[(k + 1) % 3]}];
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(sides.contains({side.second, side.first}));
  }
}

double least_height(const Mesh& m) {
  double least = 1e300;
  for (const auto& t : m.triangles) {
    double longest = 0;
    for (int k = 0; k < 3; ++k)
      longest = std::max(longest, (m.vertices[t[(k + 1) % 3]] - m.vertices[t[k]]).norm());
    const Vec3 n = (m.vertices[t[1]] - m.vertices[t[0]]).cross(m.vertices[t[2]] - m.vertices[t[0]]);
    least = std::min(least, n.norm() / longest);
  }
  return least;
}

/// A vertex within h of the middle of a side, or of an end of it, with triangles of that height.
TEST(Slivers, GoWithTheirNeighboursAndTheBodyStaysClosed) {
  for (const double h : {1e-14, 1e-12, 3e-11})
    for (const double along : {0.5, 1 - h}) {
      Mesh cube = unit_cube();
      const auto [a, b, c] = cube.triangles[0];
      const Vec3 &p = cube.vertices[a], &q = cube.vertices[b], &r = cube.vertices[c];
      const int v = static_cast<int>(cube.vertices.size());
      const Vec3 at = p + along * (q - p) + h * (r - p);
      cube.triangles[0] = {a, b, v};
      cube.triangles.push_back({b, c, v});
      cube.triangles.push_back({c, a, v});
      cube.vertices.push_back(at);
      ASSERT_LT(least_height(cube), 2 * h);
      const std::vector<int> source = remove_slivers(cube.vertices, cube.triangles, 1e-10);
      ASSERT_EQ(source.size(), cube.triangles.size());
      expect_closed(cube.triangles);
      EXPECT_GT(least_height(cube), 0.1) << h << " " << along;
      EXPECT_NEAR(signed_volume(cube.vertices, cube.triangles), 1, 1e-10);
    }
}

TEST(Slivers, WhatIsThickEnoughStaysAsItIs) {
  Mesh cube = unit_cube();
  const auto before = cube.triangles;
  const std::vector<int> source = remove_slivers(cube.vertices, cube.triangles, 1e-10);
  EXPECT_EQ(cube.triangles, before);
  for (std::size_t t = 0; t < source.size(); ++t) EXPECT_EQ(source[t], static_cast<int>(t));
}

}  // namespace
}  // namespace talus::geometry
