#include "core/bisect.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace talus {

TEST(Bisect, EndsAtNeighboursOfTheRootWhereverItLies) {
  for (const double root : {1e-12, 0.3, 1.0, 7.0, 999.9}) {
    const auto [low, high] = bisect(0, 1000, [&](double x) { return x < root; });
    EXPECT_LT(low, root);
    EXPECT_GE(high, root);
    EXPECT_LE(high - low, std::max(4e-16 * root, 1e-27));  // a hundred halvings of what was given
  }
}

TEST(Bisect, OfARootAtNothingLeavesAMillionthOfATrillionth) {
  const auto [low, high] = bisect(0, 1, [](double x) { return x < 0; });
  EXPECT_EQ(low, 0);
  EXPECT_LT(high, 1e-18);
  EXPECT_GT(high, 0);
}

TEST(Bisect, GoesDownwardsAsWell) {
  const auto [low, high] = bisect(-1, -3, [](double x) { return x > -2; });
  EXPECT_NEAR(low, -2, 1e-15);
  EXPECT_NEAR(high, -2, 1e-15);
}

}  // namespace talus
