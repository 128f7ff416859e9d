#include "fem/materials/material_steel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "core/reject.hpp"

namespace talus::material {
double steel_yield_at_rate(double yield, double rate) {
  return yield + 6e6 * std::log(std::max(1.0, std::abs(rate) / 5e-5));
}

Steel::Steel(const Parameters& p) : p_(p) {
  Requirements c;
  c.require(p.young > 0 && std::isfinite(p.young), "steel.young", p.young, "must be positive", "200 GPa");
  c.require(p.yield > 0 && p.yield < p.young * 0.02, "steel.yield", p.yield,
            "must be positive and below 2 % of E", "500 MPa for B500");
  c.require(p.ultimate >= p.yield, "steel.ultimate", p.ultimate, "must be at least the yield stress",
            "1.08 f_y for B500B");
  c.require(p.fracture_strain > p.yield / p.young && p.fracture_strain < 1, "steel.fracture_strain",
            p.fracture_strain, "must lie between the yield strain and 1", "0.05 for B500B");
  c.require(p.prestress >= 0 && p.prestress < p.yield, "steel.prestress", p.prestress, "must be in [0, f_y)",
            "at most 0.75 f_y after losses");
  c.done();
  const double tangent = (p.ultimate - p.yield) / (p.fracture_strain - p.yield / p.young);
  hardening_ = tangent / (1 - tangent / p.young);  // with respect to plastic strain
}

Steel::Result Steel::operator()(double strain, double rate, const State& before, State& next) const {
  const State old = before;  // next may be the same object
  const double e = p_.young;
  next = old;
  Result r;
  if (old.broken > 0) return r;
  const double trial = p_.prestress + e * (strain - old.plastic);
  const double relative = trial - old.back_stress;
  double yield = old.yield;
  if (yield == 0) {
    yield = p_.yield;  // a rate only raises it: the logarithm is asked for where it decides
    if (p_.rate_effect && std::abs(relative) > yield) yield = steel_yield_at_rate(yield, rate);
  }
  const double excess = std::abs(relative) - yield;
  if (excess <= 0) {
    r.stress = trial;
    r.tangent = e;
  } else {
    const double sign = relative > 0 ? 1 : -1, growth = excess / (e + hardening_);
    next.yield = yield;
    next.plastic += sign * growth;
    next.accumulated += growth;
    next.back_stress += sign * hardening_ * growth;
    r.stress = trial - e * sign * growth;
    r.tangent = e * hardening_ / (e + hardening_);
    r.dissipation = yield * growth;
  }
  r.energy = stored(r.stress, next.back_stress);
  if (strain + p_.prestress / e > p_.fracture_strain) {
    r.dissipation += r.energy;
    next.broken = 1;
    r.stress = r.energy = r.tangent = 0;
  }
  return r;
}

namespace {
/// What is wrong with a grade of numbers, in MPa and 1; empty: nothing.
std::string wrong_in(double f_y, double f_u, double eps_u) {
  if (!(f_y >= 100 && f_y <= 3000)) return "f_y must be between 100 and 3000 MPa";
  if (!(f_u >= f_y && f_u <= 4000)) return "f_u must be at least f_y, and at most 4000 MPa";
  if (!(eps_u > f_y / 200e3 && eps_u < 1))
    return fmt::format("eps_u must be between the yield strain, {:.3g}, and 1", f_y / 200e3);
  return {};
}
}  // namespace

Steel::Parameters steel_grade(const std::string& grade, const std::string& key, const std::string& file,
                              int line) {
  struct Row {
    double f_y, f_u, eps_u, e;
  };
  // EN 1992-1-1 annex C (A, B, C: eps_uk 2.5, 5, 7.5 %), EN 10138 for strands, EN 10025 for sections.
  static const std::map<std::string, Row> known{
      {"B400", {400, 432, 0.05, 200e9}},     {"B400C", {400, 460, 0.075, 200e9}},
      {"B450", {450, 520, 0.075, 200e9}},    {"B450C", {450, 520, 0.075, 200e9}},
      {"B500", {500, 540, 0.05, 200e9}},     {"B500A", {500, 525, 0.025, 200e9}},
      {"B500B", {500, 540, 0.05, 200e9}},    {"B500C", {500, 575, 0.075, 200e9}},
      {"S235", {235, 360, 0.15, 210e9}},     {"S355", {355, 490, 0.15, 210e9}},
      {"Y1770", {1560, 1770, 0.035, 195e9}}, {"Y1860", {1640, 1860, 0.035, 195e9}}};
  Steel::Parameters p;
  if (const auto found = known.find(grade); found != known.end()) {
    p.young = found->second.e;
    p.yield = found->second.f_y * 1e6;
    p.ultimate = found->second.f_u * 1e6;
    p.fracture_strain = found->second.eps_u;
    return p;
  }
  double f_y = 0, f_u = 0, eps_u = 0;
  int used = 0;
  const bool own = std::sscanf(grade.c_str(), "%lf/%lf/%lf%n", &f_y, &f_u, &eps_u, &used) == 3 &&
                   used == static_cast<int>(grade.size());
  const std::string wrong = own ? wrong_in(f_y, f_u, eps_u) : "not a known steel grade";
  if (wrong.empty()) {
    p.yield = f_y * 1e6;
    p.ultimate = f_u * 1e6;
    p.fracture_strain = eps_u;
    return p;
  }
  std::string names;
  for (const auto& [name, row] : known) names += (names.empty() ? "" : ", ") + name;
  Problem problem;
  problem.file = file;
  problem.line = line;
  problem.key = key;
  problem.value = grade;
  problem.rule = wrong;
  problem.remedy = "use one of " + names + ", or f_y/f_u/eps_u in MPa and 1, such as 464/630/0.1";
  throw InputError(problem);
}

double BondSlip::envelope(double slip) const {
  const double s = std::abs(slip);
  if (s <= s_1) return tau_max_ * std::pow(s / s_1, 0.4);
  if (s <= s_2) return tau_max_;
  if (s <= s_3) return tau_max_ * (1 - 0.6 * (s - s_2) / (s_3 - s_2));
  return 0.4 * tau_max_;
}

namespace {

/// Greatest |tau| [Pa]: away from the origin (also on reloading) that of the envelope, on the way back
/// friction, a quarter of it. Through the origin it rises from one to the other by the unloading stiffness:
/// with a jump there slips came to lie at 0 where no force balances the bar's.
double bond_bound(double envelope, double stiffness, double slip, double trial) {
  const double friction = 0.25 * envelope;
  return trial * slip >= 0 ? std::min(envelope, friction + stiffness * std::abs(slip)) : friction;
}

}  // namespace

double BondSlip::tangent(double slip, const State& old) const {
  const double largest = std::max(old.largest, std::abs(slip)), trial = unloading * (slip - old.plastic),
               full = envelope(largest);
  const double bound = bond_bound(full, unloading, slip, trial);
  if (std::abs(trial) < bound || (trial * slip > 0 && bound < full)) return unloading;
  if (std::abs(slip) < largest || largest >= s_1 || largest == 0) return 0;
  return std::min(unloading, 0.4 * tau_max_ / s_1 * std::pow(largest / s_1, -0.6));
}

BondSlip::Result BondSlip::operator()(double slip, const State& before, State& next) const {
  const State old = before;  // next may be the same object
  next = old;
  next.largest = std::max(old.largest, std::abs(slip));
  const double trial = unloading * (slip - old.plastic);
  const double bound = bond_bound(envelope(next.largest), unloading, slip, trial);
  Result r;
  r.stress = std::clamp(trial, -bound, bound);
  next.plastic = slip - r.stress / unloading;
  r.energy = 0.5 * r.stress * r.stress / unloading;
  r.dissipation = std::max(0.0, r.stress * (next.plastic - old.plastic));
  return r;
}

Bearing::Result Bearing::operator()(double closing, const std::array<double, 2>& u, const State& before,
                                    State& next, const std::array<double, 2>& slope) const {
  const State old = before;  // next may be the same object
  next = old;
  Result r;
  if (old.lost > 0) return r;
  if (u[0] < p_.seat_along[0] || u[0] > p_.seat_along[1] || u[1] < p_.seat_across[0] ||
      u[1] > p_.seat_across[1]) {
    next.lost = 1;
    return r;
  }
  const std::array<double, 2> stretched{p_.shear_stiffness * (u[0] - old.slip[0]),
                                        p_.shear_stiffness * (u[1] - old.slip[1])};
  const Slide slide = slides(closing, stretched, slope);
  r.normal = slide.normal;
  const std::array<double, 2> t{stretched[0] - p_.shear_stiffness * slide.way[0],
                                stretched[1] - p_.shear_stiffness * slide.way[1]};
  for (std::size_t i = 0; i < 2; ++i) {
    next.slip[i] += slide.way[i];
    r.dissipation += (t[i] - r.normal * slope[i]) * slide.way[i];
  }
  r.shear = {-t[0], -t[1]};
  r.energy = stored(r.normal / p_.normal_stiffness, t);
  if (r.normal == 0 && closing > 0)
    r.dissipation = stored(closing, stretched);  // the foot slid away from below
  return r;
}

double Bearing::stored(double depth, const std::array<double, 2>& t) const {
  return 0.5 * p_.normal_stiffness * depth * depth + 0.5 * (t[0] * t[0] + t[1] * t[1]) / p_.shear_stiffness;
}

Bearing::Slide Bearing::slides(double closing, const std::array<double, 2>& t,
                               const std::array<double, 2>& slope) const {
  const auto dot = [](const std::array<double, 2>& a, const std::array<double, 2>& b) {
    return a[0] * b[0] + a[1] * b[1];
  };
  // For a normal force N the friction has the direction of w = t - N s, and the foot slides by as much as
  // leaves mu N of it.
  const auto at = [&](double normal) {
    const std::array<double, 2> w{t[0] - normal * slope[0], t[1] - normal * slope[1]};
    const double size = std::sqrt(dot(w, w)),
                 way = size > p_.friction * normal
                           ? (size - p_.friction * normal) / (p_.shear_stiffness * size)
                           : 0.0;
    return Slide{normal, {way * w[0], way * w[1]}};
  };
  // What N lacks of the force at the depth that is left where the foot has come to.
  const auto excess = [&](const Slide& s) {
    return s.normal - p_.normal_stiffness * (closing + dot(slope, s.way));
  };
  const double stuck = p_.normal_stiffness * std::max(0.0, closing);
  const Slide first = at(stuck);
  if (stuck == 0 || dot(slope, first.way) == 0) return first;
  double low = 0, high = stuck;
  if (excess(at(low)) >= 0) return at(low);
  while (excess(at(high)) < 0) high *= 2;
  for (int i = 0; i < 60 && high - low > 1e-15 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (excess(at(middle)) < 0 ? low : high) = middle;
  }
  return at(0.5 * (low + high));
}

}  // namespace talus::material
