#include "fem/material_damage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/reject.hpp"
#include "fem/material_eigen.hpp"

namespace talus::material {

double CellFrame::extent(const std::array<double, 3>& n) const {
  double sum = 0;
  for (const auto& e : edge) sum += std::abs(e[0] * n[0] + e[1] * n[1] + e[2] * n[2]);
  return sum;
}

namespace {
constexpr double rubble_friction = 0.7;
}

ConcreteDamage::ConcreteDamage(const Parameters& p) : p_(p) {
  const Concrete& c = p.concrete;
  Requirements needs;
  needs.require(c.young > 0, "material.young", c.young, "must be positive", "derive it from f_cm");
  needs.require(c.poisson >= 0 && c.poisson < 0.5, "material.poisson", c.poisson, "must be in [0, 0.5)", "concrete has about 0.2");
  needs.require(c.f_t > 0 && c.f_t < c.f_cm, "material.tensile_strength", c.f_t, "must be positive and below f_cm", "derive it from f_cm");
  needs.require(c.fracture_energy > 0, "material.fracture_energy", c.fracture_energy, "must be positive", "derive it from f_cm");
  needs.require(c.crushing_energy > 0, "material.crushing_energy", c.crushing_energy, "must be positive", "derive it from f_cm");
  needs.require(c.young * c.eps_c1 > c.f_cm, "material.eps_c1", c.eps_c1, "must be above f_cm / E", "derive it from f_cm");
  needs.require(c.biaxial_ratio > 1, "material.biaxial_ratio", c.biaxial_ratio, "must be above 1", "1.16 after Kupfer");
  needs.require(p.elastic_limit > 0 && p.elastic_limit <= 0.6, "material.elastic_limit", p.elastic_limit, "must be in (0, 0.6]", "0.2 follows the Model Code curve within 5 %");
  needs.require(p.cap > 0.9 && p.cap < 1, "material.damage_cap", p.cap, "must be in (0.9, 1)", "1 - 1e-5 keeps G_F");
  needs.require(p.rate_cap_compression >= 1, "material.rate_cap_compression", p.rate_cap_compression, "must be at least 1", "1.25");
  needs.require(p.aggregate >= 0 && p.aggregate < 0.2, "material.aggregate", p.aggregate, "must be in [0, 0.2) m", "0.016");
  needs.done();

  young_ = c.young;
  poisson_ = c.poisson;
  f_t_ = c.f_t;
  f_c_ = c.f_cm;
  f_c0_ = p.elastic_limit * f_c_;
  stress_peak_ = young_ * c.eps_c1;
  shear_ = young_ / (2 * (1 + poisson_));
  bulk_ = young_ / (3 * (1 - 2 * poisson_));
  const double sine = rubble_friction / std::sqrt(1 + rubble_friction * rubble_friction);
  friction_ = std::sqrt(2.0 / 3) * 6 * sine / (3 - sine);
  interlock_ = p.aggregate > 0 ? 0.18e6 * std::sqrt(f_c_ / 1e6) / 0.31 : 0.0;
  widen_ = 24 / 0.31 / (p.aggregate + 0.016);
  part_ = p.aggregate > 0 ? 1 / p.aggregate : 0.0;
  const double root2 = std::sqrt(2.0);
  k_oct_ = root2 * (c.biaxial_ratio - 1) / (2 * c.biaxial_ratio - 1);
  tau_scale_ = 3 / (root2 - k_oct_);
  k_curve_ = (stress_peak_ - f_c0_) / (f_c_ - f_c0_);
  inverse_span_ = 1 / (stress_peak_ - f_c0_);
  // tau_t^2 <= E eps:C:eps for nu >= 0. tau_c <= tau_scale t_oct, t_oct^2 <= |s|^2/3, |s|^2 <= E eps:C:eps / (1 - 2 nu).
  const double reach = tau_scale_ * tau_scale_ / (3 * (1 - 2 * poisson_));
  elastic_bound_ = std::min(f_t_ * f_t_, f_c0_ * f_c0_ / reach) / young_;
}

double ConcreteDamage::largest_cell() const { return snapback_limit(young_, f_t_, p_.concrete.fracture_energy); }

double ConcreteDamage::crack_length(double f_t, double b_t) const {
  if (!(f_t > 0) || !(b_t > 0)) return 0;
  return p_.concrete.fracture_energy / (f_t * (1 / (young_ * b_t) + f_t / (2 * young_)));
}

double ConcreteDamage::crack_opening(double f_t, double b_t, double d_t, double largest_strain) const {
  return crack_length(f_t, b_t) * d_t * std::max(0.0, largest_strain);
}

namespace {
constexpr double mobilised = 0.5;   // slip over crack width at which the faces give all they can (0.3 to 0.75 by Walraven's linear relation)
}

template <class R>
struct ConcreteDamage::Lanes {
  R r_t, f_t, b_t, d_t, r_c, dif_c, b_c, d_c;
  R normal[3], slip[3];
  R compaction, pressure;
  R flow[6];
};

template <class R>
inline R ConcreteDamage::damage_tension(R r, R f_t, R b_t) const {
  return minimum(1.0 - f_t / r * exponential(b_t * (f_t - r)), spread(p_.cap, r));
}

template <class R>
inline R ConcreteDamage::damage_compression(R r, R dif, R b_c) const {
  const R s = r / dif;  // quasi-static equivalent, E eps
  const R x = (s - f_c0_) * inverse_span_;
  const R rising = f_c0_ + (f_c_ - f_c0_) * (k_curve_ * x - x * x) / (1.0 + (k_curve_ - 2) * x);
  const R falling = f_c_ * exponential(b_c * (stress_peak_ - s));
  return minimum(1.0 - select(x < 1.0, rising, falling) / s, spread(p_.cap, r));
}

void ConcreteDamage::start_tension(const Sym& stress, double tau, double largest, const Sym* rate, const CellFrame& cell, State& s) const {
  const double g_f = p_.concrete.fracture_energy;
  const double limit = largest_cell();
  const std::array<double, 3> normal = principal_direction(stress, largest);
  const double l = std::min(cell.extent(normal), 0.98 * limit);
  double factor = 1;
  if (rate && p_.rate_effect) {
    const double without_snapback = std::sqrt(std::max(1.0, 0.9 * limit / l));
    factor = std::clamp(rate_factor_tension(std::max(0.0, extreme_rates(*rate)[0])), 1.0, without_snapback);
  }
  const double f = factor * f_t_;
  if (tau <= f) return;
  s.f_t = f;
  s.b_t = 1 / (young_ * (g_f / (l * f) - f / (2 * young_)));
  s.r_t = f;
  s.normal = normal;
}

void ConcreteDamage::start_compression(const Sym& stress, double tau, double least, const Sym* rate, const CellFrame& cell, State& s) const {
  double factor = 1;
  if (rate && p_.rate_effect)
    factor = std::clamp(rate_factor_compression(std::max(0.0, -extreme_rates(*rate)[1])), 1.0, p_.rate_cap_compression);
  if (tau <= factor * f_c0_) return;
  const double l = cell.extent(principal_direction(stress, least));
  s.dif_c = factor;
  s.b_c = l * f_c_ * factor * factor / (young_ * p_.concrete.crushing_energy);
  s.r_c = factor * f_c0_;
}

namespace {
inline double lane(double v, int) { return v; }
inline double lane(const V4& v, int i) { return v[i]; }
inline void set_lane(double& v, int, double x) { v = x; }
inline void set_lane(V4& v, int i, double x) { v[i] = x; }
template <class R> constexpr int width = 1;
template <> constexpr int width<V4> = 4;
}  // namespace

template <class R>
inline void ConcreteDamage::effective_stress(const R (&strain)[6], R poisson, R (&stress)[6]) const {
  const R mu = 0.5 * young_ / (1.0 + poisson);
  const R volumetric = 2.0 * mu * poisson / (1.0 - 2.0 * poisson) * (strain[0] + strain[1] + strain[2]);
  for (int i = 0; i < 3; ++i) stress[i] = volumetric + 2.0 * mu * strain[i];
  for (int i = 3; i < 6; ++i) stress[i] = mu * strain[i];
}

namespace {
/// sigma : eps for given damage.
template <class R, class Values>
inline R twice_energy(const R (&strain)[6], const R (&effective)[6], const Values& v, R d_t, R d_c) {
  R plus[6], sum = effective[0] * 0.0;
  positive_part(effective, v, plus);
  for (int i = 0; i < 6; ++i) sum = sum + (effective[i] - d_t * plus[i] - d_c * (effective[i] - plus[i])) * strain[i];
  return sum;
}
}  // namespace

namespace {
/// The part of a symmetric tensor's product with n that lies in the plane normal to n; `normal_part` the rest.
template <class R>
inline void in_plane(const R (&s)[6], const R (&n)[3], double shear, R (&t)[3], R& normal_part) {
  t[0] = s[0] * n[0] + shear * (s[5] * n[1] + s[4] * n[2]);
  t[1] = s[1] * n[1] + shear * (s[5] * n[0] + s[3] * n[2]);
  t[2] = s[2] * n[2] + shear * (s[4] * n[0] + s[3] * n[1]);
  normal_part = t[0] * n[0] + t[1] * n[1] + t[2] * n[2];
  for (int i = 0; i < 3; ++i) t[i] = t[i] - normal_part * n[i];
}
template <class R>
inline R dot(const R (&a)[3], const R (&b)[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
}  // namespace

template <class R>
inline void ConcreteDamage::interlock(const R (&strain)[6], const R& old_d_t, Lanes<R>& s, R (&stress)[6], R& energy, R& dissipation) const {
  const R zero = spread(0.0, s.d_t), one = spread(1.0, s.d_t);
  const auto cracked = s.d_t > 0.0;
  const R (&n)[3] = s.normal;
  R pull[3], opening, law[3], across;
  in_plane(strain, n, 0.5, pull, opening);
  in_plane(stress, n, 1.0, law, across);
  const R f_t = select(cracked, s.f_t, one), b_t = select(cracked, s.b_t, one);
  const R band = p_.concrete.fracture_energy / (f_t * (1.0 / (young_ * b_t) + f_t * (0.5 / young_)));
  const auto limit_of = [&](const R& d, const R& strain_of_opening) {
    const R width = band * d * maximum(strain_of_opening, zero);
    return select(cracked, d * interlock_ / (1.0 + widen_ * width) * maximum(1.0 - width * part_, zero), zero);
  };
  // The concrete between the cracks and the faces, one after the other, as stiff as at the widest opening so far.
  const auto stiffness_of = [&](const R& d, const R& widest) {
    const R whole = shear_ * d, hold = limit_of(d, widest) * band;
    return select(cracked, whole * hold / (hold + mobilised * band * d * maximum(widest, zero) * whole + 1e-30), zero);
  };
  const R opened = dot(s.slip, n), widest = maximum(opened, opening);
  const R before = stiffness_of(old_d_t, opened), now = stiffness_of(s.d_t, widest), stiffness = minimum(before, now);
  R held[3];
  for (int i = 0; i < 3; ++i) held[i] = 2.0 * pull[i] - (s.slip[i] - opened * n[i]);
  const R length = square_root(dot(held, held)), trial = stiffness * length;
  // Together with what the damage law carries along the same direction, at most the limit.
  R t[3];
  const R inverse = 1.0 / maximum(length, spread(1e-30, zero));
  for (int i = 0; i < 3; ++i) t[i] = held[i] * inverse;
  const R tau = minimum(trial, maximum(limit_of(s.d_t, opening) - maximum(dot(law, t), zero), zero));
  // Stored: tau^2 / (2 now). A stiffness that has risen takes the stress over as it is, one that has fallen the strain.
  const R slid = select(stiffness > 0.0, (trial - tau) / select(stiffness > 0.0, stiffness, one), zero), kept = length - slid;
  const R elastic = select(now > 0.0, tau / select(now > 0.0, now, one), zero);
  energy = energy + 0.5 * tau * elastic;
  dissipation = dissipation + tau * slid + 0.5 * (before - stiffness) * kept * kept + 0.5 * tau * (kept - elastic);
  for (int i = 0; i < 3; ++i) {
    s.slip[i] = s.slip[i] + select(cracked, (length - elastic) * t[i] + (widest - opened) * n[i], zero);
    stress[i] = stress[i] + 2.0 * tau * n[i] * t[i];
  }
  stress[3] = stress[3] + tau * (n[1] * t[2] + n[2] * t[1]);
  stress[4] = stress[4] + tau * (n[0] * t[2] + n[2] * t[0]);
  stress[5] = stress[5] + tau * (n[0] * t[1] + n[1] * t[0]);
}

/// What the crushed part carries; `largest`: the largest principal value of the effective stress, with Poisson's ratio `poisson`.
template <class R>
inline void ConcreteDamage::crushed(const R (&strain)[6], R largest, R poisson, R old_d_c, Lanes<R>& s, R (&stress)[6], R& energy, R& dissipation) const {
  const R zero = spread(0.0, s.d_c), volume = strain[0] + strain[1] + strain[2];
  const auto broken = s.d_c > 0.0;
  const R mu = 0.5 * young_ / (1.0 + poisson);
  const R widest = (largest - 2.0 * mu * poisson / (1.0 - 2.0 * poisson) * volume) / (2.0 * mu);   // principal strain
  const R confinement = maximum(zero - ((bulk_ - 2 * shear_ / 3) * volume + 2 * shear_ * widest), zero);
  const R trial = bulk_ * (zero - volume - s.compaction);
  const R p = select(broken, maximum(minimum(trial, confinement), zero), zero);
  const R theta = select(broken & (trial > confinement), zero - volume - confinement / bulk_, s.compaction);
  // Friction: radial return of the deviator.
  R shear[6], norm = zero;
  for (int i = 0; i < 3; ++i) shear[i] = 2 * shear_ * (strain[i] - volume / 3.0 - s.flow[i]), norm = norm + shear[i] * shear[i];
  for (int i = 3; i < 6; ++i) shear[i] = shear_ * (strain[i] - s.flow[i]), norm = norm + 2.0 * shear[i] * shear[i];
  norm = square_root(norm);
  const R limit = friction_ * p;
  const auto slides = norm > limit;
  const R keep = select(slides, limit / select(slides, norm, spread(1.0, zero)), spread(1.0, zero));
  const R held = keep * norm;
  const R rubbed = 0.25 / shear_ * (1.0 - keep) * norm * (friction_ * s.pressure + held);   // it slid at the limit before, too
  const R compacted = 0.5 * (s.pressure + p) * (theta - s.compaction);
  const R mean_d = 0.5 * (old_d_c + s.d_c), grown = s.d_c - old_d_c;
  dissipation = dissipation + select(broken, mean_d * (compacted + rubbed) - grown * (0.25 / bulk_ * (s.pressure * s.pressure + p * p) + 0.25 / shear_ * held * held), zero);
  energy = energy + select(broken, s.d_c * (0.5 / bulk_ * p * p + 0.25 / shear_ * held * held), zero);
  for (int i = 0; i < 6; ++i) {
    const R t = keep * shear[i];
    stress[i] = stress[i] + select(broken, s.d_c * (i < 3 ? t - p : t), zero);
    s.flow[i] = select(broken, s.flow[i] + (1.0 - keep) * shear[i] * (i < 3 ? 0.5 / shear_ : 1 / shear_), s.flow[i]);
  }
  s.compaction = theta;
  s.pressure = p;
}

template <class R, class Rate>
inline __attribute__((always_inline)) bool ConcreteDamage::point(const R (&strain)[6], Lanes<R>& s, const CellFrame& cell, const Rate& rate,
                                                                  R (&stress)[6], R& energy, R& dissipation) const {
  R effective[6];
  R poisson = poisson_ * (1.0 - s.d_t);
  effective_stress(strain, poisson, effective);
  auto v = principal_values(effective);
  const R zero = spread(0.0, v.first);
  const R p1 = maximum(v.first, zero), p2 = maximum(v.second, zero), p3 = maximum(v.third, zero);
  const R n1 = minimum(v.first, zero), n2 = minimum(v.second, zero), n3 = minimum(v.third, zero);
  const R sum = p1 + p2 + p3;
  const R tau_t = square_root(maximum((1.0 + poisson) * (p1 * p1 + p2 * p2 + p3 * p3) - poisson * (sum * sum), zero));
  const R octahedral = square_root((n1 - n2) * (n1 - n2) + (n2 - n3) * (n2 - n3) + (n3 - n1) * (n3 - n1));
  const R tau_c = maximum((tau_scale_ / 3) * (k_oct_ * (n1 + n2 + n3) + octahedral), zero);

  const auto fresh_t = (s.r_t == 0.0) & (tau_t > f_t_);
  const auto fresh_c = (s.r_c == 0.0) & (tau_c > f_c0_);
  if (any(fresh_t | fresh_c)) {  // rare, lane by lane: strength and cell extent are frozen here
    for (int i = 0; i < width<R>; ++i) {
      const Sym here{lane(effective[0], i), lane(effective[1], i), lane(effective[2], i), lane(effective[3], i), lane(effective[4], i), lane(effective[5], i)};
      Sym speed;
      const Sym* const speed_or_null = rate(i, speed) ? &speed : nullptr;
      State one;
      if (lane(s.r_t, i) == 0 && lane(tau_t, i) > f_t_) {
        start_tension(here, lane(tau_t, i), lane(v.first, i), speed_or_null, cell, one);
        set_lane(s.r_t, i, one.r_t);
        set_lane(s.f_t, i, one.f_t);
        set_lane(s.b_t, i, one.b_t);
        for (int k = 0; k < 3; ++k) set_lane(s.normal[k], i, one.normal[static_cast<std::size_t>(k)]);
      }
      if (lane(s.r_c, i) == 0 && lane(tau_c, i) > f_c0_) {
        start_compression(here, lane(tau_c, i), lane(v.third, i), speed_or_null, cell, one);
        set_lane(s.r_c, i, one.r_c);
        set_lane(s.dif_c, i, one.dif_c);
        set_lane(s.b_c, i, one.b_c);
      }
    }
  }
  const auto grow_t = (s.r_t > 0.0) & (tau_t > s.r_t);
  const auto grow_c = (s.r_c > 0.0) & (tau_c > s.r_c);
  R weight_t = zero, before = zero, loss_c = zero;  // mean of r^2/tau^2 over the step; twice the energy with the old damage; growth times mean
  const R old_d_t = s.d_t, old_d_c = s.d_c;
  const bool grows_t = any(grow_t), grows_c = any(grow_c);
  if (grows_t) {
    const R one = spread(1.0, zero);
    const R r = select(grow_t, tau_t, one);
    const R d = select(grow_t, maximum(damage_tension(r, select(grow_t, s.f_t, one), select(grow_t, s.b_t, one)), s.d_t), s.d_t);
    // The mean of r^2 over the growth, exact: r^2 d d_t = s (1 + b r) dr with the softening stress s = f_t exp(-b (r - f_t)).
    const R b = select(grow_t, s.b_t, one), from = select(grow_t, s.r_t, one), grown = d - s.d_t;
    const R s_0 = (1.0 - s.d_t) * from, s_1 = minimum((1.0 - d) * r, s_0 * exponential(b * (from - r)));
    const R exact = (s_0 * (2.0 / b + from) - s_1 * (2.0 / b + r)) / (r * r * maximum(grown, spread(1e-12, zero)));
    weight_t = select(grow_t, select(grown > 1e-10, minimum(maximum(exact, zero), one), 0.5 + 0.5 * (from * from) / (r * r)), zero);
    before = twice_energy(strain, effective, v, old_d_t, old_d_c);
    s.d_t = d;
    s.r_t = select(grow_t, tau_t, s.r_t);
    poisson = poisson_ * (1.0 - d);
    effective_stress(strain, poisson, effective);
    v = principal_values(effective);
  }
  if (grows_c) {
    const R one = spread(1.0, zero);
    const R r = select(grow_c, tau_c, spread(f_c0_, zero));
    const R d = select(grow_c, maximum(damage_compression(r, select(grow_c, s.dif_c, one), select(grow_c, s.b_c, one)), s.d_c), s.d_c);
    // The integral of r^2 over the growth; beyond the peak, where the stress falls as in tension, exact.
    const R from = select(grow_c, s.r_c, r), s_0 = (1.0 - s.d_c) * from, s_1 = (1.0 - d) * r;
    const R fall = 2.0 * s.dif_c / select(grow_c, s.b_c, one);
    const R exact = maximum(s_0 * (fall + from) - s_1 * (fall + r), zero), rising = (d - s.d_c) * 0.5 * (r * r + from * from);
    loss_c = select(from > stress_peak_ * s.dif_c, exact, rising) / (r * r);
    s.d_c = d;
    s.r_c = select(grow_c, tau_c, s.r_c);
  }
  R plus[6];
  positive_part(effective, v, plus);
  R stored_plus = zero, stored = zero, work = zero;
  for (int i = 0; i < 6; ++i) {
    const R minus = effective[i] - plus[i];
    stress[i] = effective[i] - s.d_t * plus[i] - s.d_c * minus;
    stored_plus = stored_plus + plus[i] * strain[i];
    stored = stored + effective[i] * strain[i];
    work = work + stress[i] * strain[i];
  }
  energy = 0.5 * work;
  const R with_new_cracks = stored - s.d_t * stored_plus - old_d_c * (stored - stored_plus);
  dissipation = 0.5 * (maximum(before - with_new_cracks, zero) * weight_t + maximum(stored - stored_plus, zero) * loss_c);
  if (any(s.d_c > 0.0)) crushed(strain, v.first, poisson, old_d_c, s, stress, energy, dissipation);
  if (interlock_ > 0 && any(s.d_t > 0.0)) interlock(strain, old_d_t, s, stress, energy, dissipation);
  return grows_t || grows_c;
}

Response ConcreteDamage::operator()(const Sym& strain, const Sym& rate, const State& old, State& next) const {
  Lanes<double> s{old.r_t, old.f_t, old.b_t, old.d_t, old.r_c, old.dif_c, old.b_c, old.d_c,
                  {old.normal[0], old.normal[1], old.normal[2]}, {old.slip[0], old.slip[1], old.slip[2]}, old.compaction, old.pressure,
                  {old.flow[0], old.flow[1], old.flow[2], old.flow[3], old.flow[4], old.flow[5]}};
  const double e[6] = {strain[0], strain[1], strain[2], strain[3], strain[4], strain[5]};
  double stress[6];
  Response out;
  point(e, s, p_.cell, [&](int, Sym& speed) { speed = rate; return true; }, stress, out.energy, out.dissipation);
  std::copy(stress, stress + 6, out.stress.begin());
  next = {s.r_t, s.f_t, s.b_t, s.d_t, s.r_c, s.dif_c, s.b_c, s.d_c, {s.normal[0], s.normal[1], s.normal[2]}, {s.slip[0], s.slip[1], s.slip[2]}, s.compaction, s.pressure, {s.flow[0], s.flow[1], s.flow[2], s.flow[3], s.flow[4], s.flow[5]}};
  return out;
}

bool ConcreteDamage::stress8(const double* strain, const double* rate, const CellFrame& cell, const DamageCell& old, DamageCell& next,
                             double* stress, double* energy, double* dissipation) const {
  bool grew = false;
  for (int half = 0; half < 8; half += 4) {
    V4 e[6], out[6], stored, lost;
    for (int i = 0; i < 6; ++i) e[i] = load4(strain + 8 * i + half);
    Lanes<V4> s{load4(old.r_t + half), load4(old.f_t + half), load4(old.b_t + half), load4(old.d_t + half),
                load4(old.r_c + half), load4(old.dif_c + half), load4(old.b_c + half), load4(old.d_c + half),
                {load4(old.normal[0] + half), load4(old.normal[1] + half), load4(old.normal[2] + half)},
                {load4(old.slip[0] + half), load4(old.slip[1] + half), load4(old.slip[2] + half)},
                load4(old.compaction + half), load4(old.pressure + half),
                {load4(old.flow[0] + half), load4(old.flow[1] + half), load4(old.flow[2] + half), load4(old.flow[3] + half), load4(old.flow[4] + half), load4(old.flow[5] + half)}};
    const auto speed_of = [&](int i, Sym& speed) {
      if (!rate) return false;
      for (int k = 0; k < 6; ++k) speed[k] = rate[8 * k + half + i];
      return true;
    };
    const bool grows = point(e, s, cell, speed_of, out, stored, lost);
    grew = grew || grows;
    for (int i = 0; i < 6; ++i) store4(stress + 8 * i + half, out[i]);
    if (energy) store4(energy + half, stored);
    if (dissipation) store4(dissipation + half, lost);
    store4(next.r_t + half, s.r_t);
    store4(next.f_t + half, s.f_t);
    store4(next.b_t + half, s.b_t);
    store4(next.d_t + half, s.d_t);
    store4(next.r_c + half, s.r_c);
    store4(next.dif_c + half, s.dif_c);
    store4(next.b_c + half, s.b_c);
    store4(next.d_c + half, s.d_c);
    for (int k = 0; k < 3; ++k) {
      store4(next.normal[k] + half, s.normal[k]);
      store4(next.slip[k] + half, s.slip[k]);
    }
    store4(next.compaction + half, s.compaction);
    store4(next.pressure + half, s.pressure);
    for (int k = 0; k < 6; ++k) store4(next.flow[k] + half, s.flow[k]);
  }
  return grew;
}

double compression_curve(const ConcreteDamage::Parameters& p, double eps, double l) {
  const Concrete& c = p.concrete;
  const double f_0 = p.elastic_limit * c.f_cm, eps_0 = f_0 / c.young;
  if (eps <= eps_0) return c.young * eps;
  if (eps >= c.eps_c1) return c.f_cm * std::exp(-(eps - c.eps_c1) * l * c.f_cm / c.crushing_energy);
  const double x = (eps - eps_0) / (c.eps_c1 - eps_0), k = c.young * (c.eps_c1 - eps_0) / (c.f_cm - f_0);
  return f_0 + (c.f_cm - f_0) * (k * x - x * x) / (1 + (k - 2) * x);
}

}  // namespace talus::material
