/// Multiples of a time, each the double nearest to the exact product of decimals: 3 x 0.1 s is 0.3 s. So
/// multiples of one time that are also those of another are equal to the bit.
#pragma once
#include <cmath>

namespace talus {

class Multiples {
 public:
  explicit Multiples(double time) : time_(time) {
    double power = 1;
    for (int digits = 0; digits <= 12; ++digits, power *= 10) {
      const double scaled = std::round(time * power);
      if (scaled >= 1 && scaled / power == time) {
        numerator_ = scaled;
        denominator_ = power;
        return;
      }
    }
  }
  double at(long k) const {
    return denominator_ > 0 ? static_cast<double>(k) * numerator_ / denominator_
                            : static_cast<double>(k) * time_;
  }
  /// The first that is later than t.
  long after(double t) const {
    long k = std::lround(std::floor(t / time_));
    while (at(k) > t) --k;
    while (at(k) <= t) ++k;
    return k;
  }

 private:
  double time_, numerator_ = 0, denominator_ = 0;  // the latter 0: no short decimal
};

}  // namespace talus
