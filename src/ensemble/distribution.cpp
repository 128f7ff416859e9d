#include "ensemble/distribution.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <boost/math/special_functions/erf.hpp>

#include "core/error.hpp"

namespace talus::ensemble {
namespace {

using Kind = scene::Vary::Kind;

double normal_quantile(double u) { return -std::sqrt(2.0) * boost::math::erfc_inv(2 * u); }
double normal_below(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

}  // namespace

Distribution::Distribution(const scene::Vary& vary, const std::string& file)
    : kind_(vary.kind), min_(vary.min), max_(vary.max) {
  const auto& p = vary.parameters;
  a_ = p[0], b_ = p[1], c_ = p[2];
  if (kind_ == Kind::lognormal) {
    const double variance = std::log1p(p[1] * p[1] / (p[0] * p[0]));
    a_ = std::log(p[0]) - 0.5 * variance;
    b_ = std::sqrt(variance);
  }
  if (kind_ == Kind::power_law) a_ = std::abs(p[0]);
  bool empty = false;
  if (kind_ == Kind::table) {
    for (const double x : vary.table)
      if (!(min_ && x < *min_) && !(max_ && x > *max_)) table_.push_back(x);
    empty = table_.empty();
  } else {
    if (min_) low_ = below(*min_);
    if (max_) high_ = below(*max_);
    empty = !(low_ < high_);
  }
  if (!empty) return;
  throw InputError(Problem{.severity = Problem::Severity::error,
                           .file = file,
                           .line = 0,
                           .column = 0,
                           .key = "ensemble.vary",
                           .value = vary.key,
                           .rule = "nothing of the distribution lies between min and max",
                           .remedy = "widen them"});
}

double Distribution::below(double x) const {
  switch (kind_) {
    case Kind::lognormal: return x > 0 ? normal_below((std::log(x) - a_) / b_) : 0;
    case Kind::normal: return normal_below((x - a_) / b_);
    case Kind::uniform: return std::clamp((x - a_) / (b_ - a_), 0.0, 1.0);
    case Kind::power_law: {
      if (x <= b_) return 0;
      if (x >= c_) return 1;
      if (a_ == 1) return std::log(x / b_) / std::log(c_ / b_);
      const double e = 1 - a_, from = std::pow(b_, e);
      return (std::pow(x, e) - from) / (std::pow(c_, e) - from);
    }
    case Kind::table:
      return static_cast<double>(std::upper_bound(table_.begin(), table_.end(), x) - table_.begin()) /
             static_cast<double>(table_.size());
    default: return 0;
  }
}

double Distribution::whole(double u) const {
  switch (kind_) {
    case Kind::lognormal: return std::exp(a_ + b_ * normal_quantile(u));
    case Kind::normal: return a_ + b_ * normal_quantile(u);
    case Kind::uniform: return a_ + u * (b_ - a_);
    case Kind::power_law: {
      if (a_ == 1) return b_ * std::pow(c_ / b_, u);
      const double e = 1 - a_, from = std::pow(b_, e);
      return std::clamp(std::pow(from + u * (std::pow(c_, e) - from), 1 / e), b_, c_);
    }
    case Kind::table:
      return table_[std::min(table_.size() - 1,
                             static_cast<std::size_t>(u * static_cast<double>(table_.size())))];
    default: return 0;
  }
}

double Distribution::quantile(double u) const {
  double x = whole(kind_ == Kind::table ? u : low_ + u * (high_ - low_));
  if (min_) x = std::max(x, *min_);  // rounding of the inverse
  if (max_) x = std::min(x, *max_);
  return x;
}

}  // namespace talus::ensemble
