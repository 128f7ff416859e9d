// What is jammed so that nothing can free it costs little.
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace talus::verify
