// Restitution between a block and a deformable structure: dashpots of the contact's springs; hard contacts do
// not use it, and the plan says so.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

/// Rebound over approach of a block of 540 kg on a slab ten times as stiff as concrete, held below.
double rebound(const std::string& law) {
  SceneText s(Method::by_accuracy(1e-3), 0.03, Vec3::Zero());
  s.history(0.001).material("c", 2400, "young = 300e9\npoisson = 0.2").material("rock", 2500);
  s.interface("rock", "c", 0.5, law);
  s.box("B", Vec3(0.6, 0.6, 0.6), Vec3(0, 0, 0.81), "velocity = [0.0, 0.0, -5.0]\n");
  s.raw(structure_box("slab", Vec3(2, 2, 1), Vec3::Zero(), {6, 6, 3}, "c",
                      "support = [\"-z\"]\npreload = \"none\"\n"));
  const Outcome o = run_scene(s.str());
  EXPECT_TRUE(o.ok()) << o.result.message;
  return o.rows.empty() ? 0 : o.rows.back().velocity[0].z() / 5;
}

TEST(StructureRestitution, SpringsGiveBackWhatIsAskedFor) {
  for (const double e : {0.1, 0.4, 0.8, 1.0})
    EXPECT_NEAR(rebound(fmt::format("normal_stiffness = 1e7\nrestitution = {}", e)), e, 0.02) << e;
  EXPECT_NEAR(rebound("normal_stiffness = 1e7"), 1, 0.005);
}

TEST(StructureRestitution, HardContactsDoNotUseIt) {
  EXPECT_EQ(rebound("normal_stiffness = \"hard\"\nrestitution = 0.8"),
            rebound("normal_stiffness = \"hard\""));
}

/// A cube on the fixed skin of a structure, on a slope as steep as 1.06: it tips over at 1, with a resistance
/// of 0.1 at 1.124 (1 + 2 mu_r R / a).
TEST(StructureRestitution, RollingResistanceOnAFixedSkin) {
  const auto speed = [](double resistance) {
    const double angle = std::atan(1.06);
    SceneText s(Method::by_accuracy(1e-3), 0.1, 9.81 * Vec3(std::sin(angle), 0, -std::cos(angle)));
    s.history(0.01).material("c", 2400, "young = 30e9\npoisson = 0.2").material("rock", 2600);
    s.interface("rock", "c", 3,
                fmt::format("normal_stiffness = \"hard\"\nrolling_resistance = {}", resistance));
    s.box("B", Vec3::Ones(), Vec3(0, 0, 0.5));
    s.raw(structure_box("deck", Vec3(4, 4, 1), Vec3(0, 0, -0.5), {4, 4, 1}, "c",
                        "support = [\"-z\"]\npreload = \"none\"\n"));
    const Outcome o = run_scene(s.raw("[coupling]\nscheme = \"rigid\"\n").str());
    EXPECT_TRUE(o.ok()) << o.result.message;
    return o.rows.empty() ? 0 : o.last().velocity[0].norm();
  };
  EXPECT_LT(speed(0.1), 1e-6);
  EXPECT_GT(speed(0), 1e-3);
}

}  // namespace
}  // namespace talus::verify
