#include "contact/solver/solver_interior.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

namespace talus::contact::detail {

namespace {

using Vec4 = Eigen::Vector4d;

constexpr double long_step = 0.8;     // from it on another corrector is not worth its cost
constexpr double settled_from = 0.5;  // part of the contacts that are off, below which visits pay
constexpr double inside = 0.9;        // part of the way to a cone's surface that is gone at most
constexpr double short_step = 0.15;   // a contact that admits less takes the monotone direction next

/// x_0^2 - |x_t|^2.
double determinant(const Vec3& x) {
  const double t = length(x.y(), x.z());
  return (x.x() - t) * (x.x() + t);
}

Vec3 reflected(const Vec3& x) { return {x.x(), -x.y(), -x.z()}; }

/// Largest a in [0, 1] that keeps x + a d in the cone.
double cone_step(const Vec3& x, const Vec3& d) {
  const double A = d.dot(reflected(d)), B = x.dot(reflected(d)), C = std::max(0.0, determinant(x));
  double a = 1;
  if (d.x() < 0) a = std::min(a, -x.x() / d.x());
  // A a^2 + 2 B a + C = 0: the smallest positive root.
  const double discriminant = B * B - A * C;
  if (discriminant >= 0 && (A < 0 || B < 0)) {
    const double q = -B + std::sqrt(discriminant);  // stable form C / (-B + sqrt) for the first root
    if (q > 0) a = std::min(a, C / q);
  }
  return a;
}

/// The product a o b, and c of l o c = d.
Vec3 product(const Vec3& a, const Vec3& b) {
  return {a.dot(b), a.x() * b.y() + b.x() * a.y(), a.x() * b.z() + b.x() * a.z()};
}
Vec3 quotient(const Vec3& l, const Vec3& d) {
  const double c = l.dot(reflected(d)) / determinant(l);
  return {c, (d.y() - c * l.y()) / l.x(), (d.z() - c * l.z()) / l.x()};
}

/// Slip rate beyond |u_t| of a point that is inside its cones by delta [m/s].
double slip_slack(const Law& law, double delta) { return delta * std::min(1.0, 1 / law.mu); }

}  // namespace

/// Inside the cones by about delta. The impulse that goes with it is that of a contact of the heaviest bodies
/// where this one may bear their load, of its own where it may lie free: their geometric mean.
void Interior::begin(double delta) {
  const int nc = system_->contacts(), n = system_->n;
  pairs_.resize(nc);
  D_.resize(nc);
  constant_.resize(nc);
  un_.resize(nc);
  products_.resize(2 * static_cast<std::size_t>(nc));
  for (auto* x : {&step_, &rhs_, &force_, &vp_}) x->resize(n);
  count_ = 0;
  const auto place = [&](std::size_t i) {
    const Touch& t = system_->touch[i];
    Pair& q = pairs_[i];
    q.lag = q.dP = q.dy = 0;
    q.dx = q.dz = Vec3::Zero();
    if (!(t.w > 0)) {
      p_[i].setZero();
      return;
    }
    q.frictional = t.law.mu > 0 || t.law.cohesion > 0;
    q.P = std::max(p_[i].x() - t.law.floor, delta / (t.load * t.w));
    p_[i].x() = q.P + t.law.floor;
    const double g = t.law.mu * p_[i].x() + t.law.cohesion, along = length(p_[i].y(), p_[i].z());
    if (!q.frictional)
      p_[i].tail<2>().setZero();
    else if (along > inside * g)
      p_[i].tail<2>() *= inside * g / along;
    q.x = Vec3(g, p_[i].y(), p_[i].z());
    const Vec3 u = system_->relative(t, v_.data()) + t.bias + t.compliance.cwiseProduct(p_[i]);
    q.z = Vec3(length(u.y(), u.z()) + slip_slack(t.law, delta), u.y(), u.z());
    q.y = std::max(u.x() - (t.law.exact ? 0.0 : t.law.mu * q.z.x()), delta);
  };
  in_ranges(nc, contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) place(static_cast<std::size_t>(i));
  });
  for (int i = 0; i < nc; ++i)
    if (system_->touch[i].w > 0) count_ += pairs_[i].frictional ? 2 : 1;
}

/// Fills v(p) and the normal velocities at the point; returns the mean of the complementary products [J].
double Interior::measure() {
  const System& system = *system_;
  system.velocities(p_, vp_);
  for (int k = 0; k < system.n; ++k) force_[k] = v_[k] - vp_[k];
  in_ranges(system.contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Touch& t = system.touch[i];
      if (!(t.w > 0)) continue;
      un_[i] = system.relative_normal(t, v_.data()) + t.bias.x() + t.compliance.x() * p_[i].x();
    }
  });
  return work_after(0);
}

/// Of the impulses with the velocities that follow from them, or with the path's own where these have their
/// momentum, whichever is less; of the former alone where it meets the tolerance [m/s].
double Interior::residual(double tolerance) {
  const System& system = *system_;
  const double by_impulses = system.residual(vp_, p_);
  own_ = false;
  if (by_impulses <= tolerance) return by_impulses;
  const double own = system.residual_apart(v_, force_, p_);
  own_ = own < by_impulses;
  return own_ ? own : by_impulses;
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
    best_v_ = settled_v_;
  }
  return after <= options.tolerance;
}

/// The scaling, M = size^2 (2 w w^T - diag(1, -1, -1)), and the inverse of the contact's equations
///
///   (y + P R_n) dP - P b mu dz_0                       = r_n - P du_n
///   (mu dP, dx_t) + M (dz_0, R_t dx_t)                 = r   - M (0, du_t)
void Interior::scale(const Touch& t, Pair& q) const {
  const double dx = determinant(q.x), dz = determinant(q.z), mu = t.law.mu;
  const Vec3 x = q.x / std::sqrt(dx), z = q.z / std::sqrt(dz);
  const Vec3 w = (x + reflected(z)) / std::sqrt(2 * (1 + x.dot(z)));
  q.size = std::pow(dx / dz, 0.25);
  q.axis = (w + Vec3::UnitX()) / std::sqrt(2 * (w.x() + 1));
  const double square = q.size * q.size;
  q.M = 2 * square * w * w.transpose();
  q.M(0, 0) -= square;
  q.M(1, 1) += square;
  q.M(2, 2) += square;
  Eigen::Matrix4d equations = Eigen::Matrix4d::Zero();
  equations(0, 0) = q.y + q.P * t.compliance.x();
  equations(0, 1) = -q.P * mu * (t.law.exact ? q.lag : 1.0);
  equations(1, 0) = mu;
  equations.block<3, 1>(1, 1) = q.M.col(0);
  for (int k = 1; k < 3; ++k) {
    equations.block<3, 1>(1, 1 + k) = t.compliance[k] * q.M.col(k);
    equations(1 + k, 1 + k) += 1;
  }
  q.inverse = equations.inverse();
}

/// r_n, r: towards the work tau; of the corrector with the products of the last direction's own parts.
Vec4 Interior::right_hand_side_of(const Touch& t, const Pair& q, std::size_t i, Phase phase,
                                  double tau) const {
  const double a = t.law.exact ? 0.0 : t.law.mu, off = un_[i] - a * q.z.x() - q.y;
  Vec4 r = Vec4::Zero();
  r[0] = tau - q.P * q.y - q.P * off;
  if (phase == Phase::corrector) r[0] -= q.dP * q.dy;
  if (!q.frictional) return r;
  Vec3 s = tau / determinant(q.z) * reflected(q.z) - q.x;
  if (phase == Phase::corrector) {
    const auto root = [&](const Vec3& d) -> Vec3 {
      return q.size * (2 * q.axis.dot(d) * q.axis - reflected(d));
    };
    const auto root_of_inverse = [&](const Vec3& d) -> Vec3 {
      return (2 * reflected(q.axis).dot(d) * reflected(q.axis) - reflected(d)) / q.size;
    };
    s -= root(quotient(root(q.z), product(root_of_inverse(q.dx), root(q.dz))));
  }
  r.tail<3>() = s;
  return r;
}

/// Eliminates the variables of one contact: its constant, and in the predictor its block D.
void Interior::contact_equations(const Touch& t, Pair& q, std::size_t i, Phase phase, double tau) {
  Vec3& c = constant_[i];
  Mat3& D = D_[i];
  if (!q.frictional) {
    const double pivot = q.y + q.P * t.compliance.x();
    c = Vec3(right_hand_side_of(t, q, i, phase, tau)[0] / pivot, 0, 0);
    if (phase == Phase::predictor) {
      D.setZero();
      D(0, 0) = q.P / pivot;
    }
    return;
  }
  if (phase == Phase::predictor) scale(t, q);
  q.right = right_hand_side_of(t, q, i, phase, tau);
  const Vec4 r = q.inverse * q.right;
  c = Vec3(r[0], r[2], r[3]);
  if (phase == Phase::corrector) return;
  Eigen::Matrix<double, 4, 3> by_velocity = Eigen::Matrix<double, 4, 3>::Zero();
  by_velocity(0, 0) = q.P;
  by_velocity.bottomRightCorner<3, 2>() = q.M.rightCols<2>();
  const Eigen::Matrix<double, 4, 3> response = q.inverse * by_velocity;
  D.row(0) = response.row(0);
  D.row(1) = response.row(2);
  D.row(2) = response.row(3);
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
double Interior::steps() {
  std::atomic<double> alpha = 1;  // the least: the same in whatever order
  in_ranges(system_->contacts(), contacts_at_once, [&](int from, int to) {
    double here = 1;
    for (int i = from; i < to; ++i) {
      const Touch& t = system_->touch[i];
      if (!(t.w > 0)) continue;
      contact_step(t, pairs_[i], static_cast<std::size_t>(i));
      here = std::min(here, pairs_[i].own);
    }
    for (double least = alpha.load(std::memory_order_relaxed);
         here < least && !alpha.compare_exchange_weak(least, here, std::memory_order_relaxed);) {}
  });
  return alpha;
}

/// The contact's step from that of the velocities, and how much of it the contact admits.
void Interior::contact_step(const Touch& t, Pair& q, std::size_t i) const {
  const double mu = t.law.mu, a = t.law.exact ? 0.0 : mu, off = un_[i] - a * q.z.x() - q.y;
  const Vec3 du = system_->relative(t, step_.data());
  q.own = 1;
  if (q.frictional) {
    Vec4 r = q.right;
    r[0] -= q.P * du.x();
    r.tail<3>() -= q.M.rightCols<2>() * du.tail<2>();
    const Vec4 s = q.inverse * r;
    q.dP = s[0];
    q.dx = Vec3(mu * s[0], s[2], s[3]);
    q.dz = Vec3(s[1], du.y() + t.compliance.y() * s[2], du.z() + t.compliance.z() * s[3]);
    q.own = std::min(cone_step(q.x, q.dx), cone_step(q.z, q.dz));
  } else {
    q.dP = constant_[i].x() - D_[i](0, 0) * du.x();
    q.dx = q.dz = Vec3::Zero();
  }
  q.dy = du.x() + t.compliance.x() * q.dP - mu * (t.law.exact ? q.lag : 1.0) * q.dz.x() + off;
  if (q.dP < 0) q.own = std::min(q.own, -q.P / q.dP);
  if (q.dy < 0) q.own = std::min(q.own, -q.y / q.dy);
}

/// Mean of the complementary products after a part of the step [J].
double Interior::work_after(double alpha) {
  in_ranges(system_->contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      products_[2 * i] = products_[2 * i + 1] = 0;
      if (!(system_->touch[i].w > 0)) continue;
      const Pair& q = pairs_[i];
      products_[2 * i] = (q.P + alpha * q.dP) * (q.y + alpha * q.dy);
      if (q.frictional) products_[2 * i + 1] = (q.x + alpha * q.dx).dot(q.z + alpha * q.dz);
    }
  });
  return std::max(std::accumulate(products_.begin(), products_.end(), 0.0) / count_,
                  0.0);  // one after the other, whatever the threads
}

/// Predictor to tau = 0, then the corrector with the centring that the predictor's success asks for. The
/// factor serves again: up to `correctors` more, each with the products of the last direction's own parts,
/// while they lengthen a short step. False if a pivot vanishes.
bool Interior::direction(double work, int correctors, double& alpha) {
  right_hand_side(Phase::predictor, 0);
  hessian_->assemble(*system_, D_.data(), nullptr);
  if (!hessian_->lu.factor()) return false;
  step_ = rhs_;
  hessian_->lu.solve(step_.data());
  alpha = steps();
  const double sigma = std::min(1.0, std::pow(work_after(alpha) / work, 3));
  const double tau = std::max(sigma, 1e-3 * (1 - alpha)) * work;
  right_hand_side(Phase::corrector, tau);
  step_ = rhs_;
  hessian_->lu.solve(step_.data());
  alpha = steps();
  for (int k = 0; k < correctors && alpha < long_step; ++k) {
    last_pairs_.resize(pairs_.size());
    in_ranges(system_->contacts(), contacts_at_once, [&](int from, int to) {
      std::copy(pairs_.begin() + from, pairs_.begin() + to, last_pairs_.begin() + from);
    });
    last_step_ = step_;
    right_hand_side(Phase::corrector, tau);
    step_ = rhs_;
    hessian_->lu.solve(step_.data());
    const double longer = steps();
    if (longer < 1.1 * alpha) {
      pairs_.swap(last_pairs_);
      step_.swap(last_step_);
      break;
    }
    alpha = longer;
  }
  return true;
}

void Interior::advance(double alpha) {
  const double step = std::min(1.0, inside * alpha);
  for (int k = 0; k < system_->n; ++k) v_[k] += step * step_[k];
  const auto move = [&](std::size_t i) {
    const Touch& t = system_->touch[i];
    if (!(t.w > 0)) return;
    Pair& q = pairs_[i];
    q.P += step * q.dP;
    q.y += step * q.dy;
    q.x += step * q.dx;
    q.z += step * q.dz;
    p_[i] = Vec3(q.P + t.law.floor, q.frictional ? q.x.y() : 0, q.frictional ? q.x.z() : 0);
    q.lag = q.own < short_step ? std::min(1.0, q.lag + 0.5) : 0.5 * q.lag;
  };
  in_ranges(system_->contacts(), contacts_at_once, [&](int from, int to) {
    for (int i = from; i < to; ++i) move(static_cast<std::size_t>(i));
  });
}

InteriorOutcome Interior::run(const System& system, std::vector<Vec3>& p, std::vector<double>& v,
                              const InteriorOptions& options) {
  constexpr int patience = 15;  // iterations that are to halve the work
  InteriorOutcome outcome;
  Progress progress;
  system_ = &system;
  v_ = v;
  p_ = p;
  begin(std::max(options.start, options.tolerance));
  best_ = p_;
  best_v_ = v_;
  double first = 0;
  for (int it = 0; count_ > 0; ++it) {
    const double work = measure();
    if (it == 0) first = work;
    work_left_ = work / first;
    const double residual_here = residual(options.tolerance);
    if (residual_here < progress.least) {
      progress.least = residual_here;
      best_ = p_;
      best_v_ = own_ ? v_ : vp_;
    }
    if (progress.least <= options.tolerance || it >= options.max_iterations || !std::isfinite(work) ||
        !(work > 0))
      break;
    if (options.sweeps > 0 && it >= progress.next_settling &&
        system.count_off(options.tolerance) < settled_from * system.contacts()) {
      if (settle(options, progress)) break;
      progress.next_settling = it + 3;
    }
    if (work <= 0.5 * progress.work) {
      progress.work = work;
      progress.stalls = 0;
    } else if (++progress.stalls > patience) {
      break;  // the caller goes on
    }
    ++outcome.iterations;
    double alpha = 0;
    if (!direction(work, options.correctors, alpha)) break;
    advance(alpha);
  }
  outcome.residual = progress.least;
  p = best_;
  v = best_v_;
  return outcome;
}

}  // namespace talus::contact::detail
