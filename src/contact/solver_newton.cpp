#include "contact/solver_newton.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact::detail {

namespace {

struct Proximal { double rn, rt; Vec3 rho; };

inline Proximal proximal(const Touch& t, double epsilon) {
  Proximal q;
  const double least = epsilon * t.w;
  q.rn = std::max(t.compliance.x(), least);
  q.rt = std::max({t.compliance.y(), t.compliance.z(), least});
  q.rho = Vec3(q.rn - t.compliance.x(), q.rt - t.compliance.y(), q.rt - t.compliance.z());
  return q;
}

template <int NA, int NB>
inline void add_block_fixed(const double* Ja, int na, const double* T, int nb, double* H) {
  const int ra = NA > 0 ? NA : na, rb = NB > 0 ? NB : nb;
  for (int c = 0; c < rb; ++c) {
    const double t0 = T[c], t1 = T[rb + c], t2 = T[2 * rb + c];
    double* h = H + c * ra;
    for (int r = 0; r < ra; ++r) h[r] += Ja[r] * t0 + Ja[ra + r] * t1 + Ja[2 * ra + r] * t2;
  }
}

inline void add_block(const double* Ja, int na, const double* T, int nb, double* H) {
  if (na == 6 && nb == 6) return add_block_fixed<6, 6>(Ja, 6, T, 6, H);
  if (na == 12 && nb == 12) return add_block_fixed<12, 12>(Ja, 12, T, 12, H);
  if (na == 3 && nb == 3) return add_block_fixed<3, 3>(Ja, 3, T, 3, H);
  add_block_fixed<0, 0>(Ja, na, T, nb, H);
}

}  // namespace

void Newton::prepare(const System& system) {
  sizes_ = system.ndof;
  keys_.clear();
  first_pair_.clear();
  int count = 0;
  const std::uint64_t bodies = system.body.size();
  for (const Touch& t : system.touch) {
    first_pair_.push_back(count);
    for (int a = 0; a < t.count; ++a)
      for (int b = a + 1; b < t.count; ++b) {
        const std::uint64_t i = system.terms[t.first + a].body, j = system.terms[t.first + b].body;
        keys_.emplace_back(std::min(i, j) * bodies + std::max(i, j), count++);
      }
  }
  pair_of_.resize(count);
  std::sort(keys_.begin(), keys_.end());
  pairs_.clear();
  for (std::size_t k = 0; k < keys_.size(); ++k) {
    if (k == 0 || keys_[k].first != keys_[k - 1].first)
      pairs_.emplace_back(static_cast<int>(keys_[k].first / bodies), static_cast<int>(keys_[k].first % bodies));
    pair_of_[keys_[k].second] = static_cast<int>(pairs_.size()) - 1;
  }
  lu_.analyse(sizes_, pairs_);
}

void Newton::evaluate(const System& system, const std::vector<Vec3>& multiplier, double epsilon, bool convex, Point& point,
                      bool derivatives) {
  const int nc = system.contacts();
  point.p.resize(nc);
  point.u.resize(nc);
  point.state.resize(nc);
  D_.resize(nc);
  point.difference = system.v_hat;
  for (int i = 0; i < nc; ++i) {
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
    if (point.p[i] != Vec3::Zero()) system.push(t, point.p[i], point.difference.data());
  }
  for (int k = 0; k < system.n; ++k) point.difference[k] = point.v[k] - point.difference[k];
  work_.resize(system.n);
  point.merit = system.apply_mass(point.difference.data(), work_.data());
}

void Newton::assemble(const System& system, const std::vector<unsigned char>& state) {
  lu_.set_zero();
  for (std::size_t b = 0; b < system.body.size(); ++b) {
    const int m = system.ndof[b];
    std::copy_n(system.mass.data() + system.matrix[b], m * m, lu_.diagonal(static_cast<int>(b)));
  }
  static thread_local std::vector<double> T;
  for (int i = 0; i < system.contacts(); ++i) {
    if (state[i] == open) continue;
    const Touch& t = system.touch[i];
    const Mat3& D = D_[i];
    int pair = first_pair_[i];
    for (int b = 0; b < t.count; ++b) {
      const TouchTerm& tb = system.terms[t.first + b];
      const double* Jb = system.J.data() + tb.at;
      T.resize(std::max<std::size_t>(T.size(), 3 * tb.n));
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < tb.n; ++c)
          T[r * tb.n + c] = D(r, 0) * Jb[c] + D(r, 1) * Jb[tb.n + c] + D(r, 2) * Jb[2 * tb.n + c];
      for (int a = 0; a < t.count; ++a) {
        const TouchTerm& ta = system.terms[t.first + a];
        double* H;
        if (a == b) {
          H = lu_.diagonal(ta.body);
        } else {
          // Pairs of terms are numbered (0,1), (0,2), ..., (1,2), ...
          const int lo = std::min(a, b), hi = std::max(a, b);
          const int index = pair_of_[pair + lo * t.count - lo * (lo + 1) / 2 + hi - lo - 1];
          H = ta.body < tb.body ? lu_.upper(index) : lu_.lower(index);
        }
        add_block(system.J.data() + ta.at, ta.n, T.data(), tb.n, H);
      }
    }
  }
}

double Newton::exact_step(const System& system, const std::vector<Vec3>& multiplier, double epsilon, const Point& from) {
  // phi'(a) = dv^T A (v + a dv - v_hat) - sum (J dv)^T p(u + a J dv): increasing in a; its root is the exact step.
  const int nc = system.contacts();
  slope_.resize(nc);
  work_.resize(system.n);
  const double quadratic = system.apply_mass(step_.data(), work_.data());
  double linear = 0;
  for (int k = 0; k < system.n; ++k) linear += work_[k] * (from.v[k] - system.v_hat[k]);
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

NewtonOutcome Newton::run(const System& system, std::vector<Vec3>& p, std::vector<double>& v, const NewtonOptions& options) {
  NewtonOutcome outcome;
  const int nc = system.contacts();
  double epsilon = options.epsilon;
  multiplier_ = p;
  best_p_ = p;
  system.velocities(p, v);
  double best = INFINITY, last_outer = INFINITY, last_inner = INFINITY;
  here_.v = v;
  bool factored = false;
  double factored_epsilon = 0;
  evaluate(system, multiplier_, epsilon, options.convex, here_, true);
  int failures = 0;
  while (true) {
    // The candidate: the impulses p(v), with the velocities that follow from them.
    candidate_.resize(system.n);
    for (int k = 0; k < system.n; ++k) candidate_[k] = here_.v[k] - here_.difference[k];
    double inner = 0, outer = 0, residual = 0;
    system.impulse_reach(here_.p, reach_);
    for (int i = 0; i < nc; ++i) {
      const Touch& t = system.touch[i];
      if (!(t.w > 0)) continue;
      const Vec3 u = system.relative(t, candidate_.data()) + t.bias;
      inner = std::max(inner, (u - here_.u[i]).cwiseAbs().maxCoeff());
      outer = std::max(outer, proximal(t, epsilon).rho.cwiseProduct(here_.p[i] - multiplier_[i]).cwiseAbs().maxCoeff());
      Law law = t.law;
      if (options.convex) law.exact = false;
      const double r = natural_residual(law, u + t.compliance.cwiseProduct(here_.p[i]), here_.p[i], t.w,
                                        system.round_off(t, reach_), options.convex ? t.shift : 0.0);
      if (!(r <= residual)) residual = r;
    }
    if (residual < best) {
      best = residual;
      best_p_ = here_.p;
    }
    if (best <= options.tolerance || !std::isfinite(here_.merit)) break;
    if (inner <= 0.1 * outer || inner <= 0.01 * options.tolerance) {
      // Inner problem solved: move the multipliers. Slow outer progress asks for a smaller proximal term.
      if (++outcome.outer > options.max_outer) break;
      if (outer > 0.2 * last_outer && epsilon > 1e-8) epsilon *= 0.1;
      last_outer = outer;
      last_inner = INFINITY;
      multiplier_ = here_.p;
      here_.v = candidate_;
      evaluate(system, multiplier_, epsilon, options.convex, here_, true);
      continue;
    }
    const bool stale = !factored || factored_epsilon != epsilon || inner > 0.05 * last_inner || factored_state_ != here_.state;
    last_inner = inner;
    if (stale) {
      if (outcome.newton >= options.max_newton) break;
      ++outcome.newton;
      assemble(system, here_.state);
      factored = lu_.factor();
      factored_epsilon = epsilon;
      factored_state_ = here_.state;
      if (!factored) break;
    }
    step_.resize(system.n);
    system.apply_mass(here_.difference.data(), step_.data());
    for (double& x : step_) x = -x;
    lu_.solve(step_.data());
    double a = options.convex ? exact_step(system, multiplier_, epsilon, here_) : 1.0;
    const double merit = here_.merit;
    bool accepted = false;
    for (int k = 0; k < 12; ++k) {
      there_.v.resize(system.n);
      for (int j = 0; j < system.n; ++j) there_.v[j] = here_.v[j] + a * step_[j];
      evaluate(system, multiplier_, epsilon, options.convex, there_, true);
      if (options.convex || there_.merit <= (1 - 2e-4 * a) * merit) {
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
  outcome.converged = best <= options.tolerance;
  p = best_p_;
  system.velocities(p, v);
  return outcome;
}

}  // namespace talus::contact::detail
