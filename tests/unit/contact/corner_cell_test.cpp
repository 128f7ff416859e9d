// Cells of corners: together they are the area of the body across the normal; a cube's tip and edge as they
// are cut.
#include "contact/geometry/corner_cell.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "detect_shapes.hpp"

namespace talus::contact::testing {
namespace {

double area_across(const Polyhedron& body, const Vec3& n) {
  double area = 0;
  for (const auto& t : body.triangles) {
    const Vec3 a = body.vertices[static_cast<std::size_t>(t[0])],
               b = body.vertices[static_cast<std::size_t>(t[1])],
               c = body.vertices[static_cast<std::size_t>(t[2])];
    area += std::max(0.0, -0.5 * n.dot((b - a).cross(c - a)));
  }
  return area;
}

int lowest(const Polyhedron& body, const Vec3& n) {
  int best = 0;
  for (std::size_t v = 1; v < body.vertices.size(); ++v)
    if (n.dot(body.vertices[v]) < n.dot(body.vertices[static_cast<std::size_t>(best)]))
      best = static_cast<int>(v);
  return best;
}

TEST(CornerCell, CellsOfAllCornersAreTheAreaAcrossTheNormal) {
  std::mt19937 rng(7);
  for (const Polyhedron& body :
       {box(1, 2, 3), hull(sphere_points(12, 1.0, rng)), hull(sphere_points(300, 1.0, rng))})
    for (const Vec3& n : {Vec3(0, 0, 1), Vec3(1, 2, 2).normalized(), Vec3(-0.3, 0.1, 0.7).normalized()})
      for (const bool divided : {false, true}) {
        double sum = 0;
        for (int v = 0; v < static_cast<int>(body.vertices.size()); ++v)
          sum += corner_cell(body, v, n, divided).area;
        if (!divided) EXPECT_NEAR(sum, area_across(body, n), 1e-12);
        EXPECT_LE(sum, area_across(body, n) + 1e-12);  // the rest is that of the points between
      }
}

TEST(CornerCell, TipOfACubeIsCutAsItSinks) {
  // Three planes of a right angle about n = (1, 1, 1): at a depth d the cut is 3 sqrt(3)/2 d^2, the volume
  // sqrt(3)/2 d^3.
  const Polyhedron cube = box(1, 1, 1);
  const Vec3 n = Vec3::Ones().normalized();
  const CornerCell cell = corner_cell(cube, lowest(cube, n), n, false);
  EXPECT_NEAR(cell.area, 3 * 0.25 / std::sqrt(3.0), 1e-12);
  const CornerArea growing(cell.triangles);
  for (const double d : {0.01, 0.1, 0.25}) {
    EXPECT_NEAR(cell.area * growing.part(d), 1.5 * std::sqrt(3.0) * d * d, 1e-12);
    EXPECT_NEAR(cell.area * growing.volume(d), 0.5 * std::sqrt(3.0) * d * d * d, 1e-12);
    EXPECT_NEAR(growing.depth_of(growing.volume(d)), d, 1e-9);
    EXPECT_NEAR(growing.depth_of_square(growing.square(d)), d, 1e-9);
  }
}

TEST(CornerCell, EdgeAlongTheGroundGrowsByItsLength) {
  for (const double length : {1.0, 20.0}) {
    const Polyhedron beam = box(length, 1, 1);
    const Vec3 n = Vec3(0, 1, 1).normalized();
    const CornerCell cell = corner_cell(beam, lowest(beam, n), n, false);
    const CornerArea growing(cell.triangles);
    for (const double d : {0.01, 0.1, 0.3})
      EXPECT_NEAR(cell.area * growing.part(d), length * d, 1e-12 * length);
  }
}

TEST(CornerCell, PartVolumeAndSquareAreIntegralsOfEachOther) {
  const CornerArea a({{0.3, {0, 0.01, 0.03}}, {0.7, {0.02, 0.06, 0.2}}, {0.2, {0.05, 0.05, 0.05}}});
  for (double x = 0.003; x < 0.3; x += 0.0117) {
    const double d = 1e-6;
    EXPECT_NEAR((a.volume(x + d) - a.volume(x - d)) / (2 * d), a.part(x), 1e-4);
    EXPECT_NEAR((a.square(x + d) - a.square(x - d)) / (2 * d), a.volume(x), 1e-8);
  }
  EXPECT_EQ(a.part(0), 0);
  EXPECT_EQ(a.volume(-1), 0);
}

}  // namespace
}  // namespace talus::contact::testing
