// G1 to G7, G9 to G12, G14: what holds for any number of blocks and at any output interval.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "geometry/random.hpp"
#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double accuracy = 1e-3, size = 1;

std::vector<int> numbers(const CaseRun& c) {
  return c.quick() ? std::vector{1, 13, 40} : std::vector{1, 12, 13, 40, 130, 300};
}

/// Place of block k of a square field whose blocks are `pitch` apart.
Vec3 place(int k, int n, double pitch, double height) {
  const int side = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(n))));
  return {pitch * (k % side), pitch * (k / side), height};
}

/// Largest distance of a block's final value from `expected`.
template <class Value>
double farthest_off(const Outcome& o, double expected, Value&& value) {
  double off = 0;
  for (std::size_t b = 0; b < o.last().position.size(); ++b)
    off = std::max(off, std::abs(value(b) - expected));
  return off;
}

/// Cubes with gaps of 2 cm between them fall by 0.3 m: each rises to e^2 h, whatever falls beside it.
void drop(CaseRun& c) {
  const double h = 0.3;
  c.method(Method::by_accuracy(accuracy));
  for (const double e : {0.0, 0.5, 0.8, 1.0})
    for (const int n : numbers(c)) {
      c.reset();
      const double apex = std::sqrt(2 * h / g) * (1 + e);
      SceneText s(Method::by_accuracy(accuracy), apex);
      const std::string law = fmt::format("normal_stiffness = \"hard\"\nrestitution = {}", e);
      s.material("rock", 2600)
          .interface("rock", "ground", 0.4, law)
          .interface("rock", "rock", 0.4, law)
          .plane(Vec3::UnitZ());
      for (int k = 0; k < n; ++k)
        s.box(fmt::format("B{}", k), Vec3::Ones() * size, place(k, n, 1.02 * size, 0.5 * size + h));
      const Outcome o = c.run(s.str());
      const double off =
          farthest_off(o, e * e * h, [&](std::size_t b) { return o.last().position[b].z() - 0.5 * size; });
      c.absolute(fmt::format("height off after the bounce, e = {}, {} cubes", e, n), "e^2 h", 0, off,
                 accuracy * size);
    }
}

/// A cube strikes the first of a row on a smooth floor, 1 mm apart: with e = 1 each hands its motion on to
/// the next one and stands, and the last one goes on with the speed of the first, through the gaps in the
/// time of the first.
void blow_runs_on(CaseRun& c) {
  const double v = 5, gap = 1e-3;
  c.method(Method::by_accuracy(accuracy));
  for (const int n : numbers(c)) {
    c.reset();
    SceneText s(Method::by_accuracy(accuracy), 0.2);
    const std::string law = "normal_stiffness = \"hard\"\nrestitution = 1.0";
    s.material("rock", 2600)
        .interface("rock", "ground", 0.0, law)
        .interface("rock", "rock", 0.0, law)
        .plane(Vec3::UnitZ());
    for (int k = 0; k <= n; ++k)
      s.box(fmt::format("B{}", k), Vec3::Ones() * size, Vec3((size + gap) * k, 0, 0.5 * size),
            k == 0 ? velocity(Vec3(v, 0, 0)) : "");
    const Outcome o = c.run(s.str());
    double energy = 0;
    for (const Vec3& u : o.last().velocity) energy += u.squaredNorm();
    const double went = v * 0.2 - n * gap;
    c.relative(fmt::format("energy in motion, {} cubes struck", n), "that of the first", 1, energy / (v * v),
               1e-9);
    c.absolute(fmt::format("way of the last one off, {} cubes struck", n), "v t - n gaps", 0,
               o.last().position.back().x() - o.rows.front().position.back().x() - went, accuracy * size);
  }
}

/// Down a slope of 20 degrees and across it: a cube that slides with mu 0.3, starting across at 3 m/s;
/// integrated by the trapezoid in steps of 10 us.
Eigen::Vector2d slides(double duration) {
  const double a = 20 * deg, mu = 0.3;
  Eigen::Vector2d v(0, 3), x(0, 0);
  const int steps = 100000;
  const double h = duration / steps;
  const auto rate = [&](const Eigen::Vector2d& u) {
    return Eigen::Vector2d(Eigen::Vector2d(g * std::sin(a), 0) - mu * g * std::cos(a) * u.normalized());
  };
  for (int k = 0; k < steps; ++k) {
    const Eigen::Vector2d middle = v + 0.5 * h * rate(v);
    x += h * middle;
    v += h * rate(middle);
  }
  return x;
}

void slide(CaseRun& c) {
  const double a = 20 * deg, duration = 1;
  const Mat3 axes = slope_axes(a);
  const Eigen::Vector2d expected = slides(duration);
  c.method(Method::by_accuracy(accuracy));
  for (const int n : numbers(c)) {
    c.reset();
    SceneText s(Method::by_accuracy(accuracy), duration);
    s.material("rock", 2600)
        .interface("rock", "ground", 0.3)
        .interface("rock", "rock", 0.6)
        .plane(axes.col(2));
    for (int k = 0; k < n; ++k)
      s.box(fmt::format("B{}", k), Vec3::Ones() * size, size * (k * axes.col(0) + 0.5 * axes.col(2)),
            turned(Vec3(0, a, 0)) + velocity(Vec3(0, 3, 0)));
    const Outcome o = c.run(s.str());
    const auto went = [&](std::size_t b) {
      return Vec3(axes.transpose() * (o.last().position[b] - o.rows.front().position[b]));
    };
    const double off =
        farthest_off(o, 0, [&](std::size_t b) { return (went(b).head<2>() - expected).norm(); });
    c.absolute(fmt::format("path off in 1 s, {} cubes in a row", n), "integrated Coulomb friction", 0, off,
               accuracy * size);
  }
}

/// A block slides from mu 0.2 onto mu 0.6. While it stands on both the pressure of its front is between
/// uniform and that of its corners alone.
void friction_that_changes(CaseRun& c) {
  const double v = 12, from = 5, to = 10, half = 0.1, high = 0.05, mu1 = 0.2, mu2 = 0.6;
  // Corners alone: N_f + N_r = W, (N_f - N_r) half = F high, F = mu1 N_r + mu2 N_f.
  const double mean = 0.5 * (mu1 + mu2), lean = 0.5 * (mu2 - mu1) * high / half, corners = mean / (1 - lean);
  const auto stops = [&](double mu) {
    return to + half + (v * v - 2 * g * (mu1 * (to - half - from) + 2 * half * mu)) / (2 * g * mu2);
  };
  c.method(Method::by_accuracy(accuracy));
  double first = 0;
  for (const double interval : {1e-3, 1e-2, 0.1, 1.0}) {
    if (c.quick() && interval < 1e-2) continue;
    c.reset();
    SceneText s(Method::by_accuracy(accuracy), 4);
    s.history(interval).material("rock", 2600).material("smooth", 2600).material("rough", 2600);
    s.interface("rock", "smooth", mu1).interface("rock", "rough", mu2).interface("smooth", "rough", 0.5);
    s.box("B", Vec3(0.2, 0.2, 0.1), Vec3(from, 0.3, 0.05), velocity(Vec3(v, 0, 0)));
    s.box("f1", Vec3(20, 4, 1), Vec3(0, 0, -0.5), "fixed = true\n", "smooth")
        .box("f2", Vec3(20, 4, 1), Vec3(20, 0, -0.5), "fixed = true\n", "rough");
    const Outcome o = c.run(s.str());
    const double at = o.last().position[0].x(), low = stops(corners), most = stops(mean);
    c.absolute(fmt::format("stop outside of {:.3f} to {:.3f} m, rows each {} s", low, most, interval),
               "friction on both sides", 0, std::max({0.0, low - at, at - most}), accuracy * 0.2);
    if (first == 0) first = at;
    c.holds(fmt::format("the same bits with rows each {} s", interval), "output does not change the motion",
            at == first);
  }
}

/// Cubes that touch, in free space, each with a velocity and a spin of its own.
void free_cluster(CaseRun& c) {
  c.method(Method::by_accuracy(accuracy));
  for (const int n : numbers(c)) {
    c.reset();
    SceneText s(Method::by_accuracy(accuracy), 0.2, Vec3::Zero());
    s.material("rock", 2600).interface("rock", "rock", 0.4, "normal_stiffness = \"hard\"\nrestitution = 0.5");
    geometry::Random random(static_cast<std::uint64_t>(n));
    const auto any = [&] {
      return Vec3(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5);
    };
    for (int k = 0; k < n; ++k)
      s.box(fmt::format("B{}", k), Vec3::Ones() * size, place(k, n, size, 0), velocity(any()) + spin(any()));
    const Outcome o = c.run(s.str());
    double linear = 0, angular = 0, of_linear = 0, of_angular = 0;
    const sim::LedgerRow& start = o.rows.front().ledger;
    for (const Vec3& v : o.rows.front().velocity) of_linear += 2600 * v.norm();
    for (std::size_t b = 0; b < o.rows.front().position.size(); ++b)
      of_angular += 2600 * o.rows.front().velocity[b].norm() * (1 + o.rows.front().position[b].norm());
    const sim::LedgerRow& end =
        o.last().ledger;  // at the end of a step: rows within one are as exact as the accuracy
    linear = (end.linear_momentum - start.linear_momentum).norm() / of_linear;
    angular = (end.angular_momentum - start.angular_momentum).norm() / of_angular;
    c.absolute(fmt::format("linear momentum lost, {} cubes", n), "kept", 0, linear, 1e-12);
    c.absolute(fmt::format("angular momentum lost, {} cubes", n), "kept", 0, angular, 1e-12);
  }
}

/// Pairs of cubes, one on the other, side by side on a floor without friction: they keep their speed.
void smooth_floor(CaseRun& c) {
  c.method(Method::by_accuracy(accuracy));
  for (const int n : c.quick() ? std::vector{2, 26} : std::vector{2, 14, 40, 130})
    for (const double speed : {1e-3, 1.0}) {
      c.reset();
      SceneText s(Method::by_accuracy(accuracy), 0.5);
      s.material("rock", 2600)
          .interface("rock", "ground", 0)
          .interface("rock", "rock", 0.5)
          .plane(Vec3::UnitZ());
      for (int k = 0; k < n; ++k)
        s.box(fmt::format("B{}", k), Vec3::Ones() * size,
              place(k / 2, (n + 1) / 2, size, 0.5 * size + (k % 2) * size), velocity(Vec3(speed, 0, 0)));
      const Outcome o = c.run(s.str());
      const double off = farthest_off(o, speed, [&](std::size_t b) { return o.last().velocity[b].x(); });
      c.absolute(fmt::format("part of {:g} m/s lost, {} cubes", speed, n), "kept", 0, off / speed, 1e-6);
    }
}

/// Cubes from 24 heights fall on a floor with e = 1: their energy is never above that of the start.
void elastic_heap(CaseRun& c) {
  c.method(Method::by_accuracy(accuracy));
  for (const double interval : {0.01, 0.1}) {
    c.reset();
    SceneText s(Method::by_accuracy(accuracy), 1);
    const std::string law = "normal_stiffness = \"hard\"\nrestitution = 1";
    s.history(interval)
        .material("rock", 2600)
        .interface("rock", "ground", 0.3, law)
        .interface("rock", "rock", 0.3, law)
        .plane(Vec3::UnitZ());
    geometry::Random random(24);
    for (int k = 0; k < 24; ++k)
      s.box(fmt::format("B{}", k), Vec3::Ones() * size, place(k, 24, 1.1 * size, 0.6 + random.uniform()));
    const Outcome o = c.run(s.str());
    double above = 0, released = 0;
    const auto energy = [](const sim::LedgerRow& l) { return l.kinetic + l.potential; };
    for (const sim::HistoryRow& r : o.rows) {
      above = std::max(above, energy(r.ledger) - energy(o.rows.front().ledger));
      released = std::max(released, r.ledger.kinetic);
    }
    c.absolute(fmt::format("energy above the start over energy in motion, rows each {} s", interval), "none",
               0, above / released, accuracy);
    c.absolute(fmt::format("numerical energy gain of steps over energy in motion, rows each {} s", interval),
               "none", 0, o.result.counters.gained / released, accuracy);
  }
}

/// An octahedron spins on a vertex, where friction has no lever: drilling resistance alone brakes it, w(t) =
/// w_0 - mu_d R m g t / J.
void drilling(CaseRun& c) {
  const double w0 = 2, mu = 0.05, duration = 0.2;
  const Method m = Method::by_accuracy(accuracy);
  c.method(m);
  const double r = 0.5;
  std::vector<Vec3> corners;
  for (int k = 0; k < 3; ++k)
    for (const double sign : {1.0, -1.0}) corners.push_back(Vec3(sign * r * Vec3::Unit(k) + Vec3(0, 0, r)));
  SceneText s(m, duration);
  s.material("rock", 2600)
      .interface("rock", "ground", 0.5,
                 fmt::format("normal_stiffness = \"hard\"\ndrilling_resistance = {}", mu))
      .plane(Vec3::UnitZ());
  s.hull("B", corners, Vec3(0, 0, r), spin(Vec3(0, 0, w0)));
  const Outcome o = c.run(s.str());
  const double volume = 4.0 / 3 * r * r * r, radius = std::cbrt(0.75 * volume / std::numbers::pi),
               inertia_over_mass = r * r / 5;
  c.absolute("spin after 0.2 s [rad/s]", "w_0 - mu_d R g t / (J / m)",
             w0 - mu * radius * g * duration / inertia_over_mass, o.last().spin[0].z(), 1e-6 * w0);
}

/// Boxes that fall, turn and bounce, as a scene in any frame: turned by `turn`, shifted by `shift`, mirrored
/// in y.
Outcome tumble(CaseRun& c, int n, const Mat3& turn, const Vec3& shift, bool mirrored) {
  const Vec3 size_of(0.6, 0.8, 1);
  const auto polar = [&](const Vec3& x) { return Vec3(turn * (mirrored ? Vec3(x.x(), -x.y(), x.z()) : x)); };
  const auto axial = [&](const Vec3& w) { return Vec3(turn * (mirrored ? Vec3(-w.x(), w.y(), -w.z()) : w)); };
  SceneText s(Method::by_accuracy(accuracy), 0.6, polar(Vec3(0, 0, -g)));
  s.material("rock", 2600)
      .interface("rock", "ground", 0.4, "normal_stiffness = \"hard\"\nrestitution = 0.5")
      .interface("rock", "rock", 0.4);
  s.plane(polar(Vec3::UnitZ()), shift);
  for (int k = 0; k < n; ++k) {
    const Vec3 lean(0.3, 0.2, 0.1);
    const Mat3 axes =
        Eigen::AngleAxisd(lean.norm(), (mirrored ? Vec3(-lean.x(), lean.y(), -lean.z()) : lean).normalized())
            .toRotationMatrix();
    s.box(fmt::format("B{}", k), size_of, polar(place(k, n, 1.5, 1)) + shift,
          turned(rotation_vector(turn * axes)) + velocity(polar(Vec3(1, 0.5, 0))) +
              spin(axial(Vec3(0.5, 1, 0.2))));
  }
  return c.run(s.str());
}

void frames(CaseRun& c) {
  c.method(Method::by_accuracy(accuracy));
  const Mat3 turn = Eigen::AngleAxisd(1, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Vec3 far(1e6, -1e6, 1e3);
  for (const int n : numbers(c)) {
    if (n > 130) continue;
    c.reset();
    const Outcome base = tumble(c, n, Mat3::Identity(), Vec3::Zero(), false);
    const auto off = [&](const Outcome& o, auto&& back) {
      double most = 0;
      for (std::size_t b = 0; b < base.last().position.size(); ++b)
        most = std::max(most, (back(o.last().position[b]) - base.last().position[b]).norm());
      return most;
    };
    const Outcome whirled = tumble(c, n, turn, Vec3::Zero(), false),
                  shifted = tumble(c, n, Mat3::Identity(), far, false),
                  mirrored = tumble(c, n, Mat3::Identity(), Vec3::Zero(), true);
    c.absolute(fmt::format("turned scene off [m], {} boxes", n), "frame", 0,
               off(whirled, [&](const Vec3& x) { return Vec3(turn.transpose() * x); }), 1e-9);
    c.absolute(fmt::format("mirrored scene off [m], {} boxes", n), "frame", 0,
               off(mirrored, [](const Vec3& x) { return Vec3(x.x(), -x.y(), x.z()); }), 1e-9);
    c.absolute(fmt::format("scene shifted by 1.4e6 m off [m], {} boxes", n), "frame", 0,
               off(shifted, [&](const Vec3& x) { return Vec3(x - far); }), 1e-6);
  }
}

/// A pebble of 0.1 mm that lies in front of, on, or beside a cube that slides to a stop: it changes nothing
/// that matters.
void pebble(CaseRun& c) {
  const double mu = 0.3, v = 3, grain = 1e-4, goes = v * v / (2 * mu * g);
  c.method(Method::by_accuracy(accuracy));
  for (const auto& [where, at] : {std::pair("beside", Vec3(0.5, 0.51, 0.5 * grain)),
                                  std::pair("on top", Vec3(0.1, 0.2, 1 + 0.5 * grain)),
                                  std::pair("far away", Vec3(-50, 20, 0.5 * grain))}) {
    c.reset();
    SceneText s(Method::by_accuracy(accuracy), 2);
    s.material("rock", 2600)
        .interface("rock", "ground", mu)
        .interface("rock", "rock", 0.6)
        .plane(Vec3::UnitZ());
    s.box("B", Vec3::Ones() * size, Vec3(0, 0, 0.5), velocity(Vec3(v, 0, 0)));
    s.box("pebble", Vec3::Ones() * grain, at,
          std::string(where) == "on top" ? velocity(Vec3(v, 0, 0)) : std::string());
    const Outcome o = c.run(s.str());
    c.absolute(fmt::format("path off [m], a pebble {}", where), "closed form", goes,
               o.ok() ? o.last().position[0].x() : NAN, accuracy * size);
  }
}

/// Cubes in a row on a slope by 0.005 degrees too steep, and too flat.
void almost_too_steep(CaseRun& c) {
  const double limit = 20 * deg, mu = std::tan(limit);
  c.method(Method::by_accuracy(accuracy));
  for (const double over : {0.005 * deg, -0.005 * deg})
    for (const int n : numbers(c)) {
      c.reset();
      const Mat3 axes = slope_axes(limit + over);
      SceneText s(Method::by_accuracy(accuracy), 1);
      s.material("rock", 2600)
          .interface("rock", "ground", mu)
          .interface("rock", "rock", 0.6)
          .plane(axes.col(2));
      for (int k = 0; k < n; ++k)
        s.box(fmt::format("B{}", k), Vec3::Ones() * size, size * (k * axes.col(0) + 0.5 * axes.col(2)),
              turned(Vec3(0, limit + over, 0)));
      const Outcome o = c.run(s.str());
      const double expected = over > 0 ? 0.5 * g * (std::sin(limit + over) - mu * std::cos(limit + over)) : 0;
      double least = INFINITY, most = -INFINITY;
      for (std::size_t b = 0; b < o.last().position.size(); ++b) {
        const double way = axes.col(0).dot(o.last().position[b] - o.rows.front().position[b]);
        least = std::min(least, way), most = std::max(most, way);
      }
      const double worst = std::abs(most - expected) > std::abs(least - expected) ? most : least;
      if (over > 0)
        c.relative(fmt::format("path in 1 s [m], 0.005 deg too steep, {} cubes", n), "closed form", expected,
                   worst, 1e-2);
      else
        c.absolute(fmt::format("path in 1 s [m], 0.005 deg too flat, {} cubes", n), "stands", 0, worst, 1e-9);
    }
}

/// A soft cube that comes down at 10 m/s flattens into a plate 1 mm beside it: the speed it gives the plate,
/// against fixed steps of 1e-5 s.
void soft_beside_plate(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-6);
  c.method(m);
  for (const double interval : {0.1, 0.3}) {
    c.reset();
    SceneText s(m, 0.3);
    s.history(interval)
        .material("soft", 1000, "young = 1e6\npoisson = 0.45")
        .material("rock", 2500)
        .interface("*", "*", 0, "normal_stiffness = \"hard\"\nrestitution = 0")
        .plane(Vec3::UnitZ(), Vec3::Zero(), "rock");
    s.box("soft", Vec3::Ones(), Vec3(0, 0, 0.501), velocity(Vec3(0, 0, -10)) + "deformable = true\n", "soft")
        .box("plate", Vec3(0.02, 1, 1), Vec3(0.511, 0, 0.5));
    const Outcome o = c.run(s.str());
    c.relative(fmt::format("speed of the plate [m/s], rows each {} s", interval), "limit of fixed steps",
               0.04649, o.last().velocity[1].x(), 0.05);
  }
}

}  // namespace

std::vector<Case> invariant_cases() {
  const std::string coulomb = "closed form", suite = "invariants";
  return {{suite, "G1", "cubes dropped side by side", coulomb, true, drop},
          {suite, "G2", "cubes in a row slide down and across", coulomb, true, slide},
          {suite, "G3", "friction that changes on the way", coulomb, true, friction_that_changes},
          {suite, "G4", "momenta of a free cluster", "Newton", true, free_cluster},
          {suite, "G5", "a pile on a smooth floor keeps its speed", "Newton", true, smooth_floor},
          {suite, "G6", "an elastic pile gains no energy", "energy", true, elastic_heap},
          {suite, "G7", "drilling resistance stops a spin", coulomb, true, drilling},
          {suite, "G9", "boxes that tumble, in any frame", "Newton", true, frames},
          {suite, "G10", "a pebble of 0.1 mm anywhere", coulomb, true, pebble},
          {suite, "G11", "slopes almost too steep", coulomb, true, almost_too_steep},
          {suite, "G12", "a soft block flattens beside a plate", "fixed steps", true, soft_beside_plate},
          {suite, "G14", "a blow runs through a row", coulomb, true, blow_runs_on}};
}

}  // namespace talus::verify
