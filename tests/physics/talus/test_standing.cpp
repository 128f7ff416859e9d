// What stands needs no steps of what falls, whether or not it may sleep.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// A tower of more cubes than events are located for, which may not sleep.
std::string tower(int cubes, double duration, const Vec3& gravity, double nudge = 0) {
  SceneText s(Method::by_accuracy(1e-3), duration, gravity, "sleeping = false\n");
  s.history(0.1)
      .material("rock", 2500)
      .interface("rock", "rock", 0.6, "normal_stiffness = \"hard\"")
      .interface("rock", "ground", 0.6, "normal_stiffness = \"hard\"");
  s.plane(Vec3::UnitZ());
  for (int i = 0; i < cubes; ++i)
    s.box(fmt::format("B{}", i), Vec3::Ones(), Vec3(0, 0, 0.5 + i),
          fmt::format("deformable = false\nvelocity = [{}, 0.0, 0.0]\n", i + 1 == cubes ? nudge : 0.0));
  return s.str();
}

TEST(Standing, TowerTakesOneStepAMacroStep) {
  const Outcome o = run_scene(tower(15, 2, Vec3(0, 0, -9.81)));
  ASSERT_TRUE(o.ok());
  EXPECT_LE(o.result.counters.steps, 45);  // 40 macro steps of 0.05 s; 120 by what a block may fall in a step
  EXPECT_LT((o.last().position[14] - Vec3(0, 0, 14.5)).norm(), 1e-8);
}

TEST(Standing, NudgedTowerComesToRest) {
  // The topmost cube slides v^2 / (2 mu g) and stops within a step; its friction, as the mean over that step,
  // turns over no part of the tower.
  const double v = 0.05;
  const Outcome o = run_scene(tower(50, 1, Vec3(0, 0, -9.81), v));
  ASSERT_TRUE(o.ok());
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_LT(o.last().velocity[i].norm(), 1e-5)
        << i;  // [m/s]; 0.03 when the residuals of fifty joints added up to a sway that gravity drove
    EXPECT_LT((o.last().position[i] - Vec3(0, 0, 0.5 + static_cast<double>(i))).norm(),
              i == 49 ? 0.5 * v / 60 + 2e-5 : 3e-5)  // a thirtieth of what the accuracy allows a cube
        << i;
  }
}

TEST(Standing, NudgedTowerOfHundredsDoesNotSinkIntoItself) {
  // Solutions taken where their search stalls leave residuals of one sign, which add up along a tower: it
  // came to 0.8 MJ of motion, 2.6 MJ made a second. It is lifted again by what it sank, which is taken from
  // its motion: without that, 0.6 kJ of motion in four seconds with 256 cubes.
  for (const int cubes : {256, 300}) {
    const Outcome o = run_scene(tower(cubes, 0.5, Vec3(0, 0, -9.81), 1e-3));
    ASSERT_TRUE(o.ok());
    for (const sim::HistoryRow& row : o.rows) {
      EXPECT_LT(row.ledger.kinetic, 1) << cubes << ", " << row.time;  // [J]; its weight is 6.3 MN or more
      EXPECT_GT(row.ledger.numerical_dissipation(), -20) << cubes << ", " << row.time;
    }
    for (int i = 0; i < cubes; ++i)
      EXPECT_LT((o.last().position[static_cast<std::size_t>(i)] - Vec3(0, 0, 0.5 + i)).norm(), 1e-3)
          << cubes << ", " << i;
  }
}

TEST(Standing, HardTowerOnSoftGroundSinksToItsRest) {
  // Hard joints above springs in one island, whose events are not located (more than twelve blocks) and are
  // (twelve).
  for (const int cubes : {12, 13, 30}) {
    const double stiffness = 1e8, weight = cubes * 2500 * 9.81;
    SceneText s(Method::by_accuracy(1e-3), 1, Vec3(0, 0, -9.81));
    s.history(0.1)
        .material("rock", 2500)
        .interface("rock", "rock", 0.5, "normal_stiffness = \"hard\"")
        .interface("rock", "ground", 0.5, fmt::format("normal_stiffness = {}", stiffness));
    s.plane(Vec3::UnitZ());
    for (int i = 0; i < cubes; ++i)
      s.box(fmt::format("B{}", i), Vec3::Ones(), Vec3(0, 0, 0.5 + i), "deformable = false\n");
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    const double sinks = weight / (4 * stiffness);  // four corners
    for (int i = 0; i < cubes; ++i) {
      const Vec3 off = o.last().position[static_cast<std::size_t>(i)] - Vec3(0, 0, 0.5 + i - sinks);
      EXPECT_LT(std::abs(off.z()), 0.02 * sinks) << cubes << ", " << i;
      // It sways from round-off, and the couple that the accuracy leaves a face holds it where it leans: a
      // tenth of the accuracy.
      EXPECT_LT(off.head<2>().norm(), 1e-4) << cubes << ", " << i;
    }
    // Not above what springs give back as it sinks; a hard joint held by a rule that its blocks do not go by
    // lost and made 33 kJ of thirteen blocks.
    for (const sim::HistoryRow& row : o.rows) {
      EXPECT_LT(row.ledger.kinetic, 0.5 * weight * sinks) << cubes << ", " << row.time;
      EXPECT_GT(row.ledger.numerical_dissipation(), -0.6 * weight * sinks) << cubes << ", " << row.time;
    }
  }
}

TEST(Standing, BondsHoldWhatIsLeftUnsolved) {
  // Chains of cubes that hang from a fixed one, bonds a hundred times as strong as the load asks, the lowest
  // cube nudged: a solution of many contacts is no closer than a thousandth of what moves, which is no break.
  for (const int cubes : {20, 100, 256}) {
    SceneText s(Method::by_accuracy(1e-3), 0.3, Vec3(0, 0, -9.81));
    s.history(0.1)
        .material("rock", 2500)
        .interface("rock", "rock", 0.5, "normal_stiffness = \"hard\"\ncohesion = 1e9\ntension = 1e9\n");
    for (int i = 0; i < cubes; ++i) {
      const bool lowest = i + 1 == cubes;
      s.box(fmt::format("B{}", i), Vec3::Ones(), Vec3(0, 0, -0.5 - i),
            fmt::format("deformable = false\n{}{}", i == 0 ? "fixed = true\n" : "",
                        lowest ? "velocity = [0.1, 0.0, 0.0]\n" : ""));
    }
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    for (int i = 0; i < cubes; ++i)
      EXPECT_LT((o.last().position[static_cast<std::size_t>(i)] - Vec3(0, 0, -0.5 - i)).norm(), 1e-3)
          << cubes << ", " << i;
  }
}

TEST(Standing, WhatSlidesOffFromRestIsFollowed) {
  // Gravity slants beyond the friction of the topmost cube alone, which has nothing above it to hold.
  const double pull = 0.62 * 9.81, t = 0.3;
  SceneText s(Method::by_accuracy(1e-3), t, {pull, 0, -9.81}, "sleeping = false\n");
  s.history(0.1).material("rock", 2500).material("ice", 2500);
  s.interface("*", "*", 0.7, "normal_stiffness = \"hard\"")
      .interface("rock", "ice", 0.6, "normal_stiffness = \"hard\"")
      .plane(Vec3::UnitZ());
  for (int i = 0; i < 13; ++i)
    s.box(fmt::format("B{}", i), Vec3(8, 8, 0.5), Vec3(0, 0, 0.25 + 0.5 * i), "deformable = false\n");
  s.box("top", Vec3::Ones(), Vec3(0, 0, 7), "deformable = false\n", "ice");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  EXPECT_NEAR(o.last().position[13].x(), 0.5 * 0.02 * 9.81 * t * t, 1e-6);
  EXPECT_NEAR(o.last().position[12].x(), 0, 1e-9);
}

}  // namespace
}  // namespace talus::verify
