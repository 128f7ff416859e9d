// What round-off tells must not choose the way a block goes; what a solution leaves must not drive it.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// A turned box that spins onto a plane and goes on tumbling, in axes of which `axes` are the columns. A
/// reflection reverses turns: `hand` -1.
Outcome tumbles(const Mat3& axes, double hand, const std::string& contact) {
  const Vec3 turn(0.3, 0.45, -0.15), size(1, 0.8, 0.6);
  SceneText s(Method::by_accuracy(1e-3), 1.5);
  s.history(0.1).material("rock", 2500).interface("rock", "ground", 0.5, contact).plane(Vec3::UnitZ());
  // The box has its own mirror planes: only its turn is carried over.
  const Mat3 rotation =
      axes * Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * axes.transpose();
  const Vec3 turned_size = (axes * size).cwiseAbs();
  s.box("B", turned_size, axes * Vec3(0.2, -0.3, 1.2),
        turned(rotation_vector(rotation)) + velocity(axes * Vec3(1, 0.5, -1)) +
            spin(hand * (axes * Vec3(1, -2, 0.5))));
  return run_scene(s.str());
}

/// Springs: whether a step began in contact was asked of the sign of a gap of 1e-14 m, and 0.7 s later that
/// was a millimetre.
TEST(SameByAnyAxes, MirroredAndTurnedBlocksGoTheSameWay) {
  const Mat3 mirrored = Vec3(1, -1, 1).asDiagonal(),
             quarter = Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ()).toRotationMatrix();
  for (const char* contact : {"normal_stiffness = 1e7", "normal_stiffness = 1e9",
                              "normal_stiffness = \"1e9 Pa/m\"", "normal_stiffness = \"hard\""}) {
    const Outcome one = tumbles(Mat3::Identity(), 1, contact);
    ASSERT_TRUE(one.ok());
    for (const auto& [axes, hand] : {std::pair(mirrored, -1.0), std::pair(quarter, 1.0)}) {
      const Outcome other = tumbles(axes, hand, contact);
      ASSERT_TRUE(other.ok());
      for (std::size_t i = 0; i < one.rows.size(); ++i)
        EXPECT_LT((other.rows[i].position[0] - axes * one.rows[i].position[0]).norm(), 1e-7)
            << contact << " at " << one.rows[i].time;
    }
  }
}

/// The topmost cube of a tower slides v^2 / (2 mu g) and stops; the others stand. At a fine accuracy the
/// friction that turns over the tower's head is resolved, and what the solution left open drove a sway (made
/// of 3.1 J given: 20 cubes 3.7 J, 50 cubes 25 J).
TEST(SameByAnyAxes, NudgedTowerMakesNoEnergy) {
  constexpr int cubes = 20;
  constexpr double mu = 0.53, v = 0.05;
  SceneText s(Method::by_accuracy(1e-5), 0.5);
  s.history(0.1)
      .material("rock", 2500)
      .interface("rock", "rock", mu)
      .interface("rock", "ground", mu)
      .plane(Vec3::UnitZ());
  for (int i = 0; i < cubes; ++i)
    s.box((i < 10 ? "b0" : "b") + std::to_string(i), Vec3::Ones(), Vec3(0, 0, 0.5 + i),
          i + 1 == cubes ? velocity(Vec3(v, 0, 0)) : "");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  const double given = o.rows.front().ledger.kinetic, slides = v * v / (2 * mu * 9.81);
  for (const sim::HistoryRow& row : o.rows)
    EXPECT_GT(row.ledger.numerical_dissipation(), -0.01 * given) << row.time;
  EXPECT_NEAR(o.last().ledger.friction_work, given, 0.02 * given);
  EXPECT_NEAR(o.last().position[cubes - 1].x(), slides, 0.02 * slides);
  EXPECT_LT(o.last().ledger.kinetic, 1e-6 * given);
}

/// Two cubes that close slowly bounce off each other whatever speed both have: which meeting is too slow to
/// rebound was asked of their speed in the scene.
TEST(SameByAnyAxes, BouncesInAFrameThatMovesAreTheSame) {
  constexpr double closing = 0.004, time = 10;
  for (const double along : {0.0, 30.0, 1000.0}) {
    SceneText s(Method::by_accuracy(1e-2), time, Vec3::Zero());
    s.history(1)
        .material("rock", 2500)
        .interface("rock", "rock", 0, "normal_stiffness = \"hard\"\nrestitution = 1\n");
    for (const double side : {-1.0, 1.0})
      s.box(side < 0 ? "a" : "b", Vec3::Ones(), Vec3(side * 0.505, 0, 0),
            velocity(Vec3(-side * closing, along, 0)));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    const double meets = 0.005 / closing;
    EXPECT_NEAR(o.last().position[0].x(), -0.5 - closing * (time - meets), 1e-9) << along;
    EXPECT_NEAR(o.last().position[1].x(), 0.5 + closing * (time - meets), 1e-9) << along;
  }
}

}  // namespace
}  // namespace talus::verify
