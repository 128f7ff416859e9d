// Points on a face of a skin in terms of its nodes.
#include <gtest/gtest.h>

#include <memory>

#include "coupling/touch.hpp"

namespace talus::coupling {
namespace {

/// A face whose corners lie out of one plane, nodes 10 to 13.
TriangleSurface warped_face() {
  TriangleSurface skin;
  skin.vertices = {{0, 0, 0.02}, {1, 0, -0.02}, {1.1, 0.9, 0.02}, {0, 1, -0.02}};
  Vec3 centre = Vec3::Zero();
  for (const Vec3& v : skin.vertices) centre += 0.25 * v;
  skin.vertices.push_back(centre);
  for (int i = 0; i < 4; ++i) {
    skin.triangles.push_back({i, (i + 1) % 4, 4});
    skin.nodes.emplace_back();
    skin.nodes.back().count = 1, skin.nodes.back().node[0] = 10 + i, skin.nodes.back().weight[0] = 1;
  }
  skin.nodes.emplace_back();
  skin.nodes.back().count = 4;
  for (std::size_t i = 0; i < 4; ++i) skin.nodes.back().node[i] = 10 + static_cast<int>(i), skin.nodes.back().weight[i] = 0.25;
  return skin;
}

/// Columns are measured from the face's mean plane: what turns and shifts that moves them, and what only warps the face does not. A row that did work on the warp
/// made energy.
TEST(SkinWeights, OfABedGoWithTheMeanPlane) {
  const TriangleSurface skin = warped_face();
  Touch t;
  t.at.face_a = 2;
  t.normal_law.bed = std::make_shared<const contact::Bed>(std::vector<contact::Column>{}, Vec3::UnitZ(), 0.0, 1.0, 1.0, 0.0, 0.0);
  const Vec3 x(0.3, 0.8, 0);
  const SurfaceWeights w = skin_weights(t, skin, x);
  ASSERT_EQ(w.count, 4);
  double sum = 0, warp = 0;
  Vec3 point = Vec3::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(w.node[i], 10 + static_cast<int>(i));
    sum += w.weight[i];
    point += w.weight[i] * skin.vertices[i];
    warp += w.weight[i] * (i % 2 == 0 ? 1 : -1);
  }
  const Vec3 normal = (skin.vertices[2] - skin.vertices[0]).cross(skin.vertices[3] - skin.vertices[1]).normalized();
  EXPECT_NEAR(sum, 1, 1e-14);
  EXPECT_LT((point - x).cross(normal).norm(), 1e-14);
  EXPECT_NEAR(warp, 0, 1e-14);
}

}  // namespace
}  // namespace talus::coupling
