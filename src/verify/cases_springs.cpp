// A23 to A26: blocks on contact springs, where the closed form is an oscillator's.
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double density = 2500;

/// A unit cube over a plane, four contact points of stiffness k.
SceneText cube(const Method& m, double duration, double k, double height, double friction,
               const std::string& more = {}) {
  SceneText s(m, duration);
  s.material("rock", density)
      .interface("rock", "ground", friction, "normal_stiffness = " + number(k) + "\n" + more);
  s.plane(Vec3::UnitZ()).box("B", Vec3::Ones(), Vec3(0, 0, 0.5 + height));
  return s;
}

void rest_on_springs(CaseRun& c) {
  for (const Method& m : {Method::by_accuracy(1e-3), Method::fixed_step(0.01)}) {
    c.method(m);
    for (const double k : {1e7, 1e9, 1e12}) {
      c.reset();
      const Outcome o = c.run(cube(m, 3, k, 0, 0.5, "damping_ratio = 0.3").history(0.05).str());
      const double depth = density * g / (4 * k);
      c.absolute(fmt::format("height at rest, k = {:g} N/m [m]", k), "1/2 - m g / 4 k", 0.5 - depth,
                 o.last().position[0].z(), std::max(1e-4 * depth, 1e-11));
      c.absolute(fmt::format("velocity at rest, k = {:g} N/m [m/s]", k), "0", 0, o.last().velocity[0].norm(),
                 1e-6);
    }
  }
}

void slide_on_springs(CaseRun& c) {
  const double a = 35 * pi / 180, mu = 0.3, path = 0.5 * g * (std::sin(a) - mu * std::cos(a)) * 4;
  for (const Method& m : {Method::by_accuracy(1e-3), Method::fixed_step(0.01)}) {
    c.method(m);
    for (const std::string shear : {"", "shear_stiffness = 4e9\n"}) {
      c.reset();
      const Mat3 axes = slope_axes(a);
      const double k = 1e10;
      SceneText s(m, 2);
      s.material("rock", density)
          .interface("rock", "ground", mu, "normal_stiffness = " + number(k) + "\n" + shear);
      s.plane(axes.col(2)).box("B", Vec3::Ones(), 0.5 * axes.col(2), turned(Vec3(0, a, 0)));
      const Outcome o = c.run(s.str());
      const double moved = axes.col(0).dot(o.last().position[0] - o.rows.front().position[0]);
      c.relative(shear.empty() ? "path in 2 s" : "path in 2 s, shear springs",
                 "s = 1/2 g (sin a - mu cos a) t^2", path, moved, 1e-5);
    }
  }
}

/// Height that the centroid reaches after the first contact, over the height it fell from.
double rebound_height(const Outcome& o, double drop) {
  double low = 1e9, top = 0;
  bool up = false;
  for (const sim::HistoryRow& r : o.rows) {
    const double z = r.position[0].z() - 0.5;
    low = std::min(low, z);
    up = up || (low < 0.01 * drop && r.velocity[0].z() > 0);
    if (up) top = std::max(top, z);
    if (up && r.velocity[0].z() < 0) break;
  }
  return top / drop;
}

void elastic_rebound(CaseRun& c) {
  const double k = 1e8, drop = 1, fall = std::sqrt(2 * drop / g);
  double last = 0;
  for (const double accuracy : {1e-3, 1e-4, 1e-5}) {
    const Method m = Method::by_accuracy(accuracy);
    c.method(m);
    const Outcome o = c.run(cube(m, 2 * fall + 0.1, k, drop, 0).history(1e-3).str());
    const double height = rebound_height(o, drop);
    c.absolute("height of rebound over height of fall", "1: an undamped spring gives back what it took", 1,
               height, 1e-4);
    // Time in contact, from the time at the top of the flight: 2 (pi / 2 + atan(g / (omega v))) / omega.
    const double v = g * fall, omega = std::sqrt(4 * k / density);
    const double contact = (pi + 2 * std::atan(g / (omega * v))) / omega;
    const sim::HistoryRow& after = o.rows[static_cast<std::size_t>(std::lround((1.5 * fall) / 1e-3))];
    const double left = after.time - (v - after.velocity[0].z()) / g;
    const double error = std::abs((left - fall) - contact);
    CaseResult& r = c.relative("time in contact", "(pi + 2 atan(g / omega v)) / omega", contact, left - fall,
                               30 * accuracy);
    if (last > 0 && error > 0) r.order = std::log(last / error) / std::log(10.0);
    last = error;
  }
}

void damped(CaseRun& c) {
  // The contact ends when its force does: e = exp(-(zeta / sqrt(1 - zeta^2)) (pi - atan(2 zeta sqrt(1 -
  // zeta^2) / (1 - 2 zeta^2)))), gravity being small against the contact force.
  const Method m = Method::by_accuracy(1e-5);
  c.method(m);
  for (const double zeta : {0.05, 0.1, 0.3}) {
    c.reset();
    const double root = std::sqrt(1 - zeta * zeta), drop = 2;
    const double angle = std::atan2(2 * zeta * root, 1 - 2 * zeta * zeta);
    const double e = std::exp(-zeta / root * (pi - angle));
    const Outcome o =
        c.run(cube(m, 1.6, 1e10, drop, 0, fmt::format("damping_ratio = {}\n", zeta)).history(1e-3).str());
    c.relative(fmt::format("restitution at damping ratio {}", zeta),
               "oscillator whose contact ends with its force", e, std::sqrt(rebound_height(o, drop)), 2e-3);
  }
}

}  // namespace

std::vector<Case> spring_cases() {
  return {
      {"dda", "A23", "Rest on contact springs", "closed form", true, rest_on_springs},
      {"dda", "A24", "Sliding on contact springs", "Coulomb; closed form", true, slide_on_springs},
      {"dda", "A25", "Elastic rebound from contact springs", "oscillator; closed form", true,
       elastic_rebound},
      {"dda", "A26", "Damped rebound from contact springs", "oscillator; closed form", true, damped},
  };
}

}  // namespace talus::verify
