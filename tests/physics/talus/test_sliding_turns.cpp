// Friction of what turns as it slides: by the accuracy asked for, not by the history interval.
#include <gtest/gtest.h>

#include <cmath>

#include <fmt/format.h>

#include "sim/world.hpp"
#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double friction = 0.3;

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

/// Round plates side by side slide down and across a slope as each of them alone does: what moves along with
/// them is none of their concern. Taken as one heap they went up to 7.6 mm beside their way.
TEST(SlidingTurns, PlatesBesideEachOtherGoAsOneAlone) {
  constexpr int corners = 30;
  constexpr double radius = 0.5, pitch = 1.05, slope = 25 * M_PI / 180;
  std::vector<Vec3> points;
  for (const double z : {0.0, 0.2})
    for (int k = 0; k < corners; ++k)
      points.emplace_back(radius * std::cos(2 * M_PI * k / corners),
                          radius * std::sin(2 * M_PI * k / corners), z);
  const auto slides = [&](int plates, double accuracy) {
    SceneText s(Method::by_accuracy(accuracy), 1, g * Vec3(std::sin(slope), 0, -std::cos(slope)));
    s.material("rock", 2500).interface("rock", "ground", 0.6).interface("rock", "rock", 0.6);
    s.plane(Vec3::UnitZ());
    for (int i = 0; i < plates; ++i)
      s.hull(fmt::format("B{:02}", i), points, Vec3(pitch * (i / 4), pitch * (i % 4), 0.1),
             velocity(Vec3(0, 3, 0)));
    return run_scene(s.str());
  };
  const Outcome alone = slides(1, 1e-6), all = slides(12, 1e-3);
  ASSERT_TRUE(alone.ok() && all.ok());
  const Vec3 way = alone.last().position[0] - Vec3(0, 0, 0.1);
  for (int i = 0; i < 12; ++i) {
    const Vec3 from(pitch * (i / 4), pitch * (i % 4), 0.1);
    EXPECT_LT((all.last().position[static_cast<std::size_t>(i)] - from - way).norm(), 1e-3 * radius) << i;
  }
}

/// A box slides on an edge and turns, held upright by its resistance to rolling. How its two corners and its
/// couple share a moment that both could bear is not determined, and friction makes another motion of each
/// share: a step and the accelerations at its ends took different ones, so that steps were short without end,
/// and the ways at two accuracies were 3e-3 m apart.
TEST(SlidingTurns, OnAnEdgeThatResistsRolling) {
  const Vec3 size(2, 0.7, 1), size_fast(1.3, 0.9, 1.1);
  const auto slid = [](const Vec3& of, double tilt, double turns, double accuracy) {
    SceneText s(Method::by_accuracy(accuracy), 1);
    s.history(0.5).material("rock", 2500).plane(Vec3::UnitZ());
    s.interface("rock", "ground", friction, "normal_stiffness = \"hard\"\nrolling_resistance = 0.3");
    s.box("B", of, Vec3(0, 0, 0.5 * (of.y() * std::sin(tilt) + of.z() * std::cos(tilt))),
          "deformable = false\n" + velocity(Vec3(2, 0.5, 0)) + spin(Vec3(0, 0, turns)) +
              turned(Vec3(tilt, 0, 0)));
    return run_scene(s.str());
  };
  const Outcome o = slid(size, 0.6107, 0.3, 1e-3);
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_LT(o.simulation->world().counters().steps, 300);
  const Outcome coarse = slid(size_fast, 0.685, 1, 1e-3), fine = slid(size_fast, 0.685, 1, 1e-4);
  ASSERT_TRUE(coarse.ok() && fine.ok());
  EXPECT_LT((coarse.last().position[0] - fine.last().position[0]).norm(), 1e-3 * size_fast.minCoeff());
}

}  // namespace
}  // namespace talus::verify
