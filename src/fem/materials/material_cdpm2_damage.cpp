// Damage of CDPM2, and its answer for a point and for the eight points of a cell.
#include <algorithm>
#include <cmath>

#include "fem/materials/crack_row.hpp"
#include "fem/materials/material_cdpm2.hpp"
#include "fem/materials/material_eigen.hpp"

namespace talus::material {
namespace {

const double sqrt6 = std::sqrt(6.0), root23 = std::sqrt(2.0 / 3.0);

double norm_of_strain(const Sym& e) {
  return std::sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + 0.5 * (e[3] * e[3] + e[4] * e[4] + e[5] * e[5]));
}

Principal<double> values_of(const Sym& s) {
  const double raw[6] = {s[0], s[1], s[2], s[3], s[4], s[5]};
  return principal_values(raw);
}

/// (1 - w) E k = f exp(-(k1 + w k2)/eps_f): within the cell-size limit the excess of the left side is concave
/// and falls with w. Newton's first step lands at the root or beyond it, and from there on comes back without
/// passing it.
double solve_damage(double young, double f, double k, double k1, double k2, double eps_f, double old,
                    double cap) {
  double w = old;
  for (int i = 0; i < 40; ++i) {
    const double right = f * std::exp(-(k1 + w * k2) / eps_f), excess = (1 - w) * young * k - right;
    if (i == 0 && excess <= 0) return old;
    const double slope = right * k2 / eps_f - young * k;
    const double next = slope < 0 ? std::min(1.0, w - excess / slope) : 1.0;
    if (std::abs(next - w) <= 1e-16 || (i > 0 && next >= w)) break;
    w = next;
  }
  return std::clamp(w, old, std::max(old, cap));
}

struct Nominal {
  Sym stress;
  double energy;
};

/// What damage leaves of an effective stress, and the energy stored at an elastic strain.
Nominal nominal(const Sym& effective, const Principal<double>& values, const Sym& elastic,
                const Cdpm2::State& s) {
  if (s.w_t == 0 && s.w_c == 0) return {effective, 0.5 * contract(effective, elastic)};
  const double raw[6] = {effective[0], effective[1], effective[2], effective[3], effective[4], effective[5]};
  double plus[6];
  positive_part(raw, values, plus);
  Nominal out;
  for (std::size_t i = 0; i < 6; ++i)
    out.stress[i] = (1 - s.w_t) * plus[i] + (1 - s.w_c) * (raw[i] - plus[i]);
  out.energy = 0.5 * contract(out.stress, elastic);
  return out;
}

Sym elastic_strain(const double* strain, const Cdpm2::State& s) {
  Sym elastic;
  for (int i = 0; i < 6; ++i) elastic[i] = strain[i] - s.plastic[i];
  return elastic;
}

}  // namespace

double Cdpm2::compressive_share(const Principal<double>& p) {
  double sum = 0, sq = 0;
  for (const double x : {p.first, p.second, p.third}) {
    if (x < 0) sum += x * x;
    sq += x * x;
  }
  return sq > 0 ? sum / sq : 0;
}

double Cdpm2::rate_factor(const Sym& effective, const Sym& rate, const CellFrame& cell) const {
  if (!p_.rate_effect) return 1;
  const auto extremes = extreme_rates(rate);
  const double share = compressive_share(values_of(effective));
  // In tension the strength may not rise so far that the cell would snap back across its diagonal.
  double diagonal = 0;
  for (const auto& e : cell.edge) diagonal += e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
  const double room = std::sqrt(std::max(1.0, 0.9 * largest_cell() / std::max(std::sqrt(diagonal), 1e-9)));
  const double t = std::clamp(rate_factor_tension(std::max(0.0, extremes[0])), 1.0, room);
  const double c =
      std::clamp(rate_factor_compression(std::max(0.0, -extremes[1])), 1.0, rate_cap_compression);
  return (1 - share) * t + share * c;
}

void Cdpm2::damage_step(const Sym& effective, const Principal<double>& values, const Sym& plastic_before,
                        const CellFrame& cell, double factor, State& s) const {
  const Concrete& c = p_.concrete;
  const double f_t = factor * c.f_t, f_c = factor * c.f_cm, onset = f_t / c.young;
  const Haigh h = haigh(effective, f_c);
  const double drive = h.r / sqrt6 * shape(h.cos_theta) + h.v;
  const double half = 0.5 * onset * m0_ * drive;
  const double equivalent = std::max(0.0, half + std::sqrt(half * half + 1.5 * onset * onset * h.r * h.r));
  const double growth = equivalent - s.equivalent;
  const double share = compressive_share(values);
  s.equivalent = equivalent;
  s.equivalent_c = std::max(0.0, s.equivalent_c + share * growth);
  Sym moved;
  for (int i = 0; i < 6; ++i) moved[i] = s.plastic[i] - plastic_before[i];
  const double flowed = norm_of_strain(moved);
  double softening = 1;
  if (h.v < 0) softening = 1 + (a_s - 1) * std::min(100.0, -sqrt6 * h.v / std::max(h.r, 1e-12));

  bool moved_t = false, moved_c = false;
  if (s.size == 0 && (equivalent > onset || s.equivalent_c > onset)) {
    const double limit = 0.98 * largest_cell() / (factor * factor);
    s.size = std::min(
        cell.extent(principal_direction(effective, values.first > 0 ? values.first : values.third)), limit);
    s.factor = factor;
    moved_t = moved_c = true;
  }
  if (equivalent > s.t) {
    moved_t = true;
    if (equivalent > onset) s.t1 += flowed / softening;
    s.t2 += (equivalent - s.t) / softening;
    s.t = equivalent;
  }
  if (s.equivalent_c > s.c) {
    moved_c = true;
    if (s.equivalent_c > onset) {
      const double beta =
          f_t * q2(s.kappa) * root23 / (std::max(h.r, 1e-9) * f_c * std::sqrt(1 + 2 * dilation * dilation));
      s.c1 += share * std::min(beta, 1.0) * flowed / softening;
    }
    s.c2 += (s.equivalent_c - s.c) / softening;
    s.c = s.equivalent_c;
  }
  if (!p_.damage || s.size == 0) return;
  if (moved_t && s.t > onset) {
    const double before = s.w_t;
    s.w_t = solve_damage(c.young, f_t, s.t, s.t1, s.t2, c.fracture_energy / (f_t * s.size), s.w_t, cap);
    const double grown = (1 - share) * (s.w_t - before);
    if (cell.leans && grown > s.cracked) {
      const std::array<double, 3> n = principal_direction(effective, values.first);
      std::copy(n.begin(), n.end(), s.normal);
    }
    s.cracked += grown;
  }
  if (moved_c && s.c > onset) s.w_c = solve_damage(c.young, f_t, s.c, s.c1, s.c2, eps_fc, s.w_c, cap);
}

Response Cdpm2::respond(const Sym& strain, const Sym& rate, const CellFrame& cell, const State& before,
                        State& next) const {
  const State old = before;  // next may be the same object
  Sym effective = hooke(lambda_, mu_, elastic_strain(strain.data(), old));
  const double factor = old.factor > 0 ? old.factor : rate_factor(effective, rate, cell);
  const double f_c = factor * p_.concrete.f_cm;

  State s;
  Principal<double> values{};
  for (int parts = 1;; parts *= 2) {
    s = old;
    bool good = true;
    for (int k = 1; k <= parts && good; ++k) {
      Sym at, plastic_before;
      for (int i = 0; i < 6; ++i) {
        at[i] = old.strain[i] + (strain[i] - old.strain[i]) * k / parts;
        plastic_before[i] = s.plastic[i];
      }
      if (k == parts) at = strain;
      good = plastic_step(at, f_c, parts >= 1024, s, effective);
      if (!good) break;
      values = values_of(effective);
      damage_step(effective, values, plastic_before, cell, factor, s);
    }
    if (good) break;
  }
  std::copy(strain.begin(), strain.end(), s.strain);

  // What forces do between the ends of the step is the mean of both stresses; what of it is not stored is
  // lost, if anything flowed or cracked. The stress of cracked concrete, parted by signs, has no potential:
  // it may return other work than it took.
  const Sym elastic_before = elastic_strain(old.strain, old),
            stress_before = hooke(lambda_, mu_, elastic_before);
  const bool damaged = old.w_t > 0 || old.w_c > 0;
  const Nominal here = nominal(effective, values, elastic_strain(strain.data(), s), s);
  const Nominal there =
      nominal(stress_before, damaged ? values_of(stress_before) : Principal<double>{}, elastic_before, old);
  Response out{here.stress, here.energy};
  double work = 0;
  for (std::size_t i = 0; i < 6; ++i)
    work += 0.5 * (here.stress[i] + there.stress[i]) * (strain[i] - old.strain[i]);
  const bool changed =
      s.w_t > old.w_t || s.w_c > old.w_c || !std::equal(s.plastic, s.plastic + 6, old.plastic);
  const double taken = work - (here.energy - there.energy);
  if (changed) out.dissipation = std::max(0.0, taken);
  if (changed || damaged) out.returned = out.dissipation - taken;
  next = s;
  return out;
}

namespace {
/// As if never evaluated beyond the elastic bound: where there is no history yet, nothing below it makes one,
/// whichever cell the point is in.
bool untouched(const Cdpm2::State& s) {
  return s.kappa == 0 && s.equivalent == 0 && s.t == 0 && s.c == 0 && s.equivalent_c == 0;
}
}  // namespace

bool Cdpm2::stress8(const double* strain, StrainRates* rates, const CellFrame& cell, const State* old,
                    State* next, double* stress, double* energy, double* dissipation) const {
  bool grew = false;
  const double* rate = rates ? rates->at_points() : nullptr;
  for (int i = 0; i < 8; ++i) {
    Sym e, v{};
    for (int k = 0; k < 6; ++k) {
      e[k] = strain[8 * k + i];
      if (rate) v[k] = rate[8 * k + i];
    }
    if (untouched(old[i])) {
      const Sym elastic = hooke(lambda_, mu_, e);
      const double twice = contract(elastic, e);
      if (twice <= elastic_bound_) {
        next[i] = old[i];
        std::copy(e.begin(), e.end(), next[i].strain);
        for (int k = 0; k < 6; ++k) stress[8 * k + i] = elastic[k];
        if (energy) energy[i] = 0.5 * twice;
        if (dissipation) dissipation[i] = 0;
        continue;
      }
    }
    const double kappa = old[i].kappa, w_t = old[i].w_t, w_c = old[i].w_c;
    const bool turns = cell.leans && old[i].cracked > 0;
    CrackRow<double> row{};
    double seen[6];
    if (turns) {
      row = row_along(cell, old[i].normal, old[i].cracked);
      std::copy(e.begin(), e.end(), seen);
      row.see_crack(seen);
      std::copy(seen, seen + 6, e.begin());
    }
    const Response r = respond(e, v, cell, old[i], next[i]);
    grew = grew || next[i].kappa > kappa || next[i].w_t > w_t || next[i].w_c > w_c;
    std::copy(r.stress.begin(), r.stress.end(), seen);
    if (turns) row.press_row(seen);
    for (int k = 0; k < 6; ++k) stress[8 * k + i] = seen[k];
    if (energy) energy[i] = r.energy;
    if (dissipation) dissipation[i] = r.dissipation - r.returned;
  }
  return grew;
}

}  // namespace talus::material
