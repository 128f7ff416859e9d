/// Where a condition ends along a line.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace talus {

/// `holds` is true at `low`, false at `high`, and changes once between them: the two ends of the interval in
/// which it does, halved until it is round-off of the larger of them, or 1e-30 of the interval given.
template <class Holds>
std::pair<double, double> bisect(double low, double high, Holds holds) {
  constexpr int halvings = 100;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (holds(middle) ? low : high) = middle;
    if (std::abs(high - low) <=
        std::numeric_limits<double>::epsilon() * std::max(std::abs(low), std::abs(high)))
      break;
  }
  return {low, high};
}

}  // namespace talus
