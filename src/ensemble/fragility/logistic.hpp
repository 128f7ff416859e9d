/// P(class >= k | x) = 1 / (1 + exp(-(a_k + b x))): one slope b for all classes (proportional odds), so that
/// a worse class is nowhere likelier than a lesser one [McCullagh 1980, Regression models for ordinal data].
/// The parameters maximise the likelihood times Jeffreys' prior, the root of the determinant of Fisher's
/// information, which stays finite where the classes do not overlap in x [Firth 1993].
#pragma once
#include <span>
#include <vector>

namespace talus::ensemble {

struct Logistic {
  double a = 0, b = 0;
  double var_a = 0, var_b = 0, cov = 0;    // of the estimate
  double deviance = 0, null_deviance = 0;  // -2 ln L of the fit, and of one probability for all
  double brier = 0;                        // mean squared difference of probability and outcome
  bool fitted = false;  // false: fewer than 4 outcomes, all x alike, all or none reach the class, or no end
                        // of the iteration

  struct Band {
    double value, low, high;
  };  // 95 %, by the normal approximation of a + b x
  Band at(double x) const;
};

/// Of the classes 1 to `most`; `grades`: class of each outcome.
std::vector<Logistic> fit_logistic(std::span<const double> x, std::span<const int> grades, int most);

}  // namespace talus::ensemble
