/// Distributions of single variables by the inverse of their distribution function: value = Q(u), u in (0,
/// 1).
///
///   lognormal  exp(mu + sigma z), sigma^2 = ln(1 + s^2 / m^2), mu = ln m - sigma^2 / 2, z = Phi^-1(u)
///   normal     m + s z; m the mean, s the standard deviation;  uniform: low + u (high - low)
///   power law  x^-a on [x0, x1]: (x0^(1-a) + u (x1^(1-a) - x0^(1-a)))^(1/(1-a)); a = 1: x0 (x1/x0)^u
///   table      one of n values, each with 1 / n
///
/// Cut off at [min, max]: Q(F(min) + u (F(max) - F(min))).
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "scene/scene.hpp"

namespace talus::ensemble {

class Distribution {
 public:
  /// Of lognormal, normal, uniform, power_law and table. Throws InputError if nothing is left between min and
  /// max.
  /// Throws InputError, at `file`, if min and max leave nothing.
  explicit Distribution(const scene::Vary& vary, const std::string& file = {});
  double quantile(double u) const;
  /// Probability of a value <= x, before any cut.
  double below(double x) const;

 private:
  double whole(double u) const;  // quantile before any cut
  scene::Vary::Kind kind_;
  double a_ = 0, b_ = 0, c_ = 0;
  std::vector<double> table_;
  double low_ = 0, high_ = 1;  // F(min), F(max)
  std::optional<double> min_, max_;
};

}  // namespace talus::ensemble
