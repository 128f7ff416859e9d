// Cells that are halved where a block is about to strike ([[structure.refine]] where = "impact").
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "helpers/resumed.hpp"
#include "scene/scene.hpp"
#include "sim/simulation.hpp"
#include "sim/world.hpp"
#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

const std::string at_impact = "[[structure.refine]]\nwhere = \"impact\"\ncell_size = 0.0625\n";

/// A pier of 1 x 1 x 4 m that stands under its weight.
std::string pier(const std::string& cells, const std::string& refine) {
  return "[[structure]]\nname = \"pier\"\nkind = \"column\"\nmaterial = \"concrete\"\nbase = [0, 0, "
         "0]\nsection = [1, 1]\nheight = 4\n" +
         cells + "\n[[structure.probe]]\nname = \"top\"\nat = [0, 0, 4]\n" + refine;
}

SceneText struck_scene(double end) {
  SceneText s(Method::by_accuracy(1e-3), end);
  s.history(2.5e-4).material("rock", 2600).material("concrete", 2450, "young = 33e9\npoisson = 0.2");
  s.interface("*", "*", 0.3, "normal_stiffness = \"1e9 N/m\"");
  return s;
}

std::string boulder(const std::string& name, const Vec3& at, const Vec3& v) {
  return "[[block]]\nname = \"" + name +
         "\"\nmaterial = \"rock\"\nshape = \"dodecahedron\"\nmass = 800\nposition = " + vector(at) +
         "\nvelocity = " + vector(v) +
         "\ndeformable = false\norientation = { rotation_vector = [0.3, 0.2, 0.1] }\n";
}

std::string struck_pier(const std::string& cells, const std::string& refine, double end = 0.015) {
  return struck_scene(end)
      .raw(pier(cells, refine))
      .raw(boulder("B", Vec3(-1.15, 0.05, 2.6), Vec3(15, 0, 0)))
      .str();
}

struct Answer {
  double peak_base = 0, peak_contact = 0, impulse = 0, top = 0;
  long cells = 0;
};

Answer answer(const std::string& text) {
  const Outcome o = run_scene(text);
  EXPECT_TRUE(o.ok()) << o.result.message;
  Answer a;
  a.peak_base = o.rows.back().structures[0].peaks.force.value;
  for (const sim::HistoryRow& r : o.rows) {
    a.top = std::max(a.top, std::abs(r.structures[0].probe_displacement[0].x()));
  }
  for (const ContactSpell& s : spells(resultants(o), 1e-3))
    a.peak_contact = std::max(a.peak_contact, s.peak), a.impulse += s.impulse.norm();
  a.cells = o.simulation->structures()[0]->elements();
  EXPECT_LT(std::abs(o.rows.back().ledger.residual), 1e-9 * o.rows.front().ledger.kinetic);
  return a;
}

/// Peak force, impulse and drift are those of cells as fine throughout, with a fraction of the cells; so is
/// the mean reaction at the base, as far as the cells between carry its waves. Cells that are large where it
/// is struck are 15 % off in the peak force and 6 % in the impulse.
TEST(RefinedWhereStruck, AnswersAsUniformCellsDo) {
  const Answer fine = answer(struck_pier("cell_size = 0.0625", ""));
  struct Given {
    const char* cells;
    double base, share;
  };
  for (const Given& g : {Given{"cell_size = 0.25", 0.02, 0.2}, Given{"cell_size = 0.125", 0.02, 0.3}}) {
    const Answer refined = answer(struck_pier(g.cells, at_impact));
    EXPECT_LT(static_cast<double>(refined.cells), g.share * static_cast<double>(fine.cells)) << g.cells;
    EXPECT_NEAR(refined.peak_contact / fine.peak_contact, 1, 0.02) << g.cells;
    EXPECT_NEAR(refined.impulse / fine.impulse, 1, 0.02) << g.cells;
    EXPECT_NEAR(refined.top / fine.top, 1, 0.02) << g.cells;
    EXPECT_NEAR(refined.peak_base / fine.peak_base, 1, g.base) << g.cells;
  }
  const Answer large = answer(struck_pier("cell_size = 0.25", ""));
  EXPECT_GT(large.peak_contact / fine.peak_contact, 1.1);
  EXPECT_GT(large.impulse / fine.impulse, 1.04);
}

/// A second block strikes elsewhere while the pier rings from the first: its cells are halved in motion, and
/// every joule is accounted for.
TEST(RefinedWhereStruck, AgainBeforeALaterBlowElsewhere) {
  SceneText s = struck_scene(0.12);
  s.raw(pier("cell_size = 0.25", at_impact))
      .raw(boulder("first", Vec3(-1.15, 0.05, 1.2), Vec3(15, 0, 0)))
      .raw(boulder("second", Vec3(0.05, 1.5, 3.3), Vec3(0, -9, 0)));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  const auto& struck = o.simulation->world().struck;
  ASSERT_EQ(struck.size(), 2u);
  EXPECT_TRUE(struck[0].zone.region.contains(Vec3(-0.5, 0.05, 1.2)));
  EXPECT_NEAR(struck[1].zone.region.center().y(), 0.5, 0.1);
  double scheme = 0;
  for (const sim::HistoryRow& r : o.rows)
    scheme = std::max(scheme, std::abs(r.ledger.numerical_dissipation()));
  const double energy = o.rows.front().ledger.kinetic;
  EXPECT_LT(std::abs(o.rows.back().ledger.residual), 1e-9 * energy);
  EXPECT_LT(scheme, 0.01 * energy);
}

struct Seen : sim::Sink {
  sim::HistoryRow last;
  std::vector<std::string> told;
  double kinetic = 0, scheme = 0;
  void warning(const std::string& text) override { told.push_back(text); }
  void history(const sim::HistoryRow& row) override {
    last = row;
    kinetic = std::max(kinetic, row.ledger.kinetic);
    scheme = std::max(scheme, std::abs(row.ledger.numerical_dissipation()));
  }
};

std::string twice_struck(const std::string& cells, double speed, double end = 0.05,
                         const std::string& contact = "1e9 N/m") {
  SceneText s(Method::by_accuracy(1e-3), end);
  s.history(0.002).material("rock", 2600).material("concrete", 2450, "f_cm = \"38 MPa\"");
  s.interface("*", "*", 0.3, "normal_stiffness = \"" + contact + "\"");
  return s
      .raw(pier(
          cells + "\ndamage = \"concrete\"\nrebar = [{ kind = \"longitudinal\", bars = 16, diameter = 0.025, "
                  "cover = 0.04 }]",
          "[[structure.refine]]\nwhere = \"impact\"\ncell_size = 0.125\n"))
      .raw(boulder("first", Vec3(-1.02, 0.05, 1.2), Vec3(speed, 0, 0)))
      .raw(boulder("second", Vec3(0.05, 1.3, 3.3), Vec3(0, -9, 0)))
      .str();
}

/// A pier that the first blow cracked, or tore pieces from: cells that cracked stay, those that the second
/// blow is about to reach are halved, and mass, energy and momentum go on.
TEST(RefinedWhereStruck, ALaterBlowOnACrackedPier) {
  for (const double speed : {5.0, 15.0}) {
    sim::Simulation simulation(scene::read_scene_text(
        twice_struck("cell_size = 0.25", speed, 0.05, speed > 10 ? "hard" : "1e9 N/m"), "/test.toml"));
    Seen seen;
    EXPECT_EQ(simulation.run(seen).exit_code, 0);
    const auto& struck = simulation.world().struck;
    const auto stayed = std::count_if(struck.begin(), struck.end(),
                                      [](const auto& place) { return place.zone.cell_size == 0; });
    EXPECT_GT(stayed, 0) << speed;
    EXPECT_NEAR(struck.back().zone.region.center().y(), 0.5, 0.1) << speed;
    EXPECT_GT(simulation.structures()[0]->damage().largest, 0.5) << speed;
    EXPECT_TRUE(seen.told.empty()) << speed << ": " << seen.told.front();
    EXPECT_LT(std::abs(seen.last.ledger.residual), 1e-9 * seen.kinetic) << speed;
    EXPECT_LT(seen.scheme, 0.02 * seen.kinetic) << speed;
  }
}

/// The second block goes on as from a pier whose cells were small from the start, on at 0.9 of 9 m/s; large
/// ones where it strikes would send it back at 1.3 m/s.
TEST(RefinedWhereStruck, ALaterBlowOnACrackedPierIsThatOfSmallCells) {
  const auto speed = [](const std::string& cells) {
    sim::Simulation simulation(scene::read_scene_text(twice_struck(cells, 5, 0.055), "/test.toml"));
    Seen seen;
    EXPECT_EQ(simulation.run(seen).exit_code, 0);
    return simulation.world().system->state().blocks.v[1].y();
  };
  EXPECT_NEAR(speed("cell_size = 0.25"), speed("cell_size = 0.125"), 0.1);
}

/// Stopped after the cells of a cracked pier were halved, it goes on to the same bits.
TEST(RefinedWhereStruck, ACrackedPierResumesToTheBit) {
  const auto [whole, resumed, stopped] =
      test::run_and_resume(twice_struck("cell_size = 0.25", 15, 0.047, "hard"), 0.0455);
  EXPECT_GT(stopped->world().struck.size(), 2u);
  EXPECT_EQ(whole.ledger.kinetic, resumed.ledger.kinetic);
  EXPECT_EQ(whole.ledger.strain, resumed.ledger.strain);
  EXPECT_EQ(whole.ledger.residual, resumed.ledger.residual);
}

/// What flies past, falls softly, or strikes a skin that has its cells already changes none.
TEST(RefinedWhereStruck, OnlyWhereAndWhenItIsStruck) {
  SceneText s = struck_scene(0.08);
  s.raw(pier("cell_size = 0.25", at_impact))
      .raw(boulder("past", Vec3(-1.6, 1.3, 3), Vec3(20, 0, 0)))
      .raw(boulder("soft", Vec3(0.1, 0, 4.6), Vec3(0, 0, -0.02)));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_TRUE(o.simulation->world().struck.empty());
}

/// A run that is stopped after its cells were halved goes on to the same bits.
TEST(RefinedWhereStruck, ResumesToTheBit) {
  const auto [whole, resumed, stopped] =
      test::run_and_resume(struck_pier("cell_size = 0.25", at_impact), 0.012);
  ASSERT_EQ(stopped->world().struck.size(), 1u);
  EXPECT_EQ(whole.ledger.kinetic, resumed.ledger.kinetic);
  EXPECT_EQ(whole.ledger.strain, resumed.ledger.strain);
  EXPECT_EQ(whole.ledger.residual, resumed.ledger.residual);
}

/// The state that a run ends with is one of a structure whose cells were halved, as it is pushed down.
TEST(RefinedWhereStruck, ItsFinalStateIsPutIntoTheSameCells) {
  const std::string text = struck_pier("cell_size = 0.25", at_impact);
  const Outcome run = run_scene(text);
  const sim::FinalState end = run.simulation->final_state();
  sim::Simulation again(scene::read_scene_text(text, "/test.toml"));
  EXPECT_LT(again.structures()[0]->elements(), run.simulation->structures()[0]->elements());
  again.halve_cells_struck(end);
  Structure& pier = *again.structures()[0];
  ASSERT_EQ(pier.elements(), run.simulation->structures()[0]->elements());
  pier.restore(end.structures.begin()->second.history);
  EXPECT_EQ(pier.skin().node_position(0), run.simulation->structures()[0]->skin().node_position(0));
}

/// A later run begins with the cells that the earlier one halved, in the state and with the contacts that it
/// ended with, and keeps its books; a structure that could not have them is refused.
TEST(RefinedWhereStruck, ALaterRunGoesOnInItsCells) {
  const std::string text = struck_pier("cell_size = 0.25", at_impact, 0.0121);
  const Outcome first = run_scene(text);
  const sim::FinalState state = first.simulation->final_state();
  sim::Simulation second(scene::read_scene_text(text, "/test.toml"));
  second.start_from(state, "first.h5");
  EXPECT_EQ(second.structures()[0]->elements(), first.simulation->structures()[0]->elements());
  test::LastRow sink;
  EXPECT_EQ(second.run(sink).exit_code, 0);
  EXPECT_EQ(second.structures()[0]->elements(), first.simulation->structures()[0]->elements());
  EXPECT_LT(std::abs(sink.last.ledger.residual), 1e-9 * first.rows.front().ledger.kinetic);
  sim::Simulation plain(scene::read_scene_text(struck_pier("cell_size = 0.25", ""), "/test.toml"));
  try {
    plain.start_from(state, "first.h5");
    ADD_FAILURE() << "accepted";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("where = \"impact\""), std::string::npos) << e.what();
  }
}

/// What cannot be is said by the scene.
TEST(RefinedWhereStruck, IsRefusedWhereItCannotBe) {
  const auto problems = [](const std::string& cells, const std::string& refine) {
    try {
      sim::Simulation(scene::read_scene_text(struck_pier(cells, refine), "/test.toml"));
    } catch (const InputError& e) { return std::string(e.what()); }
    return std::string();
  };
  EXPECT_NE(problems("cell_size = 0.25", "[[structure.refine]]\ncell_size = 0.1\n").find("needs its place"),
            std::string::npos);
  EXPECT_NE(problems("cell_size = 0.25\nsupport = []\npreload = \"none\"", at_impact).find("with supports"),
            std::string::npos);
  EXPECT_NE(problems("cell_size = 0.25", at_impact + "local = true\n").find("no meaning"), std::string::npos);
  EXPECT_EQ(problems("cells = [4, 4, 16]", at_impact), "");
}

}  // namespace
}  // namespace talus::verify
