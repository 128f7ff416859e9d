// B: concrete, reinforcement and bearings in a structure by itself.
#include <algorithm>
#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "verify/scene_text.hpp"
#include "verify/structure_text.hpp"

namespace talus::verify {
namespace {

// C30 by the Model Code 2010, f_cm = 38 MPa (numerics-structure, section 2).
constexpr double f_c = 38e6, f_t = 2.896e6, fracture_energy = 140.5, young = 33.55e9;
const char* const c30 = "density = 2450.0\nf_cm = \"38 MPa\"";

/// One cell of 0.1 m, three of its faces on rollers, damped; tractions on the three others follow one table
/// each.
StructureText element(double duration, double interval) {
  StructureText s;
  s.duration = duration;
  s.interval = interval;
  s.material = c30;
  s.body =
      "kind = \"box\"\nposition = [0.05, 0.05, 0.05]\nsize = [0.1, 0.1, 0.1]\ncells = [1, 1, 1]\ndamage = "
      "\"concrete\"\nrate_effect = false\nerosion = false\n"
      "integrator = \"explicit\"\npreload = \"none\"\ndamping_ratio = 0.5\n"
      "support = [{ face = \"-x\", held = \"x\" }, { face = \"-y\", held = \"y\" }, { face = \"-z\", held = "
      "\"z\" }]\n";
  s.probes = {Vec3(0.1, 0.1, 0.1)};
  return s;
}

StructureText& pull(StructureText& s, int axis, double stress,
                    const std::vector<std::pair<double, double>>& history) {
  Vec3 low = Vec3::Zero();
  low[axis] = 0.1;
  Vec3 traction = Vec3::Zero();
  traction[axis] = stress;
  s.loads.push_back({Box3(low, Vec3(0.1, 0.1, 0.1)), traction, history});
  return s;
}

/// Largest stress that the face on rollers across `axis` carried, by its sign, until the cell had strained by
/// 0.5 % [Pa]: once it fails, the load drives it together, and its own inertia confines the rubble.
double strength(const Outcome& o, int axis, double sign) {
  double most = 0;
  for (const sim::HistoryRow& row : o.rows) {
    if (std::abs(row.structures[0].probe_displacement[0][axis]) > 5e-4) break;
    most = std::max(most, sign * row.structures[0].base_force[axis] / 0.01);
  }
  return most;
}

void uniaxial(CaseRun& c) {
  c.method("concrete, one cell");
  // Loads grow so slowly that the cell is in equilibrium until its strength is reached; then it fails.
  StructureText s = element(0.1, 1e-5);
  pull(s, 0, 1.05 * f_t, {{0, 0}, {0.1, 1}});
  c.relative("tensile strength [Pa]", "MC2010: 0.3 f_ck^(2/3)", f_t, strength(c.run(s.str()), 0, 1), 5e-3);
  c.reset();
  s = element(0.1, 1e-5);
  pull(s, 0, -1.02 * f_c, {{0, 0}, {0.1, 1}});
  c.relative("compressive strength [Pa]", "f_cm", f_c, strength(c.run(s.str()), 0, -1), 1e-2);
}

void biaxial(CaseRun& c) {
  c.method("concrete, one cell");
  for (const auto& [ratio, expected] :
       {std::pair(0.25, 1.172), std::pair(0.5, 1.284), std::pair(1.0, 1.160)}) {
    c.reset();
    StructureText s = element(0.1, 1e-5);
    pull(s, 0, -1.05 * expected * f_c, {{0, 0}, {0.1, 1}});
    pull(s, 1, -1.05 * expected * f_c * ratio, {{0, 0}, {0.1, 1}});
    c.relative(fmt::format("strength at 1:{:g} over f_cm", ratio), "d+/d- surface, beta 1.16", expected,
               strength(c.run(s.str()), 0, -1) / f_c, 1e-2);
  }
}

/// Strain of the Model Code parabola at a stress on its rising branch, after the linear part to 0.2 f_c.
double rising_strain(double stress) {
  const double f_0 = 0.2 * f_c, eps_0 = f_0 / young, eps_1 = 2.28e-3,
               k = young * (eps_1 - eps_0) / (f_c - f_0);
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double x = 0.5 * (low + high), y = (k * x - x * x) / (1 + (k - 2) * x);
    (f_0 + (f_c - f_0) * y < stress ? low : high) = x;
  }
  return eps_0 + 0.5 * (low + high) * (eps_1 - eps_0);
}

void cyclic(CaseRun& c) {
  // Compressed to 0.8 f_c, half unloaded, unloaded, pulled apart: unloading is straight to the permanent
  // strain, 0.7 of what is inelastic, and the tensile strength is that of sound concrete.
  c.method("concrete, one cell");
  StructureText s = element(0.5, 1e-5);
  pull(s, 0, -0.8 * f_c,
       {{0, 0},
        {0.1, 1},
        {0.15, 1},
        {0.2, 0.5},
        {0.25, 0.5},
        {0.3, 0},
        {0.35, 0},
        {0.5, -1.1 * f_t / (0.8 * f_c)}});
  const Outcome o = c.run(s.str());
  const auto strain = [&](double t) {
    return -o.rows.at(static_cast<std::size_t>(std::lround(t / 1e-5)))
                .structures[0]
                .probe_displacement[0]
                .x() /
           0.1;
  };
  const double top = rising_strain(0.8 * f_c);
  c.relative("strain at 0.8 f_c", "MC2010 parabola above 0.2 f_c", top, strain(0.15), 1e-2);
  const double permanent = 0.7 * (strain(0.15) - 0.8 * f_c / young);
  c.relative("strain at 0.4 f_c on the way back", "straight", 0.5 * (strain(0.15) + permanent), strain(0.25),
             5e-3);
  c.relative("strain after unloading", "0.7 of the inelastic", permanent, strain(0.35), 1e-2);
  c.relative("tensile strength after compression [Pa]", "unilateral: f_t", f_t, strength(o, 0, 1), 5e-3);
}

void fracture(CaseRun& c) {
  // A bar with one weaker cell, its right end grown into a head of 20 t that moves away at 3 cm/s: the bar is
  // torn apart slowly.
  for (int cells : {5, 9, 15}) {
    c.method(fmt::format("concrete, {} cells of {:.0f} mm", cells, 1000.0 / cells));
    std::vector<Section> sections;
    for (int i = 0; i <= cells; ++i)
      sections.push_back({1.0 * i / cells, i == cells / 2 || i == cells / 2 + 1 ? 0.09 : 0.1});
    for (int i = 0; i <= 31; ++i) sections.push_back({1.5 + 0.64 * i, 0.32});
    StructureText s;
    s.duration = 0.1;
    s.interval = 1e-3;
    s.material = c30;
    s.body = fmt::format(
        "kind = \"mesh\"\nfile = \"{}\"\nsupport = [\"LEFT\"]\ndamage = \"concrete\"\nrate_effect = "
        "false\nerosion = false\nintegrator = \"explicit\"\npreload = \"none\"\n"
        "initial_velocity = [0.03, 0.0, 0.0]\n",
        write_chain(fmt::format("bar{}", cells), sections));
    const Outcome o = c.run(s.str());
    c.relative("work of damage over the section [J/m^2]", "G_F = 73 f_cm^0.18, one crack", fracture_energy,
               o.last().ledger.damage_work / (0.18 * 0.18), 0.05);
  }
}

constexpr double bar_diameter = 0.03, steel_area = 0.25 * M_PI * bar_diameter * bar_diameter;

/// Bars of steel of `steel_area` in all along x, from 0 to `length`: one in the axis, or four 3 cm beside it
/// each way; the path of their file.
std::string write_bars(const std::string& mesh, double length, bool four) {
  const std::string path = mesh.substr(0, mesh.size() - 4) + ".csv";
  std::ofstream out(path);
  out << "bar,diameter,x,y,z,grade\n";
  for (int i = 0; i < (four ? 4 : 1); ++i) {
    const double y = four ? i % 2 * 0.06 - 0.03 : 0.0, z = four ? i / 2 * 0.06 - 0.03 : 0.0;
    for (const double x : {0.0, length})
      out << fmt::format("B{},{},{},{},{},B500B\n", i + 1, number(four ? bar_diameter / 2 : bar_diameter),
                         number(x), number(y), number(z));
  }
  if (!out.flush()) throw NumericalFailure("the bars " + path + " cannot be written");
  return path;
}

/// A concrete bar of 1 m and 0.1 m square along x with bars of steel, pulled at its right end by `force`.
/// Cracked, its end is a flare of 0.3 m to 0.2 m square, and it has four bars: one in the axis resists no
/// turning of a section, and cells that soften crack by turns on one side and the other.
Outcome pulled(CaseRun& c, const std::string& name, bool cracked, double poisson, double force) {
  std::vector<Section> sections;
  for (int i = 0; i <= 20; ++i) sections.push_back({0.05 * i, 0.05});
  for (int i = 1; cracked && i <= 6; ++i) sections.push_back({1 + 0.05 * i, 0.05 + 0.05 * i / 6});
  const double end = sections.back().x, half = sections.back().half;
  const std::string mesh = write_chain(name, sections);
  StructureText s;
  s.duration = 0.4;
  s.interval = 1e-3;
  s.material = fmt::format("{}\npoisson = {}", c30, number(poisson));
  s.body = fmt::format(
      "kind = \"mesh\"\nfile = \"{}\"\nsupport = [\"LEFT\"]\nrebar = \"{}\"\n"
      "damage = \"{}\"\nrate_effect = false\nerosion = false\n"
      "integrator = \"explicit\"\npreload = \"none\"\ndamping_ratio = 0.3\n",
      mesh, write_bars(mesh, end, cracked), cracked ? "concrete" : "none");
  s.probes = {Vec3(0.25, 0, 0), Vec3(0.75, 0, 0)};
  s.loads.push_back({Box3(Vec3(end, -half, -half), Vec3(end, half, half)),
                     Vec3(force / (4 * half * half), 0, 0),
                     {{0, 0}, {0.3, 1}, {1, 1}}});
  return c.run(s.str());
}

double middle_strain(const Outcome& o) {
  const auto& u = o.last().structures[0].probe_displacement;
  return (u[1].x() - u[0].x()) / 0.5;
}

void reinforced_elastic(CaseRun& c) {
  c.method("perfect bond, elastic");
  const Outcome o = pulled(c, "elastic", false, 0.2, 1e4);
  c.relative("strain between the quarter points", "N / (E_c A_c + E_s A_s), concrete not subtracted",
             1e4 / (young * 0.01 + 200e9 * steel_area), middle_strain(o), 2e-3);
}

void reinforced_cracked(CaseRun& c) {
  // Steel stiffer than the concrete softens, in each quarter of the section: every cell follows sigma_c(eps)
  // A_c + E_s A_s eps = N, and the bar stays stable throughout. The flare hands the load to the steel before
  // the section narrows.
  const double l = 0.05, force = 6e4, softening = fracture_energy / (l * f_t) - f_t / (2 * young);
  double low = f_t / young, high = 1e-2;
  for (int i = 0; i < 60; ++i) {
    const double eps = 0.5 * (low + high), sigma = f_t * std::exp(-(eps - f_t / young) / softening);
    (sigma * 0.01 + 200e9 * steel_area * eps < force ? low : high) = eps;
  }
  for (const double poisson : {0.2, 0.0}) {
    c.method(fmt::format("perfect bond, cracked, nu = {:g}", poisson));
    const Outcome o = pulled(c, "cracked", true, poisson, force);
    c.relative("strain between the quarter points", "equilibrium of exponential softening and steel",
               0.5 * (low + high), middle_strain(o), 5e-3);
  }
}

void bearing(CaseRun& c) {
  // One span on two stiff bents, pushed along its axis until it slides: the piers carry friction and no more.
  c.method("viaduct, explicit");
  const double friction = 0.2, density = 2450, g = 9.81, push = 1.6;
  StructureText s;
  s.duration = 0.6;
  s.interval = 2e-3;
  s.gravity = Vec3(0, 0, -g);
  s.material = fmt::format("density = {}\nyoung = \"33.55 GPa\"\npoisson = 0.2", number(density));
  s.body = fmt::format(
      "kind = \"viaduct\"\nposition = [0.0, 0.0, 0.0]\ncell_size = 1.0\nspans = 1\nspan_length = "
      "10.0\npier_height = 3.0\npier_width = 2.0\npier_depth = 2.0\ncap_length = 4.0\n"
      "deck_width = 4.0\ndeck_depth = 1.0\nbearing_friction = {}\nbearing_stiffness = \"100 "
      "MN/m\"\nintegrator = \"explicit\"\n",
      number(friction));
  const double weight = density * g * 4 * 1 * (10 - 0.05);  // joints of 25 mm at each end
  const double bottom = 3.0 + 1.0 + 0.1;
  s.probes = {Vec3(5, 0, bottom + 0.5), Vec3(0, 0, 4)};
  s.loads.push_back({Box3(Vec3(0.02, -2, bottom), Vec3(0.03, 2, bottom + 1)),
                     Vec3(push * friction * weight / 4, 0, 0),
                     {{0, 0}, {0.1, 1}, {1, 1}}});
  const Outcome o = c.run(s.str());
  // Mean over the last half: what the bents carry, and how the deck gathers speed.
  double mean = 0;
  int count = 0;
  for (const sim::HistoryRow& row : o.rows)
    if (row.time > 0.3 - 1e-9) mean += row.structures[0].base_force.x(), ++count;
  c.relative("force on the bents while sliding [N]", "mu times the weight of the deck", friction * weight,
             mean / count, 0.02);
  const std::vector<double> u = probe_history(o, 0, 0);
  const std::size_t n = u.size() - 1, step = (n - 150) / 2;
  const double h = 2e-3 * static_cast<double>(step);
  c.relative("acceleration of the deck [m/s^2]", "(push - mu W) / m", (push - 1) * friction * g,
             (u[n] - 2 * u[n - step] + u[n - 2 * step]) / (h * h), 0.02);
  c.relative("work of friction [J]", "mu W times the path over the bents",
             friction * weight * (u[n] - probe_history(o, 1, 0)[n]), o.last().ledger.damage_work, 0.03);
}

}  // namespace

std::vector<Case> concrete_cases() {
  return {
      {"fem", "B12", "One cell of concrete, uniaxial", "fib Model Code 2010", true, uniaxial},
      {"fem", "B13", "One cell of concrete, biaxial", "Faria and Oliver 1998", true, biaxial},
      {"fem", "B14", "One cell of concrete, cyclic", "fib Model Code 2010; Birtel and Mark 2006", true,
       cyclic},
      {"fem", "B15", "Fracture energy of a torn bar", "crack band: Bazant and Oh 1983", true, fracture},
      {"fem", "B16", "Reinforced bar, elastic", "statics", true, reinforced_elastic},
      {"fem", "B17", "Reinforced bar, cracked", "statics", true, reinforced_cracked},
      {"fem", "B18", "Bearing that slides", "Coulomb's law", true, bearing},
  };
}

}  // namespace talus::verify
