// The search that is spared while bodies have not left what was searched, beside one made anew.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "coupling/touch/pair_watch.hpp"
#include "dda/kinematics.hpp"
#include "helpers/shapes.hpp"

namespace talus::coupling {
namespace {

/// Two cubes of 1 m, the second `apart` above the first.
struct Pair {
  dda::Model model;
  dda::State state;
  Environment env;
  CandidatePair pair{{Partner::Kind::block, 0}, 1};
  explicit Pair(double apart) {
    dda::Model::Block block;
    block.shape = std::make_shared<Polyhedron>(test::unit_cube());
    model.blocks = {block, block};
    state.c = {Vec3::Zero(), Vec3(0.1, 0.2, 1 + apart)};
    state.v = state.w = {Vec3::Zero(), Vec3::Zero()};
    state.q = {Quat::Identity(), Quat::Identity()};
    state.eps = state.eps_rate = {Vec6::Zero(), Vec6::Zero()};
    env.laws = {1, {ContactLaw{}}};
  }
  std::vector<FoundPoint> watched(PairWatch& watch, double margin, double reach = 0) const {
    std::vector<FoundPoint> out;
    watch.look(model, state, env, pair, margin, reach, 0, out);
    return out;
  }
  std::vector<FoundPoint> anew(double margin) const {
    std::vector<FoundPoint> out;
    find_points(model, state, env, pair, margin, out);
    return out;
  }
  /// Both blocks fly on together; the second also sinks by `way` and tilts by way per metre.
  void move(double way) {
    const Vec3 together(0.3, -0.2, 5);
    for (Vec3& c : state.c) c += together;
    state.c[1].z() -= way;
    state.q[1] = dda::rotation_by(Vec3(way, 0, 0)) * state.q[1];
  }
};

TEST(PairWatch, GapsOfWhatTouchesAreRightToSecondOrder) {
  Pair two(1e-3);
  PairWatch watch;
  ASSERT_EQ(two.watched(watch, 0.01).size(), two.anew(0.01).size());
  two.move(5e-5);  // carried along: below 3e-3 of the radius
  const auto kept = two.watched(watch, 0.01), fresh = two.anew(0.01);
  ASSERT_EQ(kept.size(), fresh.size());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_EQ(kept[i].at.key, fresh[i].at.key);
    EXPECT_NEAR(kept[i].at.gap, fresh[i].at.gap, 1e-8);
    EXPECT_LT(kept[i].at.gap, 1e-3 - 2e-5);  // it did sink
  }
}

TEST(PairWatch, WhatHasMovedFartherIsSearchedAnew) {
  Pair two(1e-3);
  PairWatch watch;
  two.watched(watch, 0.01);
  two.move(5e-3);
  const auto kept = two.watched(watch, 0.01), fresh = two.anew(0.01);
  ASSERT_EQ(kept.size(), fresh.size());
  for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_EQ(kept[i].at.gap, fresh[i].at.gap);
}

TEST(PairWatch, NothingIsMissedThatComesWithinTheMargin) {
  Pair two(0.05);
  PairWatch watch;
  EXPECT_TRUE(two.watched(watch, 0.01).empty());
  for (int step = 0; step < 45; ++step) {
    two.move(1e-3);
    EXPECT_EQ(two.watched(watch, 0.01).empty(), two.anew(0.01).empty()) << step;
  }
  EXPECT_FALSE(two.watched(watch, 0.01).empty());
}

TEST(PairWatch, WhatWasSeenFarOffIsMetWhenItComesNear) {
  // The first search reaches beyond the cubes' gap: its features wait until they may have come within the
  // margin.
  Pair two(0.05);
  PairWatch watch;
  EXPECT_TRUE(two.watched(watch, 0.01, 0.01).empty());
  for (int step = 0; step < 45; ++step) {
    two.move(1e-3);
    const auto kept = two.watched(watch, 0.01, 0.01), fresh = two.anew(0.01);
    ASSERT_EQ(kept.size(), fresh.size()) << step;
    for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_NEAR(kept[i].at.gap, fresh[i].at.gap, 1e-6) << step;
  }
  EXPECT_FALSE(two.watched(watch, 0.01, 0.01).empty());
}

/// A cube that lies on a face of a skin, and flies along with it.
TEST(PairWatch, WhatFliesAlongWithASkinKeepsItsContacts) {
  Pair flight(0);
  flight.pair = {{Partner::Kind::structure, 0}, 1};
  flight.state.c[1] = Vec3(0, 0, 0.5 + 1e-4);
  TriangleSurface skin;
  skin.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 0}};
  skin.velocities.assign(5, Vec3::Zero());
  skin.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  skin.parent_face = {0, 0, 0, 0};
  for (int k = 0; k < 4; ++k) skin.nodes.push_back({1, {k}, {1, 0, 0, 0}});
  skin.nodes.push_back({4, {0, 1, 2, 3}, {0.25, 0.25, 0.25, 0.25}});
  flight.env.structures.emplace_back();
  flight.env.structures[0].index = moving_index(skin);
  PairWatch watch;
  ASSERT_GE(flight.watched(watch, 0.01).size(), 4u);
  // Both turn and fly on by far more than a watch lasts; the cube sinks by 2e-5 against the face.
  const Mat3 turn = dda::rotation_by(Vec3(0.02, 0.01, -0.01)).toRotationMatrix();
  const Vec3 way(0.01, -0.02, 0.04);
  for (Vec3& x : skin.vertices) x = way + turn * x;
  flight.env.structures[0].index->refit(skin);
  flight.state.c[1] = way + turn * (flight.state.c[1] - Vec3(0, 0, 2e-5));
  flight.state.q[1] = Quat(turn);
  const auto kept = flight.watched(watch, 0.01), fresh = flight.anew(0.01);
  ASSERT_EQ(kept.size(), fresh.size());
  bool carried = false;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_NEAR(kept[i].at.gap, 8e-5, 1e-9);
    EXPECT_NEAR((kept[i].at.normal - turn.col(2)).norm(), 0, 1e-9);
    EXPECT_NEAR((kept[i].at.point_a - fresh[i].at.point_a).norm(), 0, 1e-8);
    carried = carried || kept[i].at.gap != fresh[i].at.gap || kept[i].at.point_b != fresh[i].at.point_b;
  }
  EXPECT_TRUE(carried);  // to the last digit it would be a new search's
}

TEST(PairWatch, ServesHardContactAlone) {
  Pair two(0);
  EXPECT_TRUE(PairWatch::serves(two.model, two.env, two.pair));
  two.env.laws.law[0].stiffness = ContactLaw::Stiffness::per_area;
  EXPECT_FALSE(PairWatch::serves(two.model, two.env, two.pair));
}

}  // namespace
}  // namespace talus::coupling
