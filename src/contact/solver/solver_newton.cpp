#include "contact/solver/solver_newton.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace talus::contact::detail {

namespace {

struct Proximal {
  double rn, rt;
  Vec3 rho;
};

inline Proximal proximal(const Touch& t, double epsilon) {
  Proximal q;
  q.rn = std::max(t.compliance.x(), epsilon * t.load * t.w);
  q.rt = std::max({t.compliance.y(), t.compliance.z(), epsilon * t.load * t.wt});
  q.rho = Vec3(q.rn - t.compliance.x(), q.rt - t.compliance.y(), q.rt - t.compliance.z());
  return q;
}

/// What the proximal compliance is to be multiplied with. An eigenvalue lambda of the Delassus matrix leaves
/// q = rho / (rho + lambda) of an error of the multipliers: by the rate q of the slowest, rho is made a
/// `wanted` rate's, however light the bodies between which loads are borne (lambda / w is their ratio of
/// masses).
double closer(double rate) {
  constexpr double wanted = 0.1, most_at_once = 1e-3;
  return std::clamp((1 - rate) / rate * wanted / (1 - wanted), most_at_once, 0.1);
}

constexpr double least_epsilon =
    1e-13;  // beyond, round-off of the held directions is as large as the masses in those that are free

}  // namespace

void Newton::evaluate(const System& system, const std::vector<Vec3>& multiplier, double epsilon, bool convex,
                      Point& point, bool derivatives) {
  const int nc = system.contacts();
  point.p.resize(nc);
  point.u.resize(nc);
  point.state.resize(nc);
  D_.resize(nc);
  in_ranges(nc, contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Touch& t = system.touch[i];
      point.u[i] = system.relative(t, point.v.data()) + t.bias;
      if (!(t.w > 0)) {
        point.p[i].setZero();
        point.state[i] = open;
        D_[i].setZero();
        continue;
      }
      const Proximal q = proximal(t, epsilon);
      Law law = t.law;
      Vec3 u = point.u[i];
      if (convex) {
        law.exact = false;
        u.x() += t.shift;
      }
      Vec3 z = q.rho.cwiseProduct(multiplier[i]) - u;
      z.x() /= q.rn;
      z.y() /= q.rt;
      z.z() /= q.rt;
      point.state[i] = project(law, z, q.rn, q.rt, point.p[i], derivatives ? &D_[i] : nullptr);
    }
  });
  system.velocities(point.p, point.difference);
  point.merit = 0;
  for (int k = 0; k < system.n; ++k) {
    point.difference[k] = point.v[k] - point.difference[k];
    point.merit += point.difference[k] * point.difference[k];
  }
}

double Newton::exact_step(const System& system, const std::vector<Vec3>& multiplier, double epsilon,
                          const Point& from) {
  // phi'(a) = dv^T (v + a dv - v_hat) - sum (J dv)^T p(u + a J dv): increasing in a; its root is the exact
  // step.
  const int nc = system.contacts();
  slope_.resize(nc);
  double quadratic = 0, linear = 0;
  for (int k = 0; k < system.n; ++k) {
    quadratic += step_[k] * step_[k];
    linear += step_[k] * (from.v[k] - system.v_hat[k]);
  }
  for (int i = 0; i < nc; ++i) slope_[i] = system.relative(system.touch[i], step_.data());
  auto derivative = [&](double a) {
    double sum = linear + a * quadratic;
    for (int i = 0; i < nc; ++i) {
      const Touch& t = system.touch[i];
      if (!(t.w > 0)) continue;
      const Proximal q = proximal(t, epsilon);
      Law law = t.law;
      law.exact = false;
      Vec3 u = from.u[i] + a * slope_[i];
      u.x() += t.shift;
      Vec3 z = q.rho.cwiseProduct(multiplier[i]) - u, p;
      z.x() /= q.rn;
      z.y() /= q.rt;
      z.z() /= q.rt;
      project(law, z, q.rn, q.rt, p, nullptr);
      sum -= slope_[i].dot(p);
    }
    return sum;
  };
  const double at_zero = derivative(0);
  double lo = 0, f_lo = at_zero, hi = 1, f_hi = derivative(1);
  if (!(at_zero < 0) || std::abs(f_hi) <= 0.1 * std::abs(at_zero)) return 1;
  for (int k = 0; k < 4 && f_hi < 0; ++k) {
    lo = hi;
    f_lo = f_hi;
    hi *= 2;
    f_hi = derivative(hi);
  }
  if (f_hi < 0) return hi;
  for (int k = 0; k < 40; ++k) {
    double a = lo - f_lo * (hi - lo) / (f_hi - f_lo);
    if (!(a > lo + 0.05 * (hi - lo) && a < hi - 0.05 * (hi - lo))) a = 0.5 * (lo + hi);
    const double f = derivative(a);
    if (std::abs(f) <= 0.05 * std::abs(at_zero)) return a;
    (f < 0 ? lo : hi) = a;
    (f < 0 ? f_lo : f_hi) = f;
  }
  return lo > 0 ? lo : 0.5 * (lo + hi);
}

double Newton::contradiction(const System& system) {
  balance_.assign(static_cast<std::size_t>(system.n), 0.0);
  constexpr double among = 0.1;  // of the most that one grows: others find their load still
  const auto growth = [&](int i) {
    const Touch& t = system.touch[i];
    return t.w > 0 && !(t.compliance.x() > 0) ? here_.p[i].x() - multiplier_[i].x() : 0.0;
  };
  double pressed = 0, work = 0, least = 0;
  for (int i = 0; i < system.contacts(); ++i) least = std::max(least, among * growth(i));
  for (int i = 0; i < system.contacts(); ++i) {
    const Touch& t = system.touch[i];
    const double grown = growth(i);
    if (!(grown > least)) continue;
    system.push(t, Vec3(grown, 0, 0), balance_.data());
    pressed += grown;
    work += grown * here_.u[i].x();
  }
  double square = 0, speed = 0;
  for (int k = 0; k < system.n; ++k) {
    square += balance_[k] * balance_[k];
    speed += here_.v[k] * here_.v[k];
  }
  const double most = work + (std::sqrt(speed) + system.most_moving) * std::sqrt(square);
  return most < 0 ? -most / pressed : 0;
}

/// Two candidates: the impulses p(v) with the velocities that follow from them, and, where the balance of
/// momentum is met to round-off, with v itself. The largest of all contacts.
Newton::OfContact Newton::measure(const System& system, double epsilon, bool convex) {
  const int nc = system.contacts();
  candidate_.resize(system.n);
  for (int k = 0; k < system.n; ++k) candidate_[k] = here_.v[k] - here_.difference[k];
  system.impulse_reach(here_.p, reach_);
  of_contact_.resize(nc);
  in_ranges(nc, contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Touch& t = system.touch[i];
      of_contact_[i] = {};
      if (!(t.w > 0)) continue;
      const Vec3 u = system.relative(t, candidate_.data()) + t.bias;
      Law law = t.law;
      if (convex) law.exact = false;
      const Vec3 rho = proximal(t, epsilon).rho,
                 off = rho.cwiseProduct(here_.p[i] - multiplier_[i]).cwiseAbs();
      // Where the multipliers swallow u in the projection, the law is met as far as their last digits tell.
      const double swallowed =
          std::numeric_limits<double>::epsilon() * rho.cwiseProduct(multiplier_[i]).norm();
      const double along = length(off.y(), off.z());
      of_contact_[i] = {std::max(0.0, (u - here_.u[i]).norm() - system.round_off(t, reach_)), off.maxCoeff(),
                        length(off.x() + (law.exact ? law.mu * along : 0.0), along) + swallowed,
                        natural_residual(law, u + t.compliance.cwiseProduct(here_.p[i]), here_.p[i],
                                         t.scale(), system.excuse(t, reach_), convex ? t.shift : 0.0)};
    }
  });
  OfContact worst;
  for (const OfContact& of : of_contact_) {
    worst.inner = std::max(worst.inner, of.inner);
    worst.outer = std::max(worst.outer, of.outer);
    worst.law = std::max(worst.law, of.law);
    worst.residual = larger(worst.residual, of.residual);
  }
  return worst;
}

NewtonOutcome Newton::run(const System& system, std::vector<Vec3>& p, std::vector<double>& v,
                          const NewtonOptions& options) {
  NewtonOutcome outcome;
  double epsilon = options.epsilon;
  multiplier_ = p;
  best_p_ = p;
  double best = INFINITY, last_outer = INFINITY, last_inner = INFINITY;
  here_.v = v;
  bool factored = false;
  double factored_epsilon = 0;
  evaluate(system, multiplier_, epsilon, options.convex, here_, true);
  int failures = 0, halved = 0, told = 0;  // told: factorisations at the last look for a contradiction
  bool moved = false;                      // the multipliers, and no step since
  while (true) {
    const OfContact worst = measure(system, epsilon, options.convex);
    const double inner = worst.inner, outer = worst.outer, residual = worst.residual;
    const double apart = inner == 0 ? worst.law : INFINITY;
    if (std::min(residual, apart) < 0.5 * best) halved = outcome.newton;
    if (residual < best) {
      best = residual;
      best_p_ = here_.p;
      best_v_ = candidate_;
    }
    if (apart < best) {
      best = apart;
      best_p_ = here_.p;
      best_v_ = here_.v;
    }
    if (best <= options.sufficient && outcome.newton >= halved + 3) break;  // at round-off
    if (best <= options.tolerance || !std::isfinite(here_.merit)) break;
    if (outcome.newton > 0 && outcome.newton != told) {
      told = outcome.newton;
      outcome.least = std::max(outcome.least, contradiction(system));
      if (options.most > 0 && outcome.least > options.most) break;
    }
    if (!(moved && inner == 0) && (inner <= 0.1 * outer || inner <= 0.01 * options.tolerance)) {
      // Inner problem solved: move the multipliers. Slow outer progress asks for a smaller proximal term.
      if (++outcome.outer > options.max_outer) break;
      if (const double rate = outer / last_outer; rate > 0.2 && !options.held)
        epsilon = std::max(least_epsilon, epsilon * closer(rate));
      last_outer = outer;
      last_inner = INFINITY;
      multiplier_ = here_.p;
      moved = true;
      evaluate(system, multiplier_, epsilon, options.convex, here_, true);
      continue;
    }
    moved = false;
    const bool stale = !factored || factored_epsilon != epsilon || inner > 0.05 * last_inner ||
                       factored_state_ != here_.state;
    last_inner = inner;
    if (stale) {
      if (outcome.newton >= options.max_newton) break;
      ++outcome.newton;
      hessian_->assemble(system, D_.data(), here_.state.data());
      factored = hessian_->lu.factor();
      factored_epsilon = epsilon;
      factored_state_ = here_.state;
      if (!factored) break;
    }
    step_.resize(system.n);
    for (int k = 0; k < system.n; ++k) step_[k] = -here_.difference[k];
    hessian_->lu.solve(step_.data());
    double a = options.convex ? exact_step(system, multiplier_, epsilon, here_) : 1.0;
    const double merit = here_.merit;
    bool accepted = false;
    for (int k = 0; k < 12; ++k) {
      there_.v.resize(system.n);
      for (int j = 0; j < system.n; ++j) there_.v[j] = here_.v[j] + a * step_[j];
      evaluate(system, multiplier_, epsilon, options.convex, there_, true);
      if (options.convex || inner == 0 || there_.merit <= (1 - 2e-4 * a) * merit) {
        accepted = true;
        break;
      }
      a *= 0.5;
    }
    if (!accepted && ++failures > 3) break;
    if (a < 1) last_inner = 0;  // never reuse a factor after a shortened step
    std::swap(here_, there_);
  }
  outcome.residual = best;
  p = best_p_;
  if (std::isfinite(best)) v = best_v_;
  return outcome;
}

}  // namespace talus::contact::detail
