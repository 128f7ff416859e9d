// Who meets whom on ways that were taken and on those that are still to come.
#include <gtest/gtest.h>

#include <memory>

#include "coupling/islands/planner.hpp"
#include "dda/kinematics.hpp"
#include "helpers/shapes.hpp"

namespace talus::coupling {
namespace {

/// Two cubes of 1 m: the first rests at the origin, the second flies to where it will be 3 m beside it.
struct Two {
  static constexpr double duration = 1;  // [s]
  dda::Model model;
  SystemState state;
  Environment env;
  SystemSettings settings;
  Two() {
    dda::Model::Block block;
    block.shape = std::make_shared<Polyhedron>(test::unit_cube());
    block.mass = 1;
    model.blocks = {block, block};
    model.gravity.setZero();
    dda::State& s = state.blocks;
    s.c = {Vec3::Zero(), Vec3(3, 5, 0)};
    s.v = {Vec3::Zero(), Vec3(0, -5, 0)};
    s.w = {Vec3::Zero(), Vec3::Zero()};
    s.q = {Quat::Identity(), Quat::Identity()};
    s.eps = s.eps_rate = {Vec6::Zero(), Vec6::Zero()};
    state.contacts.resize(2);
    state.asleep.resize(2, 0);
    state.step.resize(2, 0.0);
    env.laws = {1, {ContactLaw{}}};
  }
  /// Both by themselves, beside each other.
  IslandPlan plan() const {
    IslandPlan p;
    for (const int b : {0, 1}) {
      Island& island = p.islands.emplace_back();
      island.blocks = {b};
      island.watched = {1};
    }
    p.beside = {{0, 1}};
    return p;
  }
  /// The first was pushed and has gone 2.5 m to the second; what the second did is given, or still to come.
  BlockPairs met(bool second_stepped, const Vec3& second_went = Vec3::Zero()) const {
    std::vector<IslandReport> reports(2);
    const auto went = [&](int b, const Vec3& way) {
      contact::Motion m;
      m.start = dda::pose(state.blocks, b);
      m.displacement = way;
      reports[static_cast<std::size_t>(b)].ways = {{Leg{0, duration, m}}};
    };
    went(0, Vec3(2.5, 0, 0));
    if (second_stepped) went(1, second_went);
    const IslandPlanner planner(model, state, env, settings);
    return planner.meetings(plan(), reports, state.blocks, Stretch::from(0, duration)).pairs;
  }
};

TEST(Meetings, WhatIsStillToBeSteppedIsMetWhereItIsForeseen) {
  Two two;
  EXPECT_EQ(two.met(false), (BlockPairs{{0, 1}}));
  two.state.asleep[1] = 1;  // it stays 5 m off
  EXPECT_TRUE(two.met(false).empty());
}

TEST(Meetings, WhatWasSteppedIsMetOnItsOwnWay) {
  const Two two;
  EXPECT_EQ(two.met(true, Vec3(0, -5, 0)), (BlockPairs{{0, 1}}));
  EXPECT_TRUE(two.met(true, Vec3(0, -1, 0)).empty());
}

}  // namespace
}  // namespace talus::coupling
