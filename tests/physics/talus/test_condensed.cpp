// Condensed steps of structures while blocks are at them: statics, frequency, order, energy, balance, the
// switch both ways, sleep, resume.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "helpers/resumed.hpp"
#include "sim/simulation.hpp"
#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

/// A beam of 6 m on two hinges, 0.25 m deep, and a flat block on its middle.
struct Beam {
  std::string integrator = "auto", more;
  double end = 1, damping = 0, drop = 0, x = 0;
  bool until_rest = false;
  std::string text() const {
    SceneText s(Method::by_accuracy(1e-3), end, Vec3(0, 0, -9.81), until_rest ? "until = \"rest\"\n" : "");
    s.history(end / 100)
        .material("beam", 2500, "young = 10e9\npoisson = 0.0")
        .material("rock", 2500)
        .interface("rock", "beam", 0.5)
        .interface("rock", "rock", 0.5);
    s.box("B", Vec3(0.6, 0.2, 0.2), Vec3(x, 0, 0.225 + drop), more);
    return s
        .raw(structure_box("beam", Vec3(6, 0.25, 0.25), Vec3::Zero(), {24, 1, 2}, "beam",
                           fmt::format("support = [{{ line = [[-3, -0.125, 0], [-3, 0.125, 0]] }}, {{ line = "
                                       "[[3, -0.125, 0], [3, 0.125, 0]], held = \"yz\" }}]\n"
                                       "preload = \"gravity\"\nintegrator = \"{}\"\ndamping_ratio = "
                                       "{}\n[[structure.probe]]\nname = \"middle\"\nat = [0, 0, 0]\n",
                                       integrator, damping)))
        .str();
  }
};
constexpr double weight = 0.6 * 0.04 * 2500 * 9.81;

/// A light column of 4 m, 1 MN/m, and a block of 1 t that fills its top: a mass on a spring.
struct Column {
  double end = 0.4, step = 0;
  std::string text() const {
    SceneText s(step > 0 ? Method::fixed_step(step) : Method::by_accuracy(1e-3), end, Vec3(0, 0, -9.81));
    s.history(end / 50)
        .material("rod", 1e-3, "young = 4e6\npoisson = 0.0")
        .material("rock", 2000)
        .interface("rock", "rod", 0.5);
    s.box("B", Vec3(1, 1, 0.5), Vec3(0, 0, 4.25));
    return s
        .raw(structure_box("column", Vec3(1, 1, 4), Vec3(0, 0, 2), {2, 2, 4}, "rod",
                           "support = [\"-z\"]\npreload = \"none\"\nintegrator = \"implicit\"\n"))
        .str();
  }
};
constexpr double column_omega = 31.6227766016838;  // sqrt(1e6 / 1000) [rad/s]
constexpr double sag = 1000 * 9.81 / 1e6;          // static [m]

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

TEST(Condensed, BlockComesToRestOnABeam) {
  Beam b;
  b.damping = 0.3;
  b.end = 6;
  b.until_rest = true;
  const Outcome o = run_scene(b.text());
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.status, "at rest");
  // A rigid block carries on its ends; against the sag under the beam's own weight, so that the elements'
  // stiffness in bending drops out: P b (3 L^2 - 4 b^2) / (48 E I) over 5 w L^4 / (384 E I), b from the
  // support to the end of the block.
  const double end = 3 - 0.3, own = 0.0625 * 2500 * 9.81,
               sag_of_beam = -o.rows.front().structures[0].probe_displacement[0].z();
  EXPECT_NEAR(deflection(o.last(), o.rows.front()) / sag_of_beam,
              8 * weight * end * (3 * 36 - 4 * end * end) / (5 * own * 1296), 1e-3);
  const double whole = weight + 6 * 0.0625 * 2500 * 9.81;
  // It counts as at rest while it still swings, a period in two seconds, by 1 to 3 parts in 1e4 of the
  // reaction, at 6e-9 J.
  EXPECT_NEAR(-o.last().structures[0].base_force.z() / whole, 1, 3e-4);
  EXPECT_GT(o.result.counters.condensed_steps, 100);
  EXPECT_LT(worst_residual(o), 1e-6);
  expect_balance(o);
}

/// What a step stops in the mean keeps a velocity that turns from step to step, of block and beam: at three
/// of fifteen places, as chance had it, it counted as motion for ever.
TEST(Condensed, BlocksComeToRestWhereverTheyLie) {
  for (const double x : {0.01, 0.02, 0.03, 0.1}) {
    Beam b;
    b.damping = 0.3, b.end = 6, b.until_rest = true, b.x = x;
    const Outcome o = run_scene(b.text());
    ASSERT_TRUE(o.ok());
    EXPECT_EQ(o.result.status, "at rest") << x;
  }
}

/// A cube slides past the beam that a block lies on, 10 mm beside it: within its reach, but it does not come
/// to it. The beam took explicit steps as long as the cube was near.
TEST(Condensed, WhatSlidesPastDoesNotKeepStepsShort) {
  SceneText s(Method::by_accuracy(1e-3), 1.0, Vec3(0, 0, -9.81));
  s.history(0.02)
      .material("beam", 2500, "young = 10e9\npoisson = 0.0")
      .material("rock", 2500)
      .material("ground", 2500);
  s.interface("rock", "beam", 0.5).interface("rock", "ground", 0.0).interface("rock", "rock", 0.5);
  s.box("A", Vec3(0.6, 0.2, 0.2), Vec3(0, 0, 0.2255));
  s.raw(
      "[[block]]\nname = \"B\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [0.4, 0.4, 0.4]\nposition = "
      "[-1, 0.335, 0]\nvelocity = [2, 0, 0]\ndeformable = false\n");
  s.plane(Vec3::UnitZ(), Vec3(0, 0, -0.2), "ground");
  s.raw(structure_box("beam", Vec3(6, 0.25, 0.25), Vec3::Zero(), {24, 1, 2}, "beam",
                      "support = [{ line = [[-3, -0.125, 0], [-3, 0.125, 0]] }, { line = [[3, -0.125, 0], "
                      "[3, 0.125, 0]], held = \"yz\" }]\npreload = \"gravity\"\ndamping_ratio = 0.3\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_NEAR(o.last().position[1].x(), 1, 1e-9);
  EXPECT_NEAR(o.last().velocity[1].x(), 2, 1e-9);
  EXPECT_LT(o.result.counters.structure_steps, 4000);
  EXPECT_GT(o.result.counters.condensed_steps, 50);
  EXPECT_LT(worst_residual(o), 1e-6);
  expect_balance(o);
}

/// Springs of 60 GPa/m between a deck that sags and a block that stands on its edges: what tilts there, cells
/// and block, is stiff by the columns.
TEST(Condensed, BlockOnLinesOfTheMeshComesToRest) {
  SceneText s(Method::by_accuracy(1e-3), 0.5, Vec3(0, 0, -9.81));
  s.history(0.005)
      .material("deck", 2500, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600, "young = 40e9\npoisson = 0.25")
      .interface("rock", "deck", 0.5, "normal_stiffness = \"60 GPa/m\"");
  s.box("B", Vec3::Constant(0.5), Vec3(1, 0, 0.5), "deformable = true\n");
  s.raw(structure_box("deck", Vec3(6, 0.3, 0.5), Vec3::Zero(), {24, 2, 4}, "deck",
                      "support = [{ line = [[-3, -0.15, 0], [-3, 0.15, 0]] }, { line = [[3, -0.15, 0], [3, "
                      "0.15, 0]], held = \"yz\" }]\npreload = \"gravity\"\ndamping_ratio = 0.1\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  EXPECT_GT(o.result.counters.condensed_steps, 50);
  const double whole = (2600 * 0.125 + 2500 * 0.9) * 9.81;
  EXPECT_NEAR(-o.last().structures[0].base_force.z() / whole, 1, 3e-3);  // the deck still swings
  EXPECT_LT(o.last().ledger.kinetic, 1e-4);
  double made = 0;
  for (const sim::HistoryRow& r : o.rows) made = std::max(made, -r.ledger.numerical_dissipation());
  EXPECT_LT(made, 0.01 * 1.56);  // of the fall onto the sagging deck
  expect_balance(o);
}

/// A squat footing, whose first period is a few stable steps: what rests on it sleeps all the same.
TEST(Condensed, BlockSleepsOnAFooting) {
  SceneText s(Method::by_accuracy(1e-3), 1, Vec3(0, 0, -9.81), "until = \"rest\"\n");
  s.history(0.005)
      .material("footing", 2500, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600, "young = 40e9\npoisson = 0.25")
      .interface("rock", "footing", 0.5, "normal_stiffness = \"25 GPa/m\"");
  s.box("B", Vec3::Constant(0.6), Vec3(0.03, 0.02, 0.5), "deformable = true\n");
  s.raw(structure_box("footing", Vec3(1.6, 1.6, 0.4), Vec3::Zero(), {4, 4, 1}, "footing",
                      "support = [\"-z\"]\npreload = \"gravity\"\ndamping_ratio = 0.1\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.status, "at rest");
  EXPECT_NEAR(-o.last().structures[0].base_force.z() / ((2600 * 0.216 + 2500 * 1.024) * 9.81), 1, 1e-6);
  EXPECT_LT(o.result.counters.structure_steps, 1000);
}

TEST(Condensed, MassOnASpringOscillatesAtItsFrequency) {
  const Outcome o = run_scene(Column{.step = 1e-3}.text());
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.counters.structure_steps, 0);
  // From rest it swings to twice the static deflection and back, without end.
  double worst = 0;
  for (const sim::HistoryRow& r : o.rows)
    worst =
        std::max(worst, std::abs((4.25 - r.position[0].z()) / sag - (1 - std::cos(column_omega * r.time))));
  EXPECT_LT(worst, 2e-3);
  // No damping, and the contact stays closed.
  EXPECT_LT(std::abs(o.last().ledger.numerical_dissipation()) + std::abs(o.last().ledger.damping_work) +
                std::abs(o.last().ledger.friction_work),
            1e-6 * 1000 * 9.81 * sag);
  EXPECT_LT(worst_residual(o), 1e-9 * 1000 * 9.81 * sag);
  expect_balance(o);
}

TEST(Condensed, OrderTwoInTheStep) {
  const auto error = [](double step) {
    const Outcome o = run_scene(Column{0.15, step}.text());
    EXPECT_TRUE(o.ok());
    return std::abs((4.25 - o.last().position[0].z()) / sag - (1 - std::cos(column_omega * 0.15)));
  };
  const double a = error(3e-3), b = error(1.5e-3), c = error(0.75e-3);
  EXPECT_NEAR(std::log2(a / b), 2, 0.2) << a << " " << b << " " << c;
  EXPECT_NEAR(std::log2(b / c), 2, 0.2) << a << " " << b << " " << c;
}

/// A block slides on a slab: the path is v^2 / (2 mu g), and all of its energy goes into friction.
TEST(Condensed, FrictionWorksThroughTheCompliance) {
  SceneText s(Method::by_accuracy(1e-3), 0.3, Vec3(0, 0, -9.81));
  s.history(0.01)
      .material("slab", 2500, "young = 10e9\npoisson = 0.2")
      .material("rock", 2500)
      .interface("rock", "slab", 0.5);
  s.box("B", Vec3(1, 0.6, 0.2), Vec3(-0.5, 0, 1.1), velocity(Vec3(1, 0, 0)));
  s.raw(structure_box("slab", Vec3(4, 1, 1), Vec3(0, 0, 0.5), {8, 2, 2}, "slab",
                      std::string(held_below) + "integrator = \"implicit\"\ndamping_ratio = 0.05\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.counters.structure_steps, 0);
  EXPECT_NEAR((o.last().position[0].x() + 0.5) / (1 / (2 * 0.5 * 9.81)), 1, 0.01);
  EXPECT_NEAR(o.last().ledger.friction_work / 150, 1, 0.01);
  EXPECT_LT(std::abs(o.last().velocity[0].x()), 1e-3);
  EXPECT_LT(worst_residual(o), 1e-6 * 150);
  expect_balance(o);
}

/// A drop of 2 cm is explicit; the quiet that follows is not; a second block strikes later.
TEST(Condensed, ImpactQuietImpact) {
  Beam b;
  b.damping = 0.3;
  b.end = 1.2;
  b.drop = 0.02;
  std::string text = b.text();
  text +=
      "[[block]]\nname = \"C\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [0.2, 0.2, 0.2]\nposition = "
      "[1.5, 0, 5.0]\n";
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
  EXPECT_GT(last_explicit, 0.98);  // C meets the beam after 0.99 s
  EXPECT_GT(longest, 1e-3);
  double energy = 0;
  for (const sim::HistoryRow& r : o.rows) energy = std::max(energy, r.ledger.kinetic);
  EXPECT_LT(worst_residual(o), 1e-6 * energy);
  expect_balance(o);
}

/// A wedge of 120 kg falls between two columns with 2 % of damping, which ring in many modes. Condensed steps
/// began at once and took 27 % of its energy; they wait for what they do not resolve.
TEST(Condensed, RingingColumnsAreNotStilled) {
  SceneText s(Method::by_accuracy(1e-3), 0.3, Vec3(0, 0, -9.81));
  s.history(0.005)
      .material("concrete", 2400, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600)
      .interface("rock", "concrete", 0.5);
  s.raw(
      "[[block]]\nname = \"W\"\nmaterial = \"rock\"\nshape = \"convex\"\nposition = [0, 0, 2.12]\nvelocity = "
      "[0, 0, -1]\n"
      "vertices = [[-0.3, -0.3, 0.3], [0.3, -0.3, 0.3], [-0.3, 0.3, 0.3], [0.3, 0.3, 0.3], [-0.05, -0.3, "
      "-0.4], [0.05, -0.3, -0.4], [-0.05, 0.3, -0.4], [0.05, 0.3, -0.4]]\n");
  for (const double x : {-0.45, 0.45})
    s.raw(structure_box(x < 0 ? "left" : "right", Vec3(0.4, 0.6, 2), Vec3(x, 0, 1), {2, 3, 8}, "concrete",
                        "support = [\"-z\"]\npreload = \"gravity\"\ndamping_ratio = 0.02\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_GT(o.result.counters.condensed_steps, 5);
  double kinetic = 0, taken = 0;
  for (const sim::HistoryRow& r : o.rows) {
    kinetic = std::max(kinetic, r.ledger.kinetic);
    taken = std::max(taken, std::abs(r.ledger.numerical_dissipation()));
  }
  EXPECT_LT(taken, 0.01 * kinetic);
}

TEST(Condensed, ExplicitByItsKey) {
  Beam b;
  b.integrator = "explicit";
  b.end = 0.05;
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
  const auto [whole, resumed, stopped] = test::run_and_resume(b.text(), 0.1);
  EXPECT_LT(stopped->time(), 0.15);
  EXPECT_EQ(whole.position[0], resumed.position[0]);
  EXPECT_EQ(whole.velocity[0], resumed.velocity[0]);
  EXPECT_EQ(whole.structures[0].probe_displacement[0], resumed.structures[0].probe_displacement[0]);
}

/// A cube of 1.3 t comes down by 0.3 mm on a slab that is asleep, in steps that resolve neither its spring
/// nor the onset. The spring that acted by the velocity at the end stopped it deeper in the columns than it
/// knew, and these threw it up with 40 times the energy of its fall.
TEST(Condensed, GentleLandingsMakeNoEnergy) {
  for (const char* stiffness : {"5e9 Pa/m", "4e10 Pa/m", "1e9 N/m"})
    for (const double interval : {0.01, 0.05}) {
      SceneText s(Method::by_accuracy(1e-2), 0.1, Vec3(0, 0, -9.81));
      s.history(interval)
          .material("C", 2450, "f_cm = \"38 MPa\"")
          .material("rock", 2600)
          .interface("*", "*", 0.5, std::string("normal_stiffness = \"") + stiffness + "\"");
      s.raw(structure_box("slab", Vec3(8, 2, 0.4), Vec3(0, 0, 0), {40, 10, 2}, "C",
                          "support = [\"-x\", \"+x\"]\n"));
      s.box("B", Vec3(0.8, 0.8, 0.8), Vec3(0.7, 0.2, 0.5998));
      const Outcome o = run_scene(s.str());
      ASSERT_TRUE(o.ok()) << o.result.message;
      EXPECT_GT(o.result.counters.condensed_steps, 0) << stiffness;
      const double fall = 2600 * std::pow(0.8, 3) * 9.81 * 3e-4;
      double made = 0;
      for (const sim::HistoryRow& r : o.rows) made = std::max(made, -r.ledger.numerical_dissipation());
      EXPECT_LT(made, 0.05 * fall) << stiffness << ", rows each " << interval << " s";
    }
}

/// The same on a layer that crushes within a fraction of the step, and a cube that comes by 1 m/s, condensed
/// throughout. Steps whose force was not that of the law crushed what nothing gave, up to 200 times the
/// energy of the fall.
TEST(Condensed, LandingsOnCrushingLayersMakeNoEnergy) {
  struct Layer {
    const char* stiffness;
    double pressure;
  };
  for (const Layer layer : {Layer{"5e9 Pa/m", 1e5}, {"5e9 Pa/m", 1e6}, {"5e8 Pa/m", 3e4}, {"4e10 Pa/m", 1e6}})
    for (const double interval : {0.01, 0.05})
      for (const char* integrator : {"auto", "implicit"})
        for (const double speed : {0.0, 1.0}) {
          SceneText s(Method::by_accuracy(1e-2), 0.1, Vec3(0, 0, -9.81));
          s.history(interval)
              .material("C", 2450, "f_cm = \"38 MPa\"")
              .material("rock", 2600)
              .interface("*", "*", 0.5,
                         std::string("normal_stiffness = \"") + layer.stiffness +
                             "\"\ncontact_law = { kind = \"crushing\", pressure = " + number(layer.pressure) +
                             " }");
          s.raw(structure_box(
              "slab", Vec3(8, 2, 0.4), Vec3(0, 0, 0), {40, 10, 2}, "C",
              std::string("support = [\"-x\", \"+x\"]\nintegrator = \"") + integrator + "\"\n"));
          const double gap = speed > 0 ? 0.02 : -2e-4;
          s.box("B", Vec3(0.8, 0.8, 0.8), Vec3(0.7, 0.2, 0.6 + gap), velocity(Vec3(0, 0, -speed)));
          const Outcome o = run_scene(s.str());
          ASSERT_TRUE(o.ok()) << o.result.message;
          const double mass = 2600 * std::pow(0.8, 3), brought = mass * (9.81 * 3e-4 + 0.5 * speed * speed);
          double made = 0;
          for (const sim::HistoryRow& r : o.rows) made = std::max(made, -r.ledger.numerical_dissipation());
          EXPECT_LT(made, 0.05 * brought)
              << layer.stiffness << ", " << layer.pressure << " Pa, " << integrator << ", " << speed
              << " m/s, rows each " << interval << " s";
        }
}

}  // namespace
}  // namespace talus::verify
