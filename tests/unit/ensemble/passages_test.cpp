// Ways of single blocks through lines and cells of maps, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "ensemble/ensemble.hpp"
#include "helpers/place.hpp"
#include "sim/world.hpp"

namespace talus::ensemble {
namespace {

using test::Place;

/// One box above a plane.
std::string falling(const std::string& block, const std::string& duration) {
  return R"(schema = 1
[simulation]
duration = ")" +
         duration + R"( s"
[[plane]]
normal = [0.0, 0.0, 1.0]
material = "ground"
[[material]]
name = "rock"
density = 2600
[[interface]]
between = ["rock", "ground"]
friction = 0.5
restitution = 0.0
normal_stiffness = "hard"
[[block]]
name = "B"
material = "rock"
shape = "box"
)" + block +
         R"(
[[line]]
name = "road"
points = [[2.02, -5.0], [2.02, 5.0]]
[ensemble]
members = 1
map_cell = "20 m"
[output]
report = false
)";
}

// A block that is no ball tumbles in flight: its spin is that of the crossing, not of the step's start.
TEST(Passages, SpinAtALineIsThatOfTheInstant) {
  const Place place;
  const std::string tumbling =
      "size = [1.0, 0.5, 0.2]\nposition = [0, 0, 10]\nvelocity = [7, 0, 0]\nspin = [1, 12, 1]";
  Ensemble ensemble(place.put("scene.toml", falling(tumbling, "0.6")).string(), {});
  const std::optional<Member> m = ensemble.run(0, nullptr);
  ASSERT_TRUE(m && m->crossings.size() == 1);
  const Crossing& c = m->crossings[0];
  sim::Simulation until(
      scene::read_scene(place.put("until.toml", falling(tumbling, fmt::format("{}", c.time))).string()));
  sim::Sink none;
  until.run(none);
  const Vec3 spin = until.world().system->state().blocks.w[0];
  EXPECT_GT((spin - Vec3(1, 12, 1)).norm(), 0.1);
  EXPECT_LT((c.spin - spin).norm(), 1e-6 * spin.norm()) << c.spin.transpose() << " " << spin.transpose();
}

// The greatest energy in a cell is that just before the blow, within a macro step that ends after it.
TEST(Passages, MapsKnowTheEnergyJustBeforeABlow) {
  for (const double height : {3.0, 3.1, 3.2, 3.3}) {
    const Place place;
    Ensemble ensemble(
        place
            .put("scene.toml", falling(fmt::format("size = [1, 1, 1]\nposition = [5, 5, {}]", height), "1.2"))
            .string(),
        {});
    const std::optional<Member> m = ensemble.run(0, nullptr);
    ASSERT_TRUE(m && m->passages.size() == 1);
    EXPECT_NEAR(m->passages[0].energy / (2600 * 9.81 * (height - 0.5)), 1, 5e-3) << height;
  }
}

// A cube between two walls, without gravity: it strikes them at 6.25 and at 31.25 ms, within one macro step,
// each blow halves its speed across, and a cell has the energy with which the cube comes into it.
TEST(Passages, MapsKnowTheWaysBetweenTheBlowsOfOneMacroStep) {
  const Place place;
  const std::string scene = R"(schema = 1
[simulation]
duration = "80 ms"
gravity = [0, 0, 0]
[[plane]]
point = [0, 0, -5]
normal = [0, 0, 1]
material = "ground"
[[plane]]
point = [0.5, 0, 0]
normal = [-1, 0, 0]
material = "ground"
[[plane]]
point = [-0.5, 0, 0]
normal = [1, 0, 0]
material = "ground"
[[material]]
name = "rock"
density = 2600
[[interface]]
between = ["rock", "ground"]
friction = 0
restitution = 0.5
normal_stiffness = "hard"
[[block]]
name = "B"
material = "rock"
shape = "box"
size = [0.5, 0.5, 0.5]
position = [0, 0, 0]
velocity = [40, 10, 0]
[ensemble]
members = 1
map_cell = "0.05 m"
[output]
report = false
)";
  Ensemble ensemble(place.put("scene.toml", scene).string(), {});
  const std::optional<Member> m = ensemble.run(0, nullptr);
  ASSERT_TRUE(m);
  const double mass = 2600 * 0.125, blows[] = {6.25e-3, 31.25e-3};
  std::map<std::pair<int, int>, double>
      expected;  // the greatest energy in a cell, and a moment of the path in it
  for (int k = 0; k <= 80000; ++k) {
    const double t = 1e-6 * k, y = 10 * t;
    const double x = t < blows[0]   ? 40 * t
                     : t < blows[1] ? 0.25 - 20 * (t - blows[0])
                                    : -0.25 + 10 * (t - blows[1]);
    const double across = t < blows[0] ? 40 : t < blows[1] ? 20 : 10;
    double& most = expected[{static_cast<int>(std::floor(x / 0.05)), static_cast<int>(std::floor(y / 0.05))}];
    most = std::max(most, 0.5 * mass * (across * across + 100));
  }
  int met = 0;
  for (const Passage& p : m->passages) {
    const auto cell = expected.find({p.i, p.j});
    if (cell == expected.end()) continue;  // touched at a corner
    EXPECT_NEAR(p.energy / cell->second, 1, 1e-6) << p.i << " " << p.j;
    ++met;
  }
  EXPECT_GE(met, 25);
  EXPECT_GE(met + 2, static_cast<int>(m->passages.size()));
}

}  // namespace
}  // namespace talus::ensemble
