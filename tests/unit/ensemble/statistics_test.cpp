#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ensemble/random.hpp"
#include "ensemble/statistics.hpp"

namespace talus::ensemble {
namespace {

TEST(Percentile, InterpolatesBetweenOrderStatistics) {
  const std::vector<double> x{1, 2, 4, 8};
  EXPECT_DOUBLE_EQ(percentile(x, 50), 3);
  EXPECT_DOUBLE_EQ(percentile(x, 90), 6.8);  // place 2.7: 4 + 0.7 (8 - 4)
  EXPECT_DOUBLE_EQ(percentile(x, 100), 8);
  EXPECT_TRUE(std::isnan(percentile({}, 50)));
}

TEST(Percentile, AsManyValuesAsBoundItByTheLargest) {
  EXPECT_EQ(enough_for(95), 59);
  EXPECT_EQ(enough_for(5), 1);
  EXPECT_EQ(enough_for(50), 5);
  EXPECT_EQ(enough_for(99), 299);
}

// Of 7 in 20: Newcombe 1998, and in closed form.
TEST(Wilson, ClosedForm) {
  const Estimate e = wilson(7, 20);
  EXPECT_DOUBLE_EQ(e.value, 0.35);
  const double z = 1.959963984540054, c = (0.35 + z * z / 40) / (1 + z * z / 20),
               h = z / (1 + z * z / 20) * std::sqrt(0.35 * 0.65 / 20 + z * z / 1600);
  EXPECT_NEAR(e.low, c - h, 1e-15);
  EXPECT_NEAR(e.high, c + h, 1e-15);
  EXPECT_EQ(wilson(0, 10).low, 0);
  EXPECT_NEAR(wilson(0, 10).high, z * z / (10 + z * z), 1e-15);
}

std::vector<Sample> exponential(int members, std::uint32_t seed, double crossing) {
  std::vector<Sample> s;
  for (int i = 0; i < members; ++i) {
    const auto k = static_cast<std::uint64_t>(i);
    s.push_back({i, uniform_of(bits(seed, for_draws, k, 1, 0)) < crossing,
                 -std::log(uniform_of(bits(seed, for_draws, k, 0, 0)))});
  }
  return s;
}

// 95 % intervals hold the true percentile in about 95 of 100 ensembles: of 100, at least 88 (a share of 0.95
// gives less in 1 of 300).
TEST(Bootstrap, IntervalsHoldTheTruth) {
  int median = 0, ninety = 0;
  const std::vector<double> percents{50, 90};
  for (std::uint32_t seed = 1; seed <= 100; ++seed) {
    const auto e = Bootstrap(exponential(400, seed, 0.6), seed, false).percentiles(percents);
    median += e[0].low <= std::log(2.0) && std::log(2.0) <= e[0].high;
    ninety += e[1].low <= std::log(10.0) && std::log(10.0) <= e[1].high;
  }
  EXPECT_GE(median, 88);
  EXPECT_GE(ninety, 88);
}

// 59 values bound a 95th percentile from above and a 5th from below; any number bounds the other end of each.
TEST(Bootstrap, AnEndThatTheSampleDoesNotBoundIsNone) {
  const std::vector<double> percents{5, 50, 95};
  for (const bool replicated : {false, true})
    for (const int members : {4, 58, 59}) {
      const auto e = Bootstrap(exponential(members, 3, 1), 1, replicated).percentiles(percents);
      EXPECT_EQ(std::isfinite(e[0].low), members == 59) << members;
      EXPECT_TRUE(std::isfinite(e[0].high));
      EXPECT_EQ(std::isfinite(e[1].low), members > 4);
      EXPECT_EQ(std::isfinite(e[1].high), members > 4);
      EXPECT_TRUE(std::isfinite(e[2].low));
      EXPECT_EQ(std::isfinite(e[2].high), members == 59);
    }
  EXPECT_EQ(interval_text({2, 1, none}, 1e3), "1e+03 or more");
  EXPECT_EQ(interval_text({2, none, 3}), "3 or less");
  EXPECT_EQ(interval_text({2, 1.25, 3}, 1, 2), "1.2 to 3");
  EXPECT_EQ(interval_text({2, none, none}), "");
}

TEST(Bootstrap, IsTheSameForTheSameSeedAndNotOfNothing) {
  const std::vector<double> percents{95};
  const auto s = exponential(300, 5, 0.5);
  const Estimate a = Bootstrap(s, 9, false).percentiles(percents)[0],
                 b = Bootstrap(s, 9, false).percentiles(percents)[0];
  EXPECT_EQ(a.low, b.low);
  EXPECT_EQ(a.high, b.high);
  EXPECT_TRUE(std::isnan(Bootstrap(exponential(50, 1, 0), 1, false).percentiles(percents)[0].value));
  EXPECT_EQ(Bootstrap(exponential(50, 1, 0), 1, false).probability().value, 0);
}

}  // namespace
}  // namespace talus::ensemble
