#include "fem/materials/material_cdpm2.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/bisect.hpp"
#include "fem/materials/material_eigen.hpp"

namespace talus::material {
namespace {

const double root6 = std::sqrt(6.0), root15 = std::sqrt(1.5);

/// Newton's method, steps halved until they lessen the residual f; `admit` makes an iterate admissible. The
/// largest |f| that is left; infinite where a step is none.
template <class V, class Residual, class Jacobian, class Admit>
double newton(V& x, const Residual& residual, const Jacobian& jacobian, const Admit& admit) {
  V f = residual(x);
  for (int it = 0; it < 60 && f.cwiseAbs().maxCoeff() >= 1e-11; ++it) {
    const V step = jacobian(x, f).partialPivLu().solve(-f);
    if (!step.allFinite()) return INFINITY;
    double length = 1;
    bool better = false;
    for (int cut = 0; cut < 12 && !better; ++cut, length *= 0.5) {
      V next = x + length * step;
      admit(next);
      const V g = residual(next);
      better = g.allFinite() && g.norm() < f.norm() * (1 - 1e-4 * length);
      if (better) x = next, f = g;
    }
    if (!better) break;
  }
  return f.cwiseAbs().maxCoeff();
}

}  // namespace

Cdpm2::Cdpm2(const Parameters& p) : p_(p) {
  const Concrete& c = p.concrete;
  const double b = c.biaxial_ratio * c.f_cm;
  const double epsilon = c.f_t / b * (b * b - c.f_cm * c.f_cm) / (c.f_cm * c.f_cm - c.f_t * c.f_t);
  e_ = (1 + epsilon) / (2 - epsilon);
  m0_ = 3 * (c.f_cm * c.f_cm - c.f_t * c.f_t) / (c.f_cm * c.f_t) * e_ / (e_ + 1);
  const double ratio = c.f_t / c.f_cm, d_f = dilation;
  b_g_ = (1 + ratio) / 3 / std::log((3 * ratio + 0.5 * m0_) * (d_f + 1) / ((2 * d_f - 1) * (3 + 0.5 * m0_)));
  lambda_ = c.young * c.poisson / ((1 + c.poisson) * (1 - 2 * c.poisson));
  mu_ = c.young / (2 * (1 + c.poisson));
  bulk_ = c.young / (3 * (1 - 2 * c.poisson));

  // Distance of the first yield surface along a fan of principal stress directions, as energy.
  double least = 1e300;
  constexpr int fan = 60;
  for (int i = 0; i <= fan; ++i)
    for (int j = 0; j < 2 * fan; ++j) {
      const double a = 3.14159265358979 * i / fan, b = 3.14159265358979 * j / fan;
      const Sym d{std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a), 0, 0, 0};
      double low = 0, high = 20 * c.f_cm;
      const auto at = [&](double x) {
        return yield({x * d[0], x * d[1], x * d[2], 0, 0, 0}, initial_hardening, 1);
      };
      if (at(high) < 0) continue;
      for (int it = 0; it < 40; ++it) {
        const double mid = 0.5 * (low + high);
        (at(mid) < 0 ? low : high) = mid;
      }
      const double tr = d[0] + d[1] + d[2];
      least = std::min(least, low * low * ((1 + c.poisson) - c.poisson * tr * tr) / c.young);
    }
  elastic_bound_ = 0.95 * least;
}

double Cdpm2::largest_cell() const {
  return 0.5 * snapback_limit(p_.concrete.young, p_.concrete.f_t, p_.concrete.fracture_energy);
}

double Cdpm2::shape(double c) const {
  const double e = e_, a = 1 - e * e, b = 2 * e - 1;
  return (4 * a * c * c + b * b) /
         (2 * a * c + b * std::sqrt(std::max(0.0, 4 * a * c * c + 5 * e * e - 4 * e)));
}

double Cdpm2::yield_at(double v, double r, double shape, double q1, double q2) const {
  const double b = r / root6 + v, a = (1 - q1) * b * b + root15 * r;
  return a * a + m0_ * q1 * q1 * q2 * (r / root6 * shape + v) - q1 * q1 * q2 * q2;
}

Cdpm2::Haigh Cdpm2::haigh(const Sym& s, double f_c) {
  const double m = (s[0] + s[1] + s[2]) / 3;
  const double a = s[0] - m, b = s[1] - m, c = s[2] - m;
  const double j2 = 0.5 * (a * a + b * b + c * c) + s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
  const double j3 =
      a * (b * c - s[3] * s[3]) - s[5] * (s[5] * c - s[3] * s[4]) + s[4] * (s[5] * s[3] - b * s[4]);
  Haigh h;
  h.v = m / f_c;
  h.r = std::sqrt(2 * j2) / f_c;
  const double cube = j2 * std::sqrt(j2);
  const double cos3 = cube > 1e-290 ? std::clamp(1.5 * std::sqrt(3.0) * j3 / cube, -1.0, 1.0) : 1.0;
  h.cos_theta = cosine_of_third(cos3);
  return h;
}

double Cdpm2::yield(const Sym& s, double q1, double q2) const {
  const Haigh h = haigh(s, p_.concrete.f_cm);
  return yield_at(h.v, h.r, shape(h.cos_theta), q1, q2);
}

double Cdpm2::q1(double k) const {
  if (k >= 1) return 1;
  const double q0 = initial_hardening;
  return q0 + (1 - q0) * (k * k * k - 3 * k * k + 3 * k) - hardening * (k * k * k - 3 * k * k + 2 * k);
}

double Cdpm2::q2(double k) const { return k < 1 ? 1 : 1 + hardening * (k - 1); }

double Cdpm2::ductility(double v) const {
  const double r = -v - 1.0 / 3.0;
  if (r >= 0) return a_h - (a_h - b_h) * std::exp(-r / c_h);
  const double e = b_h - d_h, f = e * c_h / (a_h - b_h);
  return e * std::exp(r / f) + d_h;
}

double Cdpm2::ductility_slope(double v) const {
  const double r = -v - 1.0 / 3.0;
  if (r >= 0) return -(a_h - b_h) / c_h * std::exp(-r / c_h);
  const double e = b_h - d_h, f = e * c_h / (a_h - b_h);
  return -e / f * std::exp(r / f);
}

double Cdpm2::flow_width(double q2) const {
  if (q2 == 1) return b_g_;
  const double ratio = p_.concrete.f_t / p_.concrete.f_cm, d = dilation;
  return q2 / 3 * (1 + ratio) /
         std::log((3 * ratio * q2 + 0.5 * m0_) * (d + 1) / ((2 * d - 1) * (3 * q2 + 0.5 * m0_)));
}

Cdpm2::Gradient Cdpm2::flow(double v, double r, double q1, double q2) const {
  const double ratio = p_.concrete.f_t / p_.concrete.f_cm, a_g = 3 * ratio * q2 + 0.5 * m0_,
               b_g = flow_width(q2);
  const double b = r / root6 + v, a = (1 - q1) * b * b + root15 * r;
  // The exponent is limited: far outside the surface Newton only needs the direction.
  const double m_g = a_g * std::exp(std::min(40.0, (v - q2 * ratio / 3) / b_g));
  return {4 * a * (1 - q1) * b + q1 * q1 * m_g,
          2 * a * (2 * (1 - q1) * b / root6 + root15) + q1 * q1 * m0_ / root6};
}

bool Cdpm2::regular(const Haigh& trial, double f_c, double kappa_n, double& v, double& r,
                    double& kappa) const {
  using V = Eigen::Vector4d;
  const double young = p_.concrete.young, lode = 4 * trial.cos_theta * trial.cos_theta,
               rho = shape(trial.cos_theta);
  const double push_v = bulk_ / young, push_r = 2 * mu_ / young, push_k = f_c / young * lode;
  const auto residual = [&](const V& x) {
    const double a = q1(x[2]), b = q2(x[2]);
    const Gradient m = flow(x[0], x[1], a, b);
    const double norm = std::sqrt(m.v * m.v / 3 + m.r * m.r);
    return V(x[0] - trial.v + push_v * x[3] * m.v, x[1] - trial.r + push_r * x[3] * m.r,
             x[2] - kappa_n - x[3] * push_k * norm / ductility(x[0]), yield_at(x[0], x[1], rho, a, b));
  };
  // Columns of v, r and dlambda in closed form, that of kappa by a difference.
  const auto jacobian = [&](const V& x, const V& f) {
    const double a = q1(x[2]), b = q2(x[2]), soft = 1 - a, base = x[1] / root6 + x[0],
                 big = soft * base * base + root15 * x[1];
    const double big_v = 2 * soft * base, big_r = big_v / root6 + root15;
    const Gradient m = flow(x[0], x[1], a, b);
    const double grow = m.v - 4 * big * soft * base;  // q1^2 m_g
    const double vv = 4 * soft * (big_v * base + big) + grow / flow_width(b),
                 vr = 4 * soft * (big_r * base + big / root6);
    const double rv = 2 * (big_v * big_r + 2 * big * soft / root6),
                 rr = 2 * (big_r * big_r + 2 * big * soft / 6);
    const double norm = std::max(1e-300, std::sqrt(m.v * m.v / 3 + m.r * m.r)), ductile = ductility(x[0]);
    const double nv = (m.v * vv / 3 + m.r * rv) / norm, nr = (m.v * vr / 3 + m.r * rr) / norm;
    const double surface = m0_ * a * a * b;
    Eigen::Matrix4d j;
    j.col(0) << 1 + push_v * x[3] * vv, push_r * x[3] * rv,
        -x[3] * push_k * (nv - norm * ductility_slope(x[0]) / ductile) / ductile, 2 * big * big_v + surface;
    j.col(1) << push_v * x[3] * vr, 1 + push_r * x[3] * rr, -x[3] * push_k * nr / ductile,
        2 * big * big_r + surface * rho / root6;
    V moved = x;
    moved[2] += 1e-8 * std::max(1e-2, std::abs(x[2]));
    j.col(2) = (residual(moved) - f) / (moved[2] - x[2]);
    j.col(3) << push_v * m.v, push_r * m.r, -push_k * norm / ductile, 0;
    return j;
  };
  V x(trial.v, trial.r, kappa_n, 0);
  const auto admit = [&](V& next) { next[2] = std::max(next[2], kappa_n), next[3] = std::max(next[3], 0.0); };
  if (!(newton(x, residual, jacobian, admit) <= 1e-8) || x[1] < 0) return false;
  v = x[0], r = x[1], kappa = x[2];
  return true;
}

bool Cdpm2::apex(const Haigh& trial, double f_c, double kappa_n, double& v, double& kappa) const {
  const double lode = 4 * trial.cos_theta * trial.cos_theta;
  const auto kappa_at = [&](double x) {
    const double volume = (trial.v - x) * f_c / bulk_, shear = trial.r * f_c / (2 * mu_);
    return kappa_n + std::sqrt(volume * volume / 3 + shear * shear) / ductility(x) * lode;
  };
  const auto value = [&](double x) {
    const double k = kappa_at(x);
    return yield_at(x, 0, 1, q1(k), q2(k));
  };
  if (!(value(trial.v) > 0)) return false;
  v = bisect(0, trial.v, [&](double at) { return !(value(at) > 0); }).first;
  kappa = kappa_at(v);
  // The apex takes all directions between those of the potential around it.
  const Gradient m = flow(v, 0, q1(kappa), q2(kappa));
  const double volume = (trial.v - v) * f_c / bulk_, shear = trial.r * f_c / (2 * mu_);
  return volume * m.v > 0 && shear * std::abs(m.v) <= m.r * std::abs(volume);
}

/// Return to the surface of fixed q1, q2: to the apex if it admits the direction, else Newton on (v, r,
/// dlambda).
bool Cdpm2::fixed(const Haigh& trial, double q1, double q2, double& v, double& r) const {
  const double young = p_.concrete.young, rho = shape(trial.cos_theta);
  v = trial.v;
  r = trial.r;
  if (yield_at(v, r, rho, q1, q2) <= 0) return true;
  if (yield_at(v, 0, rho, q1, q2) > 0) {
    const double inside = bisect(0, v, [&](double at) { return !(yield_at(at, 0, rho, q1, q2) > 0); }).first;
    const Gradient m = flow(inside, 0, q1, q2);
    const double volume = (trial.v - inside) / bulk_, shear = trial.r / (2 * mu_);
    if (volume * m.v > 0 && shear * std::abs(m.v) <= m.r * std::abs(volume)) {
      v = inside;
      r = 0;
      return true;
    }
  }
  using V = Eigen::Vector3d;
  const auto residual = [&](const V& x) {
    const Gradient m = flow(x[0], x[1], q1, q2);
    return V(x[0] - trial.v + bulk_ / young * x[2] * m.v, x[1] - trial.r + 2 * mu_ / young * x[2] * m.r,
             yield_at(x[0], x[1], rho, q1, q2));
  };
  const auto slopes = [&](const V& x, const V&) {
    Eigen::Matrix3d j;
    for (int c = 0; c < 3; ++c) {
      V up = x, down = x;
      const double step = 1e-7 * std::max(1e-2, std::abs(x[c]));
      up[c] += step;
      down[c] -= step;
      j.col(c) = (residual(up) - residual(down)) / (2 * step);
    }
    return j;
  };
  V x(trial.v, trial.r, 0);
  const double left = newton(x, residual, slopes, [](V& next) { next[2] = std::max(next[2], 0.0); });
  v = x[0];
  r = x[1];
  return left < 1e-9 && r >= 0;
}

/// kappa such that the plastic strain of the return to its own surface produces it: the excess grows with
/// kappa, since a larger surface leaves less plastic strain.
bool Cdpm2::nested(const Haigh& trial, double f_c, double kappa_n, double& v, double& r,
                   double& kappa) const {
  const double lode = 4 * trial.cos_theta * trial.cos_theta;
  const auto excess = [&](double k, double& value) {
    if (!fixed(trial, q1(k), q2(k), v, r)) return false;
    const double volume = (trial.v - v) * f_c / bulk_, shear = (trial.r - r) * f_c / (2 * mu_);
    value = k - kappa_n - std::sqrt(volume * volume / 3 + shear * shear) / ductility(v) * lode;
    return true;
  };
  double low = kappa_n, high = kappa_n + 1, value = 0;
  for (int i = 0; i < 40; ++i, high = kappa_n + 2 * (high - kappa_n)) {
    if (!excess(high, value)) return false;
    if (value > 0) break;
    low = high;
  }
  if (!(value > 0)) return false;
  for (int i = 0; i < 100 && high - low > 1e-14 * (1 + high); ++i) {
    kappa = 0.5 * (low + high);
    if (!excess(kappa, value)) return false;
    (value > 0 ? high : low) = kappa;
  }
  kappa = high;
  return excess(kappa, value);
}

bool Cdpm2::plastic_step(const Sym& strain, double f_c, bool last_resort, State& s, Sym& effective) const {
  Sym elastic;
  for (int i = 0; i < 6; ++i) elastic[i] = strain[i] - s.plastic[i];
  const Sym trial = hooke(lambda_, mu_, elastic);
  const Haigh h = haigh(trial, f_c);
  effective = trial;
  if (yield_at(h.v, h.r, shape(h.cos_theta), q1(s.kappa), q2(s.kappa)) <= 1e-11) return true;
  double v = 0, r = 0, kappa = s.kappa;
  bool done = apex(h, f_c, s.kappa, v, kappa);
  if (done)
    r = 0;
  else
    done = regular(h, f_c, s.kappa, v, r, kappa) || nested(h, f_c, s.kappa, v, r, kappa);
  if (!done) {
    if (!last_resort) return false;
    const double rho = shape(h.cos_theta), a = q1(s.kappa), b = q2(s.kappa);
    // Along the ray to the origin, which lies inside.
    const double part =
        bisect(0, 1, [&](double at) { return !(yield_at(at * h.v, at * h.r, rho, a, b) > 0); }).first;
    v = part * h.v;
    r = part * h.r;
    kappa = s.kappa;
    s.fallbacks += 1;
  }
  const double mean = h.v * f_c, scale = h.r > 0 ? r / h.r : 0;
  for (int i = 0; i < 6; ++i) {
    const double deviator = trial[i] - (i < 3 ? mean : 0);
    effective[i] = scale * deviator + (i < 3 ? v * f_c : 0);
    const double flow_dev = (1 - scale) * deviator / (2 * mu_);
    s.plastic[i] += i < 3 ? flow_dev + (h.v - v) * f_c / (3 * bulk_) : 2 * flow_dev;
  }
  s.kappa = kappa;
  return true;
}

}  // namespace talus::material
