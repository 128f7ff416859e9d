// until = "rest": blocks that fall past everything that is held are not waited for.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// A block lies on a ledge; with `astray` another falls beside it.
std::string ledge(bool astray, const std::string& end) {
  SceneText s(Method::by_accuracy(1e-3), 20, {0, 0, -9.81}, end);
  s.history(0.05).material("rock", 2600).interface("rock", "rock", 0.5);
  s.box("ledge", Vec3(2, 2, 1), Vec3(0, 0, 0), "fixed = true\n").box("lying", Vec3::Ones(), Vec3(0, 0, 1));
  if (astray) s.box("astray", Vec3::Ones(), Vec3(5, 0, 3));
  return s.str();
}

TEST(UntilRest, BlocksThatLeftTheModelAreNotWaitedFor) {
  const Outcome o = run_scene(ledge(true, "until = \"rest\"\n"));
  ASSERT_TRUE(o.ok());
  // Its highest point is below the lowest of the ledge: 3 m and two radii down, by the next row.
  EXPECT_EQ(o.result.status, "at rest");
  EXPECT_GT(o.last().time, std::sqrt(2 * 3 / 9.81));
  EXPECT_LT(o.last().time, 2);
  EXPECT_EQ(o.simulation->departed(), std::vector<std::string>{"astray"});
}

TEST(UntilRest, WhereAllHaveLeftTheModelNothingIsAtRest) {
  SceneText s(Method::by_accuracy(1e-3), 20, {0, 0, -9.81}, "until = \"rest\"\n");
  s.history(0.05).material("rock", 2600).interface("rock", "rock", 0.5);
  s.box("ledge", Vec3(2, 2, 1), Vec3(0, 0, 0), "fixed = true\n").box("astray", Vec3::Ones(), Vec3(5, 0, 3));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.status, "all left");
  EXPECT_LT(o.last().time, 2);
}

TEST(UntilRest, NobodyDepartsWhileSomethingBelowCouldHoldIt) {
  const Outcome o = run_scene(ledge(false, "until = \"rest\"\n"));
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.status, "at rest");
  EXPECT_TRUE(o.simulation->departed().empty());
}

/// A plate that rocks on a foot of 6 mm, 0.6 m high, by 70 um/s of its edges: each blow leaves r of its spin
/// [housner1963], so that it has r^2n of its energy after n of them. Taken in as resting contact, the edges
/// sank in within a step and were lifted again: it gained two thirds and went on for ever.
TEST(UntilRest, SlowRockingOnANarrowFootDiesAway) {
  constexpr double half_width = 0.003, half_height = 0.3, spin_0 = 0.012, g = 9.81, end = 4;
  const double radius = std::hypot(half_width, half_height), lean = std::atan(half_width / half_height),
               p_sq = 0.75 * g / radius, r = 1 - 0.75 * (1 - std::cos(2 * lean));
  for (const int plates : {1, 13}) {
    SceneText s(Method::by_accuracy(1e-3), end);
    s.history(0.01)
        .material("rock", 2600)
        .interface("rock", "*", 0.8, "normal_stiffness = \"hard\"\nrestitution = 0.05\n")
        .plane(Vec3::UnitZ());
    for (int k = 0; k < plates; ++k)
      s.box(fmt::format("B{}", k), Vec3(2 * half_width, 0.6, 2 * half_height), Vec3(0, k, half_height),
            velocity(Vec3(spin_0 * half_height, 0, 0)) + spin(Vec3(0, spin_0, 0)));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    int blows = 0;
    for (double t = 0, w = spin_0; t < end; ++blows, w *= r) t += 2 * w / (p_sq * std::sin(lean));
    const auto energy = [](const sim::HistoryRow& row) { return row.ledger.kinetic + row.ledger.potential; };
    const double rest = plates * 2600 * 4 * half_width * half_height * 0.6 * g * half_height,
                 start = energy(o.rows[1]) - rest;
    for (std::size_t i = 1; i < o.rows.size(); ++i)
      EXPECT_LT(energy(o.rows[i]) - rest, start * 1.01) << plates << " at " << o.rows[i].time;
    const double left = (energy(o.last()) - rest) / start;
    EXPECT_LT(left, 1);
    EXPECT_GT(left, 0.75 * std::pow(r, 2 * blows)) << plates;  // the scheme may lose 0.01 a second of rocking
  }
}

}  // namespace
}  // namespace talus::verify
