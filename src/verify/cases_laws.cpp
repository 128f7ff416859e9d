// Laws of the contact force: Hertz on a half-space, crushing, a table, rolling resistance.
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

void hertz(CaseRun& c) {
  // The sphere's mass on one point: an octahedron of its volume, tip down, on a plane with the Hertz law of
  // radius 1 cm.
  const double radius = 0.01, density = 7800, speed = 0.01, T = 173.15e-6;
  const double tip = std::cbrt(pi) * radius;   // 4/3 a^3 = 4/3 pi R^3
  const Method m = Method::by_accuracy(1e-6);  // whose steps resolve the force as it rises
  c.method(m);
  SceneText s(m, 2 * T, Vec3::Zero());
  s.history(T / 400).material("steel", density, "young = \"210 GPa\"\npoisson = 0.3");
  s.interface("steel", "steel", 0, "contact_law = { kind = \"hertz\", radius = " + number(radius) + " }")
      .plane(Vec3::UnitZ(), Vec3::Zero(), "steel");
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
    const double share = (0 - before) / (x - before);  // where the tip meets the plane between two rows
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
  s.history(duration / 400)
      .material("rock", 2600, "young = \"30 GPa\"\npoisson = 0.25")
      .interface("rock", "ground", 0, law)
      .material("ground", 2600, "young = \"30 GPa\"\npoisson = 0.25")
      .plane(Vec3::UnitZ());
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
  const double mass = 2600, speed = 5, pressure = 1e6, stiffness = 1e8;  // on an area of 1 m^2
  const Outcome o = c.run(cube_on_plane(
      m, "normal_stiffness = \"100 MPa/m\"\ncontact_law = { kind = \"crushing\", pressure = \"1 MPa\" }",
      speed, 0.06));
  const double elastic = pressure * pressure / (2 * stiffness),
               crushed = 0.5 * mass * speed * speed - elastic;
  c.relative("rebound [m/s]", "p A / sqrt(k m)", pressure / std::sqrt(stiffness * mass),
             o.last().velocity[0].z(), 1e-3);
  c.relative("indentation [m]", "energy", pressure / stiffness + crushed / pressure, deepest(o), 1e-3);
  c.relative("energy crushed [J]", "energy", crushed, o.last().ledger.damping_work, 1e-3);
}

void table(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  // Each of the four corners: 1e8 N/m over the first millimetre, 1e7 N/m beyond.
  const double mass = 2600, speed = 2;
  const Outcome o = c.run(cube_on_plane(
      m, "contact_law = { kind = \"table\", points = [[0, 0], [0.001, 100000], [0.01, 190000]] }", speed,
      0.1));
  // m v^2 / 2 = 4 (50 + 1e5 y + 1e7 y^2 / 2)
  const double rest = mass * speed * speed / 8 - 50, y = (-1e5 + std::sqrt(1e10 + 2e7 * rest)) / 1e7;
  c.relative("rebound [m/s]", "elastic", speed, o.last().velocity[0].z(), 1e-6);
  c.relative("indentation [m]", "energy", 0.001 + y, deepest(o), 1e-3);
}

void rolling(CaseRun& c) {
  // A cube about its lower edge on a slope: the couple of the weight against that of the rolling resistance,
  // mu_r R N.
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  const double resistance = 0.1, radius = std::cbrt(0.75 / pi), expected = 1 + 2 * resistance * radius;
  const auto stands = [&](double slope) {
    const Mat3 axes = slope_axes(std::atan(slope));
    SceneText s(m, 0.1);
    s.material("rock", 2600)
        .interface("rock", "ground", 3,
                   "normal_stiffness = \"hard\"\nrolling_resistance = " + number(resistance))
        .plane(axes.col(2));
    const Outcome o = c.run(s.box("B", Vec3::Ones(), 0.5 * axes.col(2), turned(rotation_vector(axes))).str());
    return o.ok() && o.last().velocity[0].norm() < 1e-6;
  };
  double low = 0.99 * expected, high = 1.01 * expected;
  const bool bracket = stands(low) && !stands(high);
  while (bracket && high - low > 1e-4) {
    const double x = 0.5 * (low + high);
    (stands(x) ? low : high) = x;
  }
  c.relative("steepest slope, tangent", "1 + 2 mu_r R / a", expected, bracket ? 0.5 * (low + high) : NAN,
             1e-4);
}

/// A regular octahedron, tip down on a plane when it lands at `speed` with `turn` [rad/s] about y; no
/// gravity, no friction.
Outcome landing(CaseRun& c, const Method& m, double speed, double turn, const std::string& law) {
  const double tip = 0.5, fall = 0.04;  // [m], [s]: it lands within a step
  SceneText s(m, 2 * fall, Vec3::Zero());
  s.material("rock", 2600)
      .interface("rock", "ground", 0, "normal_stiffness = \"hard\"\n" + law)
      .plane(Vec3::UnitZ());
  const Mat3 before = Eigen::AngleAxisd(-turn * fall, Vec3::UnitY()).toRotationMatrix();
  const Vec3 centre(0, 0, tip + speed * fall);
  std::vector<Vec3> corners;
  for (int k = 0; k < 3; ++k)
    for (const double side : {-1.0, 1.0}) corners.push_back(centre + before * (side * tip * Vec3::Unit(k)));
  return c.run(
      s.hull("octahedron", corners, centre, velocity(Vec3(0, 0, -speed)) + spin(Vec3(0, turn, 0))).str());
}

void rolling_impact(CaseRun& c) {
  // The impulse m v (1 + e) acts through the centroid; what it presses resists turning: I dw = mu_r R m v (1
  // + e), I = m a^2 / 5.
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  const double tip = 0.5, speed = 1, turn = 2, resistance = 0.1,
               radius = std::cbrt(1 / pi) * tip;  // V = 4/3 a^3
  for (const double e : {0.0, 0.5}) {
    const Outcome o =
        landing(c, m, speed, turn,
                "rolling_resistance = " + number(resistance) + (e > 0 ? "\nrestitution = " + number(e) : ""));
    const double left = turn - resistance * radius * speed * (1 + e) * 5 / (tip * tip);
    c.relative(fmt::format("spin after landing, e = {} [rad/s]", e), "impulse times mu_r R", left,
               o.last().spin[0].y(), 1e-9);
    const double inertia = o.simulation->header().blocks[0].mass * tip * tip / 5;
    c.relative(fmt::format("friction work, e = {} [J]", e), "I (w^2 - w'^2) / 2",
               0.5 * inertia * (turn * turn - left * left), o.last().ledger.friction_work, 1e-6);
  }
  const Outcome slow = landing(c, m, speed, 0.5, "rolling_resistance = " + number(resistance));
  c.absolute("spin after landing slowly turning [rad/s]", "the couple stops it", 0, slow.last().spin[0].y(),
             1e-9);
}

/// A faceted sphere that rolls down `slope` on a plane, on a terrain or on a fixed block.
Outcome ball(CaseRun& c, const Method& m, double slope, const std::string& ground, double resistance,
             double speed, double duration) {
  const Mat3 axes = slope_axes(slope);
  const double radius = 0.5;
  SceneText s(m, duration);
  s.history(duration / 400)
      .material("rock", 2600)
      .material("ground", 2600)
      .interface("rock", "ground", 0.8,
                 "normal_stiffness = \"hard\"\nrolling_resistance = " + number(resistance));
  if (ground == "plane") s.plane(axes.col(2));
  const Vec3 down = axes.col(0);
  if (ground == "block")
    s.box("slab", Vec3(60, 6, 1), 10 * down - 0.5 * axes.col(2),
          "fixed = true\n" + turned(rotation_vector(axes)), "ground");
  if (ground == "terrain")
    s.raw(
        fmt::format("[site]\nmaterial = \"ground\"\ncrest = {}\ndip_direction = \"90 deg\"\nwidth = "
                    "20.0\n[[site.face]]\ndip = {}\nlength = 60.0\n",
                    vector(-20 * down), number(slope)));
  s.raw(fmt::format(
      "[[block]]\nname = \"ball\"\nmaterial = \"rock\"\nshape = \"sphere\"\ndiameter = 1.0\nlongitudes = "
      "16\nlatitudes = 9\nposition = {}\nvelocity = {}\nspin = [0.0, {}, 0.0]\n",
      vector(radius * axes.col(2)), vector(speed * down), number(speed / radius)));
  return c.run(s.str());
}

void rolling_ball(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  const double slope = std::atan(0.15);
  for (const std::string ground : {"plane", "terrain", "block"}) {
    c.reset();
    // It hops from facet to facet; its normal impulses sum up to the weight's.
    const double resistance = 0.1;
    const Outcome o = ball(c, m, slope, ground, resistance, 4, 2);
    double turned = 0;
    for (std::size_t i = 1; i < o.rows.size(); ++i)
      turned += 0.5 * (o.rows[i].spin.back().norm() + o.rows[i - 1].spin.back().norm()) *
                (o.rows[i].time - o.rows[i - 1].time);
    const double mass = o.simulation->header().blocks.back().mass,
                 radius = std::cbrt(0.75 * mass / 2600 / pi);
    c.relative("friction work on a " + ground + " [J]", "mu_r R m g cos a times the angle turned",
               resistance * radius * mass * 9.81 * std::cos(slope) * turned, o.last().ledger.friction_work,
               0.05);
    c.reset();
    const Outcome stopped =
        ball(c, m, slope, ground, 0.3, 2, 4);  // on the flat of a facet, whose half width helps
    c.absolute("speed left on a " + ground + " where tan a < mu_r [m/s]", "it stops", 0,
               stopped.last().velocity.back().norm(), 1e-6);
  }
}

}  // namespace

std::vector<Case> law_cases() {
  return {
      {"dda", "A27", "Hertz contact on a half-space", "Hertz 1882", true, hertz},
      {"dda", "A28", "Contact that crushes", "energy", true, crushing},
      {"dda", "A29", "Contact force by table", "energy", true, table},
      {"dda", "A30", "Rolling resistance on a slope", "statics", true, rolling},
      {"dda", "A31", "Rolling resistance in an impact", "impulse", true, rolling_impact},
      {"dda", "A32", "Rolling resistance of a body that hops", "energy", true, rolling_ball},
  };
}

}  // namespace talus::verify
