#include "fem/materials/material_mc2010.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/reject.hpp"

namespace talus::material {
namespace {

constexpr double mpa = 1e6;
// Of f_t over f_cm: above it concrete would begin to crush (0.2 f_cm) before it cracks; below it lies no test
// of concrete.
constexpr double crushing_over_tearing = 250;  // G_c / G_F
constexpr double least_tension = 0.02, most_tension = 0.2;

double table_eps_c1(double f_cm_mpa) {
  struct Row {
    double f_ck, eps;
  };
  constexpr std::array<Row, 17> rows{{{12, 1.9},
                                      {16, 2.0},
                                      {20, 2.1},
                                      {25, 2.2},
                                      {30, 2.3},
                                      {35, 2.3},
                                      {40, 2.4},
                                      {45, 2.5},
                                      {50, 2.6},
                                      {55, 2.6},
                                      {60, 2.7},
                                      {70, 2.7},
                                      {80, 2.8},
                                      {90, 2.9},
                                      {100, 3.0},
                                      {110, 3.0},
                                      {120, 3.0}}};
  const double f_ck = f_cm_mpa - 8;
  if (f_ck <= rows.front().f_ck) return rows.front().eps * 1e-3;
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (f_ck <= rows[i].f_ck) {
      const double w = (f_ck - rows[i - 1].f_ck) / (rows[i].f_ck - rows[i - 1].f_ck);
      return (rows[i - 1].eps + w * (rows[i].eps - rows[i - 1].eps)) * 1e-3;
    }
  return rows.back().eps * 1e-3;
}

}  // namespace

Concrete mc2010(const ConcreteInput& input, const std::string& key) {
  std::vector<Problem> problems;
  if (!(input.f_cm >= 20 * mpa && input.f_cm <= 130 * mpa))
    problems.push_back(
        problem_of(key + ".f_cm", fmt::format("{:.4g} MPa", input.f_cm / mpa),
                   "the concrete model holds for a mean strength of 20 to 130 MPa",
                   "give f_cm in that range, with its unit (\"38 MPa\"); for C30 it is 38 MPa"));
  const auto not_negative = [&](double value, const char* name) {
    if (!(value >= 0) || !std::isfinite(value))
      problems.push_back(problem_of(key + "." + name, fmt::format("{:g}", value),
                                    "must be a finite positive number",
                                    "correct it, or leave it out to have it derived from f_cm"));
  };
  not_negative(input.young, "young");
  not_negative(input.density, "density");
  not_negative(input.f_t, "tensile_strength");
  not_negative(input.fracture_energy, "fracture_energy");
  if (!(input.poisson >= 0 && input.poisson < 0.5))
    problems.push_back(problem_of(key + ".poisson", fmt::format("{:g}", input.poisson), "must be in [0, 0.5)",
                                  "concrete has about 0.2"));
  if (!problems.empty()) throw InputError(problems);

  Concrete c;
  c.f_cm = input.f_cm;
  const double f_cm = c.f_cm / mpa, f_ck = f_cm - 8;
  c.f_ck = f_ck * mpa;
  c.report.push_back(fmt::format("f_cm = {:.2f} MPa (given), f_ck = f_cm - 8 MPa = {:.2f} MPa", f_cm, f_ck));
  const auto take = [&](double& out, double given, double derived, double unit, const char* name,
                        const char* unit_name, const char* from) {
    out = given > 0 ? given : derived;
    c.report.push_back(
        fmt::format("{} = {:.4g} {} ({})", name, out / unit, unit_name, given > 0 ? "given" : from));
  };
  take(c.young, input.young, 21.5e9 * std::cbrt(f_cm / 10), 1e9, "E", "GPa", "MC2010: 21.5 (f_cm/10)^(1/3)");
  c.poisson = input.poisson;  // 0 is a value, too
  c.report.push_back(fmt::format("nu = {:.4g}", c.poisson));
  take(c.density, input.density, 2450, 1, "density", "kg/m3", "assumed, reinforced");
  const double derived_f_t =
      (f_ck <= 50 ? 0.3 * std::pow(f_ck, 2.0 / 3.0) : 2.12 * std::log(1 + 0.1 * f_cm)) * mpa;
  take(c.f_t, input.f_t, derived_f_t, mpa, "f_t", "MPa",
       f_ck <= 50 ? "MC2010: 0.3 f_ck^(2/3)" : "MC2010: 2.12 ln(1 + 0.1 f_cm)");
  take(c.fracture_energy, input.fracture_energy, 73 * std::pow(f_cm, 0.18), 1, "G_F", "N/m",
       "MC2010: 73 f_cm^0.18");
  take(c.eps_c1, 0, table_eps_c1(f_cm), 1, "eps_c1", "", "MC2010: table 5.1-8");
  take(c.crushing_energy, 0, crushing_over_tearing * c.fracture_energy, 1, "G_c", "N/m",
       "250 G_F, not in MC2010");
  take(c.biaxial_ratio, 0, 1.16, 1, "f_bc/f_c", "", "Kupfer");

  if (!(c.f_t >= least_tension * c.f_cm && c.f_t <= most_tension * c.f_cm))
    problems.push_back(problem_of(
        key + ".tensile_strength", fmt::format("{:.4g} MPa", c.f_t / mpa),
        fmt::format("the concrete model holds for {:g} to {:g} of f_cm: {:.3g} to {:.3g} MPa here",
                    least_tension, most_tension, least_tension * f_cm, most_tension * f_cm),
        fmt::format(
            "leave it out for {:.3g} MPa (Model Code 2010), or give the axial tensile strength with its unit",
            derived_f_t / mpa)));
  if (c.young * c.eps_c1 <= 1.02 * c.f_cm)
    problems.push_back(
        problem_of(key + ".young", fmt::format("{:.4g} GPa", c.young / 1e9),
                   fmt::format("must be above f_cm/eps_c1 = {:.4g} GPa, the secant modulus at the peak",
                               c.f_cm / c.eps_c1 / 1e9),
                   "raise young, or leave it out"));
  if (!problems.empty()) throw InputError(problems);
  return c;
}

double rate_factor_tension(double rate) {
  const double x = std::max(1.0, std::abs(rate) / 1e-6);
  return std::abs(rate) <= 10 ? std::pow(x, 0.018) : 0.0062 * std::cbrt(x);
}

double rate_factor_compression(double rate) {
  const double x = std::max(1.0, std::abs(rate) / 3e-5);
  return std::abs(rate) <= 30 ? std::pow(x, 0.014) : 0.012 * std::cbrt(x);
}

double snapback_limit(double young, double f_t, double fracture_energy) {
  return 2 * young * fracture_energy / (f_t * f_t);
}

void check_cell_size(double limit, const std::string& formula, const CellSize& largest,
                     const std::string& key) {
  constexpr double kept = 0.98, tolerated = 1.05;  // a crack's band is at most that part of the limit: across
                                                   // more, it costs more than G_F
  const double across = tolerated * kept * limit;
  const bool snaps = largest.edge >= limit;
  if (!snaps && largest.diagonal <= across) return;
  const double needed = std::min(0.95 * limit, largest.diagonal > 0 && largest.edge > 0
                                                   ? 0.95 * across * largest.edge / largest.diagonal
                                                   : INFINITY);
  throw InputError(
      problem_of(key,
                 snaps ? fmt::format("{:.4g} m for the largest cell of the mesh", largest.edge)
                       : fmt::format("{:.4g} m for the largest cell of the mesh, {:.4g} m along its diagonal",
                                     largest.edge, largest.diagonal),
                 fmt::format("concrete cells must be smaller than {} = {:.4g} m along any direction, their "
                             "diagonals too, or a crack across them would {}",
                             formula, limit,
                             snaps ? "snap back and release more than G_F"
                                   : fmt::format("cost up to {:.2f} G_F", largest.diagonal / (kept * limit))),
                 fmt::format("use cells of {:.3g} m or less (recommended {:.2g} m)", needed, 0.5 * needed)));
}

}  // namespace talus::material
