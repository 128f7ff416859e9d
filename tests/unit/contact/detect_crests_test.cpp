// Blocks on crests of the ground, beside the crests' corners.
#include <gtest/gtest.h>

#include <algorithm>

#include "contact/geometry/surface_index.hpp"
#include "detect_shapes.hpp"

namespace talus::contact::testing {
namespace {

/// A box on a level crest, one side of it beside a corner of the crest: however near that is, and however
/// deep it has sunk, it is held upwards by what it has sunk.
TEST(SurfaceContact, ABoxOnACrestIsHeldHoweverNearTheCrestsCorner) {
  TriangleSurface
      s;  // a roof along x, with a corner of its crest at the origin, off to the side a little beyond
  s.vertices = {{-4, 0, 0},  {0, 0, 0},   {4, 0.7, 0}, {-4, -3, -2}, {0, -3, -2.5},
                {4, -3, -2}, {-4, 3, -2}, {0, 3, -2},  {4, 4, -2.2}};
  s.triangles = {{3, 4, 1}, {3, 1, 0}, {4, 5, 2}, {4, 2, 1}, {0, 1, 7}, {0, 7, 6}, {1, 2, 8}, {1, 8, 7}};
  const SurfaceIndex index(s);
  const Polyhedron& block = cube;
  for (const double depth : {1e-9, 6e-9, 1e-7, 1e-5, 1e-3})
    for (const double off : {0.0, 1e-12, 1e-10, 3e-10, 6e-10, 1e-9, 2e-9, 5e-9, 1e-8, 1e-6, 1e-4, 1e-2,
                             -1e-12, -1e-10, -1e-9, -2e-9, -1e-8, -1e-6, -1e-4})
      for (const double side : {1.0, -1.0})
        for (const double turn : {0.0, 0.3, 0.7}) {
          // Its side at x = off, out to where the crest goes on.
          const Mat3 R = Eigen::AngleAxisd(side > 0 ? turn : M_PI + turn, Vec3::UnitZ()).toRotationMatrix();
          const Vec3 centre = R * Vec3(0.5 + off, 0.1, 0) + Vec3(0, 0, 0.5 - depth);
          std::vector<ContactPoint> points;
          surface_block(index, block, {centre, R}, 1e-2, points);
          const bool held = std::ranges::any_of(points, [&](const ContactPoint& p) {
            return p.normal.z() > 0.99 && p.point_a.norm() < 0.05 &&
                   std::abs(p.gap + depth) < 1e-2 * depth + 1e-12;
          });
          EXPECT_TRUE(held) << "depth " << depth << ", beside " << off << ", side " << side << ", turn "
                            << turn;
        }
}

}  // namespace
}  // namespace talus::contact::testing
