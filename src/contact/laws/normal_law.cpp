#include "contact/laws/normal_law.hpp"
#include "core/bisect.hpp"

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
  return (1 - hardening()) * (elastic(x - yield()) - elastic(x - bottom()));
}

double NormalLaw::lost_slope(double x) const {
  return (1 - hardening()) * (elastic_slope(x - yield()) - elastic_slope(x - bottom()));
}

double NormalLaw::lost_work(double x) const {
  return (1 - hardening()) * (elastic_energy(x - yield()) - elastic_energy(x - bottom()));
}

double NormalLaw::inverse(double force) const {
  return corner ? corner->depth_of(force / stiffness) : std::max(0.0, force / stiffness);
}

double NormalLaw::reached(double y) const {
  const double force = elastic(y);
  double low = yield(), high = 2 * yield() + y;
  while (lost(high) < force && high < low + 1e3 * (y + yield())) high += high - low;
  return bisect(low, high, [&](double at) { return lost(at) < force; }).second;
}

double NormalLaw::force(double x) const {
  if (bed) return bed->force(x);
  if (law->kind == ContactLaw::Kind::linear && !corner) return stiffness * x;
  if (x <= 0) return 0;
  switch (law->kind) {
    case ContactLaw::Kind::linear: return elastic(x);
    case ContactLaw::Kind::hertz: return stiffness * std::pow(whole(x), 1.5);
    case ContactLaw::Kind::crushing: return x > crushed ? elastic(x) - elastic(crushed_after(x)) : 0.0;
    case ContactLaw::Kind::table: {
      const auto& t = law->table;
      std::size_t i = 1;
      while (i + 1 < t.size() && x > t[i].first) ++i;
      return stiffness * t[i - 1].second + (x - t[i - 1].first) * slope(x);
    }
  }
  return 0;
}

double NormalLaw::slope(double x) const {
  if (bed) return bed->slope(x);
  if (law->kind == ContactLaw::Kind::linear && !corner) return stiffness;
  if (x < 0) return 0;
  switch (law->kind) {
    case ContactLaw::Kind::linear: return elastic_slope(x);
    case ContactLaw::Kind::hertz: {
      const double tangent = 1.5 * stiffness * std::sqrt(whole(x));
      return tangent / std::max(1 - relief * tangent, least_relieved);
    }
    case ContactLaw::Kind::crushing: {
      const double loading = elastic_slope(x), back = x - yield();
      if (x < crushed) return 0;
      if (!plain()) return lost(x) > elastic(crushed) ? loading - lost_slope(x) : loading;
      return back < crushed ? loading : loading - elastic_slope(back);
    }
    case ContactLaw::Kind::table: {
      const auto& t = law->table;
      std::size_t i = 1;
      while (i + 1 < t.size() && x > t[i].first) ++i;
      return stiffness * (t[i].second - t[i - 1].second) / (t[i].first - t[i - 1].first);
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
        w += 0.5 * (to - t[i - 1].first) * (stiffness * t[i - 1].second + force(to));
      }
      return w;
    }
  }
  return 0;
}

double NormalLaw::stored(double x) const {
  if (bed) return bed->stored(x);
  if (!law->crushes()) return work(x);
  if (x <= crushed) return 0;
  const double back = crushed_after(x);  // it springs back to there
  return elastic_energy(x) - elastic_energy(back) - elastic(back) * (x - back);
}

double NormalLaw::crushed_after(double x) const {
  if (bed) return bed->crushed_after(x);
  if (!law->crushes()) return 0.0;
  return plain() ? std::max(crushed, x - yield()) : std::max(crushed, inverse(lost(x)));
}

double NormalLaw::depth_of(double energy) const {
  if (law->kind == ContactLaw::Kind::crushing)  // p A/k f(x - p A/k) < W
    return yield() + inverse(energy / yield());
  return corner ? corner->depth_of_square(energy / stiffness) : std::sqrt(2 * energy / stiffness);
}

double NormalLaw::stiffest(double energy, double weight, double least) const {
  switch (law->kind) {
    case ContactLaw::Kind::linear:
    case ContactLaw::Kind::crushing:
      if (!corner) return stiffness;
      return elastic_slope(
          std::max({least, corner->depth_of(weight / stiffness), depth_of(work(least) + energy)}));
    case ContactLaw::Kind::hertz:  // 2/5 k x^(5/2) = W, k x^(3/2) = m g
      return slope(std::max(
          {least, std::pow(2.5 * energy / stiffness, 0.4), std::pow(weight / stiffness, 2.0 / 3.0)}));
    case ContactLaw::Kind::table: {
      double most = 0;
      for (std::size_t i = 1; i < law->table.size(); ++i)
        most = std::max(most, slope(0.5 * (law->table[i - 1].first + law->table[i].first)));
      return most;
    }
  }
  return stiffness;
}

double NormalLaw::mean_force(double x0, double x1, double& derivative) const {
  if (law->kind == ContactLaw::Kind::linear && !bed && !corner) {
    derivative = 0.5 * stiffness;
    return 0.5 * stiffness * (x0 + x1);
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
