// Stacks of straining cubes that swing together: each spring gives less than the accuracy, all of them more.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "verify/scene_text.hpp"
#include "verify/suite.hpp"

namespace talus::verify {
namespace {

/// Cubes of 1 m and 1 GPa on each other, let go unstrained; how far the topmost sinks at most [m].
double sinks(int count, double accuracy, double duration) {
  SceneText s(Method::by_accuracy(accuracy), duration);
  s.history(5e-4)
      .material("rock", 2500, "young = 1e9\npoisson = 0.25")
      .material("ground", 2500)
      .interface("*", "*", 0.5, "");  // springs as chosen: E over the size
  s.raw("[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nmaterial = \"ground\"\n");
  for (int k = 0; k < count; ++k)
    s.raw("[[block]]\nname = \"b" + std::to_string(k) +
          "\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1, 1, 1]\nposition = [0, 0, " +
          std::to_string(k) + ".5]\ndeformable = true\n");
  const Outcome o = run_scene(s.str());
  EXPECT_TRUE(o.ok()) << o.result.message;
  double lowest = count;
  for (const sim::HistoryRow& r : o.rows)
    lowest = std::min(lowest, r.position[static_cast<std::size_t>(count - 1)].z());
  return count - 0.5 - lowest;
}

/// 12 cubes: n^2 W / 2 E of strain and n (n + 1) / 2 W / k of the springs, 3.7 mm at rest, is nearly doubled
/// by the swing; 7.332 mm by this program at accuracy 1e-5. It sank 4.6 and 5.9 mm at 1e-3 and 1e-4, 2.7 and
/// 14 times the accuracy off.
TEST(DeformableStack, SwingsByTheAccuracyAskedFor) {
  for (const double accuracy : {1e-2, 1e-3, 1e-4})
    EXPECT_NEAR(sinks(12, accuracy, 0.1), 7.332e-3, 1.2 * accuracy);
}

/// The more springs share the swing, the less of it each has: 30 cubes were 10 and 38 times the accuracy off
/// from 44.82 mm.
TEST(DeformableStack, HoweverManySpringsShareTheSwing) {
  EXPECT_NEAR(sinks(30, 1e-3, 0.2), 44.82e-3, 1.2e-3);
}

}  // namespace
}  // namespace talus::verify
