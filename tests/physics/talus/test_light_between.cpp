// Light blocks on springs between heavy ones: a step that resolves the heavy ones alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double spring_stiffness = 1e8, heavy = 1e4;  // [N/m], [kg]

/// Energy that can be had of a row [J].
double energy_of(const sim::HistoryRow& r) {
  return r.ledger.kinetic + r.ledger.potential + r.ledger.strain + r.ledger.contact;
}

/// The most that any row has of energy beyond the row before it [J].
double made(const Outcome& o) {
  double most = 0;
  for (std::size_t i = 1; i < o.rows.size(); ++i)
    most = std::max(most, energy_of(o.rows[i]) - energy_of(o.rows[i - 1]));
  return most;
}

SceneText blocks(const Method& method, double duration, double interval, double light,
                 const std::string& more, double friction = 0) {
  SceneText s(method, duration);
  s.history(interval).material("heavy", heavy, more).material("light", light, more).material("ground", 2000);
  s.interface("*", "*", friction, "normal_stiffness = \"" + number(spring_stiffness) + " Pa/m\"")
      .plane(Vec3::UnitZ());
  return s;
}

/// A heavy cube at 0.1 m/s on a light one, both just in contact, over `duration`.
Outcome heavy_on_light(const Method& method, double light, double duration) {
  SceneText s = blocks(method, duration, duration, light, "");
  s.box("below", Vec3::Ones(), Vec3(0, 0, 0.5), velocity(Vec3(0, 0, -0.05)), "light")
      .box("above", Vec3::Ones(), Vec3(0, 0, 1.5), velocity(Vec3(0, 0, -0.1)), "heavy");
  return run_scene(s.str());
}

TEST(LightBetweenHeavy, TheHeavyOneGoesByOrderTwoWhereTheLightOneIsNotResolved) {
  // Springs in series, w = sqrt(k/2M); the light one's own frequency is 450 times that.
  constexpr double light = 0.1;
  const double w = std::sqrt(0.5 * spring_stiffness / heavy), end = 0.7 * M_PI / w,
               rest = -(2 * heavy + light) * g / spring_stiffness;
  const double expected = 1.5 + rest * (1 - std::cos(w * end)) - 0.1 / w * std::sin(w * end);
  double error[3];
  for (int i = 0; i < 3; ++i) {
    const Outcome o = heavy_on_light(Method::fixed_step(end / (16 << i)), light, end);
    ASSERT_TRUE(o.ok()) << o.result.message;
    error[i] = std::abs(o.last().position[1].z() - expected);
  }
  EXPECT_GE(error[0] / error[1], 3) << error[0] << " " << error[1];
  EXPECT_GE(error[1] / error[2], 3) << error[1] << " " << error[2];
  EXPECT_LE(error[0], 0.02 * 0.1 / w);
}

TEST(LightBetweenHeavy, NoStepMakesEnergyNorLeavesTheLightOneRinging) {
  // The light one comes up at 2 m/s between its springs as the heavy one comes down: steps of 1e-2 to 1e4 of
  // its frequency, of which those beyond 1 do not resolve it.
  constexpr double light = 10;
  const double w = std::sqrt(2 * spring_stiffness / light);
  for (const double phase : {1e-2, 1e-1, 0.5, 1.0, 2.0, 5.0, 10.0, 100.0, 1e3, 1e4}) {
    const double h = phase / w;
    // In 90 s the last digits of a tilt squeeze it out from between smooth faces, as far as it goes.
    const double friction = phase < 1e4 ? 0 : 0.1;
    SceneText s = blocks(Method::fixed_step(h), 40 * h, h, light, "", friction);
    s.box("below", Vec3::Ones(), Vec3(0, 0, 0.5), velocity(Vec3(0, 0, 2)), "light");
    s.box("above", Vec3::Ones(), Vec3(0, 0, 1.5), velocity(Vec3(0, 0, -0.1)), "heavy");
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok()) << phase << " " << o.result.message;
    EXPECT_LE(made(o), 1e-9 * heavy * g) << phase;
    if (phase < 2) continue;
    const double faster = std::abs(o.rows[20].velocity[0].z()) - std::abs(o.rows[20].velocity[1].z());
    EXPECT_LE(faster, 0.05) << phase;
  }
}

/// Light and heavy cubes by turns, 5 mm apart, fall upon each other.
Outcome fall(double accuracy, const std::string& material, const std::string& interface) {
  SceneText s(Method::by_accuracy(accuracy), 0.3);
  s.history(0.01)
      .material("heavy", 10000, material)
      .material("light", 10, material)
      .material("ground", 2000, material);
  s.interface("*", "*", 0.5, interface).plane(Vec3::UnitZ());
  for (int i = 0; i < 6; ++i)
    s.box("b" + std::to_string(i), Vec3::Ones(), Vec3(0, 0, 0.505 + 1.005 * i), "",
          i % 2 == 0 ? "light" : "heavy");
  return run_scene(s.str());
}

void expect_symmetric(const Outcome& o, double accuracy, int steps) {
  ASSERT_TRUE(o.ok()) << o.result.message;
  double moving = 0, aside = 0;
  for (const sim::HistoryRow& r : o.rows) {
    moving = std::max(moving, r.ledger.kinetic);
    for (const Vec3& x : r.position) aside = std::max(aside, x.head<2>().norm());
  }
  EXPECT_LE(aside, 1e-3 * accuracy);
  EXPECT_LE(made(o), accuracy * moving);
  EXPECT_LE(o.result.counters.steps, steps);
}

TEST(LightBetweenHeavy, ASymmetricFallStaysSymmetricAndCostsLittle) {
  // A step that resolved the light ones throughout would be of 1e-5 s and less: 60,000 at 1e-4.
  expect_symmetric(fall(1e-3, "", "normal_stiffness = \"1e9 Pa/m\""), 1e-3, 10000);
  expect_symmetric(fall(1e-4, "young = \"1 GPa\"\npoisson = 0.2\n", ""), 1e-4, 45000);
}

}  // namespace
}  // namespace talus::verify
