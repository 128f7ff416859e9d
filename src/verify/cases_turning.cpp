// A9 to A13, A18, A21: turning, rolling and bouncing bodies.
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "verify/curves.hpp"
#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

void euler_top(CaseRun& c) {
  for (const double a : {1e-3, 1e-6}) {
    const Method m = Method::by_accuracy(a);
    c.method(m);
    const Outcome o = euler_top_run(c, m, 0.5);
    CaseResult& r = c.absolute("spin at T/2 against (-.01, -1, .01)", "Jacobi's elliptic functions", 0,
                               (body_spin(o.last()) - Vec3(-.01, -1, .01)).norm(), 1e-8);
    r.note = "plate of thickness 1e-5: I = (1, 2, 3) to 1e-10";
    c.reset();
    const Outcome full = euler_top_run(c, m, 1);
    c.absolute("spin at T against (.01, 1, .01)", "period 39.10573419726872", 0,
               (body_spin(full.last()) - Vec3(.01, 1, .01)).norm(), 1e-8);
  }
}

void box_top(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  SceneText s(m, 12.9012460037936 / 2, Vec3::Zero());
  s.material("rock", 1000)
      .interface("rock", "rock", 0.5)
      .box("B", Vec3(1, 2, 3), Vec3::Zero(), spin(Vec3(.01, 5, .01)));
  const Outcome o = c.run(s.str());
  c.absolute("spin at T/2 against (.01, -5, -.01)", "Jacobi's elliptic functions, T = 12.9012460037936", 0,
             (body_spin(o.last()) - Vec3(.01, -5, -.01)).norm(), 1e-8);
}

void rocking(CaseRun& c) {
  double last = 0;
  RockingMeasure r;
  for (const double h : {4e-4, 2e-4, 1e-4}) {
    const Method m = Method::fixed_step(h);
    c.method(m);
    r = rocking_run(c, m);
    CaseResult& q = c.relative("time to upright [s]", "elliptic integral", 0.69834320390792, r.time,
                               h < 3e-4 ? 1e-7 : 1e-6);
    if (last > 0) q.order = std::log2(last / q.error);
    last = q.error;
  }
  c.relative("spin before [rad/s]", "energy", 0.39954702463988, r.before, 1e-7);
  c.relative("w+/w-", "angular momentum about the new edge", 0.911764705882, r.after / r.before, 1e-7);
}

void rolling_prism(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  for (const auto& [n, ratio] : {std::pair(4, 0.25), std::pair(6, 0.647058823529412),
                                 std::pair(8, 0.798169546206), std::pair(12, 0.909333941571)}) {
    c.reset();
    double inradius = 0;
    const std::vector<Vec3> points = prism(n, 1, 1, inradius);
    const Vec3 centroid(0, 0, inradius),
        arm = centroid - points[static_cast<std::size_t>(2 * (n - 1))].cwiseProduct(Vec3(1, 0, 1));
    const Vec3 w(0, 1, 0);
    SceneText s(m, 1e-3, Vec3::Zero());
    s.material("rock", 1000)
        .interface("rock", "ground", 10)
        .plane(Vec3::UnitZ())
        .hull("P", points, centroid, spin(w) + velocity(w.cross(arm)));
    const Outcome o = c.run(s.str());
    c.relative(fmt::format("w+/w-, n = {}", n), "angular momentum about the new edge", ratio,
               o.last().spin[0].y(), 1e-10);
  }
}

void bouncing(CaseRun& c) {
  for (const double e : {0.5, 0.9}) {
    const Method m = Method::by_accuracy(1e-3);
    c.method(m);
    const double h0 = 1, t0 = std::sqrt(2 * h0 / g), rest = t0 * (1 + e) / (1 - e);
    SceneText s(m, rest * 1.05);
    s.history(rest / 500)
        .material("rock", 2600)
        .interface("rock", "ground", 0.5, "normal_stiffness = \"hard\"\nrestitution = " + number(e))
        .plane(Vec3::UnitZ())
        .box("B", Vec3(1, 1, 1), Vec3(0, 0, 0.5 + h0));
    const Outcome o = c.run(s.str());
    for (const int k : {1, 2, 3}) {
      // A sample in flight k gives its summit and its end.
      const double start = t0 * (1 + 2 * (e - std::pow(e, k)) / (1 - e)),
                   end = start + 2 * t0 * std::pow(e, k);
      for (const sim::HistoryRow& r : o.rows) {
        if (r.time < start + 0.3 * (end - start) || r.time > start + 0.7 * (end - start)) continue;
        const double z = r.position[0].z() - 0.5, v = r.velocity[0].z();
        c.relative(fmt::format("height of rebound {}, e = {}", k, e), "e^(2k) h_0", std::pow(e, 2 * k) * h0,
                   z + v * v / (2 * g), 1e-10);
        if (k == 3)
          c.relative(fmt::format("end of flight {}, e = {}", k, e), "t_0 (1 + 2 e + ... + 2 e^k)", end,
                     r.time + (v + std::sqrt(v * v + 2 * g * z)) / g, 1e-10);
        break;
      }
    }
    double stopped = -1;
    for (const sim::HistoryRow& r : o.rows)
      if (r.velocity[0].norm() > 1e-9 || r.position[0].z() > 0.5 + 1e-9) stopped = r.time;
    c.relative(fmt::format("last motion seen, e = {}, histories of t_r/500", e), "t_0 (1 + e)/(1 - e)", rest,
               stopped, 4e-3);
  }
}

/// A cube that falls and bounces, its restitution less the faster it comes: v_(k+1) = e_0 v_k / (1 + (v_k /
/// v_h)^2).
void bouncing_by_speed(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  const double e0 = 0.8, half = 9.144, h0 = 10, fall = std::sqrt(2 * h0 / g);
  const auto back = [&](double v) { return e0 * v / (1 + v * v / (half * half)); };
  const double first = back(g * fall), second = back(first), third = back(second);
  const double end = fall + 2 * (first + second + third) / g;
  SceneText s(m, end);
  s.history(end / 2000)
      .material("rock", 2600)
      .interface(
          "rock", "ground", 0.5,
          fmt::format("normal_stiffness = \"hard\"\nrestitution = {}\nrestitution_half_speed = {}", e0, half))
      .plane(Vec3::UnitZ())
      .box("B", Vec3(1, 1, 1), Vec3(0, 0, 0.5 + h0));
  const Outcome o = c.run(s.str());
  double start = fall;
  int flight = 0;
  for (const double v : {first, second, third}) {
    ++flight;
    for (const sim::HistoryRow& r : o.rows) {
      if (r.time < start + 0.3 * v / g) continue;  // a sample of the flight gives the energy of all of it
      const double z = r.position[0].z() - 0.5, speed = r.velocity[0].z();
      c.relative(fmt::format("height of rebound {}", flight), "v_k^2 / 2g", v * v / (2 * g),
                 z + speed * speed / (2 * g), 1e-10);
      if (flight == 3)
        c.relative("dissipated by three impacts [J]", "m (g h_0 - v_3^2 / 2)", 2600 * (g * h0 - v * v / 2),
                   r.ledger.damping_work, 1e-9);
      break;
    }
    start += 2 * v / g;
  }
}

void pendulum(CaseRun& c) {
  // A cube hung up by two corners of its upper face's middle line, let go 30 degrees from rest. I = (1/6 +
  // 1/4) m a^2 about the hinge.
  const double from = std::numbers::pi / 6,
               period = 4 * std::sqrt(5.0 / 12 / (0.5 * g)) * std::comp_ellint_1(std::sin(from / 2));
  for (const auto& [a, allowed] : {std::pair(1e-3, 1e-2), std::pair(1e-5, 1e-3)}) {
    const Method m = Method::by_accuracy(a);
    c.method(m);
    SceneText s(m, 0.75 * period);  // it passes below the hinge, at its fastest
    s.material("rock", 2600)
        .box("B", Vec3::Ones(), -0.5 * Vec3(std::sin(from), 0, std::cos(from)),
             turned(Vec3(0, from, 0)) + "fixed_points = [[0.0, -0.5, 0.0], [0.0, 0.5, 0.0]]\n");
    const Outcome o = c.run(s.str());
    c.absolute("way past the lowest place after 3/4 of the period [m]", "elliptic integral", 0,
               o.last().position[0].x(), allowed);
    c.absolute("height of the centroid there [m]", "it hangs", -0.5, o.last().position[0].z(), allowed);
    c.relative("spin there [rad/s]", "energy", std::sqrt(2 * g * 0.5 * (1 - std::cos(from)) / (5.0 / 12)),
               std::abs(o.last().spin[0].y()), allowed);
  }
}

void painleve(CaseRun& c) {
  // A thin rod, tan theta = 2 from the ground, its tip ahead of the mass centre and sliding: friction digs it
  // in. mu_c = 4/3.
  const double theta = std::atan(2.0), thickness = 1e-3;
  for (const double mu : {1.2, 1.4, 2.0}) {
    const Method m = Method::by_accuracy(1e-4);
    c.method(m);
    const Vec3 axis(std::cos(theta), 0, -std::sin(theta)), across(std::sin(theta), 0, std::cos(theta));
    // The lowest corner lies on the ground.
    const Vec3 centre = -(axis - 0.5 * thickness * across);
    const Vec3 lift(0, 0, 1e-12);
    SceneText s(m, 0.5);  // rows at the ends of macro steps: within a step energies are known to its order
    s.history(0.05)
        .material("rock", 7800)
        .interface("rock", "ground", mu)
        .plane(Vec3::UnitZ())
        .box("R", Vec3(2, 0.2, thickness), centre + lift,
             turned(Vec3(0, theta, 0)) + velocity(Vec3(2, 0, 0)));
    const Outcome o = c.run(s.str());
    double growth = 0, most = 0;
    for (std::size_t i = 1; i < o.rows.size(); ++i) {
      const auto& a = o.rows[i - 1].ledger;
      const auto& b = o.rows[i].ledger;
      most = std::max(most, b.kinetic);
      growth = std::max(growth, b.kinetic + b.potential - a.kinetic - a.potential);
    }
    c.holds(fmt::format("solves, mu {}", mu), "runs to its end, Coulomb's law always solved",
            o.ok() && std::isfinite(o.last().position[0].norm()));
    c.absolute(fmt::format("energy gained, of the largest kinetic, mu {}", mu),
               "never grows, to a tenth of the accuracy", 0, std::max(0.0, growth) / most, 1e-5);
  }
}

void free_flight(CaseRun& c) {
  const Method m = Method::by_accuracy(1e-3);
  c.method(m);
  const Vec3 v(3, -2, 10), w(3, 2, 1);
  SceneText s(m, 2);
  s.material("rock", 2600)
      .interface("rock", "rock", 0.5)
      .box("B", Vec3(1, 2, 3), Vec3(1, 2, 3), velocity(v) + spin(w));
  const Outcome o = c.run(s.str());
  const Vec3 place = Vec3(1, 2, 3) + 2 * v - Vec3(0, 0, 2 * g);
  c.absolute("place after 2 s, relative", "parabola", 0, (o.last().position[0] - place).norm() / place.norm(),
             1e-14);
  c.reset();
  SceneText free(m, 2, Vec3::Zero());
  free.history(0.1)
      .material("rock", 2600)
      .interface("rock", "rock", 0.5)
      .box("B", Vec3(1, 2, 3), Vec3(1, 2, 3), velocity(v) + spin(w));
  const Outcome p = c.run(free.str());
  double l = 0, e = 0;
  for (const sim::HistoryRow& r : p.rows) {
    l = std::max(l, (r.ledger.angular_momentum - p.rows.front().ledger.angular_momentum).norm() /
                        p.rows.front().ledger.angular_momentum.norm());
    e = std::max(e, std::abs(r.ledger.kinetic / p.rows.front().ledger.kinetic - 1));
  }
  c.momentum(l);
  c.absolute("angular momentum, relative change", "constant", 0, l, 1e-13);
  c.absolute("kinetic energy, relative change", "constant", 0, e, 1e-9);
}

}  // namespace

std::vector<Case> turning_cases() {
  return {
      {"dda", "A9", "Euler top, I = (1, 2, 3)", "closed form", true, euler_top},
      {"dda", "A10", "Box 1 x 2 x 3 about its middle axis", "closed form", true, box_top},
      {"dda", "A11", "Rocking block", "Housner 1963; elliptic integral", true, rocking},
      {"dda", "A33", "Pendulum on fixed points", "elliptic integral", true, pendulum},
      {"dda", "A12", "Rolling prism", "closed form", true, rolling_prism},
      {"dda", "A13", "Bouncing to rest", "closed form", true, bouncing},
      {"dda", "A35", "Bouncing with a restitution that falls with speed", "closed form", true,
       bouncing_by_speed},
      {"dda", "A18", "Painleve's rod", "Painleve 1895", true, painleve},
      {"dda", "A21", "Free flight", "closed form", true, free_flight},
  };
}

}  // namespace talus::verify
