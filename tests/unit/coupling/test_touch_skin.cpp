// Points on a face of a skin in terms of its nodes.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "contact/structures/node_surface.hpp"
#include "coupling/touch/touch.hpp"

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
  for (std::size_t i = 0; i < 4; ++i)
    skin.nodes.back().node[i] = 10 + static_cast<int>(i), skin.nodes.back().weight[i] = 0.25;
  return skin;
}

/// Columns are measured from the face's mean plane: what turns and shifts that moves them, and what only
/// warps the face does not. A row that did work on the warp made energy.
TEST(SkinWeights, OfABedGoWithTheMeanPlane) {
  const TriangleSurface skin = warped_face();
  Touch t;
  t.at.face_a = 2;
  t.normal_law.bed = std::make_shared<const contact::Bed>(std::vector<contact::Column>{}, Vec3::UnitZ(), 0.0,
                                                          1.0, 1.0, 0.0, 0.0);
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
  const Vec3 normal =
      (skin.vertices[2] - skin.vertices[0]).cross(skin.vertices[3] - skin.vertices[1]).normalized();
  EXPECT_NEAR(sum, 1, 1e-14);
  EXPECT_LT((point - x).cross(normal).norm(), 1e-14);
  EXPECT_NEAR(warp, 0, 1e-14);
}

/// A sheet of n x n faces of 1 m below or above z = height, outward up or down, as the skin of a structure
/// has it.
TriangleSurface sheet(int n, double height, bool up) {
  TriangleSurface skin;
  const auto add = [&](const Vec3& x, int count, std::array<int, 4> node) {
    skin.vertices.push_back(x);
    skin.velocities.push_back(Vec3::Zero());
    TriangleSurface::NodeWeights w;
    w.count = count;
    w.node = node;
    w.weight.fill(1.0 / count);
    skin.nodes.push_back(w);
  };
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) add(Vec3(i, j, height), 1, {j * (n + 1) + i, 0, 0, 0});
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int first = j * (n + 1) + i;
      std::array<int, 4> node{first, first + 1, first + n + 2, first + n + 1};
      if (!up) std::swap(node[1], node[3]);
      const int centre = static_cast<int>(skin.vertices.size());
      add(Vec3(i + 0.5, j + 0.5, height), 4, node);
      for (std::size_t k = 0; k < 4; ++k) {
        skin.triangles.push_back({node[k], node[(k + 1) % 4], centre});
        skin.parent_face.push_back(j * n + i);
      }
    }
  return skin;
}

/// Of two skins whose indices follow only what lies near the other, nodes and faces are found as if they
/// followed all, also after both have moved.
TEST(SurfaceFocus, FindsWhatTheWholeSkinFinds) {
  constexpr double reach = 0.4, followed = 0.8;
  TriangleSurface below = sheet(12, 0, true), above = sheet(3, 0.3, false);
  for (Vec3& x : above.vertices) x += Vec3(6.3, 5.2, 0);
  contact::SurfaceIndex all_below(below), all_above(above), part_below(below), part_above(above);
  const auto boxes = [&](const TriangleSurface& skin) {
    std::vector<Box3> of;
    for (std::size_t t = 0; t < skin.triangles.size(); t += 4) {
      Box3 box;
      for (std::size_t k = 0; k < 4; ++k)
        box.extend(skin.vertices[static_cast<std::size_t>(skin.triangles[t + k][0])]);
      box.min().array() -= followed;
      box.max().array() += followed;
      of.push_back(box);
    }
    return of;
  };
  part_below.focus(below, boxes(above));
  part_above.focus(above, boxes(below));
  for (Vec3& x : below.vertices) x.z() += 0.05 * std::sin(x.x()) * std::cos(2 * x.y());
  for (Vec3& x : above.vertices) x += Vec3(0.1, -0.15, -0.05 * x.x() / 6);
  for (contact::SurfaceIndex* index : {&all_below, &part_below}) index->refit(below);
  for (contact::SurfaceIndex* index : {&all_above, &part_above}) index->refit(above);
  std::vector<int> all, part;
  contact::nodes_near(all_above, all_below, reach, all);
  contact::nodes_near(part_above, part_below, reach, part);
  EXPECT_EQ(all, part);
  ASSERT_EQ(all.size(), 16u);
  for (const int v : all) {
    const Vec3 tributary = contact::tributary_area(all_above, v);
    EXPECT_EQ(tributary, contact::tributary_area(part_above, v));
    contact::ContactPoint a, b;
    ASSERT_TRUE(contact::node_surface(all_below, above.vertices[static_cast<std::size_t>(v)],
                                      tributary.normalized(), reach, a));
    ASSERT_TRUE(contact::node_surface(part_below, above.vertices[static_cast<std::size_t>(v)],
                                      tributary.normalized(), reach, b));
    EXPECT_EQ(a.gap, b.gap);
    EXPECT_EQ(a.face_a, b.face_a);
    EXPECT_EQ(a.normal, b.normal);
  }
}

}  // namespace
}  // namespace talus::coupling
