#include <gtest/gtest.h>

#include <cmath>

#include "contact/detection/detect.hpp"
#include "contact/skin/skin_block.hpp"
#include "detect_shapes.hpp"

namespace talus::contact {
namespace {

using namespace testing;

/// The upper side of a plate of n x n faces of one metre, dented; the faces of a hole are missing.
TriangleSurface plate(int n, double dent, int hole, std::uint64_t revision) {
  TriangleSurface s;
  s.revision = revision;
  const auto height = [&](double x, double y) { return dent * std::sin(0.9 * x + 0.1) * std::cos(0.7 * y); };
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) {
      s.vertices.emplace_back(j, i, height(j, i));
      s.nodes.push_back({1, {static_cast<int>(s.nodes.size()), 0, 0, 0}, {1, 0, 0, 0}});
    }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      if (i * n + j < hole) continue;
      const int k = i * (n + 1) + j;
      const std::array<int, 4> corner{k, k + 1, k + n + 2, k + n + 1};
      const int centre = static_cast<int>(s.vertices.size());
      Vec3 x = Vec3::Zero();
      for (const int c : corner) x += 0.25 * s.vertices[static_cast<std::size_t>(c)];
      s.vertices.push_back(x);
      s.nodes.push_back({4, corner, {0.25, 0.25, 0.25, 0.25}});
      for (std::size_t c = 0; c < 4; ++c) {
        s.triangles.push_back({corner[c], corner[(c + 1) % 4], centre});
        s.parent_face.push_back(centre);
      }
    }
  s.velocities.assign(s.vertices.size(), Vec3(0, 0, dent));
  return s;
}

const Polyhedron block = box(2.2, 1.7, 1.0);

std::vector<ContactPoint> contacts_at(const SurfaceIndex& index, const Vec3& at) {
  std::vector<ContactPoint> out;
  skin_block(index, block,
             {at, Quat(Eigen::AngleAxisd(0.3, Vec3(0.1, 0.2, 1).normalized())).toRotationMatrix()}, 0.1, out);
  return out;
}

/// Contacts on the index that follows a part are to the bit those on one made anew.
void expect_same(const SurfaceIndex& part, const TriangleSurface& s, const Vec3& at) {
  SurfaceIndex whole(s);
  whole.refit(s);
  const auto a = contacts_at(part, at), b = contacts_at(whole, at);
  ASSERT_EQ(a.size(), b.size());
  ASSERT_FALSE(b.empty());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].key, b[i].key);
    EXPECT_EQ(a[i].gap, b[i].gap);
    EXPECT_EQ(a[i].area, b[i].area);
    EXPECT_EQ(a[i].face_a, b[i].face_a);
    EXPECT_EQ(a[i].normal, b[i].normal);
    EXPECT_EQ(a[i].point_a, b[i].point_a);
    if (a[i].face_a < 0) continue;  // an edge or a vertex
    for (const int v : s.triangles[static_cast<std::size_t>(a[i].face_a)])
      EXPECT_EQ(part.surface().velocities[static_cast<std::size_t>(v)],
                s.velocities[static_cast<std::size_t>(v)]);
  }
}

TEST(SurfaceFocus, FollowsThePartThatIsAskedForThroughMotionAndErosion) {
  const int n = 24;
  const Vec3 near(8.3, 9.1, 0.5), far(20.2, 20.4, 0.5);
  TriangleSurface s = plate(n, 0, 0, 1);
  SurfaceIndex index(s);
  index.refit(s);
  index.focus(s, {bounds(block, {near}, 0.5)});
  expect_same(index, s, near);
  EXPECT_TRUE(contacts_at(index, far).empty());  // outside, and told so in detect.hpp
  s = plate(n, 0.01, 0, 1);
  index.refit(s);
  expect_same(index, s, near);
  s = plate(n, 0.02, 8 * n + 9, 2);  // faces beside the block are gone, all others have new numbers
  index.refit(s);
  expect_same(index, s, near);
  s = plate(n, 0.03, 8 * n + 9, 2);
  index.refit(s);
  expect_same(index, s, near);
  index.focus(s, {bounds(block, {far}, 0.5)});
  expect_same(index, s, far);
  index.unfocus(s);
  expect_same(index, s, near);
  expect_same(index, s, far);
  EXPECT_TRUE(index.bounds().isApprox(SurfaceIndex(s).bounds()));
}

}  // namespace
}  // namespace talus::contact
