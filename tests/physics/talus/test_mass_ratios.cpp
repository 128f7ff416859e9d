// Blocks of masses far apart that bear on each other.
#include <gtest/gtest.h>

#include <cmath>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// A cube of 10 m falls aside of its centre on one of side s, by half of that, and tips over it onto the
/// ground.
Outcome boulder_on_pebble(double side, double accuracy, double interval) {
  SceneText s(Method::by_accuracy(accuracy), 12 * std::sqrt(side / g));
  s.history(interval * std::sqrt(side / g))
      .material("rock", 2500)
      .interface("rock", "*", 0.5)
      .plane(Vec3::UnitZ());
  s.box("pebble", Vec3::Constant(side), Vec3(0, 0, 0.5 * side), "deformable = false\n")
      .box("boulder", Vec3::Constant(10), Vec3(3, 0, 5 + 1.5 * side), "deformable = false\n");
  return run_scene(s.str());
}

TEST(MassRatios, BoulderComesToRestOnAPebble) {
  // Masses 1e6 to 1e12 apart. At rest the boulder stands on its edge at x = 8 m and on the pebble's edge; how
  // far it slides, up to some s, changes its height by s/8 m of s.
  for (const double side : {1e-1, 1e-2, 1e-3})
    for (const double accuracy : {1e-2, 1e-3})
      for (const double interval : {0.5, 5.0}) {
        if (interval > 1 && accuracy > 1e-3) continue;
        const Outcome o = boulder_on_pebble(side, accuracy, interval);
        ASSERT_TRUE(o.ok()) << side << " " << accuracy << " " << o.result.message;
        const double angle = std::atan(side / (8 - 0.5 * side)),
                     height = 5 * (std::sin(angle) + std::cos(angle));
        EXPECT_NEAR(o.last().position[1].z(), height, side * (side / 8 + accuracy))
            << side << " " << accuracy;
        EXPECT_LE(o.last().velocity[1].norm(), 1e-3 * std::sqrt(g * side)) << side << " " << accuracy;
        EXPECT_LE((o.last().position[0] - Vec3(0, 0, 0.5 * side)).norm(), 2 * side)
            << side << " " << accuracy;
      }
}

TEST(MassRatios, FreeClustersKeepTheirMomenta) {
  // Two boulders meet with a pebble between them, aside of their centres, without gravity: masses 1e9 apart.
  SceneText s(Method::by_accuracy(1e-3), 0.2, Vec3::Zero());
  s.history(0.01).material("rock", 2500).interface("rock", "rock", 0.5);
  s.box("left", Vec3::Ones(), Vec3(-0.502, 0.1, 0), velocity(Vec3(0.1, 0.02, 0)) + "deformable = false\n")
      .box("right", Vec3::Ones(), Vec3(0.502, 0, 0.1), velocity(Vec3(-0.1, 0, 0)) + "deformable = false\n");
  s.box("pebble", Vec3::Constant(1e-3), Vec3(0, 0.2, 0.1), "deformable = false\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  const auto momenta = [&](const sim::HistoryRow& row) {
    Vec3 momentum = Vec3::Zero(), centre = Vec3::Zero(), moment = Vec3::Zero();
    const double masses[] = {2500, 2500, 2.5e-6}, sides[] = {1, 1, 1e-3};
    for (std::size_t i = 0; i < 3; ++i) {
      momentum += masses[i] * row.velocity[i];
      centre += masses[i] * row.position[i];
      moment += masses[i] * row.position[i].cross(row.velocity[i]) +
                masses[i] * sides[i] * sides[i] / 6 * row.spin[i];
    }
    return std::tuple(momentum, centre, moment);
  };
  const auto [p0, c0, l0] = momenta(o.rows.front());
  const auto [p1, c1, l1] = momenta(o.last());
  EXPECT_LE((p1 - p0).norm(), 1e-13 * 2500);
  EXPECT_LE((c1 - c0 - 0.2 * p0).norm(), 1e-13 * 2500);
  EXPECT_LE((l1 - l0).norm(), 1e-13 * 2500);
  EXPECT_LE(o.last().velocity[0].x(), 0.05);  // they did meet
}

}  // namespace
}  // namespace talus::verify
