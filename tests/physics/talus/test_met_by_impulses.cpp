// What the impulses of a step bring together within it gets its rows in that step, though no search at the start made any.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double frame = 0.02;   // one step by the speeds below [s]

/// More cubes of 1 m than events are located for, side by side along x without gravity or friction. The first comes on at 2 m/s and meets the
/// second, 1 mm on, which has `gap` left to the third. The first two slide by at 1 m/s along y: the search of a step reaches farther than the gap,
/// and at their present speeds the second and the third do not come nearer. From the third on they touch.
Outcome chain(double gap) {
  SceneText s(Method::by_accuracy(1e-3), frame, Vec3::Zero(), "sleeping = false\n");
  s.history(frame).material("rock", 2500).interface("rock", "rock", 0.0, "normal_stiffness = \"hard\"");
  constexpr int cubes = 14;
  double x = 0;
  for (int i = 0; i < cubes; ++i) {
    const Vec3 velocity(i == 0 ? 2 : 0, i < 2 ? 1 : 0, 0);
    s.box(fmt::format("B{}", i), Vec3::Ones(), Vec3(x, 0, 0), fmt::format("deformable = false\nvelocity = [{}, {}, {}]\n", velocity.x(), velocity.y(), velocity.z()));
    x += 1 + (i == 0 ? 1e-3 : i == 1 ? gap : 0);
  }
  return run_scene(s.str());
}

TEST(MetByImpulses, GetsItsRowsInTheSameStep) {
  const Outcome o = chain(0.015);
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.counters.steps, 1);        // not cut where they meet
  EXPECT_EQ(o.result.counters.rejected, 1);     // but solved again
  const sim::HistoryRow& end = o.last();
  const double left = end.position[2].x() - end.position[1].x() - 1;
  EXPECT_GT(end.velocity[2].x(), 0.02);         // the third is pushed on, and what touches it
  EXPECT_GE(left, -1e-9);
  EXPECT_LT(left, 1e-6);                        // as far as the second came
}

TEST(MetByImpulses, WhatStaysApartGetsNone) {
  const Outcome o = chain(0.022);               // within the reach of the search, beyond that of the impulses
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.counters.steps, 1);
  EXPECT_EQ(o.result.counters.rejected, 0);
  EXPECT_EQ(o.last().velocity[2].norm(), 0);
}

}  // namespace
}  // namespace talus::verify
