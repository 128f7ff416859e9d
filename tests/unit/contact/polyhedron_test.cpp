#include <gtest/gtest.h>

#include "core/error.hpp"
#include "detect_shapes.hpp"

namespace talus::contact::testing {
namespace {

std::string key_of_error(const std::vector<Vec3>& v, const Triangles& t) {
  try {
    make_polyhedron(v, t);
  } catch (const InputError& e) { return e.problems().at(0).key + " | " + e.problems().at(0).rule; }
  return "";
}

const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const Triangles tetrahedron{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

TEST(Polyhedron, BoxHasSixFacesAndTwelveConvexEdges) {
  const auto p = box(2, 3, 4);
  EXPECT_EQ(p.faces(), 6);
  EXPECT_EQ(p.edges.size(), 12u);
  EXPECT_TRUE(p.convex);
  EXPECT_DOUBLE_EQ(p.radius, std::sqrt(1 + 2.25 + 4));
  EXPECT_DOUBLE_EQ(p.inradius, 1.0);
  for (const auto& e : p.edges) EXPECT_NEAR(e.sine, 1.0, 1e-15);
  EXPECT_EQ(p.axis_faces.size(), 3u);
  EXPECT_EQ(p.axis_edges.size(), 3u);
  for (int f = 0; f < 6; ++f) EXPECT_EQ(p.face_offset[f + 1] - p.face_offset[f], 4);
}

TEST(Polyhedron, FacesRunCounterClockwiseAndEdgesFollowTheirLeftFace) {
  std::mt19937 rng(3);
  const auto p = hull(sphere_points(20, 1.0, rng));
  for (int f = 0; f < p.faces(); ++f) {
    const auto at = [&](int k) { return p.vertices[p.face_vertices[p.face_offset[f] + k]]; };
    EXPECT_GT((at(1) - at(0)).cross(at(2) - at(0)).dot(p.face_normals[f]), 0);
    EXPECT_GT(at(0).dot(p.face_normals[f]), 0);
  }
  for (const auto& e : p.edges) {
    EXPECT_GT(e.sine, 0);
    bool found = false;
    const int first = p.face_offset[e.left], n = p.face_offset[e.left + 1] - first;
    for (int k = 0; k < n; ++k)
      found |= p.face_vertices[first + k] == e.v0 && p.face_vertices[first + (k + 1) % n] == e.v1;
    EXPECT_TRUE(found);
  }
  // Euler: V - E + F = 2
  EXPECT_EQ(static_cast<int>(p.vertices.size() + p.faces()) - static_cast<int>(p.edges.size()), 2);
}

TEST(Polyhedron, LShapeMergesCapsAndKnowsItsReentrantEdge) {
  const auto p = prism({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}},
                       {{0, 1, 2}, {0, 2, 3}, {0, 3, 5}, {3, 4, 5}}, 0, 1);
  EXPECT_EQ(p.faces(), 8);
  EXPECT_EQ(p.edges.size(), 18u);
  EXPECT_FALSE(p.convex);
  int reentrant = 0;
  for (const auto& e : p.edges) reentrant += e.sine < 0;
  EXPECT_EQ(reentrant, 1);
}

TEST(Polyhedron, FaceWithAHoleIsSplitWithoutAnInternalEdge) {
  // A square block with a square hole through it: outer corners 0-3, inner 4-7 below; 8-15 above.
  std::vector<Vec3> v;
  for (const double z : {0.0, 1.0}) {
    for (const auto& [x, y] : {std::pair{-2., -2.}, {2., -2.}, {2., 2.}, {-2., 2.}}) v.emplace_back(x, y, z);
    for (const auto& [x, y] : {std::pair{-1., -1.}, {1., -1.}, {1., 1.}, {-1., 1.}}) v.emplace_back(x, y, z);
  }
  Triangles t;
  for (int i = 0; i < 4; ++i) {
    const int j = (i + 1) % 4;
    t.push_back({8 + i, 8 + j, 12 + j});
    t.push_back({8 + i, 12 + j, 12 + i});
    t.push_back({i, 4 + j, j});
    t.push_back({i, 4 + i, 4 + j});
    t.push_back({i, j, 8 + j});
    t.push_back({i, 8 + j, 8 + i});
    t.push_back({4 + i, 12 + j, 4 + j});
    t.push_back({4 + i, 12 + i, 12 + j});
  }
  const auto p = make_polyhedron(v, t);
  EXPECT_EQ(p.edges.size(), 24u);  // 4 outer + 4 inner verticals, 8 above, 8 below: no seam
  EXPECT_FALSE(p.convex);
  double area = 0;
  for (int f = 0; f < p.faces(); ++f) {
    Vec3 a = Vec3::Zero();
    for (int k = p.face_offset[f] + 1; k + 1 < p.face_offset[f + 1]; ++k) {
      const Vec3& o = p.vertices[p.face_vertices[p.face_offset[f]]];
      a += 0.5 * (p.vertices[p.face_vertices[k]] - o).cross(p.vertices[p.face_vertices[k + 1]] - o);
    }
    area += a.dot(p.face_normals[f]);
  }
  EXPECT_NEAR(area, 2 * (16 - 4) + 16 + 8, 1e-12);
}

TEST(Polyhedron, NearlyCoplanarRoundOffStillMerges) {
  std::mt19937 rng(5);
  const auto p = box(1, 1, 1);
  for (int i = 0; i < 50; ++i) {
    const Mat3 R = random_rotation(rng);
    std::vector<Vec3> v;
    for (const auto& x : p.vertices) v.push_back(R * x);
    const auto q = make_polyhedron(v, p.triangles);
    EXPECT_EQ(q.faces(), 6);
    EXPECT_TRUE(q.convex);
  }
}

TEST(Polyhedron, OpenSurfaceNamesTheEdge) {
  Triangles t(tetrahedron.begin(), tetrahedron.end());
  t.back() = {0, 3, 1};  // now 0-2 is left open
  const auto e = key_of_error(corners, t);
  EXPECT_NE(e.find("mesh edge 0-"), std::string::npos) << e;
}

TEST(Polyhedron, MissingTriangleNamesTheEdge) {
  auto v = corners;
  v.emplace_back(1, 1, 1);
  const auto p = box(1, 1, 1);
  Triangles t(p.triangles.begin(), p.triangles.end() - 1);
  const auto e = key_of_error(p.vertices, t);
  EXPECT_NE(e.find("mesh edge 1-5"), std::string::npos) << e;
  EXPECT_NE(e.find("open"), std::string::npos) << e;
}

TEST(Polyhedron, FlippedTriangleNamesTheEdge) {
  Triangles t = tetrahedron;
  std::swap(t[0][1], t[0][2]);
  const auto e = key_of_error(corners, t);
  EXPECT_NE(e.find("mesh edge 0-1"), std::string::npos) << e;
  EXPECT_NE(e.find("oriented"), std::string::npos) << e;
}

TEST(Polyhedron, InsideOutIsRejected) {
  Triangles t = tetrahedron;
  for (auto& x : t) std::swap(x[1], x[2]);
  EXPECT_NE(key_of_error(corners, t).find("seen from outside"), std::string::npos);
}

TEST(Polyhedron, SharedEdgeOfTwoBodiesIsNonmanifold) {
  auto v = corners;
  v.emplace_back(-1, 0, 0);
  v.emplace_back(0, -1, 0.3);
  Triangles t = tetrahedron;  // a second tetrahedron 0 3 4 5 on edge 0-3
  for (const auto& x : Triangles{{0, 4, 5}, {0, 5, 3}, {5, 4, 3}, {0, 3, 4}}) t.push_back(x);
  const auto e = key_of_error(v, t);
  EXPECT_NE(e.find("mesh edge 0-3"), std::string::npos) << e;
}

}  // namespace
}  // namespace talus::contact::testing
