// Which contacts are internal edges of a floor.
#include <gtest/gtest.h>

#include <memory>

#include "coupling/touch/touch_flush.hpp"
#include "dda/kinematics.hpp"
#include "helpers/shapes.hpp"

namespace talus::coupling {
namespace {

/// A cube that has sunk by 1 cm into the spring on a cube below it, and is met from the side by a third cube
/// whose top lies `top` above that of the second.
bool side_is_internal(double top) {
  constexpr double sunk = 0.01;
  dda::Model model;
  dda::Model::Block block;
  block.shape = std::make_shared<Polyhedron>(test::unit_cube());
  model.blocks = {block, block, block};
  dda::State state;
  state.c = {Vec3(0, 0, -0.5), Vec3(1, 0, top - 0.5), Vec3(0.2, 0, 0.5 - sunk)};
  state.v = state.w = {3, Vec3::Zero()};
  state.q = {3, Quat::Identity()};
  state.eps = state.eps_rate = {3, Vec6::Zero()};
  const ContactLaw law;
  Touch rests{}, side{};
  rests.law = side.law = &law;
  rests.a = {Partner::Kind::block, 0}, rests.b = 2;
  rests.stiffness = 1e6;
  rests.at.area = 0.25;
  rests.at.normal = Vec3::UnitZ();
  rests.at.point_a = Vec3(0.2, 0, 0), rests.at.point_b = Vec3(0.2, 0, -sunk), rests.at.gap = -sunk;
  side.a = {Partner::Kind::block, 1}, side.b = 2;
  side.at.normal = -Vec3::UnitX();
  side.at.point_a = Vec3(0.5, 0, top), side.at.point_b = Vec3(0.7, 0, -sunk), side.at.gap = -1e-3;
  std::vector<Touch> touches{rests, side};
  drop_internal_edges(model, state, {}, 1e-6, 1e-6, touches);
  return touches.size() == 1;
}

/// A joint of the floor is none, nor is what lies below the cube; what reaches up into it beside its support
/// is an obstacle. It was dropped as long as its top lay anywhere between the two levels of the spring: in
/// masses of hard and soft contacts blocks went through each other by centimetres until the run failed.
TEST(InternalEdges, WhatReachesUpBesideASpringIsAnObstacle) {
  EXPECT_TRUE(side_is_internal(0));
  EXPECT_TRUE(side_is_internal(-0.011));
  EXPECT_FALSE(side_is_internal(-0.005));
  EXPECT_FALSE(side_is_internal(-0.009));
  EXPECT_FALSE(side_is_internal(0.01));
}

}  // namespace
}  // namespace talus::coupling
