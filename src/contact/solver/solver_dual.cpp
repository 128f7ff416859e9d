#include "contact/solver/solver_dual.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "contact/tolerances.hpp"

namespace talus::contact::detail {

void DualNewton::assemble(const System& system) {
  const int nc = system.contacts();
  W_.setZero(3 * nc, 3 * nc);
  q_.resize(3 * nc);
  root_.resize(nc);
  for (int i = 0; i < nc; ++i) root_[i] = system.touch[i].w > 0 ? std::sqrt(system.touch[i].w) : 1;
  for (int i = 0; i < nc; ++i) {
    const Touch& a = system.touch[i];
    q_.segment<3>(3 * i) = system.relative(a, system.v_hat.data()) + a.bias;
    for (int j = 0; j < nc; ++j) {
      const Touch& b = system.touch[j];
      Mat3 block = Mat3::Zero();
      for (int s = a.first; s < a.first + a.count; ++s)
        for (int t = b.first; t < b.first + b.count; ++t) {
          const TouchTerm &x = system.terms[s], &y = system.terms[t];
          if (x.body != y.body) continue;
          using Rows = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>>;
          block += Rows(system.J.data() + x.at, 3, x.n) * Rows(system.J.data() + y.at, 3, y.n).transpose();
        }
      if (i == j) block.diagonal() += a.compliance;
      W_.block<3, 3>(3 * i, 3 * j) = block / (root_[i] * root_[j]);
    }
  }
}

/// F, scaled by sqrt(w), into F_; the states; and M_. Returns |F|^2.
double DualNewton::evaluate(const System& system, const std::vector<Vec3>& p) {
  const int nc = system.contacts();
  VecX x(3 * nc);
  for (int i = 0; i < nc; ++i) x.segment<3>(3 * i) = root_[i] * p[i];
  u_.noalias() = W_ * x;
  F_.resize(3 * nc);
  M_.resize(3 * nc, 3 * nc);
  state_.resize(nc);
  for (int i = 0; i < nc; ++i) {
    const Touch& t = system.touch[i];
    const Vec3 u = u_.segment<3>(3 * i) + q_.segment<3>(3 * i) / root_[i];  // u / sqrt(w)
    Vec3 projected;
    Mat3 G;
    if (t.w > 0) {
      state_[i] = project(t.law, p[i] - u / root_[i], 1, 1, projected, &G);
    } else {
      state_[i] = open;
      projected.setZero();
      G.setZero();
    }
    F_.segment<3>(3 * i) = root_[i] * (p[i] - projected);
    M_.middleRows<3>(3 * i).noalias() = G * W_.middleRows<3>(3 * i);
    M_.block<3, 3>(3 * i, 3 * i) += Mat3::Identity() - G;
  }
  return F_.squaredNorm();
}

/// How far p may go along the direction (scaled like F) until a contact that sticks slips or one that is
/// closed opens.
double DualNewton::give_way(const System& system, const std::vector<Vec3>& p, const VecX& direction) const {
  double reach = INFINITY;
  for (int i = 0; i < system.contacts(); ++i) {
    const Touch& t = system.touch[i];
    if (state_[i] != closed) continue;
    const Vec3 d = direction.segment<3>(3 * i) / root_[i];
    const double mu = t.law.mu, g = mu * p[i].x() + t.law.cohesion;
    if (d.x() < 0) reach = std::min(reach, std::max(0.0, (t.law.floor - p[i].x()) / d.x()));
    // |p_t + a d_t| = g + a mu d_n
    const double A = d.tail<2>().squaredNorm() - mu * mu * d.x() * d.x(),
                 B = p[i].tail<2>().dot(d.tail<2>()) - g * mu * d.x();
    const double C = std::min(0.0, p[i].tail<2>().squaredNorm() - g * g),
                 q = B + std::sqrt(std::max(0.0, B * B - A * C));
    if (q > 0) reach = std::min(reach, -C / q);
  }
  return reach;
}

DualOutcome DualNewton::run(const System& system, std::vector<Vec3>& p, std::vector<double>& v,
                            double tolerance, double sufficient, int max_iterations) {
  DualOutcome outcome;
  const int nc = system.contacts();
  assemble(system);
  best_ = p;
  outcome.residual = INFINITY;
  int halved = 0;
  for (;; ++outcome.iterations) {
    const double merit = evaluate(system, p);
    system.velocities(p, v_);
    const double residual = system.residual(v_, p);
    if (residual < 0.5 * outcome.residual) halved = outcome.iterations;
    if (residual < outcome.residual) {
      outcome.residual = residual;
      best_ = p;
    }
    if (outcome.residual <= sufficient && outcome.iterations >= halved + 3) break;  // at round-off
    if (outcome.residual <= tolerance || outcome.iterations >= max_iterations || !std::isfinite(merit)) break;
    Eigen::CompleteOrthogonalDecomposition<MatX> solver;
    solver.setThreshold(1e-11);
    solver.compute(M_);
    const VecX step = solver.solve(-F_);
    VecX left = M_ * step + F_;  // what no step can meet
    trial_ = p;
    for (int i = 0; i < nc; ++i) trial_[i] += step.segment<3>(3 * i) / root_[i];
    if (left.squaredNorm() > 0.25 * merit) {
      for (int i = 0; i < nc; ++i)
        if (state_[i] != closed) left.segment<3>(3 * i).setZero();
      const double reach = give_way(system, trial_, -left);
      if (!std::isfinite(reach)) break;
      for (int i = 0; i < nc; ++i)
        trial_[i] -= (1 + tolerances().at_bound) * reach * left.segment<3>(3 * i) / root_[i];
    }
    // Full steps: a contact that has just begun to slip turns its impulse by a large angle on the way.
    p = trial_;
  }
  p = best_;
  system.velocities(p, v);
  return outcome;
}

}  // namespace talus::contact::detail
