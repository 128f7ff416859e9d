#include "ensemble/fragility/strata.hpp"

#include <cmath>
#include <limits>

namespace talus::ensemble {
namespace {

struct Sums {
  double weight = 0, pooled = 0;
};

Sums sums_of(std::span<const Stratum> strata) {
  Sums s;
  double reached = 0, runs = 0;
  for (const Stratum& h : strata) {
    if (h.runs == 0) continue;
    s.weight += h.weight;
    reached += h.reached;
    runs += h.runs;
  }
  s.pooled = (reached + 0.5) / (runs + 1);
  return s;
}

double drawn_in(const Stratum& h, const Sums& s) { return (h.reached + s.pooled) / (h.runs + 1); }

}  // namespace

Estimate stratified(std::span<const Stratum> strata) {
  const Sums s = sums_of(strata);
  if (!(s.weight > 0)) return {none, none, none};
  double share = 0, drawn = 0, variance = 0;
  for (const Stratum& h : strata) {
    if (h.runs == 0) continue;
    const double w = h.weight / s.weight, q = drawn_in(h, s);
    share += w * h.reached / h.runs;
    drawn += w * q;
    variance += w * w * q * (1 - q) / h.runs;
  }
  return wilson_share(std::min(share, 1.0), drawn * (1 - drawn) / variance);
}

double variance_gain(std::span<const Stratum> strata, std::size_t stratum) {
  const Sums s = sums_of(strata);
  const Stratum& h = strata[stratum];
  if (h.runs == 0 || !(s.weight > 0)) return 0;
  const double w = h.weight / s.weight, q = drawn_in(h, s);
  return w * w * q * (1 - q) * (1.0 / h.runs - 1.0 / (h.runs + 1));
}

Estimate product(const Estimate& a, const Estimate& b) {
  if (!(a.value * b.value > 0)) return {a.value * b.value, 0, a.high * b.high};
  const auto ratio = [](double value, double bound) {
    return bound > 0 ? std::log(value / bound) : std::numeric_limits<double>::infinity();
  };
  const double value = a.value * b.value, down = std::hypot(ratio(a.value, a.low), ratio(b.value, b.low)),
               up = std::hypot(ratio(a.value, a.high), ratio(b.value, b.high));
  return {value, value * std::exp(-down), value * std::exp(up)};
}

}  // namespace talus::ensemble
