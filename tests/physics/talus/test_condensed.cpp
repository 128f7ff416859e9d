// Condensed steps of structures while blocks are at them: statics, frequency, order, energy, balance, the switch both ways, sleep, resume.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include <fmt/format.h>

#include "sim/simulation.hpp"
#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

/// A light beam of 6 m on two hinges, and a mass that stands on its middle. Its weight is 490.5 N.
struct Beam {
  std::string integrator = "auto";
  double end = 1, damping = 0, step = 0, drop = 0, density = 25;
  bool until_rest = false;
  std::string more;
  std::string text() const {
    SceneText s(step > 0 ? Method::fixed_step(step) : Method::by_accuracy(1e-3), end, Vec3(0, 0, -9.81), until_rest ? "until = \"rest\"\n" : "");
    s.history(end / 100).material("beam", density, "young = 10e9\npoisson = 0.0").material("rock", 2500).interface("rock", "beam", 0.5).interface("rock", "rock", 0.5);
    s.box("B", Vec3(0.2, 0.2, 0.5), Vec3(0, 0, 0.375 + drop), more);
    return s.raw(structure_box("beam", Vec3(6, 0.25, 0.25), Vec3::Zero(), {24, 1, 2}, "beam",
        fmt::format("support = [{{ line = [[-3, -0.125, 0], [-3, 0.125, 0]] }}, {{ line = [[3, -0.125, 0], [3, 0.125, 0]], held = \"yz\" }}]\n"
                    "preload = \"gravity\"\nintegrator = \"{}\"\ndamping_ratio = {}\n[[structure.probe]]\nname = \"middle\"\nat = [0, 0, 0]\n", integrator, damping))).str();
  }
};
constexpr double weight = 0.02 * 2500 * 9.81;

double deflection(const sim::HistoryRow& row, const sim::HistoryRow& first) {
  return first.structures[0].probe_displacement[0].z() - row.structures[0].probe_displacement[0].z();
}
double worst_residual(const Outcome& o) {
  double worst = 0;
  for (const sim::HistoryRow& r : o.rows) worst = std::max(worst, std::abs(r.ledger.residual));
  return worst;
}
void expect_balance(const Outcome& o) {
  EXPECT_LT(o.result.audit.worst_force_imbalance, 1e-12);
  EXPECT_LT(o.result.audit.worst_moment_imbalance, 1e-12);
}

TEST(Condensed, BlockAtRestOnABeam) {
  Beam b;
  b.damping = 0.2;
  b.end = 8;
  b.until_rest = true;
  const Outcome o = run_scene(b.text());
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.status, "at rest");
  // Euler and Bernoulli, P L^3 / (48 E I); shear adds 0.2 %, the spread of the load takes 0.3 %.
  const double inertia = std::pow(0.25, 4) / 12;
  EXPECT_NEAR(deflection(o.last(), o.rows.front()) / (weight * 216 / (48 * 10e9 * inertia)), 1, 0.01);
  const double whole = weight + 6 * 0.0625 * 25 * 9.81;
  EXPECT_NEAR(-o.last().structures[0].base_force.z() / whole, 1, 1e-4);
  EXPECT_GT(o.result.counters.condensed_steps, 100);
  EXPECT_LT(worst_residual(o), 1e-9 * weight);
  expect_balance(o);
}

/// Frequency of a mass on a spring, from the static deflection: the beam's own mass counts 17/35.
TEST(Condensed, MassOnABeamOscillatesAtItsFrequency) {
  Beam b;
  b.integrator = "implicit";
  b.end = 0.4;
  b.density = 0.25;
  const Outcome o = run_scene(b.text());
  ASSERT_TRUE(o.ok());
  const double stiffness = 48 * 10e9 * std::pow(0.25, 4) / 12 / 216, omega = std::sqrt(stiffness / (50 + 17.0 / 35 * 6 * 0.0625 * 0.25));
  // From rest: it swings to twice the static deflection and back.
  double worst = 0;
  for (const sim::HistoryRow& r : o.rows)
    worst = std::max(worst, std::abs(deflection(r, o.rows.front()) / (weight / stiffness) - (1 - std::cos(omega * r.time))));
  EXPECT_LT(worst, 0.06);
  EXPECT_EQ(o.result.counters.structure_steps, 0);
  // No damping, and the contact stays closed: what is lost is the step's own, next to nothing.
  EXPECT_LT(std::abs(o.last().ledger.algorithmic), 1e-9);
  EXPECT_LT(worst_residual(o), 1e-9);
  expect_balance(o);
}

TEST(Condensed, OrderTwoInTheStep) {
  const auto place = [](double step) {
    Beam b;
    b.integrator = "implicit";
    b.end = 0.128;
    b.step = step;
    const Outcome o = run_scene(b.text());
    EXPECT_TRUE(o.ok());
    return o.last().position[0].z();
  };
  const double fine = place(1e-3 / 8), a = place(4e-3), b = place(2e-3), c = place(1e-3);
  const double order_1 = std::log2(std::abs(a - fine) / std::abs(b - fine)), order_2 = std::log2(std::abs(b - fine) / std::abs(c - fine));
  EXPECT_GT(order_1, 1.8) << a - fine << " " << b - fine << " " << c - fine;
  EXPECT_GT(order_2, 1.8) << a - fine << " " << b - fine << " " << c - fine;
}

/// A block slides along the beam by friction: the path is v^2 / (2 mu g), all of its energy goes into friction.
TEST(Condensed, FrictionWorksThroughTheCompliance) {
  Beam b;
  b.integrator = "implicit";
  b.end = 0.5;
  b.density = 2500;
  b.more = velocity(Vec3(1, 0, 0));
  const Outcome o = run_scene(b.text());
  ASSERT_TRUE(o.ok());
  EXPECT_NEAR(o.last().position[0].x() / (1 / (2 * 0.5 * 9.81)), 1, 0.02);
  EXPECT_NEAR(o.last().ledger.friction_work / 25, 1, 0.02);
  EXPECT_LT(std::abs(o.last().velocity[0].x()), 1e-3);
  EXPECT_LT(worst_residual(o), 1e-8);
  expect_balance(o);
}

/// A drop of 2 cm is explicit; the quiet that follows is not; a second block strikes later.
TEST(Condensed, ImpactQuietImpact) {
  Beam b;
  b.density = 2500;
  b.damping = 0.3;
  b.end = 1.2;
  b.drop = 0.02;
  std::string text = b.text();
  text += "[[block]]\nname = \"C\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [0.2, 0.2, 0.2]\nposition = [1.5, 0, 5.0]\n";
  const Outcome o = run_scene(text);
  ASSERT_TRUE(o.ok());
  double first_condensed = NAN, last_explicit = 0, longest = 0;
  for (const sim::ContactRow& r : o.structure_contacts) {
    longest = std::max(longest, r.dt);
    if (r.dt > 1e-4 && !(first_condensed < r.time)) first_condensed = r.time;
    if (r.dt < 1e-4) last_explicit = r.time;
  }
  EXPECT_GT(first_condensed, 0.05);
  EXPECT_LT(first_condensed, 0.7);
  EXPECT_GT(last_explicit, 0.98);   // C meets the beam after 0.99 s
  EXPECT_GT(longest, 1e-3);
  double energy = 0;
  for (const sim::HistoryRow& r : o.rows) energy = std::max(energy, r.ledger.kinetic);
  EXPECT_LT(worst_residual(o), 1e-9 * energy);
  expect_balance(o);
}

TEST(Condensed, ExplicitByItsKey) {
  Beam b;
  b.integrator = "explicit";
  b.end = 0.01;
  const Outcome o = run_scene(b.text());
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.counters.condensed_steps, 0);
  EXPECT_GT(o.result.counters.structure_steps, 0);
}

TEST(Condensed, ResumesToTheBit) {
  Beam b;
  b.integrator = "implicit";
  b.damping = 0.05;
  b.end = 0.2;
  class Last : public sim::Sink {
   public:
    void history(const sim::HistoryRow& row) override {
      last = row;
      if (row.time >= stop_at) stop = 15;
    }
    sim::HistoryRow last;
    double stop_at = 1e9;
    std::atomic<int> stop = 0;
  } one, broken, two;
  sim::Simulation whole(scene::read_scene_text(b.text(), "/test.toml"));
  ASSERT_EQ(whole.run(one).exit_code, 0);
  broken.stop_at = 0.1;
  sim::Simulation first(scene::read_scene_text(b.text(), "/test.toml"));
  EXPECT_EQ(first.run(broken, &broken.stop).status, "interrupted");
  sim::Simulation second(scene::read_scene_text(b.text(), "/test.toml"));
  second.restore(first.save());
  EXPECT_LT(second.time(), 0.15);
  ASSERT_EQ(second.run(two).exit_code, 0);
  EXPECT_EQ(one.last.position[0], two.last.position[0]);
  EXPECT_EQ(one.last.velocity[0], two.last.velocity[0]);
  EXPECT_EQ(one.last.structures[0].probe_displacement[0], two.last.structures[0].probe_displacement[0]);
}

}  // namespace
}  // namespace talus::verify
