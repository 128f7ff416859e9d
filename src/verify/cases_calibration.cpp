// G8: the error that `accuracy` asks for is the error that is had, by scenes with a closed form, alone and
// beside copies.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "contact/tolerances.hpp"
#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// A scene that can be set up any number of times, `pitch` apart: 2 cm lie between copies, which never meet.
struct Copied {
  std::string id, title, source;
  double duration = 1;                          // [s]
  double size = 1;                              // that the accuracy is relative to [m]
  Vec3 pitch;                                   // [m]
  int judged = 0;                               // which of the blocks of a copy
  std::function<void(SceneText&)> common = {};  // materials, planes
  std::function<int(SceneText&, const Vec3& at, const std::string& name)> copy =
      {};                    // the blocks of one copy, of which there are so many
  Vec3 goes = Vec3::Zero();  // displacement of the judged block by the closed form [m]
};

/// Integrates x'' = f(x, x') by Runge's and Kutta's rule.
template <class Rate>
void integrate(double& x, double& v, double duration, Rate&& f) {
  constexpr int steps = 20000;
  const double h = duration / steps;
  for (int i = 0; i < steps; ++i) {
    const double a1 = f(x, v), v2 = v + h / 2 * a1, a2 = f(x + h / 2 * v, v2), v3 = v + h / 2 * a2,
                 a3 = f(x + h / 2 * v2, v3), v4 = v + h * a3, a4 = f(x + h * v3, v4);
    x += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
}

const auto unit = [](SceneText& s, const std::string& name, const Vec3& at, const std::string& more = {}) {
  s.box(name, Vec3::Ones(), at, more);
};

/// Down a slope of 20 degrees and across it from 3 m/s, mu 0.3: the direction of friction turns.
Copied turning_slide() {
  const double a = 20 * deg, mu = 0.3;
  const Mat3 axes = slope_axes(a);
  Copied c{.id = "slide",
           .title = "slides down and across a slope",
           .source = "Coulomb; integrated",
           .pitch = 1.02 * axes.col(0)};
  c.common = [=](SceneText& s) {
    s.material("rock", 2600)
        .interface("rock", "ground", mu)
        .interface("rock", "rock", 0.6)
        .plane(axes.col(2));
  };
  c.copy = [=](SceneText& s, const Vec3& at, const std::string& name) {
    unit(s, name, at + 0.5 * axes.col(2), turned(Vec3(0, a, 0)) + velocity(Vec3(0, 3, 0)));
    return 1;
  };
  Eigen::Vector2d v(0, 3), x(0, 0);
  constexpr int steps = 100000;
  const double h = c.duration / steps;
  const auto rate = [&](const Eigen::Vector2d& u) {
    return Eigen::Vector2d(Eigen::Vector2d(g * std::sin(a), 0) - mu * g * std::cos(a) * u.normalized());
  };
  for (int k = 0; k < steps; ++k) {
    const Eigen::Vector2d middle = v + 0.5 * h * rate(v);
    x += h * middle;
    v += h * rate(middle);
  }
  c.goes = axes.col(0) * x[0] + axes.col(1) * x[1];
  return c;
}

Copied stop() {
  const double mu = 0.3, v = 3;
  Copied c{.id = "stop",
           .title = "slides to a stop",
           .source = "Coulomb; closed form",
           .duration = 2,
           .pitch = Vec3(0, 1.02, 0)};
  c.common = [=](SceneText& s) {
    s.material("rock", 2600)
        .interface("rock", "ground", mu)
        .interface("rock", "rock", 0.6)
        .plane(Vec3::UnitZ());
  };
  c.copy = [=](SceneText& s, const Vec3& at, const std::string& name) {
    unit(s, name, at + Vec3(0, 0, 0.5), velocity(Vec3(v, 0, 0)));
    return 1;
  };
  c.goes = Vec3(v * v / (2 * mu * g), 0, 0);
  return c;
}

/// One slab on another on a smooth floor: friction mu between them until they go together.
Copied rider() {
  const double mu = 0.4, v = 2, high = 0.2, below = 4, above = 1;  // volumes [m^2 times `high`]
  Copied c{.id = "rider",
           .title = "slides on a block that it takes along",
           .source = "Coulomb and momentum; closed form",
           .pitch = Vec3(0, 1.02, 0),
           .judged = 1};
  c.common = [=](SceneText& s) {
    s.material("rock", 2600)
        .interface("rock", "ground", 0)
        .interface("rock", "rock", mu)
        .plane(Vec3::UnitZ());
  };
  c.copy = [=](SceneText& s, const Vec3& at, const std::string& name) {
    s.box(name, Vec3(4, 1, high), at + Vec3(0, 0, 0.5 * high));
    s.box(name + "r", Vec3(1, 1, high), at + Vec3(-0.5, 0, 1.5 * high), velocity(Vec3(v, 0, 0)));
    return 2;
  };
  const double until = v / (mu * g * (1 + above / below)), together = v - mu * g * until;
  c.goes = Vec3(v * until - 0.5 * mu * g * until * until + together * (c.duration - until), 0, 0);
  return c;
}

Copied bounce() {
  const double e = 0.8, h = 0.5, t0 = std::sqrt(2 * h / g);
  Copied c{.id = "bounce",
           .title = "bounces thrice, e = 0.8",
           .source = "Newton; closed form",
           .pitch = Vec3(0, 1.02, 0)};
  c.duration = t0 * (1 + 2 * (e + e * e) + e * e * e);  // to the top of the third flight
  c.common = [=](SceneText& s) {
    s.material("rock", 2600)
        .interface("rock", "ground", 0.4, fmt::format("normal_stiffness = \"hard\"\nrestitution = {}", e))
        .interface("rock", "rock", 0.4)
        .plane(Vec3::UnitZ());
  };
  c.copy = [=](SceneText& s, const Vec3& at, const std::string& name) {
    unit(s, name, at + Vec3(0, 0, 0.5 + h));
    return 1;
  };
  c.goes = Vec3(0, 0, h * (std::pow(e, 6) - 1));
  return c;
}

/// A block of 1 x 4 falls back about its edge from half of its critical angle, passes upright with the impact
/// of Housner, and rises about its other edge.
Copied rocking_scene() {
  const double alpha = std::atan(0.25), arm = 0.5 * std::sqrt(17.0), rate = 0.75 * g / arm;
  Copied c{.id = "rocking",
           .title = "rocks from edge to edge",
           .source = "Housner 1963; integrated",
           .pitch = Vec3(0, 1.02, 0)};
  c.common = [=](SceneText& s) {
    s.material("rock", 2600)
        .interface("rock", "ground", 10)
        .interface("rock", "rock", 0.5)
        .plane(Vec3::UnitZ());
  };
  const Mat3 turn = Eigen::AngleAxisd(-0.5 * alpha, Vec3::UnitY())
                        .toRotationMatrix();  // +x side up, about the edge at x = 0
  const Vec3 start = turn * Vec3(0.5, 0, 2);
  c.copy = [=](SceneText& s, const Vec3& at, const std::string& name) {
    s.box(name, Vec3(1, 1, 4), at + start, turned(Vec3(0, -0.5 * alpha, 0)));
    return 1;
  };
  const double upright = 0.69834320390792, before = 0.39954702463988, after = before * (1 - 1.5 / 17);
  double x = 0, v = after;
  integrate(x, v, c.duration - upright, [&](double y, double) { return -rate * std::sin(alpha - y); });
  // Leans by x about the edge at x = 1.
  c.goes = Vec3(1, 0, 0) + Eigen::AngleAxisd(x, Vec3::UnitY()).toRotationMatrix() * Vec3(-0.5, 0, 2) - start;
  return c;
}

Copied wedge_scene() {
  const WedgeScene w;
  const double phi = 20 * deg;
  Copied c{
      .id = "wedge", .title = "slides in a groove", .source = "limit equilibrium", .pitch = 2.02 * w.line};
  const Vec3 down = -Vec3::UnitZ(), across = down - w.line * w.line.dot(down);
  Eigen::Matrix<double, 3, 2> normals;
  normals << w.normal_a, w.normal_b;
  const Eigen::Vector2d pressed = -(normals.transpose() * normals).inverse() * (normals.transpose() * across);
  c.goes = 0.5 * g * (w.line.dot(down) - std::tan(phi) * pressed.sum()) * w.line;
  c.common = [=](SceneText& s) {
    s.material("rock", 2600)
        .interface("rock", "ground", std::tan(phi))
        .interface("rock", "rock", 0.5)
        .plane(w.normal_a)
        .plane(w.normal_b);
  };
  c.copy = [=](SceneText& s, const Vec3& at, const std::string& name) {
    std::vector<Vec3> corners = w.corners();
    for (Vec3& x : corners) x += at;
    s.hull(name, corners, 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]));
    return 1;
  };
  return c;
}

Copied edge_of_a_table() {
  Copied c{.id = "edge",
           .title = "leaves a table and tips",
           .source = "limit of fixed steps (1e-5 s)",
           .duration = 1.2,
           .pitch = Vec3(0, 1.02, 0),
           .judged = 1};
  c.common = [](SceneText& s) { s.material("rock", 2500).interface("rock", "*", 0.3); };
  c.copy = [](SceneText& s, const Vec3& at, const std::string& name) {
    s.box(name + "t", Vec3(4, 1.02, 1), at + Vec3(-2, 0, -0.5), "fixed = true\n");
    unit(s, name, at + Vec3(-0.6, 0, 0.5), velocity(Vec3(2.2, 0, 0)));
    return 2;
  };
  c.goes = Vec3(0.9199214 + 0.6, 0, -1.3229271 - 0.5);
  return c;
}

/// Hung up by two points, let go 30 degrees from rest; after 3/4 of its period it passes below the hinge at
/// its fastest.
Copied pendulum_scene() {
  const double from = 30 * deg,
               period = 4 * std::sqrt(5.0 / 12 / (0.5 * g)) * std::comp_ellint_1(std::sin(from / 2));
  Copied c{.id = "pendulum",
           .title = "pendulum on fixed points",
           .source = "elliptic integral",
           .duration = 0.75 * period,
           .pitch = Vec3(0, 1.02, 0)};
  c.common = [](SceneText& s) { s.material("rock", 2600).interface("rock", "rock", 0.5); };
  const Vec3 start = -0.5 * Vec3(std::sin(from), 0, std::cos(from));
  c.copy = [=](SceneText& s, const Vec3& at, const std::string& name) {
    const auto fixed = [&](double y) { return vector(at + Vec3(0, y, 0)); };
    unit(s, name, at + start,
         turned(Vec3(0, from, 0)) + "fixed_points = [" + fixed(-0.5) + ", " + fixed(0.5) + "]\n");
    return 1;
  };
  c.goes = Vec3(0, 0, -0.5) - start;
  return c;
}

/// A cube on a floor of springs, thrown up by what they take; `stiffness` [N/m] of its face of 1 m^2.
Copied on_springs(const std::string& id, double stiffness) {
  const double h = 0.2, m = 2600, w = std::sqrt(stiffness / m), v = std::sqrt(2 * g * h);
  Copied c{.id = id,
           .title = fmt::format("bounces on springs of {:g} Pa/m", stiffness),
           .source = "oscillator; closed form",
           .pitch = Vec3(0, 1.02, 0)};
  const double pressed = 2 / w * (std::numbers::pi - std::atan(v * w / g)),
               flight = 2 * v / g;                                 // x'' = g - w^2 x from x = 0 to x = 0
  c.duration = v / g + pressed + flight + pressed + 0.7 * flight;  // falling in its third flight
  const double t = 0.7 * flight;
  c.goes = Vec3(0, 0, v * t - 0.5 * g * t * t - h);
  c.common = [=](SceneText& s) {
    s.material("rock", m)
        .interface("rock", "ground", 0.4, fmt::format("normal_stiffness = \"{} Pa/m\"", number(stiffness)))
        .interface("rock", "rock", 0.4)
        .plane(Vec3::UnitZ());
  };
  c.copy = [=](SceneText& s, const Vec3& at, const std::string& name) {
    unit(s, name, at + Vec3(0, 0, 0.5 + h));
    return 1;
  };
  return c;
}

/// Error of the worst of n copies over the size that the accuracy is relative to; NaN if the run fails.
double worst_off(CaseRun& c, const Copied& scene, int n, const Method& method, Outcome& o) {
  SceneText s(method, scene.duration);
  scene.common(s);
  std::vector<std::size_t> judged;
  std::size_t blocks = 0;
  for (int k = 0; k < n; ++k) {
    const int of_copy = scene.copy(s, k * scene.pitch, fmt::format("B{}", k));
    judged.push_back(blocks + static_cast<std::size_t>(scene.judged));
    blocks += static_cast<std::size_t>(of_copy);
  }
  o = c.run(s.str());
  if (!o.ok()) return std::numeric_limits<double>::quiet_NaN();
  double off = 0;
  for (const std::size_t b : judged)
    off = std::max(off, (o.last().position[b] - o.rows.front().position[b] - scene.goes).norm());
  return off / scene.size;
}

void calibrate(CaseRun& c, const Copied& scene) {
  const std::vector<int> copies = c.quick() ? std::vector{1, 13} : std::vector{1, 13, 130};
  const std::vector<double> accuracies =
      c.quick() ? std::vector{1e-1, 1e-2, 1e-3, 1e-5} : std::vector{1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
  for (const int n : copies)
    for (const double a : accuracies) {
      const Method m = Method::by_accuracy(a);
      c.method(m);
      Outcome o;
      const double off = worst_off(c, scene, n, m, o);
      c.absolute(fmt::format("{} [of its size], {} cop{}", scene.title, n, n == 1 ? "y" : "ies"),
                 scene.source, 0, off, a);
      c.point(n == 1 ? "1 copy" : fmt::format("{} copies", n), a, off, o);
    }
}

std::vector<Copied> calibrated_scenes() {
  return {turning_slide(),
          stop(),
          rider(),
          bounce(),
          rocking_scene(),
          wedge_scene(),
          edge_of_a_table(),
          pendulum_scene(),
          on_springs("springs", 1e8),
          on_springs("soft", 1e6)};
}

/// No tolerance decides what a result is: with each of them a tenth and ten times as large the closed forms
/// are met to the accuracy all the same.
void vary_tolerances(CaseRun& c) {
  const double accuracy = 1e-3;
  const Method m = Method::by_accuracy(accuracy);
  const std::vector<Copied> scenes = calibrated_scenes();
  for (const contact::ToleranceInfo& tolerance : contact::list_of_tolerances())
    for (const double factor : {0.1, 10.0}) {
      c.method(m);
      contact::Tolerances others = contact::tolerances();
      others.*tolerance.value *= factor;
      const contact::OtherTolerances varied(others);
      double worst = 0;
      std::string where;
      for (const Copied& scene : scenes)
        for (const int n : c.quick() ? std::vector{1} : std::vector{1, 13}) {
          Outcome o;
          const double off = worst_off(c, scene, n, m, o);
          if (off <= worst || std::isnan(worst)) continue;
          worst = off;
          where = fmt::format("{}, {}", scene.id, n);
        }
      c.absolute(fmt::format("{} times {} (worst: {}) [of its size]", tolerance.name, factor, where),
                 "closed forms of G8", 0, worst, accuracy);
    }
}

}  // namespace

std::vector<Case> calibration_cases() {
  std::vector<Case> cases;
  for (const Copied& scene : calibrated_scenes())
    cases.push_back({"invariants", "G8-" + scene.id, scene.title, scene.source, true,
                     [scene](CaseRun& c) { calibrate(c, scene); }});
  cases.push_back({"invariants", "G13-tolerances", "each tolerance a tenth and ten times as large",
                   "closed forms of G8", true, vary_tolerances});
  return cases;
}

}  // namespace talus::verify
