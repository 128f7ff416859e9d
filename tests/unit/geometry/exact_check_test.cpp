#include "geometry/exact_check.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "geometry/cut.hpp"
#include "geometry/random.hpp"
#include "geometry/shape.hpp"
#include "geometry/terrain.hpp"

using namespace talus;
using namespace talus::geometry;

namespace {

Polyhedron cube(double a = 1) {
  ShapeSpec s;
  s.size = Vec3::Constant(a);
  return make_shape(s);
}

Pose at(const Vec3& c, const Mat3& r = Mat3::Identity()) {
  Pose p;
  p.c = c;
  p.F = r;
  return p;
}

TriangleSurface ground() {
  TriangleSurface s;
  s.vertices = {{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}};
  s.triangles = {{0, 1, 2}, {0, 2, 3}};
  return s;
}

}  // namespace

TEST(ExactCheck, CubesFaceToFace) {
  const Polyhedron c = cube();
  EXPECT_FALSE(
      deepest_intersection(c, at({0, 0, 0}), c, at({1, 0.2, 0.3}), 0).intersect);  // touching is not crossing
  const Overlap in = deepest_intersection(c, at({0, 0, 0}), c, at({1 - 0x1p-30, 0.2, 0.3}), 0);
  EXPECT_TRUE(in.intersect);
  EXPECT_NEAR(in.depth, 0x1p-30, 1e-16);
  EXPECT_NEAR(in.direction.x(), 1, 1e-14);
  // The tolerance is a sharp limit.
  EXPECT_FALSE(deepest_intersection(c, at({0, 0, 0}), c, at({1 - 0x1p-30, 0.2, 0.3}), 0x1p-30).intersect);
  EXPECT_TRUE(deepest_intersection(c, at({0, 0, 0}), c, at({1 - 0x1p-30, 0.2, 0.3}), 0x1p-31).intersect);
  const Overlap apart = deepest_intersection(c, at({0, 0, 0}), c, at({1.25, 0, 0}), 0);
  EXPECT_FALSE(apart.intersect);
}

TEST(ExactCheck, CrossedEdges) {
  const Polyhedron c = cube();
  const Mat3 a = Eigen::AngleAxisd(std::numbers::pi / 4, Vec3::UnitX()).toRotationMatrix();
  const Mat3 b = Eigen::AngleAxisd(std::numbers::pi / 4, Vec3::UnitY()).toRotationMatrix();
  const double touch = std::sqrt(2);  // edge over crossed edge
  const Overlap in = deepest_intersection(c, at({0, 0, 0}, a), c, at({0, 0, touch - 1e-6}, b), 1e-9);
  EXPECT_TRUE(in.intersect);
  EXPECT_NEAR(in.depth, 1e-6, 1e-12);
  EXPECT_FALSE(deepest_intersection(c, at({0, 0, 0}, a), c, at({0, 0, touch + 1e-12}, b), 0).intersect);
}

TEST(ExactCheck, BodyWithinBody) {
  const Overlap o = deepest_intersection(cube(3), at({0, 0, 0}), cube(1), at({0.2, 0, 0}), 1e-9);
  EXPECT_TRUE(o.intersect);
  EXPECT_NEAR(o.depth, 1.8, 1e-12);
}

TEST(ExactCheck, ConcaveBodyHoldsAnotherInItsNotch) {
  CutSpec s;
  s.box = Box3(Vec3::Zero(), Vec3::Constant(2));
  s.joints.push_back(
      {.name = "l", .through = Vec3(1, 1, 1), .polygon = {{1, -1, 1}, {3, -1, 1}, {3, 3, 1}, {1, 3, 1}}});
  s.joints.push_back({.name = "s",
                      .dip_direction = std::numbers::pi / 2,
                      .dip = std::numbers::pi / 2,
                      .through = Vec3(1, 1, 1),
                      .polygon = {{1, -1, 1}, {1, 3, 1}, {1, 3, 3}, {1, -1, 3}}});
  const CutResult r = cut(s);
  ASSERT_EQ(r.blocks.size(), 2u);
  const CheckedBody ell(r.blocks[0].body), brick(r.blocks[1].body);
  EXPECT_GT(ell.pieces().size(), 1u);
  const Pose pe = at(r.blocks[0].centroid), pb = at(r.blocks[1].centroid);
  EXPECT_FALSE(deepest_intersection(ell, pe, brick, pb, 1e-9).intersect);
  EXPECT_FALSE(deepest_intersection(ell, pe, brick, at(pb.c + Vec3(0.3, 0, 0.2)), 1e-9).intersect);
  const Overlap o = deepest_intersection(ell, pe, brick, at(pb.c - Vec3(0.1, 0, 0.2)), 1e-9);
  EXPECT_TRUE(o.intersect);
  EXPECT_NEAR(o.depth, 0.2, 1e-9);
}

TEST(ExactCheck, RandomPairsAgreeWithSampling) {
  Random random(3);
  ShapeSpec s;
  s.kind = "random-convex";
  s.volume = 1;
  s.aspect = {2, 1.5, 1};
  int intersecting = 0;
  for (int k = 0; k < 60; ++k) {
    s.seed = static_cast<unsigned>(k % 7);
    const Polyhedron a = make_shape(s);
    s.seed = static_cast<unsigned>(k % 5 + 10);
    const Polyhedron b = make_shape(s);
    const auto turn = [&] {
      return Eigen::AngleAxisd(random.uniform(0, 6), random.direction()).toRotationMatrix();
    };
    const Pose pa = at({0, 0, 0}, turn()), pb = at(random.direction() * random.uniform(0.5, 1.8), turn());
    const Overlap o = deepest_intersection(a, pa, b, pb, 1e-9);
    // A point well within both proves an intersection; moving b out by the depth must end it.
    const auto inside = [](const Polyhedron& p, const Pose& pose, const Vec3& x) {
      double depth = 1e9;
      const Vec3 local = pose.F.transpose() * (x - pose.c);
      for (int f = 0; f < p.faces(); ++f)
        depth = std::min(depth, p.face_normals[f].dot(p.vertices[p.face_vertices[p.face_offset[f]]] - local));
      return depth;
    };
    bool found = false;
    for (int i = 0; i < 4000 && !found; ++i) {
      const Vec3 x = pb.c * random.uniform() + random.direction() * random.uniform(0, 0.8);
      found = std::min(inside(a, pa, x), inside(b, pb, x)) > 1e-6;
    }
    if (found) { EXPECT_TRUE(o.intersect) << k; }
    if (o.intersect) {
      ++intersecting;
      EXPECT_FALSE(
          deepest_intersection(a, pa, b, at(pb.c + o.direction * (o.depth + 1e-12), pb.F), 1e-9).intersect)
          << k;
    }
  }
  EXPECT_GT(intersecting, 10);
  EXPECT_LT(intersecting, 55);
}

TEST(ExactCheck, CubeOnGround) {
  const CheckedSurface s(ground());
  const CheckedBody c(cube());
  EXPECT_FALSE(s.crossing(c, at({0.1, 0.2, 0.5}), 0).intersect);
  const Overlap in = s.crossing(c, at({0.1, 0.2, 0.5 - 1e-6}), 1e-9);
  EXPECT_TRUE(in.intersect);
  EXPECT_NEAR(in.depth, 1e-6, 1e-13);
  EXPECT_NEAR(in.direction.z(), 1, 1e-12);
  EXPECT_FALSE(s.crossing(c, at({0.1, 0.2, 0.5 - 1e-6}), 2e-6).intersect);
  // Mostly under the ground: pushed up, not through.
  EXPECT_NEAR(s.crossing(c, at({0.1, 0.2, -0.3}), 1e-9).depth, 0.8, 1e-12);
  // Wholly under it: no triangle is crossed, and yet it is found.
  const Overlap under = s.crossing(c, at({0, 0, -3}), 1e-9);
  EXPECT_TRUE(under.intersect);
  EXPECT_FALSE(s.crossing(c, at({20, 0, -3}), 1e-9).intersect);  // beside the ground
  EXPECT_TRUE(s.covers(0, 0));
  EXPECT_FALSE(s.covers(9, 0));
}

TEST(ExactCheck, SheetHasTwoSides) {
  TriangleSurface sheet = ground();
  sheet.two_sided = true;
  const CheckedSurface s(sheet);
  const CheckedBody c(cube());
  EXPECT_FALSE(s.crossing(c, at({0, 0, -0.5}), 0).intersect);
  EXPECT_NEAR(s.crossing(c, at({0, 0, -0.4}), 1e-9).depth, 0.1, 1e-12);
  EXPECT_FALSE(s.crossing(c, at({0, 0, -3}), 1e-9).intersect);
}

TEST(ExactCheck, PointOverAnEdgeOrVertexBelongsToOneTriangle) {
  // Fan of triangles about the origin: a vertical ray through the common vertex or edges must count once.
  TriangleSurface s;
  s.vertices = {{0, 0, 1},  {1, 0, 0},   {1, 1, 0},  {0, 1, 0}, {-1, 1, 0},
                {-1, 0, 0}, {-1, -1, 0}, {0, -1, 0}, {1, -1, 0}};
  for (int k = 1; k <= 8; ++k) s.triangles.push_back({0, k, k % 8 + 1});
  const CheckedSurface checked(s);
  for (const auto& [x, y] :
       {std::pair{0.0, 0.0}, {0.5, 0.5}, {0.5, 0.0}, {0.0, -0.25}, {-0.125, 0.125}, {0.3, 0.1}})
    EXPECT_TRUE(checked.solid_at({x, y, -1})) << x << " " << y;
}

TEST(ExactCheck, BlocksOfACutDoNotOverlap) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    CutSpec s;
    s.box = Box3(Vec3::Zero(), Vec3::Constant(6));
    Random random(seed);
    for (int k = 0; k < 3; ++k) {
      CutJointSet set;
      set.name = "s" + std::to_string(k);
      set.dip_direction = random.uniform(0, 6);
      set.dip = random.uniform(0, 1.5);
      set.spacing = 1.9;
      set.fisher = seed ? 60 : 0;
      set.seed = seed;
      set.persistence = seed == 2 ? 0.7 : 1;
      s.joint_sets.push_back(set);
    }
    s.joints.push_back({.name = "disc", .through = Vec3(3, 3, 3), .radius = 2});
    const CutResult r = cut(s);
    std::vector<CheckedBody> bodies;
    std::vector<const CheckedBody*> pointers;
    std::vector<Pose> poses;
    for (const auto& b : r.blocks) bodies.emplace_back(b.body), poses.push_back(at(b.centroid));
    for (const auto& b : bodies) pointers.push_back(&b);
    const auto found = find_intersections(pointers, poses, {}, {}, 1e-9);
    EXPECT_TRUE(found.empty()) << "seed " << seed << ": " << found[0].a << " and " << found[0].b << " by "
                               << found[0].depth;
    // The check itself must be able to fail.
    poses[0].c += (poses[1].c - poses[0].c) * 0.9;
    EXPECT_FALSE(find_intersections(pointers, poses, {}, {}, 1e-9).empty());
  }
}
