#include "ensemble/fragility/logistic.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/types.hpp"
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

/// Outcomes u (standardised, so that steps are of order one) and how many of the levels each of them reaches.
/// Parameters t: a of each level, then b.
struct Outcomes {
  std::vector<double> u;
  std::vector<int> level;

  /// ln L + 1/2 ln det I, with Fisher's information I = sum over outcomes and levels of grad p grad p^T / p;
  /// minus infinity where curves cross.
  double penalised(const VecX& t, MatX& information) const {
    const Eigen::Index levels = t.size() - 1;
    information = MatX::Zero(t.size(), t.size());
    double likelihood = 0;
    for (std::size_t i = 0; i < u.size(); ++i) {
      double above = 1;  // probability of the level or more
      VecX above_grad = VecX::Zero(t.size());
      for (Eigen::Index k = 0; k <= levels; ++k) {
        const double next = k < levels ? expit(t[k] + t[levels] * u[i]) : 0;
        VecX next_grad = VecX::Zero(t.size());
        if (k < levels) next_grad[k] = next * (1 - next), next_grad[levels] = next_grad[k] * u[i];
        const double p = above - next;
        if (!(p > 0)) return -std::numeric_limits<double>::infinity();
        const VecX grad = above_grad - next_grad;
        information += grad * grad.transpose() / p;
        if (level[i] == k) likelihood += std::log(p);
        above = next, above_grad = next_grad;
      }
    }
    const double value = likelihood + 0.5 * std::log(information.determinant());
    return std::isfinite(value) ? value : -std::numeric_limits<double>::infinity();
  }

  /// Raises it by scoring steps, halved until it rises. False: no end of the iteration.
  bool maximise(VecX& t, MatX& information) const {
    constexpr double small = 1e-4, longest = 2, accuracy = 1e-6;  // of parameters of order one
    MatX other;
    double value = penalised(t, information);
    for (int iteration = 0; iteration < 200 && std::isfinite(value); ++iteration) {
      VecX gradient(t.size());
      for (Eigen::Index k = 0; k < t.size(); ++k) {
        const VecX d = small * VecX::Unit(t.size(), k);
        gradient[k] = (penalised(t + d, other) - penalised(t - d, other)) / (2 * small);
      }
      VecX step = information.ldlt().solve(gradient);
      if (!step.allFinite()) return false;
      step *= std::min(1.0, longest / step.lpNorm<Eigen::Infinity>());
      double raised = 0;
      while (step.lpNorm<Eigen::Infinity>() > accuracy && !((raised = penalised(t + step, other)) > value))
        step *= 0.5;
      if (step.lpNorm<Eigen::Infinity>() <= accuracy) return true;
      t += step, value = raised, information = other;
    }
    return false;
  }
};

}  // namespace

Logistic::Band Logistic::at(double x) const {
  const double z = a + b * x, s = normal_975 * std::sqrt(std::max(0.0, var_a + 2 * x * cov + x * x * var_b));
  return {expit(z), expit(z - s), expit(z + s)};
}

std::vector<Logistic> fit_logistic(std::span<const double> x, std::span<const int> grades, int most) {
  std::vector<Logistic> fits(static_cast<std::size_t>(most));
  const auto n = static_cast<double>(x.size());
  double mean = 0, scale = 0;
  for (const double v : x) mean += v / n;
  for (const double v : x) scale += (v - mean) * (v - mean) / n;
  scale = std::sqrt(scale);
  if (x.size() < 4 || !(scale > 1e-12 * (1 + std::abs(mean)))) return fits;
  // Classes that the same outcomes reach are one level.
  std::vector<long> reached;                   // of each level
  std::vector<int> level_of(fits.size(), -1);  // of each class
  for (int k = 1; k <= most; ++k) {
    const auto count = std::ranges::count_if(grades, [k](int grade) { return grade >= k; });
    if (count == 0 || count == std::ssize(grades)) continue;
    if (reached.empty() || reached.back() != count) reached.push_back(count);
    level_of[static_cast<std::size_t>(k - 1)] = static_cast<int>(reached.size()) - 1;
  }
  Outcomes outcomes;
  for (std::size_t i = 0; i < x.size(); ++i) {
    outcomes.u.push_back((x[i] - mean) / scale);
    int level = 0;
    for (int k = 1; k <= std::min(most, grades[i]); ++k)
      level = std::max(level, level_of[static_cast<std::size_t>(k - 1)] + 1);
    outcomes.level.push_back(level);
  }
  const auto levels = static_cast<Eigen::Index>(reached.size());
  VecX t = VecX::Zero(levels + 1);
  for (Eigen::Index k = 0; k < levels; ++k) {
    const auto count = static_cast<double>(reached[static_cast<std::size_t>(k)]);
    t[k] = std::log(count / (n - count));
  }
  MatX information;
  if (levels == 0 || !outcomes.maximise(t, information)) return fits;
  const MatX covariance = information.inverse();
  for (std::size_t k = 0; k < fits.size(); ++k) {
    if (level_of[k] < 0) continue;
    const Eigen::Index at = level_of[k];
    const double m = mean / scale, v00 = covariance(at, at), v01 = covariance(at, levels),
                 v11 = covariance(levels, levels), share = static_cast<double>(reached[level_of[k]]) / n;
    Logistic& f = fits[k];
    f.fitted = true;
    f.b = t[levels] / scale;
    f.a = t[at] - t[levels] * m;
    f.var_b = v11 / (scale * scale);
    f.var_a = v00 - 2 * m * v01 + m * m * v11;
    f.cov = (v01 - m * v11) / scale;
    std::vector<double> p;
    std::vector<int> y;
    for (std::size_t i = 0; i < x.size(); ++i) {
      p.push_back(f.at(x[i]).value);
      y.push_back(grades[i] > static_cast<int>(k));
      f.brier += (p[i] - y[i]) * (p[i] - y[i]) / n;
    }
    f.deviance = deviance_of(p, y);
    f.null_deviance = deviance_of(std::vector<double>(x.size(), share), y);
  }
  return fits;
}

}  // namespace talus::ensemble
