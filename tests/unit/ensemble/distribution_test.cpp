// Draws against closed forms: means, percentiles, the distance of Kolmogorov.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "ensemble/distribution.hpp"
#include "ensemble/random.hpp"
#include "ensemble/sobol.hpp"

namespace talus::ensemble {
namespace {

using Kind = scene::Vary::Kind;

scene::Vary vary(Kind kind, std::array<double, 3> parameters) {
  scene::Vary v;
  v.key = "x";
  v.kind = kind;
  v.parameters = parameters;
  return v;
}

std::vector<double> draws(const Distribution& d, int n) {
  std::vector<double> x;
  for (int i = 0; i < n; ++i)
    x.push_back(d.quantile(uniform_of(bits(7, for_draws, static_cast<std::uint64_t>(i), 0, 0))));
  std::sort(x.begin(), x.end());
  return x;
}

/// Largest difference of the draws' distribution function from `below`.
template <class Below>
double kolmogorov(const std::vector<double>& sorted, Below below) {
  double most = 0;
  const auto n = static_cast<double>(sorted.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const double f = below(sorted[i]);
    most = std::max({most, f - static_cast<double>(i) / n, static_cast<double>(i + 1) / n - f});
  }
  return most;
}

constexpr int n = 20000;
/// Passed by chance in 1 of 1000 ensembles of draws [Kolmogorov's distribution, 1.95 / sqrt n].
const double limit = 1.95 / std::sqrt(n);

// Philox4x32-10 of the counters and keys of the authors' known answers (Random123, kat_vectors).
TEST(Random, PhiloxKnownAnswers) {
  EXPECT_EQ(philox({0, 0, 0, 0}, 0, 0), (Counter{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, 0xffffffff, 0xffffffff),
            (Counter{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, 0xa4093822, 0x299f31d0),
            (Counter{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Distribution, LognormalHasTheMeanAndDeviationOfTheQuantity) {
  const auto x = draws(Distribution(vary(Kind::lognormal, {1.5, 0.6, 0})), n);
  double mean = 0, square = 0;
  for (const double v : x) mean += v / n, square += v * v / n;
  EXPECT_NEAR(mean, 1.5, 4 * 0.6 / std::sqrt(n));  // four standard errors
  EXPECT_NEAR(std::sqrt(square - mean * mean), 0.6, 0.02);
  const double sigma = std::sqrt(std::log(1 + 0.16)), mu = std::log(1.5) - 0.5 * sigma * sigma;
  EXPECT_LT(kolmogorov(
                x, [&](double v) { return 0.5 * std::erfc(-(std::log(v) - mu) / (sigma * std::sqrt(2.0))); }),
            limit);
}

TEST(Distribution, Normal) {
  const auto x = draws(Distribution(vary(Kind::normal, {-3, 2, 0})), n);
  EXPECT_LT(kolmogorov(x, [](double v) { return 0.5 * std::erfc(-(v + 3) / (2 * std::sqrt(2.0))); }), limit);
}

TEST(Distribution, Uniform) {
  const auto x = draws(Distribution(vary(Kind::uniform, {2, 5, 0})), n);
  EXPECT_LT(kolmogorov(x, [](double v) { return (v - 2) / 3; }), limit);
}

TEST(Distribution, PowerLawByItsDensity) {
  for (const double a : {0.5, 1.0, 1.7, 3.0}) {
    const auto x = draws(Distribution(vary(Kind::power_law, {a, 0.1, 20})), n);
    const double all = a == 1 ? std::log(200.0) : (std::pow(20.0, 1 - a) - std::pow(0.1, 1 - a)) / (1 - a);
    EXPECT_LT(kolmogorov(x,
                         [&](double v) {
                           return (a == 1 ? std::log(v / 0.1)
                                          : (std::pow(v, 1 - a) - std::pow(0.1, 1 - a)) / (1 - a)) /
                                  all;
                         }),
              limit)
        << a;
    const auto negative = draws(Distribution(vary(Kind::power_law, {-a, 0.1, 20})), 10);
    EXPECT_EQ(negative, draws(Distribution(vary(Kind::power_law, {a, 0.1, 20})), 10));
  }
}

TEST(Distribution, CutOffKeepsItsShape) {
  scene::Vary v = vary(Kind::normal, {0, 1, 0});
  v.min = -0.5;
  v.max = 2;
  const auto x = draws(Distribution(v), n);
  EXPECT_GE(x.front(), -0.5);
  EXPECT_LE(x.back(), 2);
  const auto phi = [](double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); };
  EXPECT_LT(kolmogorov(x, [&](double z) { return (phi(z) - phi(-0.5)) / (phi(2) - phi(-0.5)); }), limit);
  v.min = 50;
  v.max = 51;
  EXPECT_THROW(Distribution{v}, InputError);
}

TEST(Distribution, TableGivesItsValuesEqually) {
  scene::Vary v = vary(Kind::table, {});
  v.table = {1, 2, 2, 7};
  const auto x = draws(Distribution(v), n);
  EXPECT_NEAR(static_cast<double>(std::count(x.begin(), x.end(), 2.0)) / n, 0.5, 0.015);
  EXPECT_NEAR(static_cast<double>(std::count(x.begin(), x.end(), 7.0)) / n, 0.25, 0.013);
}

// Each replicate of 2^k points has one point in each of 2^k slices of every coordinate, and in each box of a
// 2-dimensional net.
TEST(Sobol, ReplicatesAreNets) {
  const Sobol sobol(4, 3);
  constexpr int m = 64;
  for (int r = 0; r < replicates; ++r)
    for (int d = 0; d < 4; ++d) {
      std::vector<int> slices(m, 0);
      for (int p = 0; p < m; ++p)
        ++slices[static_cast<std::size_t>(
            sobol.coordinate(static_cast<std::uint64_t>(p * replicates + r), d) * m)];
      EXPECT_EQ(std::count(slices.begin(), slices.end(), 1), m) << r << " " << d;
    }
  std::vector<int> boxes(m, 0);
  for (int p = 0; p < m; ++p) {
    const auto i = static_cast<std::uint64_t>(p * replicates);
    ++boxes[static_cast<std::size_t>(sobol.coordinate(i, 0) * 8) * 8 +
            static_cast<std::size_t>(sobol.coordinate(i, 1) * 8)];
  }
  EXPECT_EQ(std::count(boxes.begin(), boxes.end(), 1), m);
  EXPECT_NE(sobol.coordinate(0, 0), sobol.coordinate(1, 0));
}

}  // namespace
}  // namespace talus::ensemble
