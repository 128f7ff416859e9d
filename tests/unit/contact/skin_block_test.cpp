// A block beside the skin of a structure, which ends in edges and corners.
#include "contact/skin/skin_block.hpp"

#include <gtest/gtest.h>

#include "contact/detection/detect.hpp"
#include "detect_shapes.hpp"

namespace talus::contact {
namespace {

using namespace testing;

/// The skin of a bar about the origin, a face on each side, turned by R.
TriangleSurface bar(const Vec3& size, const Mat3& turn) {
  TriangleSurface s;
  const auto add = [&](const Vec3& x, const TriangleSurface::NodeWeights& nodes) {
    s.vertices.push_back(turn * x);
    s.nodes.push_back(nodes);
    return static_cast<int>(s.vertices.size()) - 1;
  };
  for (int k = 0; k < 8; ++k)
    add(0.5 * size.cwiseProduct(Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)),
        {1, {k, 0, 0, 0}, {1, 0, 0, 0}});
  for (const std::array<int, 4> corner :
       {std::array{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    Vec3 middle = Vec3::Zero();
    for (const int c : corner) middle += 0.25 * turn.transpose() * s.vertices[static_cast<std::size_t>(c)];
    const int centre = add(middle, {4, corner, {0.25, 0.25, 0.25, 0.25}});
    for (std::size_t c = 0; c < 4; ++c) {
      s.triangles.push_back({corner[c], corner[(c + 1) % 4], centre});
      s.parent_face.push_back(centre);
    }
  }
  s.velocities.assign(s.vertices.size(), Vec3::Zero());
  return s;
}

/// The least gap of a block above the bar, both turned by R; the margin where nothing is near.
double least_gap(const Mat3& turn, const Vec3& at, double margin) {
  const SurfaceIndex index(bar(Vec3(4, 0.6, 0.6), turn));
  std::vector<ContactPoint> contacts;
  skin_block(index, box(0.8, 0.9, 1.0), {turn * at, turn}, margin, contacts);
  double least = margin;
  for (const ContactPoint& c : contacts) least = std::min(least, c.gap);
  return least;
}

}  // namespace

/// Corners of a block that is wider than a bar lie before its edges, beside its sides and behind the side
/// beyond, which the block overlaps by nothing, however the two are turned.
TEST(SkinBlock, CornersBesideABarAreNotInsideIt) {
  for (const Vec3& way : {Vec3(0, 0, 0), Vec3(0.3, 0, 0), Vec3(0.3, -0.2, 0.5), Vec3(1.2, 0.9, -2.2)}) {
    const Mat3 turn = way.isZero() ? Mat3(Mat3::Identity())
                                   : Eigen::AngleAxisd(way.norm(), way.normalized()).toRotationMatrix();
    for (const double gap : {0.001, 0.02, 0.1})
      EXPECT_NEAR(least_gap(turn, Vec3(0.2, 0.05, 0.8 + gap), 0.2), gap, 1e-12) << way.transpose();
    EXPECT_NEAR(least_gap(turn, Vec3(0.2, 0.05, 0.79), 0.2), -0.01, 1e-12) << way.transpose();
  }
}

}  // namespace talus::contact
