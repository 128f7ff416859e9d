// Blocks and structures: bad starts, and what one run hands on to the next.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <limits>
#include <set>

#include "core/error.hpp"
#include "sim/audit.hpp"
#include "sim/simulation.hpp"
#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

/// A wall of concrete, 1 m thick, its near face at x = -0.5, and a cube of this size with its centroid at x.
std::string wall(double x, double size, const std::string& more = {}, double speed = 10, double end = 0.01) {
  SceneText s(Method::by_accuracy(1e-3), end, Vec3::Zero(), more);
  s.history(end / 10)
      .material("concrete", 2450, "f_cm = \"38 MPa\"")
      .material("rock", 2600)
      .interface("rock", "concrete", 0.5)
      .interface("concrete", "concrete", 0.5);
  s.box("B", Vec3(size, size, size), Vec3(x, 0.01, 1.02), velocity(Vec3(speed, 0, 0)));
  return s
      .raw(structure_box("wall", Vec3(1, 2, 2), Vec3(0, 0, 1), {4, 8, 8}, "concrete",
                         std::string(held_below) + "damage = \"concrete\"\n"))
      .str();
}

std::string refusal(const std::string& text) {
  try {
    run_scene(text);
  } catch (const InputError& e) { return e.what(); }
  return {};
}

/// A thin wall that a cube of 325 kg sets in motion at 20 m/s, and behind it, out of its reach as the stretch
/// begins, a small one: how long stretches are is no matter.
TEST(StruckSkins, MeetWhatOnlyTheBlowBringsThemTo) {
  const auto speed_behind = [](double interval) {
    SceneText s(Method::by_accuracy(1e-3), 0.04, Vec3::Zero());
    s.history(interval)
        .material("steel", 7800, "young = 30e9\npoisson = 0.2")
        .material("rock", 2600)
        .interface("*", "*", 0);
    s.box("striker", Vec3(0.5, 0.5, 0.5), Vec3(-0.31, 0, 1), velocity(Vec3(20, 0, 0)));
    s.box("behind", Vec3(0.2, 0.2, 0.2), Vec3(0.16, 0, 1));
    const Outcome o = run_scene(s.raw(structure_box("wall", Vec3(0.1, 2, 2), Vec3(0, 0, 1), {1, 8, 8},
                                                    "steel", std::string(held_below)))
                                    .str());
    EXPECT_TRUE(o.ok()) << o.result.message;
    double fastest = 0;
    for (const sim::HistoryRow& r : o.rows) fastest = std::max(fastest, r.velocity[1].x());
    return std::pair(fastest, o.last().position[1].x());
  };
  const auto fine = speed_behind(0.001), coarse = speed_behind(0.04);
  EXPECT_GT(fine.first, 1);
  EXPECT_NEAR(coarse.first, fine.first, 0.05 * fine.first);
  EXPECT_NEAR(coarse.second, fine.second, 0.05 * fine.second);
}

/// Edges that cross deep inside each other are no touch; the block was taken to be clear of the structure.
TEST(BadStart, EdgesThatCrossDeepInsideAreAnOverlap) {
  SceneText s(Method::by_accuracy(1e-3), 0.01, Vec3::Zero());
  s.material("concrete", 2450, "f_cm = \"38 MPa\"").material("rock", 2600).interface("rock", "concrete", 0.5);
  s.box("B", Vec3(1.04, 1.13, 0.42), Vec3(-0.281, -0.487, -0.617),
        "orientation = { rotation_vector = [0.30, -0.35, 1.09] }\n");
  s.raw(structure_box("beam", Vec3(1.2, 0.6, 0.6), Vec3::Zero(), {4, 2, 2}, "concrete",
                      "orientation = { rotation_vector = [-0.42, 0.29, 0.89] }\nsupport = [\"-x\"]\n"));
  const std::string message = refusal(s.str());
  EXPECT_NE(message.find("overlaps structure beam by 0.05"), std::string::npos) << message;
}

TEST(BadStart, OverlapNamesTheStructureAndTheDepth) {
  const std::string message = refusal(wall(-0.7, 0.5));
  EXPECT_NE(message.find("block.B.position"), std::string::npos) << message;
  EXPECT_NE(message.find("overlaps structure wall by 0.05 m"), std::string::npos) << message;
}

TEST(BadStart, BlockInsideAStructureIsFound) {
  const std::string message = refusal(wall(0.01, 0.1));
  EXPECT_NE(message.find("structure wall lie one inside the other"), std::string::npos) << message;
}

/// A cube that meets a rigid wall a hair before a history row: the impulse of no duration is told as the mean
/// force over no sliver of a step. It was 1e12 N over 4e-11 s.
TEST(RigidImpacts, AreToldAsMeansOverWhatTheyBelongTo) {
  for (const char* scheme : {"rigid", "one-way"}) {
    const Outcome o = run_scene(wall(-0.8 + 1e-9, 0.5, fmt::format("[coupling]\nscheme = \"{}\"\n", scheme)));
    ASSERT_TRUE(o.ok()) << o.result.message;
    ASSERT_FALSE(o.structure_contacts.empty());
    double impulse = 0;
    for (const sim::ContactRow& r : o.structure_contacts) {
      EXPECT_GT(r.dt, 0.05 * 1e-3) << scheme;
      impulse += r.dt * r.force.x();
    }
    EXPECT_NEAR(impulse, 2600 * 0.125 * (10 - o.last().velocity[0].x()), 1e-9 * impulse) << scheme;
  }
}

TEST(BadStart, TouchingIsAllowed) { EXPECT_TRUE(run_scene(wall(-0.75, 0.5, {}, 0.1, 1e-3)).ok()); }

/// A cube on the ground beside the foot of an elastic column, into which gravity's preload bulges the column
/// by half a micrometre; `inside` [m] of the cube is the user's.
std::string beside_a_column(const char* stiffness, double inside, const std::string& preload) {
  SceneText s(Method::by_accuracy(1e-3), 0.05, Vec3(0, 0, -9.81));
  s.history(5e-3)
      .material("concrete", 2500, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600, "young = 40e9\npoisson = 0.25");
  s.interface("*", "*", 0.5, fmt::format("normal_stiffness = \"{}\"", stiffness));
  s.box("ground", Vec3(4, 4, 1), Vec3(1.5, 0, -0.5), "fixed = true\n")
      .box("B", Vec3::Constant(0.5), Vec3(1.25 - inside, 0.02, 0.25));
  return s
      .raw(
          structure_box("column", Vec3(2, 2, 4), Vec3(0, 0, 2), {4, 4, 8}, "concrete",
                        fmt::format("support = [\"-z\"]\npreload = \"{}\"\ndamping_ratio = 0.05\n", preload)))
      .str();
}

TEST(Preload, MayMoveASkinIntoABlockThatIsFlush) {
  for (const char* stiffness : {"hard", "5 GPa/m", "1 GN/m"}) {
    std::string told;
    const sim::Simulation simulation(
        scene::read_scene_text(beside_a_column(stiffness, 0, "gravity"), "/test.toml"),
        [&](const std::string& line) { told += line + "\n"; });
    EXPECT_NE(told.find("gravity preload moved its surface into block B by up to 5"), std::string::npos)
        << stiffness << told;
    const Outcome o = run_scene(beside_a_column(stiffness, 0, "gravity"));
    ASSERT_TRUE(o.ok()) << o.result.message;
    for (const auto& r : o.rows) EXPECT_LT(r.velocity[1].norm(), 1e-3) << stiffness;  // nothing pushes it
    EXPECT_NEAR(o.last().position[1].x(), 1.25, 1e-6) << stiffness;
    const std::string message = refusal(beside_a_column(stiffness, 1e-4, "gravity"));
    EXPECT_NE(message.find("overlaps structure column by 0.0001005"), std::string::npos)
        << stiffness << message;
    EXPECT_NE(refusal(beside_a_column(stiffness, 5e-7, "none")).find("overlaps structure column by 5e-07"),
              std::string::npos)
        << stiffness;  // no preload made that
  }
}

/// A block may have the name that a piece had in the run that this one goes on from: pieces that come off now
/// are numbered past it.
TEST(Pieces, GetNamesThatNoBlockHas) {
  SceneText s(Method::by_accuracy(1e-2), 0.12, Vec3(0, 0, -9.81),
              "initial_state = \"" TALUS_SOURCE_DIR
              "/CMakeLists.txt\"");  // is there, and nobody reads it here
  s.history(2e-2)
      .material("concrete", 2450, "f_cm = \"30 MPa\"")
      .material("rock", 2600)
      .interface("*", "*", 0.5);
  s.box("pier.fragment1", Vec3::Ones(), Vec3(6, 0, 0.5))
      .box("striker", Vec3(0.8, 0.8, 0.8), Vec3(-1.2, 0.05, 1.6), velocity(Vec3(30, 0, 0)));
  const Outcome o = run_scene(
      s.raw("[[structure]]\nname = \"pier\"\nkind = \"column\"\nmaterial = \"concrete\"\nbase = [0, 0, "
            "0]\nsection = [0.4, 0.4]\nheight = 3.0\ncell_size = \"0.2 m\"\ndamage = \"concrete\"\n")
          .str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  const auto& blocks = o.simulation->header().blocks;
  ASSERT_GT(blocks.size(), 2U);
  std::set<std::string> names;
  for (const auto& b : blocks) EXPECT_TRUE(names.insert(b.name).second) << b.name;
  EXPECT_EQ(blocks[2].name, "pier.fragment2");
}

TEST(BadStart, CouplingNeedsAStructure) {
  SceneText s(Method::by_accuracy(1e-3), 0.1);
  s.material("rock", 2600).interface("rock", "rock", 0.5).box("B", Vec3::Ones(), Vec3::Zero());
  const std::string message = refusal(s.raw("[coupling]\nscheme = \"two-way\"\n").str());
  EXPECT_NE(message.find("no structure to couple"), std::string::npos) << message;
}

TEST(SmallBlocks, AreWarnedOfWithTheConsequence) {
  const auto warnings = [](double size) {
    const sim::Simulation simulation(scene::read_scene_text(wall(-0.8, size), "/test.toml"));
    std::string all;
    for (const Problem& p : simulation.scene().warnings) all += p.str() + "\n";
    return all;
  };
  EXPECT_NE(warnings(0.1).find("thinner than 0.5 of a cell face"), std::string::npos) << warnings(0.1);
  EXPECT_EQ(warnings(0.2).find("thinner than"), std::string::npos) << warnings(0.2);  // cells of 0.25 m
}

TEST(InitialState, CarriesDamageOnAndStartsItsBooksAnew) {
  const Outcome first = run_scene(wall(-0.76, 0.5, {}, 6));
  ASSERT_TRUE(first.ok());
  const double damage = first.last().structures[0].damage_max;
  ASSERT_GT(damage, 0.1);
  const sim::FinalState state = first.simulation->final_state();
  // The block goes on from where it was; the structure keeps displacement and damage.
  sim::Simulation second(scene::read_scene_text(wall(-0.76, 0.5, {}, 6), "/test.toml"));
  second.start_from(state, "first.h5");
  class Last : public sim::Sink {
   public:
    void history(const sim::HistoryRow& row) override { rows.push_back(row); }
    std::vector<sim::HistoryRow> rows;
  } sink;
  EXPECT_EQ(second.run(sink).exit_code, 0);
  EXPECT_EQ(sink.rows.front().time, 0);
  EXPECT_EQ(sink.rows.front().position[0], first.last().position[0]);
  EXPECT_EQ(sink.rows.front().velocity[0], first.last().velocity[0]);
  EXPECT_EQ(sink.rows.front().structures[0].damage_max, damage);
  EXPECT_EQ(sink.rows.front().ledger.damage_work, 0);
  EXPECT_GE(sink.rows.back().structures[0].damage_max, damage);
  EXPECT_LT(std::abs(sink.rows.back().ledger.residual), 0.01 * first.rows.front().ledger.kinetic);
}

/// A column, and a cube that flies towards it at mid-height.
std::string struck_column(double x, double end, const std::string& more = {}, const std::string& load = {}) {
  SceneText s(Method::by_accuracy(1e-3), end, Vec3(0, 0, -9.81), more);
  s.history(1e-4)
      .material("concrete", 2450, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600)
      .interface("rock", "concrete", 0.5);
  s.box("B", Vec3(0.5, 0.5, 0.5), Vec3(x, 0, 3.5), velocity(Vec3(8, 0, 0)));
  return s
      .raw(
          "[[structure]]\nname = \"P\"\nkind = \"column\"\nmaterial = \"concrete\"\nbase = [0, 0, "
          "0]\nsection = [1, 1]\nheight = 4\ncell_size = 0.5\n" +
          load)
      .str();
}

/// One that stands bent under a steady load as the second run begins, as it might ring: reactions count from
/// those under its weight, not from those of the moment.
TEST(InitialState, ReactionsCountFromThePermanentLoad) {
  const std::string load =
      "damping_ratio = 0.5\n[[structure.load]]\nregion = { min = [-1, -1, 3], max = [-0.49, 1, 4] "
      "}\ntraction = [1e6, 0, 0]\n";
  const Outcome first = run_scene(struck_column(-9, 0.3, {}, load));
  ASSERT_TRUE(first.ok());
  const Vec3 weight(0, 0, -4 * 2450 * 9.81);
  EXPECT_LT((first.simulation->header().structures[0].permanent.head<3>() - weight).norm(),
            1e-6 * weight.norm());
  ASSERT_NEAR((first.last().structures[0].base_force - weight).norm(), 1e6, 5e4);
  sim::FinalState state = first.simulation->final_state();
  state.blocks.clear();
  sim::Simulation second(scene::read_scene_text(struck_column(-9, 0.03, {}, load), "/test.toml"));
  second.start_from(state, "first.h5");
  EXPECT_LT((second.header().structures[0].permanent.head<3>() - weight).norm(), 1e-6 * weight.norm());
  class Last : public sim::Sink {
   public:
    void history(const sim::HistoryRow& row) override { row_ = row; }
    sim::HistoryRow row_;
  } sink;
  EXPECT_EQ(second.run(sink).exit_code, 0);
  EXPECT_NEAR(sink.row_.structures[0].peaks.force.value, 1e6, 1e5);
}

/// What the first run bent away makes room for a block that would overlap the structure as it was built.
TEST(InitialState, BlocksMayStandWhereTheStructureHasLeft) {
  const std::string
      load =
          "[[structure.load]]\nregion = { min = [-1, -1, 3], max = [-0.49, 1, 4] }\ntraction = [1e6, 0, 0]\n",
      file = "initial_state = \"" TALUS_SOURCE_DIR "/CMakeLists.txt\"";
  const Outcome first = run_scene(struck_column(-5, 0.02, {}, load));
  ASSERT_TRUE(first.ok());
  sim::FinalState state = first.simulation->final_state();
  state.blocks.clear();
  double left = 1;  // by which its upper part has left
  for (const Vec3& x : first.simulation->structures()[0]->skin().surface().vertices)
    if (x.x() < -0.4 && x.z() > 2.9) left = std::min(left, x.x() + 0.5);
  ASSERT_GT(left, 1e-4);
  ASSERT_LT(left, 0.05);
  EXPECT_NE(refusal(struck_column(-0.75 + 0.5 * left, 0.02, {}, load)).find("overlaps structure P"),
            std::string::npos);
  sim::Simulation second(
      scene::read_scene_text(struck_column(-0.75 + 0.5 * left, 0.02, file, load), "/test.toml"));
  EXPECT_NO_THROW(second.start_from(state, "first.h5"));
  sim::Simulation third(scene::read_scene_text(struck_column(-0.70, 0.02, file, load), "/test.toml"));
  EXPECT_THROW(third.start_from(state, "first.h5"), InputError);
}

TEST(InitialState, AnotherMeshIsRefused) {
  const sim::FinalState state = run_scene(wall(-0.9, 0.5, {}, 1, 1e-3)).simulation->final_state();
  const auto said = [&](const std::string& from, const std::string& to) {
    std::string other = wall(-0.9, 0.5, {}, 1, 1e-3);
    other.replace(other.find(from), from.size(), to);
    sim::Simulation second(scene::read_scene_text(other, "/test.toml"));
    try {
      second.start_from(state, "first.h5");
    } catch (const InputError& e) { return std::string(e.what()); }
    return std::string("accepted");
  };
  const std::string finer = said("cells = [4, 8, 8]", "cells = [4, 8, 9]"),
                    aside = said("position = [0.0, 0.0, 1.0]", "position = [0.125, 0.0, 1.0]");
  EXPECT_NE(finer.find("another mesh"), std::string::npos) << finer;
  EXPECT_NE(aside.find("its nodes elsewhere there, by up to 0.125 m"), std::string::npos) << aside;
}

/// A displacement that is no number reaches every energy: the run fails, whatever else went well.
TEST(Failure, AMotionThatIsNoNumberEndsTheRun) {
  const std::string text = struck_column(-0.9, 0.02);
  sim::Checkpoint state = sim::Simulation(scene::read_scene_text(text, "/test.toml")).save();
  std::vector<double>& column = state.numbers.at("structure0");
  column[column.size() / 2] = std::numeric_limits<double>::quiet_NaN();
  sim::Simulation run(scene::read_scene_text(text, "/test.toml"));
  run.restore(state);
  sim::Sink sink;
  const sim::RunResult result = run.run(sink);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.message.find("is no number"), std::string::npos) << result.message;
}

TEST(Audit, EachGateFailsTheRun) {
  const sim::InterfaceAudit sound{
      .worst_force_imbalance = 1e-15, .worst_moment_imbalance = 1e-15, .impulse_defect = 1e-12, .met = {}};
  EXPECT_EQ(sim::audit_failure(sound, 0.009, 0.009, 0.009), "");
  const auto with = [&](double sim::InterfaceAudit::*of, double value) {
    sim::InterfaceAudit a = sound;
    a.*of = value;
    return sim::audit_failure(a, 0, 0, 0);
  };
  EXPECT_NE(with(&sim::InterfaceAudit::worst_force_imbalance, 2e-12).find("force imbalance 2e-12"),
            std::string::npos);
  EXPECT_NE(with(&sim::InterfaceAudit::worst_moment_imbalance, 2e-12).find("moment imbalance 2e-12"),
            std::string::npos);
  EXPECT_NE(with(&sim::InterfaceAudit::impulse_defect, 2e-9).find("impulse defect 2e-09"), std::string::npos);
  EXPECT_NE(with(&sim::InterfaceAudit::worst_force_imbalance, NAN).find("force imbalance nan"),
            std::string::npos);
  EXPECT_NE(sim::audit_failure(sound, 0.02, 0, 0).find("energy residual"), std::string::npos);
  EXPECT_NE(sim::audit_failure(sound, 0, 0.02, 0).find("numerical energy gain over"), std::string::npos);
  EXPECT_NE(sim::audit_failure(sound, 0, 0, 0.02).find("numerical energy gain of one step"),
            std::string::npos);
}

TEST(OneWay, PutsTheRecordedLoadsOnTheStructure) {
  SceneText s(Method::by_accuracy(1e-3), 0.03, Vec3::Zero());
  s.history(1e-3)
      .material("concrete", 2450, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600)
      .interface("rock", "concrete", 0, "normal_stiffness = \"1 GPa/m\"");
  s.box("B", Vec3(0.5, 0.5, 0.5), Vec3(-0.76, 0.01, 1.02), velocity(Vec3(5, 0, 0)));
  s.raw(structure_box("wall", Vec3(1, 2, 2), Vec3(0, 0, 1), {4, 8, 8}, "concrete", std::string(held_below)));
  const Outcome o = run_scene(s.raw("[coupling]\nscheme = \"one-way\"\n").str());
  ASSERT_TRUE(o.ok());
  // The rigid surface gives everything back; the structure moves all the same, under the same impulse.
  EXPECT_NEAR(o.last().velocity[0].x(), -5, 0.05);
  EXPECT_NEAR(o.result.audit.impulse_on_structure.x(), 2 * 5 * 2600 * 0.125, 0.02 * 3250);
  EXPECT_GT(o.last().ledger.external_work, 0);
  for (const auto& r : o.rows)
    EXPECT_LT(std::abs(r.ledger.residual), 1e-11 * o.rows.front().ledger.kinetic) << r.time;
}

/// A cube of 2.6 t that comes down on a slab of 0.5 m at 5 m/s, which it does not yield to.
Outcome slab_struck(double every, const std::string& law, const std::string& scheme = "one-way") {
  SceneText s(Method::by_accuracy(1e-3), 0.04, Vec3::Zero());
  s.history(every)
      .material("concrete", 2500, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600)
      .interface("rock", "concrete", 0, law);
  s.box("B", Vec3(1, 1, 1), Vec3(0, 0, 0.51), velocity(Vec3(0, 0, -5)));
  s.raw(
      structure_box("slab", Vec3(4, 4, 1), Vec3(0, 0, -0.5), {8, 8, 2}, "concrete", std::string(held_below)));
  return run_scene(s.raw("[coupling]\nscheme = \"" + scheme + "\"\n").str());
}

/// An impulse acts for as long as the structure's step is, whatever rows are written: it was spread from the
/// blow to the next row.
TEST(OneWay, ABlowActsAsLongAtAnyHistoryInterval) {
  for (const char* law : {"normal_stiffness = \"hard\"", "normal_stiffness = \"hard\"\nrestitution = 0.5",
                          "normal_stiffness = \"1 GPa/m\"\nrestitution = 0.5"}) {
    SCOPED_TRACE(law);
    const Outcome often = slab_struck(1e-3, law), seldom = slab_struck(0.01, law);
    ASSERT_TRUE(often.ok() && seldom.ok());
    EXPECT_NEAR(seldom.result.audit.impulse_on_structure.z() / often.result.audit.impulse_on_structure.z(), 1,
                0.01);
    // Sub-steps end at rows: others.
    EXPECT_NEAR(seldom.last().structures[0].peaks.force.value / often.last().structures[0].peaks.force.value,
                1, 0.03);
  }
}

/// Restitution by dashpots of the springs that are given, as at a structure that yields; it was an impulse,
/// and the stiffness without effect.
TEST(OneWay, RestitutionLeavesTheSpringItsDuration) {
  const std::string law = "normal_stiffness = \"1 GPa/m\"\nrestitution = 0.5";
  const Outcome apart = slab_struck(0.01, law), together = slab_struck(0.01, law, "two-way");
  ASSERT_TRUE(apart.ok() && together.ok());
  EXPECT_NEAR(apart.last().velocity[0].z(), 2.5, 0.05);
  // The spring gives 1 GN/m, the slab some 50 GN/m: what it yields changes the force by some per cent.
  EXPECT_NEAR(apart.last().structures[0].peaks.force.value / together.last().structures[0].peaks.force.value,
              1, 0.05);
}

/// A column under a steady traction that no block touches, by this scheme.
std::string loaded_column(const std::string& scheme) {
  SceneText s(Method::by_accuracy(1e-3), 0.02, Vec3(0, 0, -9.81));
  s.history(1e-3)
      .material("concrete", 2450, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600)
      .interface("rock", "concrete", 0);
  s.box("B", Vec3(0.5, 0.5, 0.5), Vec3(-5, 0, 9));
  s.raw(
      "[[structure]]\nname = \"P\"\nkind = \"column\"\nmaterial = \"concrete\"\nbase = [0, 0, 0]\nsection = "
      "[1, 1]\nheight = 4\ncell_size = 0.5\nsupport = [\"-z\"]\n");
  s.raw("[[structure.load]]\nregion = { min = [-1, -1, 3], max = [-0.49, 1, 4] }\ntraction = [1e6, 0, 0]\n");
  return s.raw(fmt::format("[coupling]\nscheme = \"{}\"\n", scheme)).str();
}

/// Base reactions, members and their peaks were left out of the rows: the summary told of zeros.
TEST(OneWay, TellsWhatTheStructureCarries) {
  const Outcome together = run_scene(loaded_column("two-way")), apart = run_scene(loaded_column("one-way"));
  ASSERT_TRUE(together.ok() && apart.ok());
  const auto &a = together.last().structures[0], &b = apart.last().structures[0];
  EXPECT_GT(b.peaks.force.value, 0.5e6);
  EXPECT_NEAR(b.peaks.force.value, a.peaks.force.value, 1e-6 * a.peaks.force.value);
  ASSERT_EQ(b.members.size(), 1U);
  ASSERT_EQ(b.peaks.members.size(), 1U);
  EXPECT_NEAR(b.peaks.members[0].shear.value, a.peaks.members[0].shear.value,
              1e-6 * a.peaks.members[0].shear.value);
  EXPECT_EQ(apart.simulation->header().structures[0].members.size(), 1U);
  EXPECT_TRUE(apart.simulation->header().structures[0].loaded);
}

TEST(Rigid, WarnsOfALoadThatHasNoEffect) {
  const sim::Simulation simulation(scene::read_scene_text(loaded_column("rigid"), "/test.toml"));
  std::string all;
  for (const Problem& p : simulation.warnings()) all += p.str() + "\n";
  EXPECT_NE(all.find("structure.P.load: has no effect"), std::string::npos) << all;
  EXPECT_FALSE(simulation.header().structures[0].loaded);
  EXPECT_TRUE(simulation.header().structures[0].members.empty());
}

/// A block that fell asleep pressed no more: what the base carried beyond the slab was gone.
TEST(OneWay, WhatSleepsGoesOnPressing) {
  SceneText s(Method::by_accuracy(1e-3), 0.6, Vec3(0, 0, -9.81));
  s.history(1e-2)
      .material("concrete", 2500, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600)
      .interface("rock", "concrete", 0.5, "normal_stiffness = \"1e8 N/m\"");
  s.box("B", Vec3(0.5, 0.5, 0.5), Vec3(0, 0, 0.25));
  s.raw(structure_box("slab", Vec3(2, 2, 0.5), Vec3(0, 0, -0.25), {4, 4, 2}, "concrete",
                      "support = [\"-z\"]\npreload = \"gravity\"\ndamping_ratio = 0.3\n"));
  const Outcome o = run_scene(s.raw("[coupling]\nscheme = \"one-way\"\n").str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  const double slab = 2 * 2 * 0.5 * 2500 * 9.81, block = 0.125 * 2600 * 9.81;
  EXPECT_GT(o.result.counters.asleep_skipped, 0);
  EXPECT_NEAR(o.last().structures[0].base_force.z(), -slab - block, 2e-3 * block);
}

/// Coupled steps of 5 ms in which a cube of 0.4 t lies on a slab, or comes down on it from 0.1 mm, and moves
/// along at 20 m/s; over those that the slab's own stable step asks for.
double steps_over_stable(double height, double down) {
  SceneText s(Method::by_accuracy(1e-3), 5e-3, Vec3(0, 0, -9.81));
  s.history(5e-3)
      .material("concrete", 2450, "young = 30e9\npoisson = 0.2")
      .material("rock", 3200)
      .interface("rock", "concrete", 0.3);
  s.box("B", Vec3(0.5, 0.5, 0.5), Vec3(0.1, 0.01, 0.75 + height), velocity(Vec3(20, 0, -down)));
  s.raw(structure_box("slab", Vec3(2, 2, 0.5), Vec3(0.3, 0, 0.25), {8, 8, 2}, "concrete",
                      "support = [\"-z\"]\npreload = \"gravity\"\nintegrator = \"explicit\"\n"));
  const Outcome o = run_scene(s.str());
  EXPECT_TRUE(o.ok());
  EXPECT_GT(o.result.audit.impulse_on_structure.norm(), 0);
  return static_cast<double>(o.result.counters.structure_steps) *
         o.simulation->structures()[0]->critical_step() / 5e-3;
}

TEST(Rise, WhatSlidesAlongSetsNoStepAndABlowDoes) {
  EXPECT_LT(steps_over_stable(0, 0), 1.2);
  EXPECT_GT(steps_over_stable(1e-4, 10), 1.5);
}

/// A cube that rolls over an edge on another one, which lies on a slab: each sub-step turns it a little into
/// the face below.
TEST(Drift, IsLedBackOnceItShowsNotEachSubStep) {
  constexpr double accuracy = 1e-3, half = 0.25, tilt = 0.2, duration = 40e-3;
  SceneText s(Method::by_accuracy(accuracy), duration, Vec3(0, 0, -9.81));
  s.history(duration)
      .material("concrete", 2450, "young = 30e9\npoisson = 0.2")
      .material("rock", 3200)
      .interface("rock", "concrete", 0.6)
      .interface("rock", "rock", 0.6);
  s.box("below", Vec3(0.5, 0.5, 0.5), Vec3(0, 0, 0.75));
  const double over =
      half * (std::cos(tilt) + std::sin(tilt));  // centre of the tilted cube over its lowest edge
  s.box("above", Vec3(0.5, 0.5, 0.5), Vec3(0.02, 0, 1.0 + over),
        turned(Vec3(0, tilt, 0)) + spin(Vec3(0, 4, 0)));
  s.raw(structure_box("slab", Vec3(2, 2, 0.5), Vec3(0, 0, 0.25), {4, 4, 2}, "concrete",
                      "support = [\"-z\"]\npreload = \"gravity\"\nintegrator = \"explicit\"\n"));
  const Outcome o = run_scene(s.str());
  EXPECT_TRUE(o.ok());
  EXPECT_GT(o.result.counters.structure_steps, 500);
  EXPECT_GT(o.result.counters.worst_penetration,
            1e-9);  // below a millionth of what the accuracy allows none is led back
  EXPECT_LE(o.result.counters.worst_penetration, 1e-2 * accuracy * 2 * half);
}

}  // namespace
}  // namespace talus::verify
