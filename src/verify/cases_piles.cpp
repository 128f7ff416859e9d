// A14 to A17, A19, A20, A22: several blocks.
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "coupling/touch/touch.hpp"
#include "sim/world.hpp"
#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

std::uint64_t block_id(int i) { return coupling::Partner{coupling::Partner::Kind::block, i}.id(); }
std::uint64_t plane_id(int i) { return coupling::Partner{coupling::Partner::Kind::plane, i}.id(); }

void bars(CaseRun& c) {
  // Each bar: n cubes of edge l and springs E/l per area, a chain with wave speed c = sqrt(E / rho).
  const int n = 40;
  const double l = 0.05, density = 2500, E = 1e9, speed = std::sqrt(E / density), v = 1,
               T = 2 * n * l / speed;
  const Method m = Method::fixed_step(0.2 * l / speed);
  c.method(m);
  SceneText s(m, 1.5 * T, Vec3::Zero());
  s.history(T / 400)
      .material("rock", density)
      .interface("rock", "rock", 0, "normal_stiffness = \"" + number(E / l) + " Pa/m\"");
  for (int i = 0; i < 2 * n; ++i)
    s.box(fmt::format("B{}", i + 1), Vec3(l, l, l), Vec3((i + 0.5) * l, 0, 0),
          velocity(Vec3(i < n ? v : 0, 0, 0)));
  const Outcome o = c.run(s.str());
  // Force between the bars: what the second bar gains in momentum.
  const auto momentum = [&](std::size_t k) {
    double p = 0;
    for (int i = n; i < 2 * n; ++i)
      p += density * l * l * l * o.rows[k].velocity[static_cast<std::size_t>(i)].x();
    return p;
  };
  const double expected = density * speed * v / 2 * l * l;
  const auto at = [&](double f) { return static_cast<std::size_t>(std::lround(f * 400)); };
  const double plateau =
      (momentum(at(0.8)) - momentum(at(0.2))) / (o.rows[at(0.8)].time - o.rows[at(0.2)].time);
  c.relative("mean force on the plateau [N]", "rho c v / 2 A", expected, plateau, 0.02);
  double start = 0, end = 0;
  for (std::size_t k = 1; k < o.rows.size(); ++k) {
    const double f = (momentum(k) - momentum(k - 1)) / (o.rows[k].time - o.rows[k - 1].time);
    if (f > 0.5 * expected) {
      if (start == 0) start = o.rows[k - 1].time;
      end = o.rows[k].time;
    }
  }
  CaseResult& r = c.relative("time above half the plateau [s]", "2 L / c", T, end - start, 0.02);
  r.note = "80 blocks";
}

void stack(CaseRun& c) {
  const int n = c.quick() ? 10 : 30;
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  SceneText s(m, 0.1);
  s.material("rock", 2600)
      .interface("rock", "ground", 0.5)
      .interface("rock", "rock", 0.5)
      .plane(Vec3::UnitZ());
  for (int i = 0; i < n; ++i) s.box(fmt::format("B{}", i + 1), Vec3(1, 1, 1), Vec3(0, 0, 0.5 + i));
  const Outcome o = c.run(s.str());
  double worst = 0;
  for (int k = 0; k < n; ++k) {
    const double f = o.force_on(k, k == 0 ? plane_id(0) : block_id(k - 1)).z();
    worst = std::max(worst, std::abs(f / ((n - k) * 2600 * g) - 1));
  }
  c.absolute(fmt::format("worst contact force of {}, relative", n), "(N - k + 1) m g", 0, worst, 1e-8);
}

/// True if it stands: nothing gathers speed.
bool arch_stands(CaseRun& c, const Method& m, int n, double t, double mu) {
  const Outcome o = c.run(arch_text(m, n, t, mu, 0.02));
  double speed = 0;
  for (const Vec3& v : o.last().velocity) speed = std::max(speed, v.norm());
  return o.ok() && speed < 2e-6;
}

void arch(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  for (const auto& [n, expected] :
       {std::pair(7, .0957035), std::pair(25, .1069588), std::pair(101, .1074465)}) {
    if (c.quick() && n > 7) continue;
    c.reset();
    double low = 0.98 * expected, high = 1.02 * expected;
    const bool bracket = !arch_stands(c, m, n, low, 0.7) && arch_stands(c, m, n, high, 0.7);
    while (bracket && high - low > 2e-4 * expected) {
      const double t = 0.5 * (low + high);
      (arch_stands(c, m, n, t, 0.7) ? high : low) = t;
    }
    c.relative(fmt::format("least t/R, n = {}", n), "thrust line of Heyman's arch, n voussoirs", expected,
               bracket ? 0.5 * (low + high) : NAN, 1e-3);
  }
  c.reset();
  if (!c.quick())
    c.holds("n = 25, mu .3 falls at t/R .15 and .4", "slides at the springings",
            !arch_stands(c, m, 25, 0.15, 0.3) && !arch_stands(c, m, 25, 0.4, 0.3));
}

void card_tent(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  const double a = 65 * deg, L = 1, t = 0.01;
  const double expected = 1 / (2 * std::tan(a)) - t / (2 * L);
  const auto stands = [&](double mu) {
    SceneText s(m, 0.02);
    s.material("card", 900).interface("card", "ground", mu).interface("card", "card", 1).plane(Vec3::UnitZ());
    for (const int side : {-1, 1}) {
      // Left card: its long axis rises towards +x, its lower face looks down right.
      const Vec3 axis(-side * std::cos(a), 0, std::sin(a)), outward(side * std::sin(a), 0, std::cos(a));
      const Vec3 foot(side * L * std::cos(a), 0, 0);
      // The inner long edges are the feet and the tips: tips meet at x = 0.
      const Vec3 centre = foot + 0.5 * L * axis + 0.5 * t * outward;
      Mat3 r;
      r.col(0) = axis;  // turned about y alone: half a turn would lose digits in its rotation vector
      r.col(1) = Vec3::UnitY();
      r.col(2) = axis.cross(Vec3::UnitY());
      s.box(side < 0 ? "left" : "right", Vec3(L, 0.6, t), centre, turned(rotation_vector(r)), "card");
    }
    const Outcome o = c.run(s.str());
    return o.ok() && std::max(o.last().velocity[0].norm(), o.last().velocity[1].norm()) < 1e-6;
  };
  double low = 0.5 * expected, high = 2 * expected;
  const bool bracket = !stands(low) && stands(high);
  while (bracket && high - low > 2e-4 * expected) {
    const double mu = 0.5 * (low + high);
    (stands(mu) ? high : low) = mu;
  }
  c.relative("least floor mu", "1/(2 tan 65) - t/(2 L)", expected, bracket ? 0.5 * (low + high) : NAN, 1e-3);
}

void cradle(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  const int n = 5;
  SceneText s(m, 0.02, Vec3::Zero());
  s.material("steel", 7800).interface("steel", "steel", 0, "normal_stiffness = \"hard\"\nrestitution = 1.0");
  for (int i = 0; i < n; ++i)
    s.box(fmt::format("B{}", i + 1), Vec3(0.1, 0.1, 0.1), Vec3(0.101 * i, 0, 0),
          velocity(Vec3(i == 0 ? 1 : 0, 0, 0)), "steel");
  const Outcome o = c.run(s.str());
  double rest = 0;
  for (int i = 0; i + 1 < n; ++i)
    rest = std::max(rest, o.last().velocity[static_cast<std::size_t>(i)].norm());
  c.relative("velocity of the last", "that of the first", 1, o.last().velocity[n - 1].x(), 1e-10);
  c.absolute("velocity of the others", "0", 0, rest, 1e-10);
}

void turntable(CaseRun& c) {
  // A plate 3e7 times heavier turns freely on a smooth floor; the block on it turns with it.
  const Method m = Method::by_accuracy(1e-5);
  c.method(m);
  const double mu = 0.5, r = 2;
  const auto slips = [&](double w2r) {
    const double w = std::sqrt(w2r / r);
    SceneText s(m, 0.05);
    s.history(0.005)
        .material("plate", 1e6)
        .material("rock", 260)
        .interface("plate", "ground", 0)
        .interface("plate", "rock", mu)
        .interface("rock", "ground", mu)
        .plane(Vec3::UnitZ());
    s.box("table", Vec3(6, 6, 1), Vec3(0, 0, 0.5), spin(Vec3(0, 0, w)), "plate");
    s.box("B", Vec3(0.2, 0.2, 0.1), Vec3(r, 0, 1.05), velocity(Vec3(0, w * r, 0)) + spin(Vec3(0, 0, w)));
    const Outcome o = c.run(s.str());
    const sim::HistoryRow& q = o.last();
    const Vec3 d = q.position[1] - q.position[0];
    return std::abs(d.normalized().dot(q.velocity[1])) > 1e-6;
  };
  double low = 0.99 * mu * g, high = 1.01 * mu * g;
  const bool bracket = !slips(low) && slips(high);
  while (bracket && high - low > 2e-5 * mu * g) {
    const double x = 0.5 * (low + high);
    (slips(x) ? high : low) = x;
  }
  CaseResult& q = c.relative("w^2 r at slip", "mu g", mu * g, bracket ? 0.5 * (low + high) : NAN, 1e-4);
  q.note = "started at its speed; bisection over speeds in place of a slow spin-up";
}

void pressed_patch(CaseRun& c) {
  // Three deformable blocks under a heavy rigid plate on stiff springs, at rest: in each the stress of what
  // it carries, half its own weight included (a block of constant strain takes the mean). Steps far longer
  // than its periods bring the pile to rest.
  const Method m = Method::fixed_step(0.05);
  c.method(m);
  const double E = 1e8, nu = 0.25, soft = 2000, plate = 7800;
  SceneText s(m, 5, {0, 0, -9.81}, "sleeping = false\n");
  s.material("soft", soft, "young = " + number(E) + "\npoisson = " + number(nu)).material("plate", plate);
  for (const auto& [a, b] :
       {std::pair("soft", "ground"), std::pair("soft", "soft"), std::pair("soft", "plate"),
        std::pair("plate", "plate"), std::pair("plate", "ground")})
    s.interface(a, b, 0, "normal_stiffness = \"1e7 GPa/m\"");
  s.plane(Vec3::UnitZ());
  for (int i = 0; i < 3; ++i)
    s.box(fmt::format("S{}", i + 1), Vec3(1, 1, 1), Vec3(0, 0, 0.5 + i), "deformable = true\n", "soft");
  s.box("plate", Vec3(1, 1, 1), Vec3(0, 0, 3.5), {}, "plate");
  const Outcome o = c.run(s.str());
  double axial = 0, lateral = 0, shear = 0;
  for (int i = 0; i < 3; ++i) {
    const Vec6& e = o.last().strain[static_cast<std::size_t>(i)];
    const double expected = -g * (plate + (2.5 - i) * soft) / E;
    axial = std::max(axial, std::abs(e[2] / expected - 1));
    lateral =
        std::max({lateral, std::abs(e[0] / (-nu * expected) - 1), std::abs(e[1] / (-nu * expected) - 1)});
    shear = std::max(shear, e.tail<3>().norm() / std::abs(expected));
  }
  c.absolute("axial strain of three blocks, relative", "stress / E", 0, axial, 1e-10);
  c.absolute("lateral strain, relative", "nu stress / E", 0, lateral, 1e-10);
  c.absolute("shear strain over the axial", "0", 0, shear, 1e-10);
}

}  // namespace

std::vector<Case> pile_cases() {
  return {
      {"dda", "A14", "Two bars as rows of blocks", "d'Alembert; closed form", false, bars},
      {"dda", "A15", "Stack", "statics", true, stack},
      {"dda", "A16", "Semicircular arch", "limit analysis of the thrust line", true, arch},
      {"dda", "A17", "Card tent", "statics", true, card_tent},
      {"dda", "A19", "Newton's cradle", "closed form", true, cradle},
      {"dda", "A20", "Turntable", "closed form", true, turntable},
      {"dda", "A22", "Patch test of stacked blocks", "uniform stress", true, pressed_patch},
  };
}

}  // namespace talus::verify
