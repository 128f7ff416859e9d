#include "contact/laws/normal_law.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace talus::contact {
namespace {

constexpr double least_relieved = 0.5;  // of the tangent's compliance is left at least

/// s at which c takes half of the tangent's compliance [m].
double half_relieved(double stiffness, double relief) {
  const double root = least_relieved / (1.5 * stiffness * relief);
  return relief > 0 ? root * root : std::numeric_limits<double>::infinity();
}

}  // namespace

double NormalLaw::whole(double x) const {
  if (relief == 0) return x;
  const double turn = half_relieved(stiffness, relief), end = turn - relief * stiffness * std::pow(turn, 1.5);
  if (x >= end) return turn + (x - end) / least_relieved;
  // s - c k s^(3/2) = x, rising and concave: Newton's steps come from below, one after another nearer
  double s = x;
  for (int i = 0; i < 30; ++i) {
    const double step =
        (x - s + relief * stiffness * s * std::sqrt(s)) / (1 - 1.5 * relief * stiffness * std::sqrt(s));
    s += step;
    if (!(s + step > s)) break;
  }
  return s;
}

double NormalLaw::lost(double x) const {
  const auto f = [&](double z) { return z > 0 ? elastic(z) : 0.0; };
  return (1 - hardening()) * (f(x - yield()) - f(x - bottom()));
}

double NormalLaw::lost_slope(double x) const {
  const auto f = [&](double z) { return z > 0 ? stiffness + 3 * growth * z * z : 0.0; };
  return (1 - hardening()) * (f(x - yield()) - f(x - bottom()));
}

double NormalLaw::lost_work(double x) const {
  const auto f = [&](double z) { return z > 0 ? elastic_energy(z) : 0.0; };
  return (1 - hardening()) * (f(x - yield()) - f(x - bottom()));
}

double NormalLaw::inverse(double force) const {
  if (!(force > 0)) return 0;
  if (!(growth > 0)) return force / stiffness;
  // k x + g x^3 = F by x = 2 a sinh(z), a^2 = k/(3 g): 4 sinh^3 z + 3 sinh z = sinh 3z
  const double a = std::sqrt(stiffness / (3 * growth));
  return 2 * a * std::sinh(std::asinh(1.5 * force / (stiffness * a)) / 3);
}

double NormalLaw::reached(double y) const {
  const double force = elastic(y);
  double low = yield(), high = yield() + y;
  while (lost(high) < force && high < low + 1e3 * (y + yield())) high += high - low;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (lost(middle) < force ? low : high) = middle;
  }
  return high;
}

double NormalLaw::force(double x) const {
  if (bed) return bed->force(x);
  if (law->kind == ContactLaw::Kind::linear) return (stiffness + growth * (x > 0 ? x * x : 0.0)) * x;
  if (x <= 0) return 0;
  switch (law->kind) {
    case ContactLaw::Kind::linear: break;
    case ContactLaw::Kind::hertz: return stiffness * std::pow(whole(x), 1.5);
    case ContactLaw::Kind::crushing: return x > crushed ? elastic(x) - elastic(crushed_after(x)) : 0.0;
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
    case ContactLaw::Kind::hertz: {
      const double tangent = 1.5 * stiffness * std::sqrt(whole(x));
      return tangent / std::max(1 - relief * tangent, least_relieved);
    }
    case ContactLaw::Kind::crushing: {
      const double elastic_slope = stiffness + 3 * growth * x * x, back = x - yield();
      if (x < crushed) return 0;
      if (!plain()) return lost(x) > elastic(crushed) ? elastic_slope - lost_slope(x) : elastic_slope;
      return back < crushed ? elastic_slope : elastic_slope - stiffness - 3 * growth * back * back;
    }
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
    case ContactLaw::Kind::linear: return elastic_energy(x);
    case ContactLaw::Kind::hertz: {
      // int F dx with dx = ds - c dF up to where c takes half of the tangent, dx = ds / 2 from there
      const double s = whole(x), turn = std::min(s, half_relieved(stiffness, relief)),
                   f = stiffness * std::pow(turn, 1.5);
      return 0.4 * f * turn - 0.5 * relief * f * f +
             least_relieved * 0.4 * stiffness * (std::pow(s, 2.5) - std::pow(turn, 2.5));
    }
    case ContactLaw::Kind::crushing: {
      if (plain()) return stored(x) + yield() * (elastic(crushed_after(x)) - elastic(crushed));
      if (!(lost(x) > elastic(crushed))) return stored(x);
      // What the way that crushes takes from where it was left to x, less what was stored there.
      const double from = crushed > 0 ? reached(crushed) : yield();
      const auto held = [&](double at, double y) {
        return elastic_energy(at) - elastic_energy(y) - elastic(y) * (at - y);
      };
      return elastic_energy(x) - lost_work(x) - (elastic_energy(from) - lost_work(from)) +
             held(from, crushed);
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
  if (x <= crushed) return 0;
  const double back = crushed_after(x);  // it springs back to there
  return elastic_energy(x) - elastic_energy(back) - elastic(back) * (x - back);
}

double NormalLaw::crushed_after(double x) const {
  if (bed) return bed->crushed_after(x);
  if (law->kind != ContactLaw::Kind::crushing) return 0.0;
  return plain() ? std::max(crushed, x - yield()) : std::max(crushed, inverse(lost(x)));
}

double NormalLaw::depth_of(double energy) const {
  if (law->kind == ContactLaw::Kind::crushing) {  // p A/k f(x - p A/k) < W
    const double crushes = energy / yield();
    return yield() + std::min(crushes / stiffness, growth > 0 ? std::cbrt(crushes / growth)
                                                              : std::numeric_limits<double>::infinity());
  }
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

double NormalLaw::before(double x0) const {
  if (bed) return bed->before(x0);
  return yields() && x0 < start ? stored(start) + crushing_before(x0) : work(x0);
}

double NormalLaw::crushing_before(double x0) const {
  if (bed) return bed->crushing_before(x0);
  return yields() && x0 < start ? yield() * (elastic(x0 - yield()) - elastic(start - yield())) : 0.0;
}

double NormalLaw::secant(double x0, double x1, double& derivative) const {
  if (bed) x0 = bed->way_from(x0);
  const double d = x1 - x0;
  if (std::abs(d) <= 1e-6 * std::max(std::abs(x0), std::abs(x1))) {  // the quotient would be round-off
    derivative = 0.5 * slope(x1);
    return 0.5 * (force(x0) + force(x1));
  }
  const double mean = (work(x1) - before(x0)) / d;
  derivative = (force(x1) - mean) / d;
  return mean;
}

}  // namespace talus::contact
