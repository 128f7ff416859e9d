#include "ensemble/fragility/logistic.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "ensemble/statistics.hpp"

namespace talus::ensemble {
namespace {

double expit(double z) { return 1 / (1 + std::exp(-z)); }

double deviance_of(std::span<const double> p, std::span<const int> y) {
  double sum = 0;
  for (std::size_t i = 0; i < y.size(); ++i)
    sum -= 2 * std::log(std::max(1e-300, y[i] != 0 ? p[i] : 1 - p[i]));
  return sum;
}

}  // namespace

Logistic::Band Logistic::at(double x) const {
  const double z = a + b * x, s = normal_975 * std::sqrt(std::max(0.0, var_a + 2 * x * cov + x * x * var_b));
  return {expit(z), expit(z - s), expit(z + s)};
}

Logistic fit_logistic(std::span<const double> x, std::span<const int> y) {
  Logistic f;
  const std::size_t n = x.size();
  if (n < 4) return f;
  double mean = 0, scale = 0;
  for (const double v : x) mean += v / static_cast<double>(n);
  for (const double v : x) scale += (v - mean) * (v - mean) / static_cast<double>(n);
  scale = std::sqrt(scale);
  if (!(scale > 1e-12 * (1 + std::abs(mean)))) return f;
  // Of u = (x - mean) / scale, so that steps are of order one.
  double a = 0, b = 0;
  std::vector<double> p(n);
  for (int iteration = 0; iteration < 200; ++iteration) {
    double i00 = 0, i01 = 0, i11 = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double u = (x[i] - mean) / scale;
      p[i] = expit(a + b * u);
      const double w = p[i] * (1 - p[i]);
      i00 += w, i01 += w * u, i11 += w * u * u;
    }
    const double det = i00 * i11 - i01 * i01;
    if (!(det > 1e-300)) return f;
    double s0 = 0, s1 = 0;  // modified score
    for (std::size_t i = 0; i < n; ++i) {
      const double u = (x[i] - mean) / scale, w = p[i] * (1 - p[i]);
      const double h = w * (i11 - 2 * u * i01 + u * u * i00) / det;  // leverage
      const double r = y[i] - p[i] + h * (0.5 - p[i]);
      s0 += r, s1 += r * u;
    }
    double d0 = (i11 * s0 - i01 * s1) / det, d1 = (i00 * s1 - i01 * s0) / det;
    const double longest = std::max(std::abs(d0), std::abs(d1));
    if (longest > 2) d0 *= 2 / longest, d1 *= 2 / longest;
    a += d0, b += d1;
    if (longest > 1e-10) continue;
    f.fitted = true;
    f.b = b / scale;
    f.a = a - f.b * mean;
    const double v00 = i11 / det, v01 = -i01 / det, v11 = i00 / det, m = mean / scale;
    f.var_b = v11 / (scale * scale);
    f.var_a = v00 - 2 * m * v01 + m * m * v11;
    f.cov = (v01 - m * v11) / scale;
    f.deviance = deviance_of(p, y);
    double share = 0;
    for (std::size_t i = 0; i < n; ++i)
      share += static_cast<double>(y[i]) / static_cast<double>(n),
          f.brier += (p[i] - y[i]) * (p[i] - y[i]) / static_cast<double>(n);
    f.null_deviance = deviance_of(std::vector<double>(n, share), y);
    return f;
  }
  return f;
}

}  // namespace talus::ensemble
