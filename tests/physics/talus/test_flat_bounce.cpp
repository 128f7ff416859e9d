// A box that falls flat on a plane meets it with four corners at once; restitution gives each its speed back,
// and no energy rule halves it.
#include <gtest/gtest.h>

#include <cmath>

#include <fmt/format.h>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

double flat_rebound(double restitution) {
  const double fall = std::sqrt(2 / 9.81);
  SceneText s(Method::by_accuracy(1e-3), 1.2 * fall);
  s.material("rock", 2600)
      .interface("rock", "ground", 0.5,
                 fmt::format("normal_stiffness = \"hard\"\nrestitution = {}", restitution), 1e8)
      .plane(Vec3::UnitZ())
      .box("B", Vec3::Ones(), Vec3(0, 0, 1.5));
  const Outcome o = run_scene(s.str());
  const double z = o.last().position[0].z() - 0.5, v = o.last().velocity[0].z();
  return std::sqrt(z + v * v / (2 * 9.81));  // of the height of fall, 1 m
}

TEST(FlatBounce, GivesTheSpeedBack) {
  for (const double e : {0.3, 0.7, 1.0}) EXPECT_NEAR(flat_rebound(e), e, 1e-9) << e;
}

}  // namespace
}  // namespace talus::verify
