// Blocks that fill a space face to face, on contact springs.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// Two courses of bricks, faces on faces, sink by their weight. A corner of a common face that comes to be
/// named as the faces turn by micrometres is no contact that begins, and a spring that lets go of next to
/// nothing ends no step: of 20 ms 909 steps with 3339 solutions were made.
TEST(PackedOnSprings, FacesThatPressedAllAlongMakeNoEvents) {
  SceneText s(Method::by_accuracy(1e-3), 0.02);
  s.material("rock", 2600)
      .interface("rock", "*", 0.5, "normal_stiffness = \"100 MPa/m\"")
      .plane(Vec3::UnitZ());
  for (int k = 0; k < 8; ++k) {
    const int x = k % 2, y = k / 2 % 2, z = k / 4;
    s.box(fmt::format("B{}", k), Vec3(1, 0.7 + 0.3 * y, 1),
          Vec3(x + 0.5 * z + 0.25 * y, 0.35 + 0.85 * y, 0.5 + z));
  }
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  EXPECT_LT(o.result.counters.steps, 100);
  // All sink as one on the springs of the floor, rho g 2 / k deep at rest.
  EXPECT_LT(o.last().position[0].z(), 0.5);
  EXPECT_GT(o.last().position[0].z(), 0.5 - 2 * 2600 * 9.81 * 2 / 100e6);
  for (const sim::HistoryRow& row : o.rows) EXPECT_LT(std::abs(row.ledger.residual), 1e-6);
}

/// Rocks that fall onto each other and onto a floor, on springs by area: an onset costs a few
/// solutions of its step, whatever its spring. What it holds too little to count was taken for no onset while
/// it was sought, and each was halved down to round-off: 11.7 solutions a step, now 4.3.
TEST(PackedOnSprings, AnOnsetIsFoundInAFewSolutions) {
  SceneText s(Method::by_accuracy(1e-3), 0.8);
  s.material("rock", 2600)
      .interface("rock", "*", 0.5, "normal_stiffness = \"10 MPa/m\"")
      .plane(Vec3::UnitZ());
  for (int k = 0; k < 12; ++k)
    s.raw(
        fmt::format("[[block]]\nname = \"B{0}\"\nmaterial = \"rock\"\nshape = \"random-convex\"\nseed = {0}\n"
                    "volume = 0.8\nposition = [{1}, {2}, {3}]\n",
                    k + 1, 1.5 * (k % 2), 1.5 * (k / 2 % 2), 1 + 1.5 * (k / 4)));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  const auto& n = o.result.counters;
  EXPECT_LT(n.newton_method + n.interior_point, 6 * n.steps);
  EXPECT_GT(n.steps, 100);
  EXPECT_LT(o.last().ledger.kinetic, o.rows.front().ledger.potential);
  for (const sim::HistoryRow& row : o.rows)
    EXPECT_LT(std::abs(row.ledger.residual), 1e-9 * o.rows.front().ledger.potential);
}

/// A turned cube settles on another by a law given as a table: the same as by the spring that the table is. A
/// table has no stiffness to grow by, and what its points of contact hand to each other made it one that is
/// no number: the contact was hard, and the run failed at its first step.
TEST(PackedOnSprings, ATableHandsOnWhatItsPointsHold) {
  std::vector<Outcome> outcomes;
  for (const char* law : {"normal_stiffness = \"1e8 N/m\"",
                          "contact_law = { kind = \"table\", points = [[0, 0], "
                          "[0.01, 1e6]] }"}) {
    SceneText s(Method::by_accuracy(1e-3), 0.4);
    s.history(0.05).material("rock", 2500).interface("rock", "*", 0.5, law).plane(Vec3::UnitZ());
    s.box("R1", Vec3(1, 1, 0.8), Vec3(0.1, 0.05, 0.4));
    s.box("R2", Vec3::Constant(0.8), Vec3(0.15, 0, 1.2002),
          "orientation = { rotation_vector = [0, 0, 0.3] }\n");
    outcomes.push_back(run_scene(s.str()));
    ASSERT_TRUE(outcomes.back().ok()) << outcomes.back().result.message;
  }
  for (const std::size_t block : {0u, 1u})
    EXPECT_LT((outcomes[0].last().position[block] - outcomes[1].last().position[block]).norm(), 1e-3 * 0.8);
}

}  // namespace
}  // namespace talus::verify
