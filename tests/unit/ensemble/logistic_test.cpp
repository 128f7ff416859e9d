// Curves of damage classes over an energy: closed forms, and what no curves may do.
#include "ensemble/fragility/logistic.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace talus::ensemble {
namespace {

/// Of two values of x the estimate with Jeffreys' prior is (reached + 1/2) / (runs + 1) at each.
TEST(Logistic, TwoPlacesHaveTheirClosedForm) {
  std::vector<double> x;
  std::vector<int> grade;
  const auto add = [&](double at, int reached, int runs) {
    for (int i = 0; i < runs; ++i) x.push_back(at), grade.push_back(i < reached ? 3 : 0);
  };
  add(12, 0, 5), add(15, 6, 7);
  const std::vector<Logistic> fits = fit_logistic(x, grade, 4);
  ASSERT_TRUE(fits[0].fitted && fits[1].fitted && fits[2].fitted);  // the same runs reach all three
  EXPECT_FALSE(fits[3].fitted);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(fits[static_cast<std::size_t>(k)].at(12).value, 0.5 / 6, 1e-6);
    EXPECT_NEAR(fits[static_cast<std::size_t>(k)].at(15).value, 6.5 / 8, 1e-6);
  }
  // Variance of a logit: 1 / (n p (1 - p)).
  const double p = 6.5 / 8, half = 1.959963984540054 / std::sqrt(7 * p * (1 - p));
  const Logistic::Band band = fits[2].at(15);
  EXPECT_NEAR(std::log(band.high / (1 - band.high)) - std::log(p / (1 - p)), half, 1e-5);
}

/// Of so many outcomes that they are as the law has them, the law's parameters.
TEST(Logistic, TheLawOfTheOutcomesIsFound) {
  const double a[] = {-19, -21, -22.5, -25}, b = 1.6;
  std::vector<double> x;
  std::vector<int> grade;
  constexpr int runs = 400;
  for (int i = 0; i <= 40; ++i) {
    const double at = 9 + 0.2 * i;
    for (int q = 0; q < runs; ++q) {
      int k = 0;
      while (k < 4 && 1 / (1 + std::exp(-(a[k] + b * at))) > (q + 0.5) / runs) ++k;
      x.push_back(at), grade.push_back(k);
    }
  }
  const std::vector<Logistic> fits = fit_logistic(x, grade, 4);
  for (std::size_t k = 0; k < 4; ++k) {
    ASSERT_TRUE(fits[k].fitted);
    // The standard error of b is 0.02; outcomes by quantiles scatter far less.
    EXPECT_NEAR(fits[k].b, b, 0.005);
    EXPECT_NEAR(fits[k].a, a[k], 0.08);
    EXPECT_LT(fits[k].deviance, fits[k].null_deviance);
  }
}

/// Strong hits that came to moderate damage and weak ones to none or severe: by themselves the curves of the
/// classes would cross.
TEST(Logistic, AWorseClassIsNowhereLikelier) {
  const std::vector<double> x{8, 9, 10, 11, 12, 13, 14, 15, 16, 17};
  const std::vector<int> grade{3, 0, 0, 3, 2, 0, 2, 2, 2, 2};
  const std::vector<Logistic> fits = fit_logistic(x, grade, 4);
  ASSERT_TRUE(fits[1].fitted && fits[2].fitted);
  for (double at = 5; at < 20; at += 0.5) {
    EXPECT_LT(fits[2].at(at).value, fits[1].at(at).value) << at;
    EXPECT_EQ(fits[0].at(at).value, fits[1].at(at).value) << at;
  }
}

/// Outcomes that do not overlap, few of them, all alike, or at one place.
TEST(Logistic, TheEdges) {
  const std::vector<double> x{10, 11, 12, 13};
  const std::vector<Logistic> apart = fit_logistic(x, std::vector<int>{0, 0, 4, 4}, 4);
  ASSERT_TRUE(apart[0].fitted);
  EXPECT_TRUE(std::isfinite(apart[0].b) && apart[0].b > 0);
  EXPECT_NEAR(apart[0].at(11.5).value, 0.5, 1e-6);
  for (const std::vector<int>& same : {std::vector<int>{0, 0, 0, 0}, std::vector<int>{4, 4, 4, 4}})
    for (const Logistic& f : fit_logistic(x, same, 4)) EXPECT_FALSE(f.fitted);
  EXPECT_FALSE(fit_logistic(std::vector<double>{1, 2, 3}, std::vector<int>{0, 1, 1}, 4)[0].fitted);
  EXPECT_FALSE(fit_logistic(std::vector<double>(4, 7.0), std::vector<int>{0, 1, 0, 1}, 4)[0].fitted);
  const std::vector<Logistic> each = fit_logistic(x, std::vector<int>{0, 1, 2, 3}, 4);
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(each[static_cast<std::size_t>(k)].fitted);
}

}  // namespace
}  // namespace talus::ensemble
