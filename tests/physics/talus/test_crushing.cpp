// Contact laws that crush, away from structures: the energy is pressure times the volume that the block has come through.
#include <gtest/gtest.h>

#include <cmath>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double density = 2500, pressure = 2e6, speed = 3;

std::string crushing(const std::string& stiffness) { return "normal_stiffness = \"" + stiffness + "\"\ncontact_law = { kind = \"crushing\", pressure = " + number(pressure) + " }"; }

/// A block thrown at the ground by 3 m/s without gravity.
Outcome thrown(SceneText& s, const std::string& stiffness) {
  s.history(2e-4).material("rock", density).interface("rock", "ground", 0, crushing(stiffness)).plane(Vec3::UnitZ());
  return run_scene(s.str());
}

double lowest(const Outcome& o) {
  double z = o.rows.front().position[0].z();
  for (const auto& r : o.rows) z = std::min(z, r.position[0].z());
  return z;
}

TEST(Crushing, FlatFaceSinksByItsEnergyOverForce) {
  SceneText s(Method::by_accuracy(1e-4), 0.1, Vec3::Zero());
  s.box("B", Vec3::Ones(), Vec3(0, 0, 0.501), velocity(Vec3(0, 0, -speed)));
  const Outcome o = thrown(s, "10 GPa/m");
  ASSERT_TRUE(o.ok()) << o.result.message;
  const double deep = 0.5 * density * speed * speed / pressure + 0.5 * pressure / 10e9;   // on the way down to the pressure springs take half of its energy
  EXPECT_NEAR(0.5 - lowest(o), deep, 1e-3 * deep);
}

/// A pyramid on its tip, whose cut at depth d is 3 d^2, the area that a corner is taken for: p d^3 = m v^2 / 2. With the area of its first touch, whatever its depth, it went through the ground.
TEST(Crushing, TipSinksByItsEnergyOverThePressedVolume) {
  const double half = 0.5 * std::sqrt(3.0), mass = density;   // a base of 3 m^2 a metre above the tip
  const double deep = std::cbrt(0.5 * mass * speed * speed / pressure);
  for (const char* stiffness : {"10 GPa/m", "1 GPa/m", "1 GN/m"}) {
    SceneText s(Method::by_accuracy(1e-4), 0.2, Vec3::Zero());
    s.hull("B", {Vec3(0, 0, 0.001), Vec3(half, half, 1.001), Vec3(half, -half, 1.001), Vec3(-half, half, 1.001), Vec3(-half, -half, 1.001)}, Vec3(0, 0, 0.751), velocity(Vec3(0, 0, -speed)));
    const Outcome o = thrown(s, stiffness);
    ASSERT_TRUE(o.ok()) << o.result.message;
    EXPECT_NEAR(0.75 - lowest(o), deep, 0.03 * deep) << stiffness;
    EXPECT_NEAR(o.last().ledger.damping_work, 0.5 * mass * speed * speed, 0.05 * 0.5 * mass * speed * speed) << stiffness;   // springs give next to nothing back
    EXPECT_NEAR(o.last().ledger.algorithmic, 0, 1e-3 * 0.5 * mass * speed * speed) << stiffness;
  }
}

}  // namespace
}  // namespace talus::verify
