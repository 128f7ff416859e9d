// What is jammed so that nothing can free it costs little.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// A cube that slides between a floor and a lid which stand closer than it is high, by 1.8 nm: no motion
/// leads it out of both. Each projection tried it 24 times.
TEST(Jams, WhatCannotBeLedOutIsGivenUp) {
  SceneText s(Method::by_accuracy(1e-3), 0.1, Vec3(0, 0, -9.81), "sleeping = false\n");
  s.history(0.02)
      .material("rock", 2500)
      .material("wall", 2500)
      .interface("rock", "wall", 0.3, "normal_stiffness = \"hard\"");
  s.plane(Vec3::UnitZ(), Vec3::Zero(), "wall")
      .raw("[[plane]]\npoint = [0, 0, 0.9999999982]\nnormal = [0, 0, -1]\nmaterial = \"wall\"\n");
  s.box("cube", Vec3::Ones(), Vec3(0, 0, 0.5 - 0.9e-9), "deformable = false\nvelocity = [1, 0, 0]\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_LT(o.result.counters.newton, 200 * o.result.counters.steps);  // 24 passes: 489 of each step
}

/// n^3 cubes stacked flush in a channel as wide as they are, which dips by 35 degrees: what each wall and
/// neighbour could press is not determined, and friction by it would hold them for ever. They slide as one.
double way_down_a_channel(int n, double play) {
  const double dip = 35 * std::numbers::pi / 180, side = 3;
  const Vec3 down(0, std::cos(dip), -std::sin(dip)), up(0, std::sin(dip), std::cos(dip));
  SceneText s(Method::by_accuracy(1e-3), 1.0);
  s.history(0.1)
      .material("rock", 2500)
      .material("wall", 2500)
      .interface("rock", "rock", 0.3, "normal_stiffness = \"hard\"")
      .interface("rock", "wall", 0.3, "normal_stiffness = \"hard\"")
      .plane(up, Vec3::Zero(), "wall")
      .plane(Vec3::UnitX(), Vec3(-play, 0, 0), "wall")
      .plane(-Vec3::UnitX(), Vec3(side * n + play, 0, 0), "wall");
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k)
        s.box(fmt::format("B{}{}{}", i, j, k), side * Vec3::Ones(),
              side * ((i + 0.5) * Vec3::UnitX() + (j + 0.5) * down + (k + 0.5) * up),
              fmt::format("orientation = {{ rotation_vector = [{:.17g}, 0, 0] }}\n", -dip));
  const Outcome o = run_scene(s.str());
  EXPECT_TRUE(o.ok()) << o.result.message;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < o.last().position.size(); ++b)
    least = std::min(least, (o.last().position[b] - o.rows[0].position[b]).dot(down));
  return least / (0.5 * g * (std::sin(dip) - 0.3 * std::cos(dip)));
}

TEST(Jams, CubesThatFillAChannelSlideDownIt) {
  EXPECT_NEAR(way_down_a_channel(1, 0), 1, 1e-6);
  EXPECT_NEAR(way_down_a_channel(2, 0), 1, 1e-3);  // accuracy; 0.002 when friction by self-stress held them
  EXPECT_GT(way_down_a_channel(3, 0), 0.9);        // 0.95; 0.003 before (docs/theory/contact.md, Limits)
  EXPECT_NEAR(way_down_a_channel(3, 1e-6), 1, 1e-3);
}

}  // namespace
}  // namespace talus::verify
