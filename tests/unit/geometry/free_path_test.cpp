#include "geometry/free_path.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/turn.hpp"
#include "geometry/shape.hpp"

using namespace talus;
using namespace talus::geometry;

namespace {

Polyhedron cube_with_edge(double edge) {
  ShapeSpec s;
  s.kind = "box";
  s.size = Vec3::Constant(edge);
  return make_shape(s);
}

/// A quadrilateral of two triangles.
TriangleSurface quadrilateral(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  TriangleSurface s;
  s.vertices = {a, b, c, d};
  s.triangles = {{0, 1, 2}, {0, 2, 3}};
  return s;
}

Mat3 turn(double angle, const Vec3& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

}  // namespace

TEST(FreePath, FaceBeforeFace) {
  const TriangleSurface wall = quadrilateral({3, -5, -5}, {3, -5, 5}, {3, 5, 5}, {3, 5, -5});
  EXPECT_NEAR(free_path(cube_with_edge(2), {Vec3(0.5, 0, 0), Mat3::Identity()}, wall, Vec3::UnitX()), 1.5,
              1e-14);
  EXPECT_TRUE(std::isinf(
      free_path(cube_with_edge(2), {Vec3(0.5, 0, 0), Mat3::Identity()}, wall, -Vec3::UnitX())));  // behind
  EXPECT_TRUE(std::isinf(
      free_path(cube_with_edge(2), {Vec3(0.5, 7, 0), Mat3::Identity()}, wall, Vec3::UnitX())));  // beside
}

TEST(FreePath, ObliqueFlightTouchesWithTheSideNotWithTheForemostCorner) {
  // A cube's flat face before a wall, flown at 60 degrees from its normal: the gap of 1 m is met after 1 /
  // cos 60 m.
  const TriangleSurface wall = quadrilateral({2, -50, -50}, {2, -50, 50}, {2, 50, 50}, {2, 50, -50});
  const double a = M_PI / 3;
  EXPECT_NEAR(free_path(cube_with_edge(2), {Vec3::Zero(), Mat3::Identity()}, wall,
                        Vec3(std::cos(a), 0, -std::sin(a))),
              2, 1e-13);
}

TEST(FreePath, CornerBeforeFaceAndEdgeAcrossEdge) {
  // On its corner a cube of edge 1 reaches sqrt(3) / 2.
  const Mat3 on_corner = turn_between(Vec3(1, 1, 1), Vec3(0, 0, -1)).toRotationMatrix();
  const TriangleSurface floor = quadrilateral({-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0});
  EXPECT_NEAR(free_path(cube_with_edge(1), {Vec3(0.1, 0.2, 5), on_corner}, floor, -Vec3::UnitZ()),
              5 - std::sqrt(3) / 2, 1e-13);
  // An edge, turned to face down and along x, above the ridge of a roof along y: they cross between their
  // ends.
  TriangleSurface roof;
  roof.vertices = {{0, -3, 1}, {0, 3, 1}, {2, 3, 0}, {2, -3, 0}, {-2, 3, 0}, {-2, -3, 0}};
  roof.triangles = {{0, 3, 2}, {0, 2, 1}, {0, 1, 4}, {0, 4, 5}};
  EXPECT_NEAR(
      free_path(cube_with_edge(2), {Vec3(0.3, 0.4, 6), turn(M_PI / 4, Vec3::UnitX())}, roof, -Vec3::UnitZ()),
      5 - std::sqrt(2), 1e-13);
}

/// A box is a closed surface: a cube that crosses its faces, lies in it, or holds it, has a corner inside.
TEST(FreePath, CornersInside) {
  const Polyhedron box = cube_with_edge(2), small = cube_with_edge(0.5), large = cube_with_edge(9);
  TriangleSurface surface;
  surface.vertices = box.vertices;
  surface.triangles = box.triangles;
  const auto at = [](double x) { return Pose{Vec3(x, 0.1, 0), Mat3::Identity()}; };
  EXPECT_TRUE(corner_inside(small, at(0), surface));
  EXPECT_TRUE(corner_inside(large, at(0), surface));
  EXPECT_TRUE(corner_inside(small, at(1.1), surface));
  EXPECT_TRUE(corner_inside(large, at(5), surface));
  EXPECT_FALSE(corner_inside(small, at(1.3), surface));
  EXPECT_FALSE(corner_inside(large, at(5.6), surface));
}
