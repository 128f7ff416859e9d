/// The damage law of material_damage.hpp in one point, or in several at once: R is a double, V4 or V8.
/// Included by the files that make it for one of them, each with its own instruction set, and by nothing
/// else: nothing here may exist for the same R in two of them.
#pragma once
#include "fem/materials/crack_row.hpp"
#include "fem/materials/material_damage.hpp"
#include "fem/materials/material_eigen.hpp"

namespace talus::material {

namespace {
constexpr double fixing_opening = 5;  // opening over G_F / f_t at which a crack's plane is fixed and its
                                      // faces begin to hold: the softening stress is 0.7 % of f_t
constexpr double least_gap = 1e-2;  // between the two largest principal stresses over the largest, from which
                                    // on the plane follows their direction: nearer, rounding turns it
constexpr double sliding_ratio =
    3;  // slip over opening at which faces slide: they hold 0.9 of what they tend to
}  // namespace

template <class R>
struct ConcreteDamage::Lanes {
  R r_t, f_t, b_t, d_t, r_c, dif_c, b_c, d_c;
  R normal[3], slip[3];
  R compaction, pressure;
  R flow[6];
  R permanent[6];
};

template <class R>
inline R ConcreteDamage::missing_tension(R q, R f_t, R b_t) const {
  return minimum(1.0 - f_t / q * exponential(b_t * (f_t - q)), spread(missing_cap_t_, q));
}

template <class R>
inline R ConcreteDamage::missing_compression(R q, R dif, R b_c) const {
  const R s = q / dif;  // quasi-static equivalent, E eps
  const R x = (s - f_c0_) * inverse_span_;
  const R rising = f_c0_ + (f_c_ - f_c0_) * (k_curve_ * x - x * x) / (1.0 + (k_curve_ - 2) * x);
  const R falling = f_c_ * exponential(b_c * (stress_peak_ - s));
  return minimum(1.0 - select(x < 1.0, rising, falling) / s, spread(missing_cap_c_, q));
}

/// Rare, and one point after the other: q at which f exp(b (start - q)) has fallen to (1 - missing) q. With y
/// = b q: y + ln y = c, by Newton's method.
template <class R>
__attribute__((noinline)) R ConcreteDamage::reaches_cap(const R& f, const R& start, const R& b,
                                                        double missing) const {
  double f_of[width<R>], from[width<R>], fall[width<R>];
  store(f_of, f), store(from, start), store(fall, b);
  for (int i = 0; i < width<R>; ++i) {
    const double c = fall[i] * from[i] + std::log(fall[i] * f_of[i] / (1 - missing));
    double y = std::max(c, 1.0);
    for (int k = 0; k < 6; ++k) y *= (1 + c - std::log(y)) / (1 + y);
    fall[i] = y / fall[i];
  }
  return load<R>(fall);
}

template <class R>
inline void ConcreteDamage::effective_stress(const R (&strain)[6], R poisson, R (&stress)[6]) const {
  const R share = young_ / ((1.0 + poisson) * (1.0 - 2.0 * poisson));  // divisions are what takes the time
  const R mu = (0.5 - poisson) * share;
  const R volumetric = poisson * share * (strain[0] + strain[1] + strain[2]);
  for (int i = 0; i < 3; ++i) stress[i] = volumetric + 2.0 * mu * strain[i];
  for (int i = 3; i < 6; ++i) stress[i] = mu * strain[i];
}

namespace {
/// The sums over the positive and over the negative principal values that energies are made of.
template <class R>
struct Parts {
  R sum_t, square_t, sum_c, square_c;

  explicit Parts(const Principal<R>& v) {
    const R zero = spread(0.0, v.first);
    const R p1 = maximum(v.first, zero), p2 = maximum(v.second, zero), p3 = maximum(v.third, zero);
    const R n1 = minimum(v.first, zero), n2 = minimum(v.second, zero), n3 = minimum(v.third, zero);
    sum_t = p1 + p2 + p3, square_t = p1 * p1 + p2 * p2 + p3 * p3;
    sum_c = n1 + n2 + n3, square_c = n1 * n1 + n2 * n2 + n3 * n3;
  }
  void scale(R t, R c) {
    sum_t = t * sum_t, square_t = t * t * square_t, sum_c = c * sum_c, square_c = c * c * square_c;
  }
  /// E times sigma : C^-1 : s.
  R twice_energy(R poisson, R d_t, R d_c) const {
    const R sum = sum_t + sum_c;
    return (1.0 - d_t) * ((1.0 + poisson) * square_t - poisson * sum_t * sum) +
           (1.0 - d_c) * ((1.0 + poisson) * square_c - poisson * sum_c * sum);
  }
};
}  // namespace

namespace {
/// Unit vector of the principal value `value` where it is single; elsewhere `n` as it was. The largest row of
/// the adjugate of s - value I, which is its multiple.
template <class R, class Mask>
inline void turn_to_principal(const R (&s)[6], R value, Mask where, R (&n)[3]) {
  const R a = s[0] - value, b = s[1] - value, c = s[2] - value;
  const R xy = s[3] * s[4] - s[5] * c, xz = s[5] * s[3] - s[4] * b,
          yz = s[4] * s[5] - a * s[3];  // of the adjugate, which is symmetric
  const R cross[3][3] = {
      {b * c - s[3] * s[3], xy, xz}, {xy, a * c - s[4] * s[4], yz}, {xz, yz, a * b - s[5] * s[5]}};
  R best[3], most = dot(cross[0], cross[0]);
  for (int i = 0; i < 3; ++i) best[i] = cross[0][i];
  for (int k = 1; k < 3; ++k) {
    const R square = dot(cross[k], cross[k]);
    const auto larger = square > most;
    for (int i = 0; i < 3; ++i) best[i] = select(larger, cross[k][i], best[i]);
    most = maximum(most, square);
  }
  const R scale = maximum(a * a, maximum(b * b, c * c)) + s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
  const auto turns = where & (most > least_gap * least_gap * scale * scale);
  const R inverse = 1.0 / square_root(select(turns, most, spread(1.0, most)));
  for (int i = 0; i < 3; ++i) n[i] = select(turns, inverse * best[i], n[i]);
}
}  // namespace

template <class R, class Mask>
inline void ConcreteDamage::interlock(const R (&strain)[6], const R (&effective)[6], R largest, Mask grows,
                                      Lanes<R>& s, R (&stress)[6], R& energy, R& dissipation) const {
  const R zero = spread(0.0, s.d_t), one = spread(1.0, s.d_t);
  const auto cracked = s.d_t > 0.0;
  const R f_t = select(cracked, s.f_t, one), b_t = select(cracked, s.b_t, one);
  const R band = 2.0 * p_.concrete.fracture_energy * young_ * b_t / (f_t * (2.0 + f_t * b_t));
  const R opened = dot(s.slip, s.normal);
  const auto fixed = cracked & (band * opened * f_t >= fixing_opening * p_.concrete.fracture_energy);
  R(&n)[3] = s.normal;
  if (any(grows))
    turn_to_principal(effective, largest,
                      grows & (band * opened * f_t < fixing_opening * p_.concrete.fracture_energy), n);
  R pull[3], opening, law[3], across;
  in_plane(strain, n, 0.5, pull, opening);
  const R widest = maximum(opened, opening);
  if (!any(fixed)) {
    for (int i = 0; i < 3; ++i) s.slip[i] = select(cracked, 2.0 * pull[i] + widest * n[i], zero);
    return;
  }
  in_plane(stress, n, 1.0, law, across);
  const auto limit_of = [&](const R& w) {
    return interlock_ * maximum(1.0 - w * part_, zero) / (1.0 + widen_ * maximum(w, zero));
  };
  const R before = limit_of(band * opened), limit = limit_of(band * widest);
  R held[3], t[3];
  for (int i = 0; i < 3; ++i) held[i] = 2.0 * pull[i] - (s.slip[i] - opened * n[i]);
  const R length = square_root(dot(held, held));
  const R inverse = 1.0 / maximum(length, spread(1e-30, zero));
  for (int i = 0; i < 3; ++i) t[i] = held[i] * inverse;
  const R apart = maximum(opening, zero), width = square_root(apart * apart + closed_ * closed_),
          per_width = 1.0 / width;
  // Together with what the damage law carries along the same direction, at most the limit.
  constexpr double share = sliding_ratio * sliding_ratio / (1 + sliding_ratio * sliding_ratio);
  const R room =
      maximum(minimum(1.0 - maximum(dot(law, t), zero) / maximum(limit, one), spread(share, zero)), zero);
  const R trial = length * per_width, psi = minimum(trial, square_root(room / (1.0 - room)));
  const R square = psi * psi, shape = square / (1.0 + square), angle = arctangent(psi);
  const R slid = maximum(length - psi * width, zero), tau = select(fixed, limit * shape, zero);
  const R stored = width * (psi - angle);  // over the limit
  const R press = select(fixed, limit * (angle - psi / (1.0 + square)) * apart * per_width, zero);
  energy = energy + select(fixed, limit * stored, zero);
  dissipation = dissipation + select(fixed, tau * slid + (before - limit) * stored, zero);
  for (int i = 0; i < 3; ++i) {
    s.slip[i] = select(fixed, s.slip[i] + slid * t[i] + (widest - opened) * n[i],
                       select(cracked, 2.0 * pull[i] + widest * n[i], zero));
    stress[i] = stress[i] + 2.0 * tau * n[i] * t[i] - press * n[i] * n[i];
  }
  stress[3] = stress[3] + tau * (n[1] * t[2] + n[2] * t[1]) - press * n[1] * n[2];
  stress[4] = stress[4] + tau * (n[0] * t[2] + n[2] * t[0]) - press * n[0] * n[2];
  stress[5] = stress[5] + tau * (n[0] * t[1] + n[1] * t[0]) - press * n[0] * n[1];
}

/// What the crushed part carries.
template <class R>
inline void ConcreteDamage::crushed(const R (&strain)[6], R old_d_c, Lanes<R>& s, R (&stress)[6], R& energy,
                                    R& dissipation) const {
  const R zero = spread(0.0, s.d_c), volume = strain[0] + strain[1] + strain[2];
  const auto broken = s.d_c > 0.0;
  R tensor[6];
  for (int i = 0; i < 6; ++i) tensor[i] = (i < 3 ? 1.0 : 0.5) * strain[i];
  const R widest = principal_values(tensor).first;
  const R confinement = maximum(zero - ((bulk_ - 2 * shear_ / 3) * volume + 2 * shear_ * widest), zero);
  const R trial = bulk_ * (zero - volume - s.compaction);
  const R p = select(broken, maximum(minimum(trial, confinement), zero), zero);
  const R theta = select(broken & (trial > confinement), zero - volume - confinement / bulk_, s.compaction);
  // Friction: radial return of the deviator.
  R shear[6], norm = zero;
  for (int i = 0; i < 3; ++i)
    shear[i] = 2 * shear_ * (strain[i] - volume / 3.0 - s.flow[i]), norm = norm + shear[i] * shear[i];
  for (int i = 3; i < 6; ++i)
    shear[i] = shear_ * (strain[i] - s.flow[i]), norm = norm + 2.0 * shear[i] * shear[i];
  norm = square_root(norm);
  const R limit = friction_ * p;
  const auto slides = norm > limit;
  const R keep = select(slides, limit / select(slides, norm, spread(1.0, zero)), spread(1.0, zero));
  const R held = keep * norm;
  // Slip grows with the fall of the limit from where it began: from the limit before, or, where that was not
  // reached, from the deviator that it then meets.
  const R rubbed = 0.25 / shear_ * (1.0 - keep) * norm * (minimum(friction_ * s.pressure, norm) + held);
  const R compacted = 0.5 * (s.pressure + p) * (theta - s.compaction);
  const R mean_d = 0.5 * (old_d_c + s.d_c), grown = s.d_c - old_d_c;
  dissipation =
      dissipation +
      select(broken,
             mean_d * (compacted + rubbed) -
                 grown * (0.25 / bulk_ * (s.pressure * s.pressure + p * p) + 0.25 / shear_ * held * held),
             zero);
  energy = energy + select(broken, s.d_c * (0.5 / bulk_ * p * p + 0.25 / shear_ * held * held), zero);
  for (int i = 0; i < 6; ++i) {
    const R t = keep * shear[i];
    stress[i] = stress[i] + select(broken, s.d_c * (i < 3 ? t - p : t), zero);
    s.flow[i] =
        select(broken, s.flow[i] + (1.0 - keep) * shear[i] * (i < 3 ? 0.5 / shear_ : 1 / shear_), s.flow[i]);
  }
  s.compaction = theta;
  s.pressure = p;
}

/// Rare, and one point after the other: strength and the cell's extent are frozen where damage starts.
template <class R, class Rate>
__attribute__((noinline)) void ConcreteDamage::start_points(const R (&effective)[6], const R& largest,
                                                            const R& least, const R& tau_t, const R& tau_c,
                                                            const CellFrame& cell, const Rate& rate,
                                                            Lanes<R>& s) const {
  constexpr int n = width<R>;
  double stress[6][n], first[n], third[n], t[n], c[n], r_t[n], f_t[n], b_t[n], r_c[n], dif_c[n], b_c[n],
      normal[3][n];
  for (int k = 0; k < 6; ++k) store(stress[k], effective[k]);
  store(first, largest), store(third, least), store(t, tau_t), store(c, tau_c);
  store(r_t, s.r_t), store(f_t, s.f_t), store(b_t, s.b_t), store(r_c, s.r_c), store(dif_c, s.dif_c),
      store(b_c, s.b_c);
  for (int k = 0; k < 3; ++k) store(normal[k], s.normal[k]);
  for (int i = 0; i < n; ++i) {
    const bool tension = r_t[i] == 0 && t[i] > f_t_, compression = r_c[i] == 0 && c[i] > f_c0_;
    if (!tension && !compression) continue;
    const Sym here{stress[0][i], stress[1][i], stress[2][i], stress[3][i], stress[4][i], stress[5][i]};
    Sym speed;
    const Sym* const speed_or_null = rate(i, speed) ? &speed : nullptr;
    State one;
    if (tension) {
      start_tension(here, t[i], first[i], speed_or_null, cell, one);
      r_t[i] = one.r_t, f_t[i] = one.f_t, b_t[i] = one.b_t;
      for (int k = 0; k < 3; ++k) normal[k][i] = one.normal[static_cast<std::size_t>(k)];
    }
    if (compression) {
      start_compression(here, c[i], third[i], speed_or_null, cell, one);
      r_c[i] = one.r_c, dif_c[i] = one.dif_c, b_c[i] = one.b_c;
    }
  }
  s.r_t = load<R>(r_t), s.f_t = load<R>(f_t), s.b_t = load<R>(b_t), s.r_c = load<R>(r_c),
  s.dif_c = load<R>(dif_c), s.b_c = load<R>(b_c);
  for (int k = 0; k < 3; ++k) s.normal[k] = load<R>(normal[k]);
}

template <class R, class Rate>
inline __attribute__((always_inline)) bool ConcreteDamage::point(const R (&strain)[6], Lanes<R>& s,
                                                                 const CellFrame& cell, const Rate& rate,
                                                                 R (&stress)[6], R& energy,
                                                                 R& dissipation) const {
  R elastic[6], effective[6];
  for (int i = 0; i < 6; ++i) elastic[i] = strain[i] - s.permanent[i];
  R poisson = poisson_ * (1.0 - s.d_t);
  effective_stress(elastic, poisson, effective);
  auto v = principal_values(effective);
  Parts<R> parts(v);
  const R zero = spread(0.0, v.first), one = spread(1.0, v.first);
  const R n1 = minimum(v.first, zero), n2 = minimum(v.second, zero), n3 = minimum(v.third, zero);
  const R tau_t =
      square_root(maximum((1.0 + poisson) * parts.square_t - poisson * (parts.sum_t * parts.sum_t), zero));
  const R octahedral = square_root((n1 - n2) * (n1 - n2) + (n2 - n3) * (n2 - n3) + (n3 - n1) * (n3 - n1));
  const R tau_c = maximum((tau_scale_ / 3) * (k_oct_ * parts.sum_c + octahedral), zero);

  const auto fresh_t = (s.r_t == 0.0) & (tau_t > f_t_);
  const auto fresh_c = (s.r_c == 0.0) & (tau_c > f_c0_);
  if (any(fresh_t | fresh_c)) start_points(effective, v.first, v.third, tau_t, tau_c, cell, rate, s);
  const auto grow_t = (s.r_t > 0.0) & (tau_t > s.r_t);
  const auto grow_c = (s.r_c > 0.0) & (tau_c > s.r_c);
  const bool grows_t = any(grow_t), grows_c = any(grow_c);
  const R old_d_c = s.d_c;
  R keep_t = one, keep_c = one;  // of the parts of the effective stress, by the permanent strain that grows
  R lost = zero;                 // E times twice the dissipation
  // What a step dissipates is what the stored energy loses at its last strain, times the ratio of the two in
  // a uniaxial test, where twice the dissipation, 2 int sigma dq - [sigma r], is known.
  if (grows_t) {
    const R f_t = select(grow_t, s.f_t, one), b = select(grow_t, s.b_t, one),
            from = select(grow_t, s.r_t, one), tau = select(grow_t, tau_t, one);
    const auto spent = s.d_t >= cap;  // nothing left to grow
    const R q = select(spent, tau, tau + ratio_t_ * s.d_t * from), missing = missing_tension(q, f_t, b);
    R opened = select(spent, zero, p_.permanent_tension * missing * q);  // E times the permanent strain
    const auto full = missing >= missing_cap_t_;
    const R grown = select(full, spread(cap, q), (1 - p_.permanent_tension) * missing * q / (q - opened)),
            d = select(grow_t, maximum(grown, s.d_t), s.d_t);
    if (const auto reach = grow_t & full & (s.d_t < cap); any(reach))
      opened = select(reach, p_.permanent_tension * missing_cap_t_ * reaches_cap(f_t, f_t, b, missing_cap_t_),
                      opened);
    const R r = q - opened;
    const R s_0 = (1.0 - s.d_t) * from,
            s_1 = minimum((1.0 - d) * r, s_0 * exponential(b * (from - tau)));  // the cap's rest is not lost
    const R fall = 2.0 / b, loss = (1.0 - s.d_t) * (tau * tau - r * r) + (d - s.d_t) * r * r;
    const R exact = (s_0 * (fall + from) - s_1 * (fall + r)) / maximum(loss, spread(1e-12, zero) * tau * tau);
    const R weight = select(loss > 1e-10 * tau * tau, minimum(maximum(exact, zero), one),
                            0.5 + 0.5 * (from * from) / (tau * tau));
    const R before = parts.twice_energy(poisson, s.d_t, s.d_c);
    s.d_t = d;
    s.r_t = select(grow_t, r, s.r_t);
    keep_t = select(grow_t, r / tau, one);
    poisson = poisson_ * (1.0 - d);
    effective_stress(elastic, poisson, effective);
    v = principal_values(effective);
    parts = Parts<R>(v);
    parts.scale(keep_t, one);
    lost = select(grow_t, weight * maximum(before - parts.twice_energy(poisson, s.d_t, s.d_c), zero), zero);
  }
  if (grows_c) {
    const R tau = select(grow_c, tau_c, spread(f_c0_, zero)), from = select(grow_c, s.r_c, tau),
            dif = select(grow_c, s.dif_c, one), b = select(grow_c, s.b_c, one);
    const auto spent = s.d_c >= cap;
    const R pressed = select(spent, zero, ratio_c_ * s.d_c * from), q = tau + pressed, began = from + pressed;
    const R missing = missing_compression(q, dif, b);
    R shortened = select(spent, zero, p_.permanent_compression * missing * q);
    const auto full = missing >= missing_cap_c_;
    const R grown =
                select(full, spread(cap, q), (1 - p_.permanent_compression) * missing * q / (q - shortened)),
            d = select(grow_c, maximum(grown, s.d_c), s.d_c);
    if (const auto reach = grow_c & full & (s.d_c < cap); any(reach))
      shortened = select(reach,
                         p_.permanent_compression * missing_cap_c_ * dif *
                             reaches_cap(spread(f_c_, q), spread(stress_peak_, q), b, missing_cap_c_),
                         shortened);
    const R r = q - shortened;
    // Beyond the peak, where the stress falls as in tension, exact.
    const R s_0 = (1.0 - s.d_c) * from, s_1 = (1.0 - d) * r, fall = 2.0 * dif / b;
    const R exact = maximum(s_0 * (fall + from) - s_1 * (fall + r), zero),
            rising =
                0.5 * (d - s.d_c) * (r * r + from * from) + (s_0 + s_1) * maximum(shortened - pressed, zero);
    const R loss = (1.0 - s.d_c) * (tau * tau - r * r) + (d - s.d_c) * r * r;
    const R weight =
        minimum(select(began > stress_peak_ * dif, exact, rising) / maximum(loss, 1e-12 * tau * tau), one);
    const R before = parts.twice_energy(poisson, s.d_t, s.d_c);
    s.d_c = d;
    s.r_c = select(grow_c, r, s.r_c);
    keep_c = select(grow_c, r / tau, one);
    parts.scale(one, keep_c);
    lost = lost +
           select(grow_c, weight * maximum(before - parts.twice_energy(poisson, s.d_t, s.d_c), zero), zero);
  }
  R plus[6], grown[6];
  positive_part(effective, v, plus);
  for (int i = 0; i < 6; ++i) {
    const R minus = keep_c * (effective[i] - plus[i]), pulled = keep_t * plus[i];
    grown[i] = effective[i] - pulled - minus;
    effective[i] = pulled + minus;
    stress[i] = effective[i] - s.d_t * pulled - s.d_c * minus;
  }
  if (grows_t || grows_c) {
    const R lateral = poisson * (grown[0] + grown[1] + grown[2]), scale = (1.0 + poisson) / young_;
    for (int i = 0; i < 3; ++i) s.permanent[i] = s.permanent[i] + scale * grown[i] - lateral / young_;
    for (int i = 3; i < 6; ++i) s.permanent[i] = s.permanent[i] + 2.0 * scale * grown[i];
  }
  energy = 0.5 / young_ * parts.twice_energy(poisson, s.d_t, s.d_c);
  dissipation = 0.5 / young_ * lost;
  if (any(s.d_c > 0.0)) crushed(strain, old_d_c, s, stress, energy, dissipation);
  if (interlock_ > 0 && any(s.d_t > 0.0))
    interlock(strain, effective, v.first * select(v.first > 0.0, keep_t, keep_c), grow_t, s, stress, energy,
              dissipation);
  return grows_t || grows_c;
}

/// The points of a cell, as many at once as R holds. Arrays as in stress8.
template <class R>
inline bool ConcreteDamage::stress_by(const double* strain, StrainRates* rates, const CellFrame& cell,
                                      const DamageCell& old, DamageCell& next, double* stress, double* energy,
                                      double* dissipation) const {
  bool grew = false;
  for (int first = 0; first < 8; first += width<R>) {
    const auto read = [first](const double* p) { return load<R>(p + first); };
    R e[6], out[6], stored, lost;
    for (int k = 0; k < 6; ++k) e[k] = read(strain + 8 * k);
    Lanes<R> s{read(old.r_t),
               read(old.f_t),
               read(old.b_t),
               read(old.d_t),
               read(old.r_c),
               read(old.dif_c),
               read(old.b_c),
               read(old.d_c),
               {read(old.normal[0]), read(old.normal[1]), read(old.normal[2])},
               {read(old.slip[0]), read(old.slip[1]), read(old.slip[2])},
               read(old.compaction),
               read(old.pressure),
               {read(old.flow[0]), read(old.flow[1]), read(old.flow[2]), read(old.flow[3]), read(old.flow[4]),
                read(old.flow[5])},
               {read(old.permanent[0]), read(old.permanent[1]), read(old.permanent[2]),
                read(old.permanent[3]), read(old.permanent[4]), read(old.permanent[5])}};
    const auto rate_at = [rates, first](int i, Sym& rate) {
      if (!rates) return false;
      const double* all = rates->at_points();
      for (int k = 0; k < 6; ++k) rate[static_cast<std::size_t>(k)] = all[8 * k + first + i];
      return true;
    };
    if (cell.leans && any(s.d_t > 0.0)) {
      const CrackRow<R> row = row_along(cell, s.normal, s.d_t);
      row.see_crack(e);
      grew = point(e, s, cell, rate_at, out, stored, lost) || grew;
      row.press_row(out);
    } else {
      grew = point(e, s, cell, rate_at, out, stored, lost) || grew;
    }
    const auto write = [first](double* p, const R& x) { store(p + first, x); };
    for (int k = 0; k < 6; ++k) write(stress + 8 * k, out[k]);
    if (energy) write(energy, stored);
    if (dissipation) write(dissipation, lost);
    write(next.r_t, s.r_t), write(next.f_t, s.f_t), write(next.b_t, s.b_t), write(next.d_t, s.d_t);
    write(next.r_c, s.r_c), write(next.dif_c, s.dif_c), write(next.b_c, s.b_c), write(next.d_c, s.d_c);
    for (int k = 0; k < 3; ++k) write(next.normal[k], s.normal[k]), write(next.slip[k], s.slip[k]);
    write(next.compaction, s.compaction), write(next.pressure, s.pressure);
    for (int k = 0; k < 6; ++k) write(next.flow[k], s.flow[k]), write(next.permanent[k], s.permanent[k]);
  }
  return grew;
}

}  // namespace talus::material
