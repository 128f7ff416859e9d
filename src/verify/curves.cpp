// Error against CPU time for the 1988 scheme, a fixed step and a step by accuracy. Errors are against closed
// forms.
#include "verify/curves.hpp"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "coupling/touch/touch.hpp"
#include "sim/world.hpp"
#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {

Outcome euler_top_run(CaseRun& c, const Method& m, double part) {
  // A plate sqrt 2 x 1 x 1e-5 has I_x : I_y : I_z = 1 : 2 : 3 to 1e-10.
  SceneText s(m, 39.10573419726872 * part, Vec3::Zero());
  s.material("rock", 1000, stone)
      .interface("rock", "rock", 0.5)
      .box("T", Vec3(std::sqrt(2.0), 1, 1e-5), Vec3::Zero(), spin(Vec3(.01, 1, .01)));
  return c.run(s.str());
}

RockingMeasure rocking_run(CaseRun& c, const Method& m) {
  const double critical = std::atan(0.25), start = 0.5 * critical, mass_arm = 0.5 * std::sqrt(17.0),
               expected = 0.69834320390792;
  // Leaning towards +x about the edge at the origin; the block lies on the +x side of it and falls back.
  const Mat3 turn = Eigen::AngleAxisd(-start, Vec3::UnitY()).toRotationMatrix();
  SceneText s(m, expected + 0.01);
  s.history(1e-3)
      .material("rock", 2600, stone)
      .interface("rock", "ground", 10, "normal_stiffness = \"hard\"", 1e9)
      .plane(Vec3::UnitZ());
  // Turning about -y by `start` raises the +x side: the edge at x = 0 is the pivot.
  s.box("B", Vec3(1, 1, 4), turn * Vec3(0.5, 0, 2), turned(Vec3(0, -start, 0)));
  RockingMeasure r;
  r.outcome = c.run(s.str());
  const auto& rows = r.outcome.rows;
  const auto fall = [&](double angle) {
    return 0.75 * g / mass_arm * std::sin(critical - angle);
  };  // of an edge-supported block
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const double before = rows[i - 1].spin[0].y(), after = rows[i].spin[0].y();
    if (rows[i].time < 0.5 * expected || after > before - 1e-3) continue;
    // The fall from the last sample to upright, and back from the first sample after.
    const double angle = -turn_about_y(rows[i - 1]), a = fall(angle);
    double d = angle / before;
    for (int k = 0; k < 20; ++k) d = angle / (before + 0.5 * a * d);
    const double slope = 0.75 * g / mass_arm * std::cos(critical) * before;  // rate of the acceleration
    for (int k = 0; k < 20; ++k) d = (angle - slope * d * d * d / 6) / (before + 0.5 * a * d);
    r.time = rows[i - 1].time + d;
    r.before = before + a * d + 0.5 * slope * d * d;
    const double back = rows[i].time - r.time, other = turn_about_y(rows[i]), b = fall(other);
    r.after = after + b * back + 0.5 * slope * 0.9 * back * back;
    break;
  }
  return r;
}

namespace {

/// Runs one scene over the methods' parameters, records the curves, and checks the two orders.
void sweep(CaseRun& c, const std::function<double(const Method&, Outcome&)>& error,
           const std::vector<double>& accuracies, const std::vector<double>& steps,
           const std::vector<double>& paper) {
  std::vector<Method> all;
  for (double a : accuracies) all.push_back(Method::by_accuracy(a));
  for (double h : steps) all.push_back(Method::fixed_step(h));
  for (double h : paper) all.push_back(Method::paper(h));
  double best = 1e300, best_paper = 1e300;
  for (const Method& m : all) {
    c.method(m);
    Outcome o;
    double e = NAN;
    try {
      e = error(m, o);
    } catch (const std::exception& x) {
      c.failed(x.what());
      continue;
    }
    c.point(m, e, o);
    if (std::isfinite(e))
      (m.kind == Method::Kind::paper ? best_paper : best) =
          std::min(m.kind == Method::Kind::paper ? best_paper : best, e);
  }
  c.method(paper.empty() ? all.back() : all[0]);
  CaseResult& r =
      c.holds("least error no larger than the 1988 scheme's", "closed form", best <= best_paper * (1 + 1e-9));
  r.note = fmt::format("least error {:.3g}, dda-1988 {:.3g}", best, best_paper);
}

std::vector<double> cut(bool quick, std::vector<double> v) {
  if (quick && v.size() > 2) v.resize(2);
  return v;
}

void incline_curve(CaseRun& c) {
  sweep(
      c,
      [&](const Method& m, Outcome& o) {
        const double a = 30 * deg, mu = 0.3;
        const Mat3 axes = slope_axes(a);
        SceneText s(m, 1);
        s.material("rock", 2600, stone)
            .interface("rock", "ground", mu)
            .plane(axes.col(2))
            .box("B", Vec3(1, 1, 0.4), 0.2 * axes.col(2), turned(Vec3(0, a, 0)));
        o = c.run(s.str());
        const double path = 0.5 * g * (std::sin(a) - mu * std::cos(a));
        return std::abs(axes.col(0).dot(o.last().position[0] - o.rows.front().position[0]) / path - 1);
      },
      cut(c.quick(), {1e-2, 1e-4}), cut(c.quick(), {1e-2, 1e-3}), cut(c.quick(), {1e-2, 3e-3, 1e-3}));
}

void rocking_curve(CaseRun& c) {
  sweep(
      c,
      [&](const Method& m, Outcome& o) {
        RockingMeasure r = rocking_run(c, m);
        o = std::move(r.outcome);
        return r.time > 0 ? std::abs(r.time / 0.69834320390792 - 1) : NAN;
      },
      cut(c.quick(), {1e-3, 1e-5, 1e-7}), cut(c.quick(), {1e-3, 5e-4, 2.5e-4}),
      cut(c.quick(), {1e-3, 5e-4, 2.5e-4}));
}

void top_curve(CaseRun& c) {
  sweep(
      c,
      [&](const Method& m, Outcome& o) {
        o = euler_top_run(c, m, 0.5);
        return (body_spin(o.last()) - Vec3(-.01, -1, .01)).norm();
      },
      cut(c.quick(), {1e-3, 1e-5, 1e-7}), cut(c.quick(), {0.02, 0.01, 0.005}),
      cut(c.quick(), {0.02, 0.01, 0.005}));
}

void bounce_curve(CaseRun& c) {
  // The 1988 scheme has no restitution of its own: its springs give what dt sqrt(k/m) says. Judged on the
  // first rebound for e = 1.
  sweep(
      c,
      [&](const Method& m, Outcome& o) {
        const double t0 = std::sqrt(2 / g);
        SceneText s(m, 2 * t0);
        s.material("rock", 2600, stone)
            .interface("rock", "ground", 0.5, "normal_stiffness = \"hard\"\nrestitution = 1.0", 1e8)
            .plane(Vec3::UnitZ())
            .box("B", Vec3(1, 1, 1), Vec3(0, 0, 1.5));
        o = c.run(s.str());
        const double z = o.last().position[0].z() - 0.5, v = o.last().velocity[0].z();
        return std::abs(z + v * v / (2 * g) - 1);
      },
      cut(c.quick(), {1e-2, 1e-4}), cut(c.quick(), {1e-2, 1e-3}), cut(c.quick(), {1e-3, 3e-4, 1e-4}));
}

void wedge_curve(CaseRun& c) {
  const WedgeScene w;
  sweep(
      c,
      [&](const Method& m, Outcome& o) {
        o = c.run(w.text(m, 20 * deg, 0.5));
        return std::abs(
            w.line.dot(o.last().position[0] - o.rows.front().position[0]) / (0.125 * g * 0.26944209) - 1);
      },
      cut(c.quick(), {1e-2, 1e-4}), cut(c.quick(), {1e-2, 1e-3}), cut(c.quick(), {2e-3, 1e-3, 5e-4}));
}

void stack_curve(CaseRun& c) {
  sweep(
      c,
      [&](const Method& m, Outcome& o) {
        // Sinking of the top of five blocks in 0.5 s: the closed form is none.
        SceneText s(m, 0.5);
        s.material("rock", 2600, stone)
            .interface("rock", "ground", 0.5, "normal_stiffness = \"hard\"", 1e9)
            .interface("rock", "rock", 0.5, "normal_stiffness = \"hard\"", 1e9)
            .plane(Vec3::UnitZ());
        for (int i = 0; i < 5; ++i) s.box(fmt::format("B{}", i + 1), Vec3(1, 1, 1), Vec3(0, 0, 0.5 + i));
        o = c.run(s.str());
        return (o.last().position[4] - o.rows.front().position[4]).norm();
      },
      cut(c.quick(), {1e-2, 1e-4}), cut(c.quick(), {1e-2, 1e-3}), cut(c.quick(), {1e-2, 3e-3}));
}

void arch_curve(CaseRun& c) {
  sweep(
      c,
      [&](const Method& m, Outcome& o) {
        // Movement of the crown of a stable arch (t/R = 0.15, seven voussoirs) in 0.1 s: the closed form is
        // none.
        o = c.run(arch_text(m, 7, 0.15, 0.7, 0.1));
        return (o.last().position[3] - o.rows.front().position[3]).norm();
      },
      cut(c.quick(), {1e-2, 1e-4}), cut(c.quick(), {1e-2, 1e-3}), cut(c.quick(), {1e-3, 3e-4}));
}

}  // namespace

std::vector<Case> comparison_cases() {
  return {
      {"dda", "W1-incline", "Incline: path", "closed form", false, incline_curve},
      {"dda", "W2-rocking", "Rocking block: time to upright", "elliptic integral", false, rocking_curve},
      {"dda", "W3-top", "Euler top: spin at T/2", "elliptic functions", false, top_curve},
      {"dda", "W4-bounce", "Bounce with e = 1: height", "closed form", false, bounce_curve},
      {"dda", "W5-wedge", "Wedge: path", "limit equilibrium", false, wedge_curve},
      {"dda", "W6-stack", "Stack of five: drift", "statics", false, stack_curve},
      {"dda", "W7-arch", "Arch of seven: drift of the crown", "statics", false, arch_curve},
  };
}

}  // namespace talus::verify
