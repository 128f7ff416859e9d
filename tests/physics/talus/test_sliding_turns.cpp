// Friction of what turns as it slides: by the accuracy asked for, not by the history interval.
#include <gtest/gtest.h>

#include <cmath>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double g = 9.81, friction = 0.3;

/// A triangular prism on its face, 0.4 m high: three corners press, each as much as the moments ask.
SceneText prism(const Method& m, double duration, const std::vector<Eigen::Vector2d>& corners,
                const std::string& motion) {
  std::vector<Vec3> points;
  for (const double z : {0.0, 0.4})
    for (const Eigen::Vector2d& c : corners) points.emplace_back(c.x(), c.y(), z);
  SceneText s(m, duration);
  s.material("rock", 2600).interface("rock", "ground", friction).plane(Vec3::UnitZ());
  s.hull("B", points, Vec3(0, 0, 0.2), motion);
  return s;
}

double turned_by(const sim::HistoryRow& row) {
  return 2 * std::atan2(row.orientation[0][3], row.orientation[0][0]);
}

/// Equilateral, corners 1 m from its axis: the couple of friction is mu m g R at any speed, I = m R^2 / 4.
TEST(SlidingTurns, SpinsToRest) {
  const double spin0 = 6, slows = friction * g / 0.25, angle = spin0 * spin0 / (2 * slows);
  std::vector<Eigen::Vector2d> corners;
  for (int k = 0; k < 3; ++k) corners.emplace_back(std::cos(2 * M_PI * k / 3), std::sin(2 * M_PI * k / 3));
  for (const double history : {0.05, 1.0}) {
    SceneText s = prism(Method::by_accuracy(1e-3), 1, corners, spin(Vec3(0, 0, spin0)));
    const Outcome o = run_scene(s.history(history).str());
    ASSERT_TRUE(o.ok());
    EXPECT_NEAR(turned_by(o.last()), angle,
                3e-3);  // 0.01 and 0.05 with friction against the slip at the end of the step
    EXPECT_LT(o.last().spin[0].norm(), 1e-9);
  }
}

/// No closed form: the error falls with the accuracy, whatever the history interval.
TEST(SlidingTurns, SlidesAndSpinsByTheAccuracyAskedFor) {
  const std::vector<Eigen::Vector2d> corners = {{1.1, 0}, {-0.5, 0.7}, {-0.6, -0.7}};
  const auto end = [&](double accuracy, double history) {
    SceneText s =
        prism(Method::by_accuracy(accuracy), 1, corners, velocity(Vec3(2, 0.3, 0)) + spin(Vec3(0, 0, 3)));
    const Outcome o = run_scene(s.history(history).str());
    EXPECT_TRUE(o.ok());
    return o.last().position[0];
  };
  const Vec3 exact = end(1e-8, 0.05);
  EXPECT_LT((end(1e-3, 0.05) - exact).norm(), 1e-3);
  EXPECT_LT((end(1e-3, 1.0) - exact).norm(), 1e-3);
  EXPECT_LT((end(1e-5, 1.0) - exact).norm(), 5e-5);
}

}  // namespace
}  // namespace talus::verify
