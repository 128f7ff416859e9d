/// The contact law as a projection: admissible impulses, their proximal map and its derivative.
///
///   C = { p : p_n >= -T, |p_t| <= mu p_n + c }            (Mohr-Coulomb with tension cut-off)
///   associated:  p = argmin over C of  r_n (p_n - z_n)^2 + r_t |p_t - z_t|^2
///   exact:       p_n = max(floor, z_n),  p_t = z_t limited to the disk |p_t| <= mu p_n + c   [alart1991]
///   D = -dp/du where z = const - u / r, so D >= 0 for the associated law;
///   it is unsymmetric for exact Coulomb
///
/// symbol   meaning                                              unit      shape
/// z        trial impulse                                        N s       3
/// r        compliance of the trial, normal and tangential       m/s/(N s) 2
/// floor    least normal impulse, max(-T, -c/mu)                 N s       1
#pragma once
#include <cmath>
#include <limits>

#include "core/types.hpp"

namespace talus::contact::detail {

/// |(y, z)|. Slips and impulses are far from the range where the square would overflow or vanish; std::hypot
/// costs ten times as much.
inline double length(double y, double z) { return std::sqrt(y * y + z * z); }

struct Law {
  double mu = 0, cohesion = 0, floor = 0;
  double floor_bound = 0;  // of the tangential impulse there, 0 exactly at the cone's apex [N s]
  bool exact = true;       // false: associated flow (cone projection)
};

inline Law law_of(double mu, double cohesion, double tension, bool exact) {
  const bool apex = mu * tension > cohesion;
  return {mu, cohesion, apex ? -cohesion / mu : -tension, apex ? 0.0 : cohesion - mu * tension, exact};
}

/// Bits of the state: the regions of the law. 0 open, 1 closed and sticking, 3 closed and slipping, 2 or 4 on
/// the cut-off.
enum State : unsigned char { open = 0, closed = 1, slip = 2, held = 4 };

/// p(z) and, if D is given, D. Returns the state.
inline unsigned char project(const Law& law, const Vec3& z, double rn, double rt, Vec3& p, Mat3* D) {
  const double s = length(z.y(), z.z());
  if (D) D->setZero();
  if (!law.exact) {
    const bool inside = s <= law.mu * z.x() + law.cohesion;
    if (inside && z.x() >= law.floor) {
      p = z;
      if (D) D->diagonal() << 1 / rn, 1 / rt, 1 / rt;
      return closed;
    }
    const double q = rn + law.mu * law.mu * rt, n = (rn * z.x() + rt * law.mu * (s - law.cohesion)) / q;
    if (!inside && n > law.floor) {
      const double g = std::max(0.0, law.mu * n + law.cohesion), ty = z.y() / s, tz = z.z() / s;
      p = Vec3(n, g * ty, g * tz);
      if (D) {
        const Vec3 d(1, law.mu * ty, law.mu * tz);
        const double k = g / (s * rt);
        *D = d * d.transpose() / q;
        (*D)(1, 1) += k * tz * tz;
        (*D)(2, 2) += k * ty * ty;
        (*D)(1, 2) -= k * ty * tz;
        (*D)(2, 1) -= k * ty * tz;
      }
      return closed | slip;
    }
  }
  // The tangential impulse by the bound that the normal one gives, or the floor.
  const bool active = law.exact && z.x() > law.floor;
  const double g = active ? std::max(0.0, law.mu * z.x() + law.cohesion) : law.floor_bound;
  p.x() = active ? z.x() : law.floor;
  if (D && active) (*D)(0, 0) = 1 / rn;
  if (s <= g && g > 0) {
    p.y() = z.y();
    p.z() = z.z();
    if (D) (*D)(1, 1) = (*D)(2, 2) = 1 / rt;
    return active ? closed : held;
  }
  if (g == 0 || s == 0) {
    p.y() = p.z() = 0;
    if (D && active && s > 0 && law.mu > 0) {
      (*D)(1, 0) = law.mu * z.y() / (s * rn);
      (*D)(2, 0) = law.mu * z.z() / (s * rn);
    }
    return active ? (closed | slip) : open;
  }
  const double ty = z.y() / s, tz = z.z() / s;
  p.y() = g * ty;
  p.z() = g * tz;
  if (D) {
    const double k = g / (s * rt);
    (*D)(1, 1) = k * tz * tz;
    (*D)(2, 2) = k * ty * ty;
    (*D)(1, 2) = (*D)(2, 1) = -k * ty * tz;
    if (active) {
      (*D)(1, 0) = law.mu * ty / rn;
      (*D)(2, 0) = law.mu * tz / rn;
    }
  }
  return active ? (closed | slip) : slip;
}

/// Velocity change per impulse of a contact, along its normal and its face [1/kg].
struct Scale {
  double normal = 0, tangential = 0;
  Vec3 operator*(const Vec3& p) const { return {normal * p.x(), tangential * p.y(), tangential * p.z()}; }
  double length(const Vec3& p) const { return normal == tangential ? normal * p.norm() : (*this * p).norm(); }
};

/// The larger of two residuals. One that is not a number is larger than any.
inline double larger(double a, double b) { return b <= a || a != a ? a : b; }

/// Natural-map residual [m/s] of impulse p at the total contact velocity u + R p, in the scale w of the
/// contact: |w (p - P_C(p - (u + R p + shift n) / w))|, P_C nearest in w, with the De Saxce shift mu |(u + R
/// p)_t| for exact Coulomb. It is zero exactly at solutions; `round_off` is what the velocities cannot
/// resolve, and is taken off. Not a number where the velocity is none or without bound: to the comparisons of
/// the law it would be open.
inline double natural_residual(const Law& law, const Vec3& u_total, const Vec3& p, const Scale& w,
                               double round_off, double extra_shift = 0) {
  if (const double sum = u_total.x() + u_total.y() + u_total.z(); !std::isfinite(sum))
    return std::numeric_limits<double>::quiet_NaN();
  if (!(w.normal > 0)) return 0;
  Law cone = law;
  cone.exact = false;
  Vec3 u = u_total, q;
  u.x() += extra_shift + (law.exact ? law.mu * length(u.y(), u.z()) : 0.0);
  project(cone, p - Vec3(u.x() / w.normal, u.y() / w.tangential, u.z() / w.tangential), 1,
          w.tangential / w.normal, q, nullptr);
  // Below its last digit p swallows u / w in the difference, of which nothing can be said.
  const double r = std::max(w.length(p - q), std::numeric_limits<double>::epsilon() * w.length(p));
  return r <= round_off ? 0.0 : r - round_off;
}

}  // namespace talus::contact::detail
