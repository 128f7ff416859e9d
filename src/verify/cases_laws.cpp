// Laws of the contact force: Hertz on a half-space, crushing, a table, rolling resistance.
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double pi = std::numbers::pi;

void hertz(CaseRun& c) {
  // The sphere's mass on one point: an octahedron of its volume, tip down, on a plane with the Hertz law of radius 1 cm.
  const double radius = 0.01, density = 7800, speed = 0.01, T = 173.15e-6;
  const double tip = std::cbrt(pi) * radius;   // 4/3 a^3 = 4/3 pi R^3
  const Method m = Method::by_accuracy(1e-4);
  c.method(m);
  SceneText s(m, 2 * T, Vec3::Zero());
  s.history(T / 400).material("steel", density, "young = \"210 GPa\"\npoisson = 0.3");
  s.interface("steel", "steel", 0, "contact_law = { kind = \"hertz\", radius = " + number(radius) + " }").plane(Vec3::UnitZ(), Vec3::Zero(), "steel");
  std::vector<Vec3> corners;
  const Vec3 centre(0, 0, tip + 0.2 * T * speed);
  for (int k = 0; k < 3; ++k)
    for (const double side : {-1.0, 1.0}) corners.push_back(centre + side * tip * Vec3::Unit(k));
  s.hull("sphere", corners, centre, velocity(Vec3(0, 0, -speed)), "steel");
  const Outcome o = c.run(s.str());
  double force = 0, deepest = 0, start = -1, end = -1;
  for (std::size_t k = 1; k < o.rows.size(); ++k) {
    const double dt = o.rows[k].time - o.rows[k - 1].time;
    const double dv = o.rows[k].velocity[0].z() - o.rows[k - 1].velocity[0].z();
    force = std::max(force, density * 4 / 3 * pi * radius * radius * radius * dv / dt);
    const double x = tip - o.rows[k].position[0].z(), before = tip - o.rows[k - 1].position[0].z();
    deepest = std::max(deepest, x);
    const double share = (0 - before) / (x - before);   // where the tip meets the plane between two rows
    if (before <= 0 && x > 0) start = o.rows[k - 1].time + share * dt;
    if (before > 0 && x <= 0) end = o.rows[k - 1].time + share * dt;
  }
  c.relative("largest force [N]", "Hertz 1882", 6.942, force, 1e-3);
  c.relative("approach [m]", "Hertz 1882", 0.5883e-6, deepest, 1e-3);
  c.relative("time of contact [s]", "Hertz 1882", T, end - start, 1e-3);
  c.relative("rebound [m/s]", "elastic", speed, o.last().velocity[0].z(), 1e-8);
}

/// A cube of 1 m^3 that meets a plane face on at `speed`, without gravity.
std::string cube_on_plane(const Method& m, const std::string& law, double speed, double duration) {
  SceneText s(m, duration, Vec3::Zero());
  s.history(duration / 400).material("rock", 2600, "young = \"30 GPa\"\npoisson = 0.25").interface("rock", "ground", 0, law).material("ground", 2600, "young = \"30 GPa\"\npoisson = 0.25").plane(Vec3::UnitZ());
  return s.box("B", Vec3::Ones(), Vec3(0, 0, 0.51), velocity(Vec3(0, 0, -speed))).str();
}

double deepest(const Outcome& o) {
  double x = 0;
  for (const sim::HistoryRow& r : o.rows) x = std::max(x, 0.5 - r.position[0].z());
  return x;
}

void crushing(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  const double mass = 2600, speed = 5, pressure = 1e6, stiffness = 1e8;   // on an area of 1 m^2
  const Outcome o = c.run(cube_on_plane(m, "normal_stiffness = \"100 MPa/m\"\ncontact_law = { kind = \"crushing\", pressure = \"1 MPa\" }", speed, 0.06));
  const double elastic = pressure * pressure / (2 * stiffness), crushed = 0.5 * mass * speed * speed - elastic;
  c.relative("rebound [m/s]", "p A / sqrt(k m)", pressure / std::sqrt(stiffness * mass), o.last().velocity[0].z(), 1e-3);
  c.relative("indentation [m]", "energy", pressure / stiffness + crushed / pressure, deepest(o), 1e-3);
  c.relative("energy crushed [J]", "energy", crushed, o.last().ledger.damping_work, 1e-3);
}

void table(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  // Each of the four corners: 1e8 N/m over the first millimetre, 1e7 N/m beyond.
  const double mass = 2600, speed = 2;
  const Outcome o = c.run(cube_on_plane(m, "contact_law = { kind = \"table\", points = [[0, 0], [0.001, 100000], [0.01, 190000]] }", speed, 0.1));
  // m v^2 / 2 = 4 (50 + 1e5 y + 1e7 y^2 / 2)
  const double rest = mass * speed * speed / 8 - 50, y = (-1e5 + std::sqrt(1e10 + 2e7 * rest)) / 1e7;
  c.relative("rebound [m/s]", "elastic", speed, o.last().velocity[0].z(), 1e-6);
  c.relative("indentation [m]", "energy", 0.001 + y, deepest(o), 1e-3);
}

void rolling(CaseRun& c) {
  // A cube about its lower edge on a slope: the couple of the weight against that of the rolling resistance, mu_r R N.
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  const double resistance = 0.1, radius = std::cbrt(0.75 / pi), expected = 1 + 2 * resistance * radius;
  const auto stands = [&](double slope) {
    const Mat3 axes = slope_axes(std::atan(slope));
    SceneText s(m, 0.1);
    s.material("rock", 2600).interface("rock", "ground", 3, "normal_stiffness = \"hard\"\nrolling_resistance = " + number(resistance)).plane(axes.col(2));
    const Outcome o = c.run(s.box("B", Vec3::Ones(), 0.5 * axes.col(2), turned(rotation_vector(axes))).str());
    return o.ok() && o.last().velocity[0].norm() < 1e-6;
  };
  double low = 0.99 * expected, high = 1.01 * expected;
  const bool bracket = stands(low) && !stands(high);
  while (bracket && high - low > 1e-4) {
    const double x = 0.5 * (low + high);
    (stands(x) ? low : high) = x;
  }
  c.relative("steepest slope, tangent", "1 + 2 mu_r R / a", expected, bracket ? 0.5 * (low + high) : NAN, 1e-4);
}

}  // namespace

std::vector<Case> law_cases() {
  return {
      {"dda", "A27", "Hertz contact on a half-space", "Hertz 1882", true, hertz},
      {"dda", "A28", "Contact that crushes", "energy", true, crushing},
      {"dda", "A29", "Contact force by table", "energy", true, table},
      {"dda", "A30", "Rolling resistance on a slope", "statics", true, rolling},
  };
}

}  // namespace talus::verify
