// Plates ten thousand times as wide as thick: what falls on a pile of them stays on it, whatever the first
// touch that a step finds at its end.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include <fmt/format.h>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

TEST(ThinPlates, FallOnEachOtherAndNotThrough) {
  const double thick = 1e-3;
  for (const int count : {2, 4, 10})
    for (const double drop : {5 * thick, 10 * thick, 100 * thick}) {
      SceneText s(Method::by_accuracy(1e-3), 0.5);
      s.history(0.005)
          .material("rock", 2500)
          .material("ground", 2500)
          .interface("*", "*", 0.5)
          .plane(Vec3::UnitZ());
      for (int i = 0; i < count; ++i)
        s.box(fmt::format("p{:02d}", i), Vec3(10, 10, thick),
              Vec3(0, 0, (i + 0.5) * thick + (i + 1 == count ? drop : 0)));
      const Outcome o = run_scene(s.str());
      ASSERT_TRUE(o.ok());
      for (int i = 0; i < count; ++i)
        EXPECT_NEAR(o.last().position[static_cast<std::size_t>(i)].z(), (i + 0.5) * thick, 1e-6)
            << count << ' ' << drop << ' ' << i;
      const double fallen = 2500 * 100 * thick * 9.81 * drop;
      // What lands within a time step is taken by the impact and the step together.
      EXPECT_NEAR(o.last().ledger.damping_work + o.last().ledger.numerical_dissipation(), fallen,
                  1e-3 * fallen)
          << count << ' ' << drop;
    }
}

}  // namespace
}  // namespace talus::verify
