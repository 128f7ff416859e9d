/// P(y = 1 | x) = 1 / (1 + exp(-(a + b x))), by maximum of the likelihood with Jeffreys' prior, which stays
/// finite where the two outcomes do not overlap [Firth 1993].
#pragma once
#include <span>

namespace talus::ensemble {

struct Logistic {
  double a = 0, b = 0;
  double var_a = 0, var_b = 0, cov = 0;    // of the estimate
  double deviance = 0, null_deviance = 0;  // -2 ln L of the fit, and of one probability for all
  double brier = 0;                        // mean squared difference of probability and outcome
  bool fitted = false;  // false: fewer than 4 outcomes, all x alike, or no end of the iteration

  struct Band {
    double value, low, high;
  };  // 95 %, by the normal approximation of a + b x
  Band at(double x) const;
};

Logistic fit_logistic(std::span<const double> x, std::span<const int> y);

}  // namespace talus::ensemble
