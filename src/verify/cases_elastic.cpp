// B: elastic structures by themselves, against beam theory, d'Alembert's wave, and each other.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "verify/beam.hpp"
#include "verify/scene_text.hpp"
#include "verify/structure_text.hpp"

namespace talus::verify {
namespace {

const Beam pier_beam{12, 33.55e9, 0.2, 2450, 1.5};

std::string elastic(double density, double young, double poisson) {
  return fmt::format("density = {}\nyoung = {}\npoisson = {}", number(density), number(young),
                     number(poisson));
}

/// The pier of verification.md B with cells [n, n, 8 n]; a load on its top along x.
StructureText pier(int n, const std::string& integrator, double duration, double interval,
                   const std::vector<std::pair<double, double>>& history = {}, double poisson = 0.2) {
  StructureText s;
  s.duration = duration;
  s.interval = interval;
  s.material = elastic(2450, 33.55e9, poisson);
  s.body = fmt::format(
      "kind = \"column\"\nbase = [0.0, 0.0, 0.0]\nsection = [1.5, 1.5]\nheight = 12.0\ncells = [{0}, {0}, "
      "{1}]\nintegrator = \"{2}\"\n",
      n, 8 * n, integrator);
  s.probes = {Vec3(0, 0, 12)};
  if (!history.empty())
    s.loads.push_back(
        {Box3(Vec3(-0.75, -0.75, 12), Vec3(0.75, 0.75, 12)), Vec3(100e3 / 2.25, 0, 0), history});
  return s;
}

double largest(const std::vector<double>& v) {
  double most = 0;
  for (double x : v) most = std::max(most, std::abs(x));
  return most;
}

/// Root of the mean square difference over that of the reference.
double distance(const std::vector<double>& a, const std::vector<double>& reference) {
  double difference = 0, scale = 0;
  for (std::size_t i = 0; i < reference.size(); ++i)
    difference += (a.at(i) - reference[i]) * (a.at(i) - reference[i]), scale += reference[i] * reference[i];
  return std::sqrt(difference / scale);
}

void patch(CaseRun& c) {
  // Seven distorted cells pulled along x, free to contract: one strain everywhere. Damped modal motion for
  // 2000 periods: statics.
  std::vector<Vec3> inner;
  StructureText s;
  s.duration = s.interval = 20;
  s.material = elastic(2450, 30e9, 0.25);
  s.body = fmt::format(
      "kind = \"mesh\"\nfile = \"{}\"\nintegrator = \"modal\"\npreload = \"none\"\ndamping_ratio = 0.7\n"
      "support = [{{ face = \"-x\", held = \"x\" }}, {{ face = \"-y\", held = \"y\" }}, {{ face = \"-z\", "
      "held = \"z\" }}]\n",
      write_patch(inner));
  s.probes = inner;
  s.loads.push_back({Box3(Vec3(1, 0, 0), Vec3(1, 1, 1)), Vec3(3e6, 0, 0), {{0, 1}}});
  c.method("modal");
  const Outcome o = c.run(s.str());
  double worst = 0;
  for (std::size_t i = 0; i < inner.size(); ++i) {
    const Vec3 expected = 1e-4 * Vec3(inner[i].x(), -0.25 * inner[i].y(), -0.25 * inner[i].z());
    worst =
        std::max(worst, (o.last().structures[0].probe_displacement[i] - expected).norm() / expected.norm());
  }
  c.absolute("displacement of the inner nodes, relative", "uniform stress in distorted cells", 0, worst,
             1e-10);
  c.relative("reaction along x [N]", "traction times area", 3e6, o.last().structures[0].base_force.x(),
             1e-10);
}

void frequencies(CaseRun& c) {
  // A short pulse at the top, then free motion; the frequencies are those of the recorded displacement.
  const int n = c.quick() ? 4 : 8;
  const double pulse = 1e-3, dt = 5e-4;
  c.method(fmt::format("modal, cells {0} x {0} x {1}", n, 8 * n));
  const Outcome o = c.run(pier(n, "modal", 0.25, dt, {{0, 0}, {pulse / 2, 1}, {pulse, 0}}).str());
  std::vector<double> u = probe_history(o, 0, 0);
  u.erase(u.begin(), u.begin() + 2);
  const std::vector<double> found = frequencies_of(u, dt);
  const std::vector<BeamMode> modes = cantilever_modes(pier_beam, 3);
  const double stated[] = {6.155, 36.19, 93.1};
  for (int i = 0; i < 3; ++i) {
    const double expected = modes[static_cast<std::size_t>(i)].omega / (2 * std::numbers::pi);
    double nearest = NAN;
    for (double f : found)
      if (!(std::abs(f - expected) >= std::abs(nearest - expected))) nearest = f;
    CaseResult& r = c.relative(fmt::format("bending frequency {} [Hz]", i + 1), "Timoshenko beam", expected,
                               nearest, c.quick() ? 0.03 : 0.01);
    r.note = fmt::format("stated: {:g} Hz", stated[i]);
  }
}

void tip_load(CaseRun& c) {
  const int n = c.quick() ? 4 : 8;
  c.method(fmt::format("modal, cells {0} x {0} x {1}", n, 8 * n));
  StructureText s = pier(n, "modal", 4, 4, {{0, 1}});
  s.body += "damping_ratio = 0.7\n";
  const Outcome o = c.run(s.str());
  c.relative("tip deflection under 100 kN [m]", "Timoshenko beam", pier_beam.tip_deflection(100e3),
             o.last().structures[0].probe_displacement[0].x(), c.quick() ? 0.03 : 0.01);
  c.relative("reaction [N]", "statics", 100e3, o.last().structures[0].base_force.x(), 1e-9);
  c.relative("moment at the base [N m]", "statics", 1.2e6, o.last().structures[0].base_moment.y(), 1e-3);
}

void tip_dynamics(CaseRun& c, const std::vector<std::pair<double, double>>& factor, const char* what) {
  const int n = c.quick() ? 4 : 8;
  const double duration = 0.1625, dt = duration / 100;  // one period
  std::vector<std::pair<double, double>> force = factor;
  for (auto& point : force) point.second *= 100e3;
  std::vector<double> times;
  for (int i = 0; i <= 100; ++i) times.push_back(dt * i);
  const std::vector<double> reference = tip_response(cantilever_modes(pier_beam, 10), force, times);
  for (const char* how : {"explicit", "modal"}) {
    c.method(fmt::format("{0}, cells {1} x {1} x {2}", how, n, 8 * n));
    const Outcome o = c.run(pier(n, how, duration, dt, factor).str());
    const std::vector<double> u = probe_history(o, 0, 0);
    c.relative(fmt::format("largest tip displacement, {} [m]", what), "Timoshenko beam, 10 modes",
               largest(reference), largest(u), c.quick() ? 0.03 : 0.01);
    c.absolute(fmt::format("distance over one period, {}", what), "Timoshenko beam, 10 modes", 0,
               distance(u, reference), c.quick() ? 0.06 : 0.02);
  }
}

void tip_step(CaseRun& c) { tip_dynamics(c, {{0, 1}, {1, 1}}, "step"); }
void tip_impulse(CaseRun& c) { tip_dynamics(c, {{0, 0}, {5e-3, 1}, {10e-3, 0}, {1, 0}}, "impulse"); }

/// A rod of 10 m with a smooth pulse of 1 ms at its free end: error of the displacement at its middle.
double rod_error(CaseRun& c, int cells, double* cpu_energy = nullptr) {
  const double young = 30e9, density = 2500, speed = std::sqrt(young / density), length = 1.5e-3,
               stress = 1e6;
  const int pieces = 40;
  std::vector<std::pair<double, double>> pulse;
  for (int i = 0; i <= pieces; ++i)
    pulse.emplace_back(length * i / pieces, std::pow(std::sin(std::numbers::pi * i / pieces), 2));
  StructureText s;
  s.duration = 8 / speed;
  s.interval = s.duration / 100;
  s.material = elastic(density, young, 0);
  s.body = fmt::format(
      "kind = \"box\"\nposition = [5.0, 0.0, 0.0]\nsize = [10.0, 0.1, 0.1]\ncells = [{}, 1, 1]\nsupport = "
      "[\"+x\"]\nintegrator = \"explicit\"\n",
      cells);
  s.probes = {Vec3(5, 0, 0)};
  s.loads.push_back({Box3(Vec3(0, -0.05, -0.05), Vec3(0, 0.05, 0.05)), Vec3(stress, 0, 0), pulse});
  const Outcome o = c.run(s.str());
  // u = 1 / (rho c) times the integral of the stress up to t - x / c, exact for the piecewise linear pulse.
  const auto passed = [&](double t) {
    double sum = 0;
    for (int i = 0; i < pieces; ++i) {
      const auto [t0, f0] = pulse[static_cast<std::size_t>(i)];
      const auto [t1, f1] = pulse[static_cast<std::size_t>(i) + 1];
      const double h = std::clamp(t - t0, 0.0, t1 - t0);
      sum += h * (f0 + 0.5 * (f1 - f0) * h / (t1 - t0));
    }
    return sum;
  };
  std::vector<double> reference;
  for (const sim::HistoryRow& row : o.rows)
    reference.push_back(stress / (density * speed) * passed(row.time - 5 / speed));
  if (cpu_energy) *cpu_energy = std::abs(o.last().ledger.residual) / o.last().ledger.external_work;
  return distance(probe_history(o, 0, 0), reference);
}

void rod(CaseRun& c) {
  c.method("explicit, fraction 0.9");
  double defect = 0;
  const double coarse = rod_error(c, 50), middle = rod_error(c, 100), fine = rod_error(c, 200, &defect);
  c.absolute("distance of the wave at the middle, 200 cells", "d'Alembert", 0, fine, 0.01);
  CaseResult& r = c.absolute("order in h and dt together", "two", 2, std::log2(middle / fine), 0.2);
  r.order = std::log2(middle / fine);
  r.note = fmt::format("50, 100, 200 cells: {:.3g}, {:.3g}, {:.3g}", coarse, middle, fine);
  c.absolute("energy residual over the work of the load", "none", 0, defect, 1e-10);
}

void order_in_h(CaseRun& c) {
  // Lateral gravity of 1 m/s^2; without Poisson's ratio the clamped face has no singular edge and the beam is
  // exact up to its ends.
  c.method("preload, nu = 0");
  Beam beam = pier_beam;
  beam.poisson = 0;
  const double expected = beam.uniform_deflection(beam.density * beam.area());
  std::vector<double> u;
  for (int n : {2, 4, 8}) {
    StructureText s = pier(n, "modal", 1e-3, 1e-3, {}, 0);
    s.gravity = Vec3(1, 0, 0);
    u.push_back(c.run(s.str()).rows.front().structures[0].probe_displacement[0].x());
  }
  const double order = std::log2((u[1] - u[0]) / (u[2] - u[1]));
  // Bending is exact in one layer; what is left is shear that the clamped face holds from warping, singular
  // at its edge: no order of two.
  CaseResult& r =
      c.holds(fmt::format("order in h, 2, 4, 8 cells across ({:.2f})", order), "at least 1.5", order >= 1.5);
  r.order = order;
  c.relative("deflection of the top, 2 cells across [m]", "Timoshenko beam", expected, u[0], 5e-3);
  c.relative("deflection of the top, 8 cells across [m]", "Timoshenko beam", expected, u[2], 5e-4);
  c.relative("deflection of the top, extrapolated [m]", "Timoshenko beam", expected, u[2] + (u[2] - u[1]) / 3,
             2e-3);
}

void order_in_dt(CaseRun& c) {
  // Two cells have 24 degrees of freedom, all of them in the modal basis: modal motion is then exact in time.
  const std::vector<std::pair<double, double>> pulse{{0, 0}, {0.02, 1}, {0.04, 0}};
  const auto small = [&](const std::string& how, double interval, const std::string& more) {
    StructureText s = pier(1, how, 0.2, interval, pulse);
    s.body.replace(s.body.find("cells = [1, 1, 8]"), 17, "cells = [1, 1, 2]");
    s.body += more;
    return s.str();
  };
  const double dt = 0.01;
  c.method("modal");
  const std::vector<double> exact = probe_history(c.run(small("modal", dt, "")), 0, 0);
  std::vector<double> e;
  c.method("explicit");
  // The number of sub-steps in an interval is whole: fractions are chosen so that each halves the step.
  for (double fraction : {0.8, 0.4, 0.2})
    e.push_back(distance(
        probe_history(
            c.run(small("explicit", dt, fmt::format("critical_step_fraction = {}\n", number(fraction)))), 0,
            0),
        exact));
  CaseResult& r = c.absolute("order in dt", "two", 2, std::log2(e[1] / e[2]), 0.2);
  r.order = std::log2(e[1] / e[2]);
  r.note = fmt::format("fractions .8, .4, .2: {:.3g}, {:.3g}, {:.3g}", e[0], e[1], e[2]);
  c.method("implicit");
  e.clear();
  for (int part : {16, 32, 64}) {  // the histories' interval bounds the step
    const std::vector<double> u = probe_history(c.run(small("implicit", dt / part, "")), 0, 0);
    std::vector<double> thinned;
    for (std::size_t i = 0; i < u.size(); i += static_cast<std::size_t>(part)) thinned.push_back(u[i]);
    e.push_back(distance(thinned, exact));
  }
  CaseResult& q = c.absolute("order in dt", "two", 2, std::log2(e[1] / e[2]), 0.2);
  q.order = std::log2(e[1] / e[2]);
  q.note = fmt::format("dt .625, .3125, .156 ms: {:.3g}, {:.3g}, {:.3g}", e[0], e[1], e[2]);
}

void agreement(CaseRun& c) {
  const std::vector<std::pair<double, double>> pulse{{0, 0}, {0.02, 1}, {0.04, 0}};
  const int n = c.quick() ? 2 : 4;
  c.method("modal");
  const std::vector<double> modal = probe_history(c.run(pier(n, "modal", 0.3, 1e-3, pulse).str()), 0, 0);
  for (const char* how : {"explicit", "implicit"}) {
    c.method(how);
    const std::vector<double> u = probe_history(c.run(pier(n, how, 0.3, 1e-3, pulse).str()), 0, 0);
    c.absolute(fmt::format("distance of {} and modal over 0.3 s", how), "the same", 0, distance(u, modal),
               std::string(how) == "explicit" ? 2e-3 : 1e-2);
  }
}

/// The elastic pier of the peers' comparison: 2 x 2 x 10 m, 2 MPa on 1 m^2 at 7.5 to 8.5 m, triangle 0-5-10
/// ms, 0.2 s.
StructureText s5(const std::string& integrator, double interval, const std::string& more = {}) {
  StructureText s;
  s.duration = 0.2;
  s.interval = interval;
  s.material = elastic(2500, 30e9, 0.2);
  s.body = fmt::format(
      "kind = \"column\"\nbase = [0.0, 0.0, 0.0]\nsection = [2.0, 2.0]\nheight = 10.0\ncells = [8, 8, "
      "40]\npreload = \"none\"\nintegrator = \"{}\"\n{}",
      integrator, more);
  s.probes = {Vec3(0, 0, 10)};
  s.loads.push_back({Box3(Vec3(-1, -0.5, 7.5), Vec3(-1, 0.5, 8.5)),
                     Vec3(2e6, 0, 0),
                     {{0, 0}, {5e-3, 1}, {10e-3, 0}, {1, 0}}});
  return s;
}

void peak_of(const Outcome& o, double& peak, double& at) {
  const std::vector<double> u = probe_history(o, 0, 0);
  peak = at = 0;
  for (std::size_t i = 0; i < u.size(); ++i)
    if (std::abs(u[i]) > std::abs(peak)) peak = u[i], at = o.rows[i].time;
}

void struck_pier(CaseRun& c) {
  for (const char* how : {"auto", "explicit", "modal", "implicit"}) {
    if (c.quick() && std::string(how) != "auto") continue;
    c.method(how);
    const Outcome o = c.run(s5(how, 1e-4).str());
    double peak = 0, at = 0;
    peak_of(o, peak, at);
    CaseResult& r = c.relative("largest displacement of the top [m]",
                               "CalculiX 2.20 implicit, C3D8, dt 1e-4 s", 4.108e-3, peak, 5e-3);
    r.note = fmt::format("at {:.1f} ms (27.3)", 1e3 * at);
  }
}

void struck_pier_curve(CaseRun& c) {
  // No closed form: the reference is the semi-discrete problem itself, from two explicit runs with a tenth
  // and a fifth of the stable step, extrapolated with order two. What is left is the error in time and of the
  // modes left out.
  const double dt = 1e-3;
  const auto run = [&](const std::string& how, double interval, const std::string& more, Outcome& o) {
    o = c.run(s5(how, interval, more).str());
    std::vector<double> thinned;
    const std::vector<double> u = probe_history(o, 0, 0);
    const auto part = static_cast<std::size_t>(std::lround(dt / interval));
    for (std::size_t i = 0; i < u.size(); i += part) thinned.push_back(u[i]);
    return thinned;
  };
  c.method("explicit");
  Outcome o;
  const std::vector<double> tenth = run("explicit", dt, "critical_step_fraction = 0.1\n", o),
                            fifth = run("explicit", dt, "critical_step_fraction = 0.2\n", o);
  std::vector<double> reference;
  for (std::size_t i = 0; i < tenth.size(); ++i) reference.push_back(tenth[i] + (tenth[i] - fifth[i]) / 3);
  double best = 1;
  for (double fraction : {0.9, 0.6, 0.4}) {
    const double e = distance(
        run("explicit", dt, fmt::format("critical_step_fraction = {}\n", number(fraction)), o), reference);
    c.point("explicit", fraction, e, o);
    best = std::min(best, e);
  }
  c.absolute("explicit, least distance over 0.2 s", "semi-discrete problem", 0, best, 2e-3);
  best = 1;
  c.method("implicit");
  for (double interval : {1e-3, 5e-4, 2.5e-4, 1.25e-4}) {
    const double e = distance(run("implicit", interval, "", o), reference);
    c.point("implicit", interval, e, o);
    best = std::min(best, e);
  }
  c.absolute("implicit, least distance over 0.2 s", "semi-discrete problem", 0, best, 5e-3);
  c.method("modal");
  const double e = distance(run("modal", dt, "", o), reference);
  c.point("modal", 24, e, o);
  c.absolute("modal, distance over 0.2 s", "semi-discrete problem", 0, e, 5e-3);
}

}  // namespace

std::vector<Case> elastic_cases() {
  return {
      {"fem", "B1", "Patch test, seven distorted cells", "Irons and Razzaque 1972; uniform stress", true,
       patch},
      {"fem", "B2", "Pier: bending frequencies", "Timoshenko 1921", true, frequencies},
      {"fem", "B3", "Pier: tip load", "Timoshenko beam, statics", true, tip_load},
      {"fem", "B4", "Pier: tip step", "Timoshenko beam, modal series", true, tip_step},
      {"fem", "B5", "Pier: tip impulse", "Timoshenko beam, modal series", true, tip_impulse},
      {"fem", "B6", "Wave in a rod", "d'Alembert; closed form", true, rod},
      {"fem", "B7", "Order in h", "Timoshenko beam, statics", true, order_in_h},
      {"fem", "B8", "Order in dt", "modal motion with all modes, exact in time", true, order_in_dt},
      {"fem", "B9", "Explicit, implicit and modal agree", "each other", true, agreement},
      {"fem", "B10", "Struck elastic pier", "CalculiX 2.20", true, struck_pier},
      {"fem", "B11", "Struck elastic pier: displacement of the top over 0.2 s", "semi-discrete problem",
       false, struck_pier_curve},
  };
}

}  // namespace talus::verify
