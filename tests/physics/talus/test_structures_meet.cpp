// Structures that strike each other in free space: what one gets the other gives, forces and moments.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "helpers/resumed.hpp"
#include "sim/simulation.hpp"
#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

/// A bar of soft rock flies askew into a plate, friction 0.5: nodes sink below faces that bend and turn, and
/// lie over none of their triangles where normals part. With weights cut off at nil there, and friction that
/// met the face below the node, the angular momentum drifted by 2e-4 m of the linear one, 6e-4 m on springs.
TEST(StructuresMeet, MomentaStay) {
  for (const char* law : {"normal_stiffness = \"hard\"", "normal_stiffness = \"20 GPa/m\""}) {
    SceneText s(Method::by_accuracy(1e-3), 0.012, Vec3::Zero());
    s.history(1e-3)
        .material("plate", 2450, "young = 3e9\npoisson = 0.2")
        .material("bar", 2450, "young = 2e9\npoisson = 0.2");
    s.interface("*", "*", 0.5, law);
    s.raw(structure_box("plate", Vec3(1.6, 1.6, 0.2), Vec3::Zero(), {6, 6, 2}, "plate",
                        "support = []\npreload = \"none\"\n"));
    s.raw(structure_box("bar", Vec3(0.4, 0.4, 0.8), Vec3(0.13, 0.07, 0.514), {4, 4, 8}, "bar",
                        "support = []\npreload = \"none\"\ninitial_velocity = [4.0, 2.0, -15.0]\norientation "
                        "= { rotation_vector = [0.04, 0.03, 0.2] }\n"));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok()) << o.result.message;
    const sim::LedgerRow& first = o.rows.front().ledger;
    double linear = 0, angular = 0;
    for (const sim::HistoryRow& r : o.rows) {
      linear = std::max(linear, (r.ledger.linear_momentum - first.linear_momentum).norm());
      angular = std::max(angular, (r.ledger.angular_momentum - first.angular_momentum).norm());
    }
    EXPECT_LT(linear, 1e-12 * first.linear_momentum.norm()) << law;
    EXPECT_LT(angular, 1e-12 * first.linear_momentum.norm()) << law;  // over lengths of a metre
    EXPECT_GT(o.rows.back().ledger.friction_work, 1e-3 * first.kinetic) << law;
    EXPECT_GT(o.rows.back().ledger.strain + o.rows.back().ledger.damping_work, 1e-2 * first.kinetic) << law;
  }
}

/// What free structures got from each other is told: they have no support that could tell.
TEST(StructuresMeet, WhatTheyGaveEachOtherIsTold) {
  SceneText s(Method::by_accuracy(1e-3), 0.03, Vec3::Zero());
  s.history(1e-3)
      .material("C", 2450, "young = 30e9\npoisson = 0.2")
      .interface("*", "*", 0.3, "normal_stiffness = \"1e10 Pa/m\"");
  s.raw(structure_box("still", Vec3(2, 2, 0.4), Vec3::Zero(), {8, 8, 2}, "C",
                      "support = []\npreload = \"none\"\n"));
  s.raw(structure_box("flying", Vec3(0.6, 0.6, 0.4), Vec3(0, 0, 0.45), {3, 3, 2}, "C",
                      "support = []\npreload = \"none\"\ninitial_velocity = [0.0, 0.0, -5.0]\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  ASSERT_EQ(o.result.audit.met.size(), 2u);
  const auto &still = o.result.audit.met[0], &flying = o.result.audit.met[1];
  EXPECT_NEAR(still.first, 0.01, 1e-4);  // 5 cm at 5 m/s
  EXPECT_EQ(flying.first, still.first);
  const double mass = 2450 * 0.6 * 0.6 * 0.4;
  EXPECT_GT(flying.impulse.z(), 5 * mass * 1.0);  // it is stopped at least, and comes back no faster
  EXPECT_LT(flying.impulse.z(), 5 * mass * 2.0);
  EXPECT_LT((still.impulse + flying.impulse).norm(), 1e-12 * flying.impulse.norm());
}

/// Two free slabs meet face to face, on springs that the structures' own step does not resolve at their
/// corners and rims, and on ones stiffer than a cell. Followed by their ends they took a quarter of the
/// energy.
TEST(StructuresMeet, FlushSlabsKeepTheirEnergy) {
  for (const char* stiffness : {"1e9 N/m", "1e10 N/m", "1e11 N/m", "1e10 Pa/m", "1e11 Pa/m"}) {
    SceneText s(Method::by_accuracy(1e-3), 0.006, Vec3::Zero());
    s.history(1e-4)
        .material("concrete", 2450, "young = 33e9\npoisson = 0.2")
        .interface("*", "*", 0.3, std::string("normal_stiffness = \"") + stiffness + "\"");
    s.raw(structure_box("below", Vec3(2, 2, 0.3), Vec3(0, 0, -0.15), {8, 8, 2}, "concrete",
                        "support = []\npreload = \"none\"\n"));
    s.raw(structure_box("above", Vec3(1.5, 1.5, 0.3), Vec3(0, 0, 0.16), {9, 9, 2}, "concrete",
                        "support = []\npreload = \"none\"\ninitial_velocity = [0.0, 0.0, -3.0]\n"));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok()) << o.result.message;
    double taken = 0, made = 0;
    for (const sim::HistoryRow& r : o.rows) {
      taken = std::max(taken, r.ledger.numerical_dissipation());
      made = std::max(made, -r.ledger.numerical_dissipation());
    }
    EXPECT_LT(taken, 0.01 * o.rows.front().ledger.kinetic) << stiffness;
    EXPECT_LT(made, 0.01 * o.rows.front().ledger.kinetic) << stiffness;
    EXPECT_GT(o.rows.back().ledger.strain, 0.01 * o.rows.front().ledger.kinetic)
        << stiffness;  // they did meet
  }
}

/// A slab lands on a plane, or on a slab: the table of a straight line is that spring, whatever stiffness
/// stands beside it ("hard" made it a hard contact, without a word), and a table along Hertz's curve is
/// Hertz's law.
TEST(StructuresMeet, LawsByTablesAreTheirCurves) {
  const auto landing = [](const std::string& law, bool on_slab) {
    SceneText s(Method::by_accuracy(1e-3), 0.02, Vec3::Zero());
    s.history(1e-4).material("C", 2450, "young = 33e9\npoisson = 0.2").interface("*", "*", 0, law);
    if (on_slab)
      s.raw(structure_box("below", Vec3(2, 2, 0.4), Vec3(0, 0, -0.2), {8, 8, 2}, "C",
                          "support = [\"-z\"]\npreload = \"none\"\n"));
    else
      s.plane(Vec3::UnitZ(), Vec3::Zero(), "C");
    s.raw(structure_box("above", Vec3(1, 1, 0.4), Vec3(0, 0, 0.202), {4, 4, 2}, "C",
                        "support = []\npreload = \"none\"\ninitial_velocity = [0.0, 0.0, -1.0]\n"));
    return run_scene(s.str());
  };
  const auto apart = [](const Outcome& a, const Outcome& b) {  // of the momentum they come with
    double most = 0;
    for (std::size_t i = 0; i < a.rows.size(); ++i)
      most = std::max(most, (a.rows[i].ledger.linear_momentum - b.rows[i].ledger.linear_momentum).norm());
    return most / a.rows.front().ledger.linear_momentum.norm();
  };
  const double radius = 5e-4, hertz = 4.0 / 3 * 33e9 / (2 * (1 - 0.04)) * std::sqrt(radius);
  std::string curve;  // by chords, 1e-3 of it apart at most
  for (int i = 0; i <= 160; ++i) {
    const double x = i == 0 ? 0.0 : 1e-7 * std::pow(1e5, (i - 1) / 159.0);
    curve += fmt::format("{}[{:.12g}, {:.12g}]", i == 0 ? "" : ", ", x, hertz * std::pow(x, 1.5));
  }
  for (const bool on_slab : {false, true}) {
    const Outcome spring = landing("normal_stiffness = \"1e8 N/m\"", on_slab),
                  table = landing(
                      "normal_stiffness = \"hard\"\ncontact_law = { kind = \"table\", points = [[0, 0], "
                      "[0.01, 1e6]] }",
                      on_slab),
                  sphere = landing("contact_law = { kind = \"hertz\", radius = 5e-4 }", on_slab),
                  chords = landing("contact_law = { kind = \"table\", points = [" + curve + "] }", on_slab);
    for (const Outcome* o : {&spring, &table, &sphere, &chords}) ASSERT_TRUE(o->ok()) << o->result.message;
    ASSERT_EQ(spring.rows.size(), table.rows.size());
    ASSERT_EQ(sphere.rows.size(), chords.rows.size());
    EXPECT_LT(apart(spring, table), 1e-12) << on_slab;
    EXPECT_LT(apart(sphere, chords), 1e-3) << on_slab;
    EXPECT_GT(spring.rows.back().ledger.linear_momentum.z(), 0) << on_slab;  // it came back
  }
}

/// Two equal slabs meet face to face: all their cells ring in phase. Without a block their steps began each
/// stretch as long as could be, and the jump from 8 to 33 us made 1.2 % of the energy.
std::string equal_slabs() {
  SceneText s(Method::by_accuracy(1e-3), 0.006, Vec3::Zero());
  s.history(1e-4)
      .material("concrete", 2450, "young = 33e9\npoisson = 0.2")
      .interface("*", "*", 0.3, "normal_stiffness = \"1e10 N/m\"");
  s.raw(structure_box("below", Vec3(2, 2, 0.3), Vec3(0, 0, -0.15), {8, 8, 2}, "concrete",
                      "support = []\npreload = \"none\"\n"));
  s.raw(structure_box("above", Vec3(2, 2, 0.3), Vec3(0, 0, 0.16), {8, 8, 2}, "concrete",
                      "support = []\npreload = \"none\"\ninitial_velocity = [0.0, 0.0, -3.0]\n"));
  return s.str();
}

/// A ball strikes a plate that is refined locally about the blow: rebound, impulse and energy are those of
/// the uniformly fine plate, within 2 %, with half of its cells or less.
TEST(LocalRefinement, BlowIsThatOfUniformCells) {
  std::vector<double> rebound, impulse, strain;
  std::vector<long> cells;
  for (const bool local : {false, true}) {
    SceneText s(Method::by_accuracy(1e-3), 0.006, Vec3(0, 0, -9.81));
    s.history(1e-4)
        .material("C", 2450, "young = 33e9\npoisson = 0.2")
        .material("rock", 2600)
        .interface("*", "*", 0.5, "normal_stiffness = \"2e8 N/m\"");
    s.raw(structure_box("plate", Vec3(2.4, 2.4, 0.6), Vec3::Zero(),
                        local ? std::array{12, 12, 3} : std::array{24, 24, 6}, "C",
                        std::string("support = [\"-x\", \"+x\"]\nintegrator = \"explicit\"\n") +
                            (local ? "[[structure.refine]]\nregion = { min = [-0.55, -0.5, -0.3], max = "
                                     "[0.65, 0.7, 0.3] }\ncell_size = 0.1\nlocal = true\n"
                                   : "")));
    s.raw(
        "[[block]]\nname = \"B\"\nmaterial = \"rock\"\nshape = \"sphere\"\ndiameter = 0.5\nposition = [0.05, "
        "0.1, 0.552]\nvelocity = [1, 0, -8]\ndeformable = false\n");
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok()) << o.result.message;
    Vec3 sum = Vec3::Zero();
    for (const sim::ContactRow& row : o.structure_contacts) sum += row.dt * row.force;
    rebound.push_back(o.last().velocity[0].z());
    impulse.push_back(sum.norm());
    strain.push_back(0);
    for (const sim::HistoryRow& r : o.rows) strain.back() = std::max(strain.back(), r.ledger.strain);
    cells.push_back(o.simulation->structures()[0]->elements());
    EXPECT_LT(o.result.audit.impulse_defect, 1e-11);
    EXPECT_LT(o.result.audit.worst_moment_imbalance, 1e-10);
    for (const sim::HistoryRow& r : o.rows)
      EXPECT_LT(std::abs(r.ledger.residual), 1e-6 * o.rows.front().ledger.kinetic);
  }
  EXPECT_LT(cells[1], 0.6 * static_cast<double>(cells[0]));
  EXPECT_NEAR(rebound[1] / rebound[0], 1, 0.02);
  EXPECT_NEAR(impulse[1] / impulse[0], 1, 0.02);
  EXPECT_NEAR(strain[1] / strain[0], 1, 0.02);
}

/// A free structure flies against a block that sleeps on a slab: the block is pushed along, with the momentum
/// that the structure loses.
TEST(StructuresMeet, FreeStructureWakesASleepingBlock) {
  SceneText s(Method::by_accuracy(1e-3), 0.35, Vec3(0, 0, -9.81));
  s.history(0.01)
      .material("concrete", 2450, "young = 3e9\npoisson = 0.2")
      .material("rock", 2600)
      .interface("*", "*", 0.0, "normal_stiffness = \"hard\"");
  s.raw(structure_box("slab", Vec3(6, 3, 0.5), Vec3(0, 0, -0.25), {6, 3, 1}, "concrete",
                      "support = [\"-z\"]\n"));
  s.raw(structure_box("striker", Vec3(0.4, 0.4, 0.4), Vec3(-1.5, 0, 1.0), {2, 2, 2}, "concrete",
                      "support = []\npreload = \"none\"\ninitial_velocity = [4.0, 0.0, 0.0]\n"));
  s.raw(
      "[[block]]\nname = \"B\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1, 1, 1]\nposition = [0, 0, "
      "0.5]\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  const double brought = 4.0 * 2450 * 0.064;
  const Vec3 v = o.last().velocity[0];
  EXPECT_GT(2600 * v.x(), 0.9 * brought);
  EXPECT_LT(2600 * v.x(), 2 * brought);
}

TEST(StructuresMeet, StepsGrowSlowlyWithoutBlocks) {
  const Outcome o = run_scene(equal_slabs());
  ASSERT_TRUE(o.ok()) << o.result.message;
  for (const sim::HistoryRow& r : o.rows)
    EXPECT_LT(std::abs(r.ledger.numerical_dissipation()), 0.006 * o.rows.front().ledger.kinetic) << r.time;
  EXPECT_GT(o.rows.back().ledger.strain, 0.01 * o.rows.front().ledger.kinetic);  // they did meet
}

TEST(StructuresMeet, StepsThatGrowResumeToTheBit) {
  const auto [whole, resumed, stopped] = test::run_and_resume(equal_slabs(), 3.7e-3);
  EXPECT_LT(stopped->time(), 4e-3);
  EXPECT_EQ(whole.ledger.kinetic, resumed.ledger.kinetic);
  EXPECT_EQ(whole.ledger.strain, resumed.ledger.strain);
}

/// Two slabs flush side by side, struck at once by a cube on the joint. Nodes on the border of the other's
/// side lie over it or a hair's breadth beside: weights were cut off there, a moment of 6e-12 that failed the
/// audit.
TEST(StructuresMeet, FlushSlabsKeepMoments) {
  SceneText s(Method::by_accuracy(1e-3), 0.03, Vec3::Zero());
  s.history(1e-3)
      .material("slab", 2500, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600)
      .interface("rock", "slab", 0.3, "normal_stiffness = \"1e9 Pa/m\"")
      .interface("slab", "slab", 0.5, "normal_stiffness = \"30 GPa/m\"");
  for (const double x : {-0.5, 0.5})
    s.raw(structure_box(x < 0 ? "left" : "right", Vec3(1, 1, 0.5), Vec3(x, 0, -0.25), {4, 4, 2}, "slab",
                        "support = [\"-z\"]\npreload = \"none\"\n"));
  s.raw(
      "[[block]]\nname = \"B\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [0.5, 0.5, 0.5]\nposition = [0, "
      "0, 0.26]\nvelocity = [0, 0, -2]\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_LT(o.result.audit.worst_moment_imbalance, 1e-13);
  EXPECT_GT(o.rows.back().velocity[0].z(), 1.9);  // it did strike
}

/// What a scene with two boxes that touch by their law is refused for; empty: it is not.
std::string refused(const Vec3& second_size, const Vec3& second_place, const std::string& more = "") {
  SceneText s(Method::by_accuracy(1e-3), 0.01, Vec3(0, 0, -9.81));
  s.material("concrete", 2500, "young = 30e9\npoisson = 0.2").interface("*", "*", 0.5);
  s.raw(more);
  s.raw(structure_box("first", Vec3(2, 2, 2), Vec3(0, 0, 1), {4, 4, 4}, "concrete", ""));
  s.raw(structure_box("second", second_size, second_place, {4, 4, 4}, "concrete",
                      "support = []\npreload = \"none\"\n"));
  try {
    return run_scene(s.str()).ok() ? "" : "it ran and failed";
  } catch (const InputError& e) { return e.what(); }
}

/// Of structures that start inside each other no node meets a face of the partner: they went through each
/// other, without a word. What touches, also by coordinates that were rounded, is none of these.
TEST(StructuresMeet, WhatOverlapsAtTheStartIsRefused) {
  const std::string overlaps = "it overlaps structure first about ";
  for (const auto& [size, place] :
       std::vector<std::pair<Vec3, Vec3>>{{Vec3(1, 1, 1), Vec3(0, 0, 2.4)},       // by a fifth of a cell
                                          {Vec3(1, 1, 1), Vec3(0, 0, 1)},         // within
                                          {Vec3(2, 2, 2), Vec3(0, 0, 1)},         // all of it
                                          {Vec3(6, 0.4, 0.4), Vec3(0, 0.1, 1)}})  // a beam through it
    EXPECT_NE(refused(size, place).find(overlaps), std::string::npos) << place.transpose();
  for (const Vec3& place : {Vec3(0, 0, 2.5), Vec3(0, 0, 2.5 - 1e-8), Vec3(1.5, 0, 1.5), Vec3(1.5, 1.5, 2.5)})
    EXPECT_EQ(refused(Vec3(1, 1, 1), place), "") << place.transpose();
}

}  // namespace
}  // namespace talus::verify
