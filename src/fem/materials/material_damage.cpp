#include "fem/materials/material_damage.hpp"

#include <algorithm>
#include <cmath>

#include "fem/materials/material_damage_point.hpp"

namespace talus::material {

CellFrame CellFrame::of(const Mat3& edges) {
  constexpr double cosine = 0.05;  // 3 degrees
  CellFrame frame{};
  const Mat3 duals = edges.inverse().transpose(), unit = edges.colwise().normalized();
  for (int k = 0; k < 3; ++k) {
    for (int x = 0; x < 3; ++x) frame.edge[k][x] = edges(x, k), frame.dual[k][x] = duals(x, k);
    frame.leans = frame.leans || std::abs(unit.col(k).dot(unit.col((k + 1) % 3))) > cosine;
  }
  return frame;
}

double CellFrame::extent(const std::array<double, 3>& n) const {
  double sum = 0;
  if (leans) {
    for (const auto& g : dual) sum = std::max(sum, std::abs(g[0] * n[0] + g[1] * n[1] + g[2] * n[2]));
    return 1 / sum;
  }
  for (const auto& e : edge) sum += std::abs(e[0] * n[0] + e[1] * n[1] + e[2] * n[2]);
  return sum;
}

namespace {
constexpr double rubble_friction = 0.7;
}

ConcreteDamage::ConcreteDamage(const Parameters& p) : p_(p) {
  const Concrete& c = p.concrete;
  young_ = c.young;
  poisson_ = c.poisson;
  f_t_ = c.f_t;
  f_c_ = c.f_cm;
  f_c0_ = elastic_limit * f_c_;
  stress_peak_ = young_ * c.eps_c1;
  shear_ = young_ / (2 * (1 + poisson_));
  bulk_ = young_ / (3 * (1 - 2 * poisson_));
  const double sine = rubble_friction / std::sqrt(1 + rubble_friction * rubble_friction);
  friction_ = std::sqrt(2.0 / 3) * 6 * sine / (3 - sine);
  interlock_ = p.aggregate > 0 ? 0.18e6 * std::sqrt(f_c_ / 1e6) / 0.31 : 0.0;
  widen_ = 24 / 0.31 / (p.aggregate + 0.016);
  part_ = p.aggregate > 0 ? 1 / p.aggregate : 0.0;
  closed_ = interlock_ / shear_;
  const auto missing_at_cap = [](double share) { return cap / (1 - share + share * cap); };  // of d
  ratio_t_ = p.permanent_tension / (1 - p.permanent_tension);
  ratio_c_ = p.permanent_compression / (1 - p.permanent_compression);
  missing_cap_t_ = missing_at_cap(p.permanent_tension);
  missing_cap_c_ = missing_at_cap(p.permanent_compression);
  const double root2 = std::sqrt(2.0);
  k_oct_ = root2 * (c.biaxial_ratio - 1) / (2 * c.biaxial_ratio - 1);
  tau_scale_ = 3 / (root2 - k_oct_);
  k_curve_ = (stress_peak_ - f_c0_) / (f_c_ - f_c0_);
  inverse_span_ = 1 / (stress_peak_ - f_c0_);
  // tau_t^2 <= E eps:C:eps for nu >= 0. tau_c <= tau_scale t_oct, t_oct^2 <= |s|^2/3, |s|^2 <= E eps:C:eps /
  // (1 - 2 nu).
  const double reach = tau_scale_ * tau_scale_ / (3 * (1 - 2 * poisson_));
  elastic_bound_ = std::min(f_t_ * f_t_, f_c0_ * f_c0_ / reach) / young_;
}

double ConcreteDamage::largest_cell() const {
  return snapback_limit(young_, f_t_, p_.concrete.fracture_energy);
}

double ConcreteDamage::crack_length(double f_t, double b_t) const {
  if (!(f_t > 0) || !(b_t > 0)) return 0;
  return p_.concrete.fracture_energy / (f_t * (1 / (young_ * b_t) + f_t / (2 * young_)));
}

void ConcreteDamage::start_tension(const Sym& stress, double tau, double largest, const Sym* rate,
                                   const CellFrame& cell, State& s) const {
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

void ConcreteDamage::start_compression(const Sym& stress, double tau, double least, const Sym* rate,
                                       const CellFrame& cell, State& s) const {
  double factor = 1;
  if (rate && p_.rate_effect)
    factor = std::clamp(rate_factor_compression(std::max(0.0, -extreme_rates(*rate)[1])), 1.0,
                        rate_cap_compression);
  if (tau <= factor * f_c0_) return;
  const double l = cell.extent(principal_direction(stress, least));
  s.dif_c = factor;
  s.b_c = l * f_c_ * factor * factor / (young_ * p_.concrete.crushing_energy);
  s.r_c = factor * f_c0_;
}

namespace {
/// One point's history, in the other of its two forms.
template <class From, class To>
void copy_state(const From& from, To& to) {
  to.r_t = from.r_t, to.f_t = from.f_t, to.b_t = from.b_t, to.d_t = from.d_t;
  to.r_c = from.r_c, to.dif_c = from.dif_c, to.b_c = from.b_c, to.d_c = from.d_c;
  to.compaction = from.compaction, to.pressure = from.pressure;
  std::copy_n(&from.normal[0], 3, &to.normal[0]);
  std::copy_n(&from.slip[0], 3, &to.slip[0]);
  std::copy_n(&from.flow[0], 6, &to.flow[0]);
  std::copy_n(&from.permanent[0], 6, &to.permanent[0]);
}
}  // namespace

Response ConcreteDamage::operator()(const Sym& strain, const Sym& rate, const State& old, State& next) const {
  Lanes<double> s;
  copy_state(old, s);
  const double e[6] = {strain[0], strain[1], strain[2], strain[3], strain[4], strain[5]};
  double stress[6];
  Response out;
  point(
      e, s, p_.cell,
      [&](int, Sym& speed) {
        speed = rate;
        return true;
      },
      stress, out.energy, out.dissipation);
  std::copy(stress, stress + 6, out.stress.begin());
  copy_state(s, next);
  return out;
}

bool ConcreteDamage::stress8(const double* strain, StrainRates* rates, const CellFrame& cell,
                             const DamageCell& old, DamageCell& next, double* stress, double* energy,
                             double* dissipation, InstructionSet with) const {
  if (with == InstructionSet::avx512)
    return stress8_avx512(strain, rates, cell, old, next, stress, energy, dissipation);
  return stress_by<V4>(strain, rates, cell, old, next, stress, energy, dissipation);
}

}  // namespace talus::material
