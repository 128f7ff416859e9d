#include "contact/solver_interior.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact::detail {

namespace {

using Vec2 = Eigen::Vector2d;

// Largest a in [0, 1] that keeps x0 + a dx0 >= |x + a dx|.
double cone_step(double x0, const Vec2& x, double dx0, const Vec2& dx) {
  const double A = dx0 * dx0 - dx.squaredNorm(), B = x0 * dx0 - x.dot(dx), C = std::max(0.0, x0 * x0 - x.squaredNorm());
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

}  // namespace

InteriorOutcome Interior::run(const System& system, std::vector<Vec3>& p, std::vector<double>& v, const InteriorOptions& options) {
  InteriorOutcome outcome;
  const int nc = system.contacts(), n = system.n;
  pairs_.resize(nc);
  D_.resize(nc);
  constant_.resize(nc);
  un_.resize(nc);
  v_ = v;
  p_ = p;
  step_.resize(n);
  rhs_.resize(n);
  force_.resize(n);
  vp_.resize(n);
  const double delta = std::max(options.start, options.tolerance);
  for (int i = 0; i < nc; ++i) {
    const Touch& t = system.touch[i];
    Pair& q = pairs_[i];
    if (!(t.w > 0)) {
      p_[i].setZero();
      continue;
    }
    q.frictional = t.law.mu > 0 || t.law.mu * t.law.floor + t.law.cohesion > 0;
    q.P = std::max(p_[i].x() - t.law.floor, delta / t.w);
    const double g = t.law.mu * (q.P + t.law.floor) + t.law.cohesion;
    q.pt = q.frictional ? Vec2(p_[i].tail<2>()) : Vec2::Zero();
    if (q.pt.norm() > 0.9 * g) q.pt *= 0.9 * g / q.pt.norm();
    p_[i] = Vec3(q.P + t.law.floor, q.pt.x(), q.pt.y());
    const Vec3 u = system.relative(t, v_.data()) + t.bias + t.compliance.cwiseProduct(p_[i]);
    q.ut = u.tail<2>();
    const double slip = q.ut.norm();
    q.gamma = slip + delta * std::min(1.0, t.law.mu > 0 ? std::max(0.1, 1 / t.law.mu) : 1.0);
    q.y = std::max(u.x() - (t.law.exact ? 0.0 : t.law.mu * q.gamma), delta);
  }
  double best = INFINITY, least = INFINITY;   // of the path, and with what sweeps made of it
  int next = 0;   // iteration of the next attempt to settle
  best_ = p_;
  int stalls = 0, blocked = 0;
  // Weight of the flow rule's own coupling in the direction: 0 is Newton on exact Coulomb, fast but now and then blocked; 1 takes the
  // direction of the convex problem with the De Saxce shift held, which is monotone, and moves the shift at each iteration.
  double lag = 0;
  for (int it = 0;; ++it) {
    // Residuals at the point.
    double complementarity = 0;
    int count = 0;
    vp_ = system.v_hat;
    for (int i = 0; i < nc; ++i) {
      const Touch& t = system.touch[i];
      if (!(t.w > 0)) continue;
      system.push(t, p_[i], vp_.data());
      un_[i] = system.relative(t, v_.data()).x() + t.bias.x() + t.compliance.x() * p_[i].x();
      const Pair& q = pairs_[i];
      complementarity += t.w * q.P * q.y;
      ++count;
      if (q.frictional) {
        complementarity += t.w * ((t.law.mu * p_[i].x() + t.law.cohesion) * q.gamma + q.pt.dot(q.ut));
        ++count;
      }
    }
    if (count == 0) break;
    complementarity /= count;
    const double residual = system.residual(vp_, p_);
    if (options.sweeps > 0 && it >= next && residual > options.tolerance && complementarity < 100 * options.tolerance * options.tolerance) {
      // Most contacts are there before the last few, which hold up the whole path.
      settled_ = p_;
      settled_v_ = vp_;
      local_.run(system, settled_, settled_v_, options.tolerance, options.sweeps);
      system.velocities(settled_, settled_v_);
      const double after = system.residual(settled_v_, settled_);
      if (after < least) {
        least = after;
        best_ = settled_;
      }
      if (after <= options.tolerance) break;
      next = it + 3;
    }
    for (int k = 0; k < n; ++k) vp_[k] = v_[k] - vp_[k];
    if (residual < least) {
      least = residual;
      best_ = p_;
    }
    if (residual < best) {
      best = residual;
      stalls = 0;
    } else if (++stalls > 15 || blocked >= 3) {  // stuck: the caller starts elsewhere
      break;
    }
    if (least <= options.tolerance || it >= options.max_iterations || !std::isfinite(complementarity)) break;
    if (complementarity < 1e-4 * options.tolerance * options.tolerance) break;
    ++outcome.iterations;

    double tau = 0, sigma = 0;
    system.apply_mass(vp_.data(), force_.data());  // F = A (v - v(p))
    for (int phase = 0; phase < 2; ++phase) {
      // phase 0: predictor to tau = 0; phase 1: corrector with centring.
      for (int k = 0; k < n; ++k) rhs_[k] = -force_[k];
      for (int i = 0; i < nc; ++i) {
        const Touch& t = system.touch[i];
        if (!(t.w > 0)) {
          if (phase == 0) D_[i].setZero();
          continue;
        }
        Pair& q = pairs_[i];
        const double mu = t.law.mu, a = t.law.exact ? 0.0 : mu, b = t.law.exact ? lag * mu : mu, target = tau / t.w;
        const double g = mu * p_[i].x() + t.law.cohesion;
        const double r2 = un_[i] - a * q.gamma - q.y;
        double rn = target - q.y * q.P - q.P * r2;
        if (phase == 1) rn -= q.dP * q.dy;
        const double m11 = q.y + q.P * t.compliance.x();
        Vec3& c = constant_[i];
        if (!q.frictional) {
          c = Vec3(rn / m11, 0, 0);
          if (phase == 0) {
            D_[i].setZero();
            D_[i](0, 0) = q.P / m11;
          }
        } else {
          const Vec2 R = t.compliance.tail<2>();
          const Vec2 e = (Vec2::Constant(q.gamma) + g * R).cwiseInverse();
          const Vec2 s = q.ut + R.cwiseProduct(q.pt);
          double r0 = target - (g * q.gamma + q.pt.dot(q.ut));
          Vec2 rt = -(g * q.ut + q.gamma * q.pt);
          if (phase == 1) {
            r0 -= mu * q.dP * q.dgamma + q.dpt.dot(q.dut);
            rt -= mu * q.dP * q.dut + q.dgamma * q.dpt;
          }
          const double m12 = -q.P * b, m21 = mu * (q.gamma - s.dot(e.cwiseProduct(q.ut)));
          const double m22 = g - s.dot(e.cwiseProduct(q.pt));
          const double det = m11 * m22 - m12 * m21;
          // (dP, dgamma) = M^-1 (rn - P du_n, r0 - s.e.rt + (g s e - p_t) . du_t)
          const double k0 = r0 - s.dot(e.cwiseProduct(rt));
          const Vec2 kt = g * s.cwiseProduct(e) - q.pt;
          const double cP = (m22 * rn - m12 * k0) / det, cg = (m11 * k0 - m21 * rn) / det;
          const Vec2 ct = e.cwiseProduct(rt - mu * q.ut * cP - q.pt * cg);
          c = Vec3(cP, ct.x(), ct.y());
          if (phase == 0) {
            // Response to du: columns n, t1, t2.
            const double Pn = -m22 * q.P / det, gn = m21 * q.P / det;
            const Vec2 Pt = -m12 / det * kt, gt = m11 / det * kt;
            Mat3& D = D_[i];
            D(0, 0) = -Pn;
            D(0, 1) = -Pt.x();
            D(0, 2) = -Pt.y();
            for (int r = 0; r < 2; ++r) {
              D(1 + r, 0) = e[r] * (mu * q.ut[r] * Pn + q.pt[r] * gn);
              for (int k = 0; k < 2; ++k)
                D(1 + r, 1 + k) = e[r] * (mu * q.ut[r] * Pt[k] + q.pt[r] * gt[k] + (r == k ? g : 0.0));
            }
          }
        }
        for (int k = t.first; k < t.first + t.count; ++k) {
          const TouchTerm& term = system.terms[k];
          const double* J = system.J.data() + term.at;
          for (int r = 0; r < term.n; ++r)
            rhs_[term.v + r] += J[r] * c.x() + J[term.n + r] * c.y() + J[2 * term.n + r] * c.z();
        }
      }
      if (phase == 0) {
        hessian_->assemble(system, D_.data(), nullptr);
        if (!hessian_->lu.factor()) {
          outcome.residual = least;
          p = best_;
          system.velocities(p, v);
          return outcome;
        }
      }
      step_ = rhs_;
      hessian_->lu.solve(step_.data());
      double alpha = 1, after = 0;
      for (int i = 0; i < nc; ++i) {
        const Touch& t = system.touch[i];
        if (!(t.w > 0)) continue;
        Pair& q = pairs_[i];
        const double mu = t.law.mu, a = t.law.exact ? 0.0 : mu, b = t.law.exact ? lag * mu : mu, target = tau / t.w;
        const double g = mu * p_[i].x() + t.law.cohesion;
        const Vec3 du = system.relative(t, step_.data());
        const double r2 = un_[i] - a * q.gamma - q.y;
        const Vec3 dp = constant_[i] - D_[i] * du;
        double dgamma = 0;
        Vec2 dut = Vec2::Zero();
        if (q.frictional) {
          dut = du.tail<2>() + t.compliance.tail<2>().cwiseProduct(dp.tail<2>());
          double r0 = target - (g * q.gamma + q.pt.dot(q.ut));
          if (phase == 1) r0 -= mu * q.dP * q.dgamma + q.dpt.dot(q.dut);
          dgamma = (r0 - q.gamma * mu * dp.x() - q.ut.dot(dp.tail<2>()) - q.pt.dot(dut)) / g;
        }
        const double dy = du.x() + t.compliance.x() * dp.x() - b * dgamma + r2;
        q.dP = dp.x();
        q.dpt = dp.tail<2>();
        q.dgamma = dgamma;
        q.dut = dut;
        q.dy = dy;
        if (q.dP < 0) alpha = std::min(alpha, -q.P / q.dP);
        if (q.dy < 0) alpha = std::min(alpha, -q.y / q.dy);
        if (q.frictional) {
          alpha = std::min(alpha, cone_step(g, q.pt, mu * q.dP, q.dpt));
          alpha = std::min(alpha, cone_step(q.gamma, q.ut, q.dgamma, q.dut));
        }
      }
      if (phase == 0) {
        for (int i = 0; i < nc; ++i) {
          const Touch& t = system.touch[i];
          if (!(t.w > 0)) continue;
          const Pair& q = pairs_[i];
          after += t.w * (q.P + alpha * q.dP) * (q.y + alpha * q.dy);
          if (q.frictional)
            after += t.w * ((t.law.mu * (p_[i].x() + alpha * q.dP) + t.law.cohesion) * (q.gamma + alpha * q.dgamma) +
                            (q.pt + alpha * q.dpt).dot(q.ut + alpha * q.dut));
        }
        after = std::max(after / count, 0.0);
        sigma = std::min(1.0, std::pow(after / complementarity, 3));
        tau = std::max(sigma, 1e-3 * (1 - alpha)) * complementarity;
        continue;
      }
      blocked = alpha < 0.03 ? blocked + 1 : 0;
      lag = alpha < 0.3 ? std::min(1.0, lag + 0.5) : 0.5 * lag;
      alpha = std::min(1.0, alpha * 0.99);
      for (int k = 0; k < n; ++k) v_[k] += alpha * step_[k];
      for (int i = 0; i < nc; ++i) {
        const Touch& t = system.touch[i];
        if (!(t.w > 0)) continue;
        Pair& q = pairs_[i];
        q.P += alpha * q.dP;
        q.y += alpha * q.dy;
        q.gamma += alpha * q.dgamma;
        q.pt += alpha * q.dpt;
        p_[i] = Vec3(q.P + t.law.floor, q.pt.x(), q.pt.y());
        q.ut += alpha * q.dut;
      }
    }
  }
  outcome.residual = least;
  outcome.converged = least <= options.tolerance;
  p = best_;
  system.velocities(p, v);
  return outcome;
}

}  // namespace talus::contact::detail
