// Scanned blocks, of many corners, that slide on a plane: all of them within reach of a step, few in contact.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "sim/world.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// Corners on an ellipsoid of semi-axes 0.5, 0.4 and 0.3 m.
std::string scan(int corners) {
  std::string list = "vertices = [";
  for (int i = 0; i < corners; ++i) {
    const double z = 1 - (2 * i + 1.0) / corners, r = std::sqrt(1 - z * z),
                 turn = i * M_PI * (3 - std::sqrt(5.0));
    list += vector(Vec3(0.5 * r * std::cos(turn), 0.4 * r * std::sin(turn), 0.3 * z)) + ", ";
  }
  return list + "]\n";
}

TEST(ScansOnGround, SlideOnAHandfulOfContacts) {
  SceneText s(Method::by_accuracy(1e-3), 1);
  const double slope = 0.6, friction = 0.5;
  s.history(0.1)
      .material("rock", 2600)
      .interface("rock", "rock", friction)
      .plane(Vec3(std::sin(slope), 0, std::cos(slope)), Vec3::Zero(), "rock");
  s.raw("[[block]]\nname = \"B\"\nmaterial = \"rock\"\nshape = \"convex\"\n" + scan(400) + "position = " +
        vector(0.35 * Vec3(std::sin(slope), 0, std::cos(slope))) + "\n" + turned(Vec3(0, slope, 0)));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  const auto n = o.simulation->world().counters();
  EXPECT_LT(static_cast<double>(n.contacts), 10.0 * static_cast<double>(n.steps));
}

}  // namespace
}  // namespace talus::verify
