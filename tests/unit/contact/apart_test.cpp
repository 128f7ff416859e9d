// Planes that prove two bodies apart.
#include <gtest/gtest.h>

#include "contact/detection/detect.hpp"
#include "contact/geometry/apart.hpp"
#include "helpers/shapes.hpp"

namespace talus::contact {
namespace {

/// A slab of 10 x 10 x 1 m that leans at 45 degrees.
struct Slab {
  Polyhedron shape = test::cuboid(Vec3(10, 10, 1));
  Pose pose;
  Vec3 normal;
  Slab() {
    pose.F = Eigen::AngleAxisd(M_PI / 4, Vec3::UnitX()).toRotationMatrix();
    normal = pose.F.col(2);
  }
};

TEST(Apart, ObliqueSlabsWhoseBoxesOverlap) {
  const Slab slab;
  const Polyhedron cube = test::cuboid(Vec3::Ones());
  Pose pose;
  pose.F = slab.pose.F;
  pose.c = 3 * slab.normal + 2 * slab.pose.F.col(0) + 3 * slab.pose.F.col(1);  // 2 m between the faces
  ASSERT_TRUE(bounds(slab.shape, slab.pose).intersects(bounds(cube, pose)));
  EXPECT_TRUE(apart(slab.shape, slab.pose, cube, pose, 1.99));
  EXPECT_FALSE(apart(slab.shape, slab.pose, cube, pose, 2.01));
  EXPECT_TRUE(apart(cube, pose, slab.shape, slab.pose, 1.99));
  pose.c = 0.9 * slab.normal;  // in each other
  EXPECT_FALSE(apart(slab.shape, slab.pose, cube, pose, 0));
}

/// Two cubes edge across edge: no face of either lies before the other, only the direction across both edges
/// parts them.
TEST(Apart, EdgesAcrossEachOther) {
  const Polyhedron cube = test::cuboid(Vec3::Ones());
  const double half = std::sqrt(0.5);  // of a cube's height on its edge
  Pose low, high;
  low.F = Eigen::AngleAxisd(M_PI / 4, Vec3::UnitX()).toRotationMatrix();
  high.F = Eigen::AngleAxisd(M_PI / 4, Vec3::UnitY()).toRotationMatrix();
  high.c = Vec3(0.3, -0.4, 2 * half + 0.1);
  EXPECT_TRUE(apart(cube, low, cube, high, 0.0999));
  EXPECT_FALSE(apart(cube, low, cube, high, 0.1001));
  high.c.z() -= 0.2;
  EXPECT_FALSE(apart(cube, low, cube, high, 0));
}

TEST(Apart, TrianglesBeyondAllOrBeforeAFace) {
  const Slab slab;
  TriangleSurface s;  // one triangle parallel to the slab, 2 m before its face, another below its underside
  const Vec3 a = slab.pose.F.col(0), b = slab.pose.F.col(1), up = 2.5 * slab.normal,
             down = -4.5 * slab.normal;
  s.vertices = {up, up + a, up + b, down, down + b, down + a};
  s.triangles = {{0, 1, 2}, {3, 4, 5}};
  const SurfaceIndex index(s);
  ASSERT_TRUE(index.overlaps(bounds(slab.shape, slab.pose)));
  EXPECT_TRUE(apart(index, slab.shape, slab.pose, 1.99));
  EXPECT_FALSE(apart(index, slab.shape, slab.pose, 2.01));
}

}  // namespace
}  // namespace talus::contact
