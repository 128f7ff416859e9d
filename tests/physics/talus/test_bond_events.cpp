// A bond breaks when its load passes its strength, not at the end of the step that this falls into.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double density = 2500;

/// A cube of 1 m hangs glued under a fixed one; how far it has fallen after half a second.
double fallen(double tension, double history) {
  SceneText s(Method::by_accuracy(1e-3), 0.5);
  s.history(history)
      .material("rock", density)
      .interface("rock", "rock", 0.5,
                 "normal_stiffness = \"hard\"\ncohesion = 1e6\ntension = " + number(tension));
  s.box("roof", Vec3(2, 2, 1), Vec3(0, 0, 1), "fixed = true\n").box("glued", Vec3::Ones(), Vec3::Zero());
  const Outcome o = run_scene(s.str());
  EXPECT_TRUE(o.ok());
  return -o.last().position[1].z();
}

TEST(BondEvents, PulledBeyondItsStrengthBreaksAtOnce) {
  for (const double history : {0.01, 0.1, 0.5})
    EXPECT_NEAR(fallen(0.98 * density * g, history), 0.5 * g * 0.25, 1e-5);
}

TEST(BondEvents, PulledBelowItsStrengthHolds) { EXPECT_NEAR(fallen(1.02 * density * g, 0.1), 0, 1e-15); }

/// Fourteen cubes hang on each other, the uppermost bond too weak by 2 %: all fall as one, freely.
TEST(BondEvents, LargeIslandFallsFromTheTimeOnThatItIsTornOff) {
  constexpr int count = 14;
  const double strength = 0.98 * density * g * count;
  SceneText s(Method::by_accuracy(1e-3), 1);
  s.history(0.1)
      .material("rock", density)
      .interface(
          "rock", "rock", 0.5,
          "normal_stiffness = \"hard\"\ncohesion = " + number(strength) + "\ntension = " + number(strength));
  s.box("b00", Vec3::Ones(), Vec3::Zero(), "fixed = true\n");
  for (int i = 1; i <= count; ++i)
    s.box((i < 10 ? "b0" : "b") + std::to_string(i), Vec3::Ones(), Vec3(0, 0, -i));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  for (int i = 1; i <= count; ++i)
    EXPECT_NEAR(o.last().position[static_cast<std::size_t>(i)].z() + i, -0.5 * g, 4e-3)
        << i;  // 0.16 where it held for a whole step
  EXPECT_NEAR(o.last().ledger.algorithmic, 0, 1e-3 * o.last().ledger.kinetic);
}

/// Cubes bonded face on face stand out from a wall. The lower corners of a joint's face are where it turns,
/// so that its two upper bonds bear T/2 a^3 of the moment rho g n^2 a^4/2 of the n cubes that it carries:
/// that at the wall tears, whatever the accuracy, below T = rho g n^2 a. The arm then swings about the lower
/// edge as one body of moment of inertia m sum(1/6 + (i + 1/2)^2 + 1/4) a^2, which asks far less of all other
/// joints.
TEST(BondEvents, CantileverTearsAtItsRootAlone) {
  constexpr double time = 1;
  for (const int count : {5, 13}) {
    double inertia = 0;
    for (int i = 0; i < count; ++i) inertia += 1.0 / 6 + (i + 0.5) * (i + 0.5) + 0.25;
    const double arm = std::hypot(0.5 * count, 0.5);
    double phi = std::atan2(0.5, 0.5 * count), rate = 0;
    const double begun = phi;
    constexpr int steps = 100000;
    for (int i = 0; i < steps; ++i) {
      rate += time / steps * count * arm * g * std::cos(phi) / inertia;
      phi -= time / steps * rate;
    }
    const double turned_by = std::atan2(0.5, count - 0.5) - begun + phi, reach = std::hypot(count - 0.5, 0.5);
    const Vec3 tip(0.5 + reach * std::cos(turned_by), 0, -0.5 + reach * std::sin(turned_by));
    for (const double strength : {0.9, 0.98, 1.02})
      for (const double accuracy : {1e-2, 1e-3, 1e-4}) {
        SceneText s(Method::by_accuracy(accuracy), time);
        s.history(0.05)
            .material("rock", density)
            .interface("rock", "rock", 1,
                       "normal_stiffness = \"hard\"\ncohesion = 1e8\ntension = " +
                           number(strength * count * count * density * g));
        s.box("wall", Vec3::Ones(), Vec3::Zero(), "fixed = true\n");
        for (int i = 1; i <= count; ++i) s.box("c" + std::to_string(i), Vec3::Ones(), Vec3(i, 0, 0));
        const Outcome o = run_scene(s.str());
        ASSERT_TRUE(o.ok());
        const Vec3 at = strength < 1 ? tip : Vec3(count, 0, 0);
        EXPECT_LT((o.last().position.back() - at).norm(), accuracy * reach)
            << count << " cubes, " << strength << " of the strength, accuracy " << accuracy;
      }
  }
}

/// A bar of bonded cubes that tumbles in no gravity stays one body: bonds far above what turning asks of them
/// let go where a step had left their sides parting by more than the slowest rebound.
TEST(BondEvents, TumblingBarStaysOne) {
  const Vec3 spin(0, 0.6, 2);
  for (const int count : {2, 5, 13})
    for (const double accuracy : {1e-2, 1e-3}) {
      SceneText s(Method::by_accuracy(accuracy), 3, Vec3::Zero());
      s.history(0.1)
          .material("rock", density)
          .interface("rock", "rock", 0.5, "normal_stiffness = \"hard\"\ncohesion = 1e9\ntension = 1e9");
      for (int i = 0; i < count; ++i) {
        const Vec3 at(i - 0.5 * (count - 1), 0, 0);
        s.box("c" + std::to_string(i), Vec3::Ones(), at,
              velocity(spin.cross(at)) + "spin = [0.0, 0.6, 2.0]\n");
      }
      const Outcome o = run_scene(s.str());
      ASSERT_TRUE(o.ok());
      for (const auto& row : o.rows)
        EXPECT_NEAR((row.position.back() - row.position.front()).norm(), count - 1, accuracy)
            << count << " cubes, accuracy " << accuracy << ", t = " << row.time;
    }
}

/// A slab that slides on a beam across it, through which no cohesion holds after the first slip, whatever
/// corners the two share.
TEST(BondEvents, CohesionOfSpringsIsLostWhereItSlides) {
  const double slope = M_PI / 6, friction = 0.3;
  const Mat3 axes = slope_axes(slope);
  for (const char* stiffness : {"\"hard\"", "\"1e9 Pa/m\""})
    for (const double width : {1.0, 0.4}) {
      SceneText s(Method::by_accuracy(1e-3), 0.8);
      s.history(0.05)
          .material("rock", density)
          .interface("rock", "rock", friction,
                     "normal_stiffness = " + std::string(stiffness) + "\ncohesion = 3e4");
      s.box("beam", Vec3(6, 0.6, 0.5), axes * Vec3(2, 0, -0.25),
            "fixed = true\n" + turned(rotation_vector(axes)));
      s.box("slab", Vec3(1, width, 0.2), axes * Vec3(0, 0, 0.1),
            velocity(axes.col(0)) + turned(rotation_vector(axes)));
      const Outcome o = run_scene(s.str());
      ASSERT_TRUE(o.ok());
      const double slid = axes.col(0).dot(o.last().position[1] - o.rows.front().position[1]),
                   free = 0.8 + 0.5 * g * (std::sin(slope) - friction * std::cos(slope)) * 0.64;
      EXPECT_NEAR(slid, free, 1e-2 * free)
          << stiffness << ' ' << width;  // half of it where springs held for a whole step
    }
}

/// Five deformable blocks hang under a fixed one, each glued to the next: they swing up and down on each
/// other, and what swings is no impact that bonds of twenty-five times the load would have to bear.
TEST(BondEvents, ChainOfDeformableBlocksHolds) {
  SceneText s(Method::by_accuracy(1e-4), 0.45, {1, 0, -g});
  s.history(5e-3)
      .material("rock", density, "young = 1e9\n")
      .interface("rock", "rock", 0.5, "normal_stiffness = \"hard\"\ncohesion = 3e6\ntension = 3e6");
  s.box("b0", Vec3::Ones(), Vec3::Zero(), "fixed = true\n");
  for (int i = 1; i < 6; ++i)
    s.box("b" + std::to_string(i), Vec3::Ones(), Vec3(0, 0, -i), "deformable = true\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  const double hangs = density * g / 1e9 * (5 * 4.5 - 0.5 * 4.5 * 4.5);  // the last centroid, at rest
  EXPECT_GT(o.last().position[5].z(), -5 - 2.1 * hangs);
  EXPECT_LT(o.last().position[5].z(), -5 + 0.1 * hangs);
}

/// Gravity slants: a cube is held on the ground by cohesion, or slides as if it had never been glued.
TEST(BondEvents, ShearedBeyondItsStrengthBreaksAtOnce) {
  const double mu = 0.3, pull = 6, mass = density;
  for (const double held : {0.999, 1.001}) {
    SceneText s(Method::by_accuracy(1e-3), 1, {pull, 0, -g});
    s.history(0.1)
        .material("rock", density)
        .interface("rock", "ground", mu,
                   "normal_stiffness = \"hard\"\ncohesion = " + number(held * (mass * pull - mu * mass * g)));
    s.plane(Vec3::UnitZ()).box("B", Vec3::Ones(), Vec3(0, 0, 0.5));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    EXPECT_NEAR(o.last().position[0].x(), held < 1 ? 0.5 * (pull - mu * g) : 0, held < 1 ? 1e-5 : 1e-12);
  }
}

}  // namespace
}  // namespace talus::verify
