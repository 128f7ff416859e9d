// Fixed points are points of their block.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// A cube of 1 m about the origin, turned by 45 degrees about z and held at a point.
std::string held_at(const Vec3& x) {
  SceneText s(Method::by_accuracy(1e-3), 0.01);
  s.material("rock", 2600)
      .box("B", Vec3::Ones(), Vec3::Zero(),
           turned(Vec3(0, 0, M_PI / 4)) + "fixed_points = [" + vector(x) + "]\n");
  return s.str();
}

TEST(FixedPoints, InsideAndOnTheSurface) {
  for (const Vec3& x : {Vec3(0.1, 0.2, -0.3), Vec3(0.7071, 0, 0.5), Vec3(0, 0, 0.5)})
    EXPECT_TRUE(run_scene(held_at(x)).ok());
}

TEST(FixedPoints, OutsideIsAnErrorThatNamesTheNearestPoint) {
  try {
    run_scene(held_at(Vec3(0.5, 0.5, 0.2)));
    FAIL() << "accepted";
  } catch (const InputError& e) {
    ASSERT_EQ(e.problems().size(), 1u);
    const Problem& p = e.problems()[0];
    EXPECT_EQ(p.key, "block.B.fixed_points");
    EXPECT_EQ(p.value, "[0.5, 0.5, 0.2]");
    EXPECT_EQ(p.rule, "lies 0.2071 m outside of the block");
    EXPECT_NE(p.remedy.find("[0.353553, 0.353553, 0.2]"), std::string::npos) << p.remedy;
  }
}

/// A box held at a corner, with a spin and no velocity: it starts as an impulse at the corner leaves it, and
/// then keeps its energy, however large it is.
TEST(FixedPoints, MotionThatMovesThemStartsAsIfCaught) {
  const Vec3 size(1, 0.6, 0.4), arm(-0.5, -0.3, 0.2), spin0(0.5, 0.2, 1);
  const double mass = 2600 * size.prod();
  const Mat3 inertia = (mass / 12 * (size.squaredNorm() - size.array().square())).matrix().asDiagonal();
  const Mat3 about_corner = inertia + mass * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  const Vec3 caught =
      about_corner.inverse() * (inertia * spin0);  // the angular momentum about the corner stays
  for (const double scale : {1e-3, 1.0, 1e3}) {
    const double time = std::sqrt(scale);
    SceneText s(Method::by_accuracy(1e-4), time);
    s.history(0.05 * time).material("rock", 2600);
    s.box("B", scale * size, -scale * arm, spin(spin0 / time) + "fixed_points = [[0, 0, 0]]\n");
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    EXPECT_LT((time * o.rows.front().spin[0] - caught).norm(), 1e-9);
    EXPECT_LT((o.rows.front().velocity[0] / time + o.rows.front().spin[0].cross(scale * arm) / time).norm(),
              1e-9);
    double swing = 0;  // the scheme's share is to be small against the energy that swings, not against what
                       // is left at a turning point
    for (const auto& r : o.rows) swing = std::max(swing, r.ledger.kinetic);
    for (const auto& r : o.rows)
      EXPECT_NEAR(r.ledger.algorithmic, 0, 1e-3 * swing) << scale;  // ten times the accuracy
    const auto& warnings = o.simulation->scene().warnings;          // another of a block of a kilometre
    EXPECT_EQ(std::count_if(warnings.begin(), warnings.end(),
                            [](const Problem& p) { return p.key == "block.B.velocity"; }),
              1)
        << scale;
  }
}

TEST(FixedPoints, ConsistentMotionIsLeftAsItIs) {
  const Vec3 arm(-0.5, -0.3, 0.2), spin0(0.5, 0.2, 1);
  SceneText s(Method::by_accuracy(1e-3), 0.01);
  s.material("rock", 2600)
      .box("B", Vec3(1, 0.6, 0.4), -arm,
           spin(spin0) + velocity(spin0.cross(-arm)) + "fixed_points = [[0, 0, 0]]\n");
  const Outcome o = run_scene(s.str());
  EXPECT_EQ(o.rows.front().spin[0], spin0);
  EXPECT_TRUE(o.simulation->scene().warnings.empty());
}

/// Two points leave the turning about the line through them.
TEST(FixedPoints, TwoPointsLeaveAHinge) {
  SceneText s(Method::by_accuracy(1e-3), 0.01);
  s.material("rock", 2600)
      .box("B", Vec3::Ones(), Vec3::Zero(),
           spin(Vec3(1, 2, 3)) + velocity(Vec3(0, 0, 1)) +
               "fixed_points = [[0.5, 0.5, 0.5], [-0.5, 0.5, 0.5]]\n");
  const Outcome o = run_scene(s.str());
  const Vec3& w = o.rows.front().spin[0];
  EXPECT_NEAR(w.y(), 0, 1e-12);
  EXPECT_NEAR(w.z(), 0, 1e-12);
  EXPECT_NEAR(w.x(), (1.0 / 6 * 1 - 0.5 * 1) / (1.0 / 6 + 0.5),
              1e-9);  // the moment about the line: I w_x and m v_z times the arm of -0.5
}

/// A rod of 2 m on a point of its end, let go at 60 degrees: its time is Jacobi's, 4 K(sin 30 deg) sqrt(I/(m
/// g l)) = 1.0732 * 2 pi sqrt(I/(m g l)), and its energy stays for as long as it swings. Drift led back by
/// speed took 2 % of it a swing by 1e-3, and made two thousand times the whole of it by 0.1, where a short
/// step followed a long one.
TEST(FixedPoints, PendulumsKeepTheirTimeAndEnergy) {
  const Vec3 size(0.1, 0.1, 2), tilt(0, M_PI / 3, 0);
  const double g = 9.81, inertia = (0.01 + 4) / 12 + 1;                // about the point, over the mass
  const double quarter = 1.6857503548125961 * std::sqrt(inertia / g);  // K(sin 30 deg)
  const Vec3 start(-std::sin(M_PI / 3), 0, -0.5);
  struct Case {
    double accuracy, off, lost;
  };  // position after two swings over the accuracy, energy over the largest kinetic
  for (const Case& c : {Case{1e-1, 2, 0.1}, {1e-2, 4, 0.02}, {1e-3, 5, 5e-3}, {1e-5, 10, 2e-4}}) {
    SceneText s(Method::by_accuracy(c.accuracy), 8 * quarter);
    s.history(0.05).material("rock", 2500);  // rows at ends of macro steps, where the point is at its place
    s.box("B", size, start, turned(tilt) + "fixed_points = [[0, 0, 0]]\n");
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    const double swings = 50 * g * 0.5;  // m g l (1 - cos 60 deg)
    EXPECT_LT((o.last().position[0] - start).norm(), c.off * c.accuracy) << c.accuracy;
    for (const auto& r : o.rows) {
      EXPECT_NEAR(r.ledger.algorithmic, 0, c.lost * swings) << c.accuracy << " at " << r.time;
      EXPECT_NEAR(r.position[0].norm(), 1, 1e-8) << c.accuracy;
    }
  }
}

/// The same on a hinge of two points through a straining block, whose distance its strain keeps: what was led
/// back by speed rang on in its strains.
TEST(FixedPoints, HingesOfStrainingBlocksKeepTheirEnergy) {
  SceneText s(Method::by_accuracy(1e-3), 3);
  s.history(0.05).material("rock", 2500, "young = 1e9\npoisson = 0.2");
  s.box("B", Vec3(2, 1, 0.2), Vec3(1, 0, 0), "fixed_points = [[0, -0.5, 0], [0, 0.5, 0]]\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  const double swings = 2500 * 0.4 * 9.81;
  EXPECT_LT(o.rows.back().ledger.damping_work, 1e-2 * swings);
  for (const auto& r : o.rows) {
    EXPECT_NEAR(r.ledger.algorithmic, 0, 1e-2 * swings) << r.time;
    EXPECT_NEAR(r.position[0].y(), 0, 1e-8);
  }
}

}  // namespace
}  // namespace talus::verify
