// Hertz's law with the moduli of its materials, as given or as the strength of concrete implies.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// Depth to which a tip sinks into a plane of that concrete at 5 m/s, over Hertz's (5/4 m v^2 / k)^(2/5) with
/// k = 4/3 E* sqrt(R), E of the concrete 21.5 GPa (f_cm / 10 MPa)^(1/3) [1].
double depth_over_hertz(const std::string& concrete) {
  constexpr double radius = 1, speed = 5, density = 2500, poisson = 0.2;
  const double mass = density * 4.0 / 3,  // octahedron of half-diagonal 1 m
      soft = (1 - poisson * poisson) * (1 / 50e9 + 1 / (21.5e9 * std::cbrt(4.8)));
  SceneText s(Method::by_accuracy(1e-5), 0.01, Vec3::Zero());
  s.history(1e-5)
      .material("rock", density, "young = 50e9\npoisson = 0.2")
      .material("C40", 2500, concrete + "\npoisson = 0.2")
      .interface("rock", "C40", 0, "contact_law = { kind = \"hertz\", radius = 1 }")
      .plane(Vec3::UnitZ(), Vec3::Zero(), "C40");
  const Vec3 at(0, 0, 1 + 1e-6);
  s.hull("B",
         {at + Vec3::UnitX(), at - Vec3::UnitX(), at + Vec3::UnitY(), at - Vec3::UnitY(), at + Vec3::UnitZ(),
          at - Vec3::UnitZ()},
         at, velocity(Vec3(0, 0, -speed)), "rock");
  const Outcome o = run_scene(s.str());
  EXPECT_TRUE(o.ok()) << o.result.message;
  double lowest = 1;
  for (const auto& r : o.rows) lowest = std::min(lowest, r.position[0].z());
  return (1 - lowest) / std::pow(1.25 * mass * speed * speed / (4.0 / 3 / soft * std::sqrt(radius)), 0.4);
}

/// By the strength alone the plan's E* counted the concrete's modulus and the force did not: it struck a
/// rigid plane, 29 % less deep.
TEST(Hertz, ConcreteByItsStrengthIsAsSoftAsByItsModulus) {
  EXPECT_NEAR(depth_over_hertz("f_cm = 48e6"), 1, 1e-3);  // rows 1e-5 s apart, of a contact of 3 ms
  EXPECT_NEAR(depth_over_hertz("young = " + number(21.5e9 * std::cbrt(4.8))), 1, 1e-3);
}

}  // namespace
}  // namespace talus::verify
