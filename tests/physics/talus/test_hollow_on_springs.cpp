// Hollow blocks on springs: a corner that comes out of a notch lies deep in the other block.
#include <gtest/gtest.h>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// One rock with dents falls onto another that comes to the ground. Its corner was found 17 mm inside the
/// other and made a hard contact, where its spring's energy was lost: 1.8 % of the kinetic energy, 180 times
/// what the accuracy allows. Sides of that contact that are a depth apart slip past each other where its
/// equation, for one point of both, had stopped: steps of 1e-6 s without end looked for the stop.
TEST(HollowOnSprings, CornerOutOfANotchKeepsTheEnergyOfItsPair) {
  SceneText s(Method::by_accuracy(1e-4), 0.32);
  const std::string law = "normal_stiffness = \"1e8 Pa/m\"\ndamping_ratio = 1.0";
  s.history(0.01).material("rock", 2500).material("ground", 2500).plane(Vec3::UnitZ());
  s.interface("rock", "rock", 2, law).interface("rock", "ground", 2, law);
  const auto rock = [&](int seed, double height, const Vec3& turn) {
    s.raw(
        "[[block]]\nmaterial = \"rock\"\nshape = \"random-concave\"\nvolume = 0.15\ndeformable = false\nseed "
        "= " +
        std::to_string(seed) + "\nposition = " + vector(Vec3(0, 0, height)) + "\n" +
        velocity(Vec3(0, 0, -3)) + turned(turn));
  };
  rock(67, 1, Vec3(-1.49, 0.71, 0.24));
  rock(75, 2.365, Vec3(1.5, 0.29, -0.07));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  double fastest = 0, off = 0;
  for (const auto& row : o.rows) {
    fastest = std::max(fastest, row.ledger.kinetic);
    off = std::max(off, std::abs(row.ledger.algorithmic));
  }
  EXPECT_LT(off, 1e-4 * fastest);  // accuracy
  EXPECT_LT(o.result.counters.steps, 300);
}

}  // namespace
}  // namespace talus::verify
