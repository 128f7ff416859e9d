#include "contact/normal_law.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact {

double NormalLaw::force(double x) const {
  if (bed) return bed->force(x);
  if (law->kind == ContactLaw::Kind::linear) return (stiffness + growth * (x > 0 ? x * x : 0.0)) * x;
  if (x <= 0) return 0;
  switch (law->kind) {
    case ContactLaw::Kind::linear: break;
    case ContactLaw::Kind::hertz: return stiffness * x * std::sqrt(x);
    case ContactLaw::Kind::crushing: return std::clamp(stiffness * (x - crushed), 0.0, limit);
    case ContactLaw::Kind::table: {
      const auto& t = law->table;
      std::size_t i = 1;
      while (i + 1 < t.size() && x > t[i].first) ++i;
      return t[i - 1].second + (x - t[i - 1].first) * slope(x);
    }
  }
  return 0;
}

double NormalLaw::slope(double x) const {
  if (bed) return bed->slope(x);
  if (law->kind == ContactLaw::Kind::linear) return stiffness + 3 * growth * (x > 0 ? x * x : 0.0);
  if (x < 0) return 0;
  switch (law->kind) {
    case ContactLaw::Kind::linear: break;
    case ContactLaw::Kind::hertz: return 1.5 * stiffness * std::sqrt(x);
    case ContactLaw::Kind::crushing: return x >= crushed && stiffness * (x - crushed) < limit ? stiffness : 0;
    case ContactLaw::Kind::table: {
      const auto& t = law->table;
      std::size_t i = 1;
      while (i + 1 < t.size() && x > t[i].first) ++i;
      return (t[i].second - t[i - 1].second) / (t[i].first - t[i - 1].first);
    }
  }
  return 0;
}

double NormalLaw::work(double x) const {
  if (bed) return bed->work(x);
  if (x <= 0) return 0;
  switch (law->kind) {
    case ContactLaw::Kind::linear: return (0.5 * stiffness + 0.25 * growth * x * x) * x * x;
    case ContactLaw::Kind::hertz: return 0.4 * stiffness * x * x * std::sqrt(x);
    case ContactLaw::Kind::crushing: {
      const double yield = crushed + limit / stiffness;
      return stored(x) + limit * std::max(0.0, x - yield);
    }
    case ContactLaw::Kind::table: {
      const auto& t = law->table;
      double w = 0;
      for (std::size_t i = 1; i < t.size(); ++i) {
        const bool last = i + 1 == t.size();
        const double to = last ? x : std::min(x, t[i].first);
        if (to <= t[i - 1].first) break;
        w += 0.5 * (to - t[i - 1].first) * (t[i - 1].second + force(to));
      }
      return w;
    }
  }
  return 0;
}

double NormalLaw::stored(double x) const {
  if (bed) return bed->stored(x);
  if (law->kind != ContactLaw::Kind::crushing) return work(x);
  const double f = force(x);
  return 0.5 * f * f / stiffness;
}

double NormalLaw::crushed_after(double x) const {
  if (bed) return bed->crushed_after(x);
  return law->kind == ContactLaw::Kind::crushing ? std::max(crushed, x - limit / stiffness) : 0.0;
}

double NormalLaw::depth_of(double energy) const {
  // k x^2 / 2 + g x^4 / 4 = W
  return std::sqrt(4 * energy / (stiffness + std::sqrt(stiffness * stiffness + 4 * growth * energy)));
}

double NormalLaw::mean_force(double x0, double x1, double& derivative) const {
  if (law->kind == ContactLaw::Kind::linear && !bed) {
    const double a = std::max(x0, 0.0), b = std::max(x1, 0.0), squares = growth * (a * a + b * b);
    derivative = 0.5 * stiffness + 0.25 * (squares + 2 * growth * b * (a + b));
    return 0.5 * stiffness * (x0 + x1) + 0.25 * squares * (a + b);
  }
  return secant(x0, x1, derivative);
}

double NormalLaw::secant(double x0, double x1, double& derivative) const {
  const double d = x1 - x0;
  if (std::abs(d) <= 1e-6 * std::max(std::abs(x0), std::abs(x1))) {   // the quotient would be round-off
    derivative = 0.5 * slope(x1);
    return 0.5 * (force(x0) + force(x1));
  }
  const double mean = (work(x1) - (bed ? bed->before(x0) : work(x0))) / d;
  derivative = (force(x1) - mean) / d;
  return mean;
}

}  // namespace talus::contact
