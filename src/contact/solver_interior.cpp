#include "contact/solver_interior.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

namespace talus::contact::detail {

namespace {

using Vec2 = Eigen::Vector2d;

constexpr double long_step = 0.8;  // from it on another corrector is not worth its cost
constexpr double short_step =
    0.6;  // below it the contacts that hold up the path are put back inside their cones

// Largest a in [0, 1] that keeps x0 + a dx0 >= |x + a dx|.
double cone_step(double x0, const Vec2& x, double dx0, const Vec2& dx) {
  const double A = dx0 * dx0 - dx.squaredNorm(), B = x0 * dx0 - x.dot(dx),
               C = std::max(0.0, x0 * x0 - x.squaredNorm());
  double a = 1;
  if (dx0 < 0) a = std::min(a, -x0 / dx0);
  // A a^2 + 2 B a + C = 0: the smallest positive root.
  const double disc = B * B - A * C;
  if (disc >= 0 && (A < 0 || B < 0)) {
    const double root = std::sqrt(disc);
    const double q = -B + root;  // stable form C / (-B + sqrt) for the first root
    if (q > 0) a = std::min(a, C / q);
  }
  return a;
}

/// Slip rate beyond |u_t| of a point that is inside its cones by delta [m/s].
double slip_slack(const Law& law, double delta) {
  return delta * (law.mu > 0 ? std::min(1.0, std::max(0.1, 1 / law.mu)) : 1.0);
}

}  // namespace

/// The impulse inside its cone: P at least delta / w, the tangential part within 0.9 of its bound.
void Interior::place_impulse(const Touch& t, Pair& q, Vec3& p, double delta) const {
  q.P = std::max(q.P, delta / t.w);
  const double g = t.law.mu * (q.P + t.law.floor) + t.law.cohesion;
  if (q.pt.norm() > 0.9 * g) q.pt *= 0.9 * g / q.pt.norm();
  p = Vec3(q.P + t.law.floor, q.pt.x(), q.pt.y());
}

void Interior::begin(double delta) {
  const int nc = system_->contacts(), n = system_->n;
  pairs_.resize(nc);
  D_.resize(nc);
  constant_.resize(nc);
  un_.resize(nc);
  products_.resize(2 * static_cast<std::size_t>(nc));
  for (auto* x : {&step_, &rhs_, &force_, &vp_}) x->resize(n);
  count_ = 0;
  lag_ = 0;
  const auto place = [&](std::size_t i) {
    const Touch& t = system_->touch[i];
    Pair& q = pairs_[i];
    if (!(t.w > 0)) {
      p_[i].setZero();
      return;
    }
    q.frictional = t.law.mu > 0 || t.law.mu * t.law.floor + t.law.cohesion > 0;
    q.P = p_[i].x() - t.law.floor;
    q.pt = q.frictional ? Vec2(p_[i].tail<2>()) : Vec2::Zero();
    place_impulse(t, q, p_[i], delta);
    const Vec3 u = system_->relative(t, v_.data()) + t.bias + t.compliance.cwiseProduct(p_[i]);
    q.ut = u.tail<2>();
    q.gamma = q.ut.norm() + slip_slack(t.law, delta);
    q.y = std::max(u.x() - (t.law.exact ? 0.0 : t.law.mu * q.gamma), delta);
  };
  in_ranges(nc, contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) place(static_cast<std::size_t>(i));
  });
  for (int i = 0; i < nc; ++i)
    if (system_->touch[i].w > 0) count_ += pairs_[i].frictional ? 2 : 1;
}

/// Fills v(p) and the normal velocities at the point; returns the mean of the complementary products
/// [m^2/s^2].
double Interior::measure() {
  const System& system = *system_;
  system.velocities(p_, vp_);
  in_ranges(system.contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Touch& t = system.touch[i];
      products_[2 * i] = products_[2 * i + 1] = 0;
      if (!(t.w > 0)) continue;
      un_[i] = system.relative_normal(t, v_.data()) + t.bias.x() + t.compliance.x() * p_[i].x();
      const Pair& q = pairs_[i];
      products_[2 * i] = t.w * q.P * q.y;
      if (q.frictional)
        products_[2 * i + 1] = t.w * ((t.law.mu * p_[i].x() + t.law.cohesion) * q.gamma + q.pt.dot(q.ut));
    }
  });
  return std::accumulate(products_.begin(), products_.end(), 0.0) /
         count_;  // one after the other, whatever the threads
}

/// Most contacts are there before the last few, which hold up the whole path: sweeps from its point. True if
/// they settle all.
bool Interior::settle(const InteriorOptions& options, Progress& progress) {
  settled_ = p_;
  settled_v_ = vp_;
  double after = INFINITY;
  for (int round = 0; round < 6; ++round) {
    local_.run(*system_, settled_, settled_v_, options.tolerance, options.sweeps);
    system_->velocities(settled_, settled_v_);
    after = system_->residual(settled_v_, settled_);
    if (after <= options.tolerance || after > 3 * options.tolerance)
      break;  // so near, they cost less than the path
  }
  if (after < progress.least) {
    progress.least = after;
    best_ = settled_;
  }
  return after <= options.tolerance;
}

bool Interior::stuck(double residual, Progress& progress) {
  if (residual < progress.least) {
    progress.least = residual;
    best_ = p_;
  }
  if (residual < progress.residual) {
    progress.residual = residual;
    progress.stalls = 0;
    return false;
  }
  return ++progress.stalls > 15 || progress.blocked >= 3;
}

/// Eliminates the variables of one contact: its constant, and in the predictor its block D.
void Interior::contact_equations(const Touch& t, Pair& q, std::size_t i, Phase phase, double tau) {
  const double mu = t.law.mu, a = t.law.exact ? 0.0 : mu, b = t.law.exact ? lag_ * mu : mu,
               target = tau / t.w;
  const double g = mu * p_[i].x() + t.law.cohesion;
  const double r2 = un_[i] - a * q.gamma - q.y;
  double rn = target - q.y * q.P - q.P * r2;
  if (phase == Phase::corrector) rn -= q.dP * q.dy;
  const double m11 = q.y + q.P * t.compliance.x();
  Vec3& c = constant_[i];
  Mat3& D = D_[i];
  if (!q.frictional) {
    c = Vec3(rn / m11, 0, 0);
    if (phase == Phase::predictor) {
      D.setZero();
      D(0, 0) = q.P / m11;
    }
    return;
  }
  const Vec2 R = t.compliance.tail<2>();
  const Vec2 e = (Vec2::Constant(q.gamma) + g * R).cwiseInverse();
  const Vec2 s = q.ut + R.cwiseProduct(q.pt);
  double r0 = target - (g * q.gamma + q.pt.dot(q.ut));
  Vec2 rt = -(g * q.ut + q.gamma * q.pt);
  if (phase == Phase::corrector) {
    r0 -= mu * q.dP * q.dgamma + q.dpt.dot(q.dut);
    rt -= mu * q.dP * q.dut + q.dgamma * q.dpt;
  }
  const double m12 = -q.P * b, m21 = mu * (q.gamma - s.dot(e.cwiseProduct(q.ut)));
  const double m22 = g - s.dot(e.cwiseProduct(q.pt));
  const double det = m11 * m22 - m12 * m21;
  // (dP, dgamma) = M^-1 (rn - P du_n, r0 - s.e.rt + (g s e - p_t) . du_t)
  const double k0 = r0 - s.dot(e.cwiseProduct(rt));
  const double cP = (m22 * rn - m12 * k0) / det, cg = (m11 * k0 - m21 * rn) / det;
  const Vec2 ct = e.cwiseProduct(rt - mu * q.ut * cP - q.pt * cg);
  c = Vec3(cP, ct.x(), ct.y());
  if (phase == Phase::corrector) return;
  // Response to du: columns n, t1, t2.
  const Vec2 kt = g * s.cwiseProduct(e) - q.pt;
  const double Pn = -m22 * q.P / det, gn = m21 * q.P / det;
  const Vec2 Pt = -m12 / det * kt, gt = m11 / det * kt;
  D(0, 0) = -Pn;
  D(0, 1) = -Pt.x();
  D(0, 2) = -Pt.y();
  for (int r = 0; r < 2; ++r) {
    D(1 + r, 0) = e[r] * (mu * q.ut[r] * Pn + q.pt[r] * gn);
    for (int k = 0; k < 2; ++k)
      D(1 + r, 1 + k) = e[r] * (mu * q.ut[r] * Pt[k] + q.pt[r] * gt[k] + (r == k ? g : 0.0));
  }
}

void Interior::right_hand_side(Phase phase, double tau) {
  const System& system = *system_;
  in_ranges(system.contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Touch& t = system.touch[i];
      if (t.w > 0) {
        contact_equations(t, pairs_[i], static_cast<std::size_t>(i), phase, tau);
      } else {
        D_[i].setZero();
        constant_[i].setZero();
      }
    }
  });
  in_ranges(static_cast<int>(system.body.size()), bodies_at_once, [&](int from, int to) {
    for (int b = from; b < to; ++b) {
      double* x = rhs_.data() + system.offset[b];
      for (int r = 0; r < system.ndof[b]; ++r) x[r] = -force_[system.offset[b] + r];
      for (int e = system.first_of_body[b]; e < system.first_of_body[b + 1]; ++e) {
        const TouchOfBody& of = system.of_body[e];
        add_transposed(system.J.data() + of.at, system.ndof[b], constant_[of.contact], x);
      }
    }
  });
}

/// Every contact's step from that of the velocities; returns the longest that all of them admit.
double Interior::steps(Phase phase, double tau) {
  std::atomic<double> alpha = 1;  // the least: the same in whatever order
  in_ranges(system_->contacts(), contacts_at_once, [&](int from, int to) {
    double here = 1;
    for (int i = from; i < to; ++i) {
      const Touch& t = system_->touch[i];
      if (!(t.w > 0)) continue;
      contact_step(t, pairs_[i], static_cast<std::size_t>(i), phase, tau);
      here = std::min(here, pairs_[i].own);
    }
    for (double least = alpha.load(std::memory_order_relaxed);
         here < least && !alpha.compare_exchange_weak(least, here, std::memory_order_relaxed);) {}
  });
  return alpha;
}

/// The contact's step from that of the velocities, and how much of it the contact admits.
void Interior::contact_step(const Touch& t, Pair& q, std::size_t i, Phase phase, double tau) const {
  const double mu = t.law.mu, a = t.law.exact ? 0.0 : mu, b = t.law.exact ? lag_ * mu : mu,
               target = tau / t.w;
  const double g = mu * p_[i].x() + t.law.cohesion;
  const Vec3 du = system_->relative(t, step_.data());
  const double r2 = un_[i] - a * q.gamma - q.y;
  const Vec3 dp = constant_[i] - D_[i] * du;
  double dgamma = 0;
  Vec2 dut = Vec2::Zero();
  if (q.frictional) {
    dut = du.tail<2>() + t.compliance.tail<2>().cwiseProduct(dp.tail<2>());
    double r0 = target - (g * q.gamma + q.pt.dot(q.ut));
    if (phase == Phase::corrector) r0 -= mu * q.dP * q.dgamma + q.dpt.dot(q.dut);
    dgamma = (r0 - q.gamma * mu * dp.x() - q.ut.dot(dp.tail<2>()) - q.pt.dot(dut)) / g;
  }
  q.dP = dp.x();
  q.dpt = dp.tail<2>();
  q.dgamma = dgamma;
  q.dut = dut;
  q.dy = du.x() + t.compliance.x() * dp.x() - b * dgamma + r2;
  q.own = 1;
  if (q.dP < 0) q.own = std::min(q.own, -q.P / q.dP);
  if (q.dy < 0) q.own = std::min(q.own, -q.y / q.dy);
  if (q.frictional)
    q.own =
        std::min({q.own, cone_step(g, q.pt, mu * q.dP, q.dpt), cone_step(q.gamma, q.ut, q.dgamma, q.dut)});
}

double Interior::complementarity_after(double alpha) {
  in_ranges(system_->contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Touch& t = system_->touch[i];
      products_[2 * i] = products_[2 * i + 1] = 0;
      if (!(t.w > 0)) continue;
      const Pair& q = pairs_[i];
      products_[2 * i] = t.w * (q.P + alpha * q.dP) * (q.y + alpha * q.dy);
      if (q.frictional)
        products_[2 * i + 1] =
            t.w * ((t.law.mu * (p_[i].x() + alpha * q.dP) + t.law.cohesion) * (q.gamma + alpha * q.dgamma) +
                   (q.pt + alpha * q.dpt).dot(q.ut + alpha * q.dut));
    }
  });
  return std::max(std::accumulate(products_.begin(), products_.end(), 0.0) / count_, 0.0);
}

/// Predictor to tau = 0, then the corrector with the centring that the predictor's success asks for. The
/// factor serves again: up to `correctors` more, each with the products of the last direction's own parts,
/// while they lengthen a short step. False if a pivot vanishes.
bool Interior::direction(double complementarity, int correctors, double& alpha) {
  right_hand_side(Phase::predictor, 0);
  hessian_->assemble(*system_, D_.data(), nullptr);
  if (!hessian_->lu.factor()) return false;
  step_ = rhs_;
  hessian_->lu.solve(step_.data());
  alpha = steps(Phase::predictor, 0);
  const double sigma = std::min(1.0, std::pow(complementarity_after(alpha) / complementarity, 3));
  const double tau = std::max(sigma, 1e-3 * (1 - alpha)) * complementarity;
  right_hand_side(Phase::corrector, tau);
  step_ = rhs_;
  hessian_->lu.solve(step_.data());
  alpha = steps(Phase::corrector, tau);
  for (int k = 0; k < correctors && alpha < long_step; ++k) {
    last_pairs_.resize(pairs_.size());
    in_ranges(system_->contacts(), contacts_at_once, [&](int from, int to) {
      std::copy(pairs_.begin() + from, pairs_.begin() + to, last_pairs_.begin() + from);
    });
    last_step_ = step_;
    right_hand_side(Phase::corrector, tau);
    step_ = rhs_;
    hessian_->lu.solve(step_.data());
    const double longer = steps(Phase::corrector, tau);
    if (longer < 1.1 * alpha) {
      pairs_.swap(last_pairs_);
      step_.swap(last_step_);
      break;
    }
    alpha = longer;
  }
  return true;
}

void Interior::advance(double alpha, double complementarity, bool recentre) {
  const double step = std::min(1.0, alpha * 0.99), inside = 0.5 * std::sqrt(complementarity);
  for (int k = 0; k < system_->n; ++k) v_[k] += step * step_[k];
  const auto move = [&](std::size_t i) {
    const Touch& t = system_->touch[i];
    if (!(t.w > 0)) return;
    Pair& q = pairs_[i];
    q.P += step * q.dP;
    q.y += step * q.dy;
    q.gamma += step * q.dgamma;
    q.pt += step * q.dpt;
    q.ut += step * q.dut;
    p_[i] = Vec3(q.P + t.law.floor, q.pt.x(), q.pt.y());
    if (!recentre || alpha >= short_step || q.own >= 1.7 * alpha) return;
    place_impulse(t, q, p_[i], inside);
    q.y = std::max(q.y, inside);
    if (q.frictional) q.gamma = std::max(q.gamma, q.ut.norm() + slip_slack(t.law, inside));
  };
  in_ranges(system_->contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) move(static_cast<std::size_t>(i));
  });
}

InteriorOutcome Interior::run(const System& system, std::vector<Vec3>& p, std::vector<double>& v,
                              const InteriorOptions& options) {
  InteriorOutcome outcome;
  Progress progress;
  system_ = &system;
  v_ = v;
  p_ = p;
  begin(std::max(options.start, options.tolerance));
  best_ = p_;
  const double tolerance_sq = options.tolerance * options.tolerance;
  for (int it = 0; count_ > 0; ++it) {
    const double complementarity = measure();
    const double residual = system.residual(vp_, p_);
    if (options.sweeps > 0 && it >= progress.next_settling && residual > options.tolerance &&
        complementarity < 40 * tolerance_sq) {
      if (settle(options, progress)) break;
      progress.next_settling = it + 3;
    }
    if (stuck(residual, progress)) break;  // the caller starts elsewhere
    if (progress.least <= options.tolerance || it >= options.max_iterations ||
        !std::isfinite(complementarity))
      break;
    if (complementarity < 1e-4 * tolerance_sq) break;
    ++outcome.iterations;
    for (int k = 0; k < system.n; ++k) force_[k] = v_[k] - vp_[k];
    double alpha = 0;
    if (!direction(complementarity, options.correctors, alpha)) break;
    progress.blocked = alpha < 0.03 ? progress.blocked + 1 : 0;
    lag_ = alpha < 0.3 ? std::min(1.0, lag_ + 0.5) : 0.5 * lag_;
    advance(alpha, complementarity, options.recentre);
  }
  outcome.residual = progress.least;
  p = best_;
  system.velocities(p, v);
  return outcome;
}

}  // namespace talus::contact::detail
