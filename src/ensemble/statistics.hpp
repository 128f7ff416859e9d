/// Percentiles and probabilities of an ensemble, with 95 % intervals.
///
///   percentile p of x_1 <= ... <= x_n  x_k + f (x_(k+1) - x_k),  k + f = 1 + (n - 1) p / 100
///                                      [Hyndman & Fan 1996, type 7]
///   its interval                       2.5 % to 97.5 % of the same of 2000 resamples of all members, those
///                                      that cross no line included (bootstrap) [Efron & Tibshirani 1993];
///                                      with design sobol of its 16 replicates; an end that the sample does
///                                      not bound (enough_for) is NaN
///   interval of a probability          Wilson's [Brown, Cai & DasGupta 2001]; with design sobol the
///                                      bootstrap over replicates, where they differ
#pragma once
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace talus::ensemble {

inline constexpr double none = std::numeric_limits<double>::quiet_NaN();  // a figure that there is not
inline constexpr double normal_975 =
    1.959963984540054;  // 97.5 % quantile of the standard normal distribution

/// How many values it takes until the largest of them lies above the percentile with 95 % certainty: the
/// least n with (percent / 100)^n <= 0.05, which are 59 for the 95th [Wilks 1941]; that the least lies below
/// it takes as many as 100 - percent takes here. With fewer that end has no bound that the sample knows of:
/// resamples end at the largest and the least value seen.
long enough_for(double percent);

struct Estimate {
  double value = 0, low = 0, high = 0;  // NaN where there is none
};

/// The interval in words: "1.2 to 3.4", "1.2 or more", "3.4 or less"; empty if neither end is known. `digits`
/// are significant ones.
std::string interval_text(const Estimate& e, double scale = 1, int digits = 3);

/// Of sorted values; NaN of none.
double percentile(std::span<const double> sorted, double percent);

/// Wilson's score interval of k of n.
Estimate wilson(long k, long n);
/// The same of a share that is known as well as by so many independent trials, which need be no whole number.
Estimate wilson_share(double share, double trials);

/// What a member gives: its largest value, or nothing if it does not cross.
struct Sample {
  std::int64_t index = 0;
  bool crosses = false;
  double value = 0;
};

class Bootstrap {
 public:
  /// `members` by index; `replicated`: 16 replicates, that of a member by its index. The same for the same
  /// seed.
  Bootstrap(std::span<const Sample> members, std::uint32_t seed, bool replicated);
  /// Percentiles of the values of the members that cross.
  std::vector<Estimate> percentiles(std::span<const double> percents) const;
  /// Of crossing.
  Estimate probability() const;

 private:
  std::vector<Sample> members_;
  std::uint32_t seed_;
  bool replicated_;
};

}  // namespace talus::ensemble
