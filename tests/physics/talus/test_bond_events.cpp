// A bond breaks when its load passes its strength, not at the end of the step that this falls into.
#include <gtest/gtest.h>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double g = 9.81, density = 2500;

/// A cube of 1 m hangs glued under a fixed one; how far it has fallen after half a second.
double fallen(double tension, double history) {
  SceneText s(Method::by_accuracy(1e-3), 0.5);
  s.history(history).material("rock", density).interface("rock", "rock", 0.5, "normal_stiffness = \"hard\"\ncohesion = 1e6\ntension = " + number(tension));
  s.box("roof", Vec3(2, 2, 1), Vec3(0, 0, 1), "fixed = true\n").box("glued", Vec3::Ones(), Vec3::Zero());
  const Outcome o = run_scene(s.str());
  EXPECT_TRUE(o.ok());
  return -o.last().position[1].z();
}

TEST(BondEvents, PulledBeyondItsStrengthBreaksAtOnce) {
  for (const double history : {0.01, 0.1, 0.5}) EXPECT_NEAR(fallen(0.98 * density * g, history), 0.5 * g * 0.25, 1e-5);
}

TEST(BondEvents, PulledBelowItsStrengthHolds) { EXPECT_EQ(fallen(1.02 * density * g, 0.1), 0); }

/// Gravity slants: a cube is held on the ground by cohesion, or slides as if it had never been glued.
TEST(BondEvents, ShearedBeyondItsStrengthBreaksAtOnce) {
  const double mu = 0.3, pull = 6, mass = density;
  for (const double held : {0.999, 1.001}) {
    SceneText s(Method::by_accuracy(1e-3), 1, {pull, 0, -g});
    s.history(0.1).material("rock", density).interface("rock", "ground", mu, "normal_stiffness = \"hard\"\ncohesion = " + number(held * (mass * pull - mu * mass * g)));
    s.plane(Vec3::UnitZ()).box("B", Vec3::Ones(), Vec3(0, 0, 0.5));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    EXPECT_NEAR(o.last().position[0].x(), held < 1 ? 0.5 * (pull - mu * g) : 0, held < 1 ? 1e-5 : 1e-12);
  }
}

}  // namespace
}  // namespace talus::verify
