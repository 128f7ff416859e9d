// A bar that slides on a ridge, edge across edge: the point where they meet wanders along both, and the
// normal turns with both.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// Where the bar is after 0.2 s in steps as long as the accuracy allows, and how it turns.
Outcome slides(double accuracy, double friction) {
  const double quarter = M_PI / 4, side = 0.5;
  SceneText s(Method::by_accuracy(accuracy), 0.2);
  s.material("rock", 2500).interface("rock", "rock", friction);
  s.box("ridge", Vec3(1, 8, 1), Vec3(0, 0, -std::sqrt(0.5)), "fixed = true\n" + turned(Vec3(0, quarter, 0)));
  s.box("bar", Vec3(6, side, side), Vec3(-0.3, 0, side * std::sqrt(0.5)),
        velocity(Vec3(3, 1, 0)) + spin(Vec3(0, 0, 2)) + turned(Vec3(quarter, 0, 0)));
  return run_scene(s.str());
}

TEST(CrossedEdges, FollowAccuracy) {
  for (const double friction : {0.0, 0.3}) {
    const Outcome exact = slides(1e-8, friction);
    ASSERT_TRUE(exact.ok());
    for (const double accuracy : {1e-3, 1e-5}) {
      const Outcome o = slides(accuracy, friction);
      ASSERT_TRUE(o.ok());
      const double off = (o.last().position[1] - exact.last().position[1]).norm(),
                   spin_off = (o.last().spin[1] - exact.last().spin[1]).norm();
      // Before: 0.57 and 0.19 rad/s without friction, 0.24 and 0.04 with it.
      EXPECT_LT(off, accuracy) << friction << ' ' << accuracy;
      EXPECT_LT(spin_off, 200 * accuracy) << friction << ' ' << accuracy;
      EXPECT_LT(std::abs(o.last().ledger.algorithmic),
                0.016 * std::sqrt(accuracy) * o.rows.front().ledger.kinetic)
          << friction << ' ' << accuracy;
    }
  }
}

}  // namespace
}  // namespace talus::verify
