// What the summary of a recorded run tells.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/error.hpp"
#include "helpers/place.hpp"
#include "io/hdf5_file.hpp"
#include "io/journal.hpp"
#include "io/recorder.hpp"
#include "io/results.hpp"
#include "recorded.hpp"

namespace fs = std::filesystem;
using namespace talus;
using talus::test::Place;
using talus::test::recorder_options;
using talus::test::small;
using talus::test::SyntheticRun;
using talus::test::whole_run;

TEST(Recorder, ImpactInTheSummaryHasTheImpulseThatWasPutIn) {
  const Place scratch;
  const SyntheticRun run = small();
  const auto j = nlohmann::json::parse(io::read_file(whole_run(scratch, run) / "summary.json"));
  ASSERT_EQ(j["impacts"].size(), 1u);
  const auto& impact = j["impacts"][0];
  double sum = 0, peak = 0;
  for (int k = 0; k < 200; ++k) {
    const double f = run.force(run.impact + (k + 0.5) * 1e-4);
    sum += f * 1e-4;
    peak = std::max(peak, f * std::hypot(1.0, 0.1));
  }
  EXPECT_NEAR(impact["impulse"][0].get<double>(), sum, 1e-9 * sum);
  EXPECT_NEAR(impact["peak_force"].get<double>(), peak, 1e-9 * peak);
  EXPECT_NEAR(impact["start"].get<double>(), run.impact, 1e-9);
  EXPECT_NEAR(impact["end"].get<double>(), run.impact + run.contact_time, 1e-9);
  EXPECT_NEAR(impact["mean_force"].get<double>(), sum * std::hypot(1.0, 0.1) / run.contact_time, 1e-6 * peak);
  EXPECT_TRUE(j["hit"].get<bool>());
  EXPECT_EQ(j["structures"][0]["name"], "P2");
  // The synthetic block turns with a tenth of the energy that it moves with.
  EXPECT_NEAR(impact["kinetic_rotational"].get<double>() / impact["kinetic_translational"].get<double>(), 0.1,
              1e-9);
  EXPECT_NEAR((impact["kinetic_rotational"].get<double>() + impact["kinetic_translational"].get<double>()) /
                  impact["kinetic"].get<double>(),
              1, 1e-12);
  EXPECT_NE(j["headline"][0].get<std::string>().find(" of rotation)"), std::string::npos) << j["headline"];
}

/// What the run's plan tells of a structure is not told again for the structure.
TEST(Recorder, EveryLineOfThePlanStandsOnce) {
  sim::RunHeader header = small().header();
  header.structures[0].plan = "P2: hexahedra 4 x 4 x 24\nno reinforcement: none was given";
  header.plan = {"Structure P2: 384 elements.", "  P2: hexahedra 4 x 4 x 24"};
  io::SummaryBuilder builder(header);
  const nlohmann::json j = nlohmann::json::parse(builder.text(nullptr));
  EXPECT_EQ(j["plan"].size(), 3u) << j["plan"];
  EXPECT_EQ(j["plan"][2], "P2: no reinforcement: none was given");
}

/// Closed forms are of sound structures: forces at the base of one that cracked are not verified by them.
TEST(Recorder, WhatCrackedIsNotCalledVerified) {
  const SyntheticRun run = small();
  const auto confidence = [&](double end) {
    io::SummaryBuilder builder(run.header());
    for (const double t : {0.0, end}) builder.add(run.row(t, run.blocks));
    std::map<std::string, std::string> levels;
    const nlohmann::json j = nlohmann::json::parse(builder.text(nullptr));
    for (const auto& c : j["confidence"])
      levels[c["quantity"].get<std::string>()] = c["level"].get<std::string>();
    return levels;
  };
  EXPECT_EQ(confidence(1).at("elastic response, base forces, displacement"), "verified");
  const auto cracked = confidence(run.impact + 1);
  for (const auto& [quantity, level] : cracked)
    EXPECT_TRUE(level == "extrapolated" || quantity.find("base forces") == std::string::npos) << quantity;
  EXPECT_EQ(cracked.count("base forces, section forces, displacement of what cracked (P2)"), 1u);
}

TEST(Recorder, DesignFormulasStandBesideTheStrongestImpact) {
  using json = nlohmann::json;
  const Place scratch;
  const json j = json::parse(io::read_file(whole_run(scratch, small()) / "summary.json"));
  ASSERT_EQ(j["formulas"].size(), 3u);  // no cushion: Hertz, hard impact, punching
  const json impact = j["impacts"][j["formulas"][0]["impact"].get<std::size_t>()];
  const json block = j["blocks"][0];
  ASSERT_EQ(impact["block"], block["name"]);
  for (const json& f : j["formulas"]) {
    EXPECT_EQ(f["structure"], "P2");
    EXPECT_FALSE(f["inputs"].get<std::string>().empty());
    EXPECT_EQ(f["computed"], f["kind"] == "equivalent static" ? impact["mean_force"]
                             : f["kind"] == "resistance"      ? impact["filtered_force"]
                                                              : impact["peak_force"])
        << f["id"];
    EXPECT_EQ(f["status"].get<std::string>().find("unverified") == std::string::npos, f["id"] == "hertz")
        << f["id"];
    if (f["id"] != "en1991-hard") continue;
    // v sqrt(k m), k = E A / D of a sphere of the block's volume, v along the normal, which is x here.
    const double diameter = std::cbrt(6 * block["volume"].get<double>() / M_PI),
                 k = 30e9 * M_PI * diameter / 4, v = std::abs(impact["velocity"][0].get<double>());
    EXPECT_NEAR(f["value"].get<double>() / (v * std::sqrt(k * block["mass"].get<double>())), 1, 1e-9);
  }
}

TEST(Recorder, DesignFormulasTakeTheStructuresOwnSection) {
  SyntheticRun run = small();
  const auto formulas = [&](const sim::RunHeader& header) {
    io::SummaryBuilder builder(header);
    builder.add(run.row(run.impact, 2));
    builder.add(run.contact_rows(run.impact, run.impact + 0.1));
    return nlohmann::json::parse(builder.text(nullptr))["formulas"];
  };
  sim::RunHeader header = run.header();
  header.structures[0].axes = {Vec3::UnitY(), Vec3::UnitX(),
                               Vec3::UnitZ()};  // the blow comes along x: the second
  header.structures[0].effective_depth = Vec3(1, 1.93, 1);
  header.structures[0].reinforcement_ratio = Vec3(0.01, 0.004, 0);
  header.structures[0].cushion = true;
  const auto with = formulas(header);
  ASSERT_EQ(with.size(), 6u);
  EXPECT_NE(with[5]["inputs"].get<std::string>().find("d = 1.93 m (section less cover)"), std::string::npos)
      << with[5]["inputs"];
  EXPECT_NE(with[5]["inputs"].get<std::string>().find("rho = 0.004 ("), std::string::npos)
      << with[5]["inputs"];
  // A control perimeter at twice 1.93 m does not fit into a member of 1 m.
  EXPECT_TRUE(with[5]["value"].is_null()) << with[5];
  EXPECT_NE(with[5]["note"].get<std::string>().find("not applicable"), std::string::npos) << with[5]["note"];
}

/// A box of earth has no resistance to punching by EN 1992.
TEST(Recorder, WhatIsNoConcreteHasNoResistanceOfIt) {
  SyntheticRun run = small();
  const auto ids = [&](double young) {
    sim::RunHeader header = run.header();
    header.structures[0].young = young;
    io::SummaryBuilder builder(header);
    builder.add(run.row(run.impact, 2));
    builder.add(run.contact_rows(run.impact, run.impact + 0.1));
    std::string all;
    const nlohmann::json j = nlohmann::json::parse(builder.text(nullptr));
    for (const auto& f : j["formulas"]) all += f["id"].get<std::string>() + " ";
    return all;
  };
  EXPECT_EQ(ids(30e6).find("en1992-punching"), std::string::npos) << ids(30e6);
  EXPECT_NE(ids(30e6).find("hertz"), std::string::npos) << ids(30e6);
  EXPECT_NE(ids(30e9).find("en1992-punching"), std::string::npos) << ids(30e9);
}

TEST(Recorder, BlocksAndStructuresOutsideOfTheFormulasRangeHaveNone) {
  SyntheticRun run = small();
  sim::RunHeader header = run.header();
  header.structures[0].young = 3e13;  // a thousand times concrete's
  io::SummaryBuilder builder(header);
  builder.add(run.row(run.impact, 2));
  builder.add(run.contact_rows(run.impact, run.impact + 0.1));
  const nlohmann::json j = nlohmann::json::parse(builder.text(nullptr));
  EXPECT_EQ(j["impacts"].size(), 1u);
  EXPECT_TRUE(j["formulas"].empty());
}

TEST(Recorder, AForceIsFilteredAndANeedleIsNot) {
  // 1 MN for 20 ms, and within it a needle of 100 MN for a microsecond.
  io::ForceTrack plain, needle;
  for (int k = 0; k < 2000; ++k) {
    const Vec3 f(1e6, 0, 0);
    plain.add(1 + (k + 1) * 1e-5, 1e-5, f);
    needle.add(1 + (k + 1) * 1e-5, 1e-5, f);
  }
  needle.add(1.01, 1e-6, Vec3(1e8, 0, 0));
  // Of a force that is held: no overshoot, up to the round-off of times over bins of 0.1 ms.
  EXPECT_NEAR(plain.filtered_peak(), 1e6, 1e-4);
  EXPECT_NEAR(needle.filtered_peak(), 1e6 + 100 / 1.5e-3, 1);  // 100 N s over the window
  EXPECT_EQ(io::ForceTrack{}.filtered_peak(), 0);
  // A rest of 3 s with one blow in it, cut into pieces wherever the blow lies: no seam shows.
  const double blow = 4e6;
  for (const double at : {0.05, 0.187, 0.199, 0.2, 0.211, 0.379, 1.7}) {
    io::ForceTrack rest, alone;
    for (int k = 0; k < 30000; ++k) {
      const double t = (k + 1) * 1e-4, f = 1e5 + (t > at && t <= at + 4e-3 ? blow : 0);
      rest.add(t, 1e-4, Vec3(0, 0, f));
      if (t > at - 0.02 && t <= at + 0.02) alone.add(t, 1e-4, Vec3(0, 0, f));
    }
    EXPECT_NEAR(rest.filtered_peak() / alone.filtered_peak(), 1, 1e-12) << at;
  }
}

/// Rows of a damaged journal say anything; two contacts a year apart are two.
TEST(Recorder, ForcesOfNoRunAreNoForces) {
  io::ForceTrack wild, alone, apart;
  for (const double t : {2e140, -3e175, static_cast<double>(INFINITY), static_cast<double>(NAN), 1e12})
    wild.add(t, 1e-3, Vec3(1e6, 0, 0));
  wild.add(1e4, 1e9, Vec3(1e6, 0, 0));
  EXPECT_EQ(wild.filtered_peak(), 0);
  for (int k = 0; k < 200; ++k) {
    alone.add(1 + k * 1e-4, 1e-4, Vec3(1e6, 0, 0));
    apart.add(1 + k * 1e-4, 1e-4, Vec3(1e6, 0, 0));
  }
  for (int k = 0; k < 200; ++k) apart.add(3e7 + k * 1e-4, 1e-4, Vec3(1e5, 0, 0));
  EXPECT_NEAR(apart.filtered_peak(), alone.filtered_peak(), 1e-6 * alone.filtered_peak());
}

TEST(Recorder, APieceAtItsOwnStructureIsNoStrike) {
  SyntheticRun run = small();
  sim::RunHeader header = run.header();
  io::SummaryBuilder builder(header);
  sim::HistoryRow row = run.row(0.1, 2);
  builder.add(row);
  sim::RunHeader::BlockInfo piece = run.fragment_info();
  piece.from = 0;
  builder.extend({&piece, 1});
  builder.add(run.row(0.2, 3));
  sim::ContactRow contact;
  contact.time = 0.21, contact.dt = 1e-4, contact.block = 2, contact.force = Vec3(5e6, 0, 0),
  contact.normal = Vec3::UnitX();
  builder.add({&contact, 1});
  auto j = nlohmann::json::parse(builder.text(nullptr));
  EXPECT_FALSE(j["hit"].get<bool>());
  EXPECT_FALSE(j["structures"][0]["hit"].get<bool>());
  EXPECT_EQ(j["structures"][0]["peak_force"], 5e6);
  EXPECT_NE(j["headline"][0].get<std::string>().find(
                "P2 fails under permanent load at t = 0.200 s, before any block arrives"),
            std::string::npos)
      << j["headline"];
  ASSERT_FALSE(j["warnings"].empty());
  // A block that strikes afterwards is told too; one that struck before makes it a strike's work.
  contact.block = 0, contact.time = 0.15;
  builder.add({&contact, 1});
  j = nlohmann::json::parse(builder.text(nullptr));
  EXPECT_TRUE(j["hit"].get<bool>());
  EXPECT_EQ(j["headline"][0].get<std::string>().find("permanent load"), std::string::npos) << j["headline"];
}

/// What nothing holds may break as it lands, and break what it lands on.
TEST(Recorder, WhatIsFreeOrMeetsWhatIsFreeDoesNotFailUnderPermanentLoad) {
  SyntheticRun run = small();
  const auto told = [&](bool held, bool other_held) {
    sim::RunHeader header = run.header();
    header.structures.push_back(header.structures[0]);
    header.structures[0].meets = {1}, header.structures[1].meets = {0};
    header.structures[0].permanent[2] = held ? -1e6 : 0;
    header.structures[1].permanent[2] = other_held ? -1e6 : 0;
    for (auto& s : header.structures) s.told_permanent = true;
    io::SummaryBuilder builder(header);
    const auto row = [&](double t, int n) {
      sim::HistoryRow r = run.row(t, n);
      r.structures.push_back(r.structures[0]);
      return r;
    };
    builder.add(row(0.1, 2));
    sim::RunHeader::BlockInfo piece = run.fragment_info();
    piece.from = 0;
    builder.extend({&piece, 1});
    builder.add(row(0.2, 3));
    return builder.text(nullptr).find("fails under permanent load") != std::string::npos;
  };
  EXPECT_TRUE(told(true, true));
  EXPECT_FALSE(told(false, true));
  EXPECT_FALSE(told(true, false));
}

// A block strikes between two rows: what it came with is that of the step before, not of the last row; a row
// of the same blow that was reported late because its impulse is spread does not change what came.
TEST(Recorder, AStrikeIsToldAsItCame) {
  const SyntheticRun run = small();
  io::SummaryBuilder builder(run.header());
  builder.add(run.row(0.1, 2));
  sim::ContactRow contact;
  contact.time = 0.151, contact.dt = 1e-3, contact.block = 0, contact.force = Vec3(5e6, 0, 0),
  contact.normal = Vec3::UnitX();
  contact.arrival = {.known = true,
                     .velocity = Vec3(3, 0, -4),
                     .spin = Vec3::UnitY(),
                     .translational = 125,
                     .rotational = 5};
  builder.add({&contact, 1});
  contact.time = 0.152, contact.arrival.velocity = Vec3::UnitX();
  builder.add({&contact, 1});
  const auto j = nlohmann::json::parse(builder.text(nullptr));
  EXPECT_EQ(j["impacts"][0]["speed"], 5);
  EXPECT_EQ(j["impacts"][0]["kinetic"], 130);
  EXPECT_EQ(j["impacts"][0]["kinetic_rotational"], 5);
}

TEST(Recorder, APieceOfNoStructureIsRefused) {
  const SyntheticRun run = small();
  const sim::RunHeader header = run.header();
  io::SummaryBuilder builder(header);
  sim::RunHeader::BlockInfo piece = run.fragment_info();
  piece.from = static_cast<int>(header.structures.size());
  EXPECT_THROW(builder.extend({&piece, 1}), std::out_of_range);
  piece.from -= 1;
  EXPECT_NO_THROW(builder.extend({&piece, 1}));
}

TEST(Recorder, ABlockCountsUntilItLeavesTheModel) {
  SyntheticRun run = small();
  run.structure = false;
  sim::RunHeader header = run.header();
  io::SummaryBuilder builder(header);
  sim::HistoryRow row = run.row(0.1, 2);
  const Vec3 edge = run.offset + Vec3(80, 160, run.ground(80, 160) + 1);
  for (int k = 0; k <= 40; ++k) {
    // Northwards over the edge at 20 m/s, then a free fall.
    const double past = std::max(0.0, 0.1 * k - 1);
    row.time = 0.1 * k;
    row.position[0] = edge + Vec3(0, 20 * (0.1 * k - 1) - 1, -4.905 * past * past);
    row.velocity[0] = Vec3(0, 20, -9.81 * past);
    row.velocity[1].setZero();
    builder.add(row);
  }
  const auto j = nlohmann::json::parse(builder.text(nullptr));
  const auto& b = j["blocks"][0];
  EXPECT_NEAR(b["left"].get<double>(), 1.0, 0.051);
  EXPECT_NEAR(b["max_speed"].get<double>(), 20, 1e-9);
  EXPECT_NEAR(b["drop"].get<double>(), 0, 1e-6);
  EXPECT_NEAR(b["runout"].get<double>(), 20, 1.1);
  EXPECT_TRUE(j["blocks"][1]["left"].is_null());
  std::string headline;
  for (const auto& line : j["headline"]) headline += line.get<std::string>() + "\n";
  EXPECT_NE(headline.find("1 of 2 blocks left the model"), std::string::npos) << headline;
  EXPECT_NE(headline.find("All other blocks are at rest"), std::string::npos) << headline;
}

TEST(Recorder, ABlockThatStartedBesideTheTerrainTellsNothing) {
  SyntheticRun run = small();
  run.structure = false;
  sim::RunHeader header = run.header();
  io::SummaryBuilder builder(header);
  sim::HistoryRow row = run.row(0.1, 2);
  for (int k = 0; k <= 100; ++k) {
    row.time = 0.1 * k;
    row.position[0] = run.offset + Vec3(300, 80, 100 - 4.905 * row.time * row.time);
    row.velocity[0] = Vec3(0, 0, -9.81 * row.time);
    row.velocity[1].setZero();
    builder.add(row);
  }
  const auto j = nlohmann::json::parse(builder.text(nullptr));
  EXPECT_EQ(j["blocks"][0]["drop"], 0.0);
  EXPECT_EQ(j["blocks"][0]["left"], 0.0);
  std::string headline;
  for (const auto& line : j["headline"]) headline += line.get<std::string>() + "\n";
  EXPECT_NE(headline.find("1 of 2 blocks started beside the terrain, with no ground below, and fell (B1)"),
            std::string::npos)
      << headline;
  EXPECT_EQ(headline.find("left the model"), std::string::npos) << headline;
  EXPECT_EQ(headline.find("B1 went"), std::string::npos) << headline;
  EXPECT_NE(headline.find("All other blocks are at rest"), std::string::npos) << headline;
}

/// What the scene is warned of, and what a run tells on its way, in the summary: once, whether it was stopped
/// or not.
TEST(Recorder, WarningsOfTheSceneAndOfTheRunAreInTheSummaryOnce) {
  const Place scratch;
  SyntheticRun run = small();
  run.end = 0.2;
  sim::RunHeader header = run.header();
  header.warnings = {"scene.toml:4:1: interface.rock/slope.friction = 35: unusually large"};
  std::uint64_t position = 0;
  {
    io::Recorder recorder(recorder_options(scratch.path() / "out"), header);
    run.record(recorder, 0, 10, [](int) {});
    recorder.warning("P2: lost its support");
    position = recorder.checkpoint();
    recorder.warning("told after the checkpoint, and told again by the run that goes on");
  }
  io::Recorder recorder(recorder_options(scratch.path() / "out"), position);
  const std::vector<std::string> expected{header.warnings[0], "P2: lost its support"};
  EXPECT_EQ(recorder.warnings(), expected);
  run.record(recorder, 11, 20, [](int) {});
  EXPECT_EQ(io::summary_warnings(recorder.finish({})), expected);
}

TEST(Recorder, AnImpactThatMissesIsWarnedOf) {
  SyntheticRun run = small();
  sim::RunHeader header = run.header();
  const auto warned = [&](bool prescribed, bool touches) {
    header.prescribed_impact = prescribed;
    io::SummaryBuilder builder(header);
    builder.add(run.row(run.impact, 2));
    if (touches) builder.add(run.contact_rows(run.impact, run.impact + 0.1));
    for (const std::string& text : io::summary_warnings(builder.text(nullptr)))
      if (text.find("the block of [impact] never touched P2 within 5 s") == 0) return true;
    return false;
  };
  EXPECT_TRUE(warned(true, false));
  EXPECT_FALSE(warned(true, true));
  EXPECT_FALSE(warned(false, false));
}

TEST(Recorder, ABlockThatWasJustLetGoIsNotAtRest) {
  SyntheticRun run = small();
  run.structure = false;
  run.blocks = 1;
  const auto told = [&](double acceleration, double speed) {
    io::SummaryBuilder builder(run.header());
    sim::HistoryRow row = run.row(0.1, 1);
    for (int k = 0; k <= 1; ++k) {
      row.time = 1e-3 * k;
      row.velocity[0] = Vec3(speed, 0, -acceleration * row.time);
      row.position[0].z() -= 0.5 * acceleration * row.time * row.time;
      builder.add(row);
    }
    std::string headline;
    const auto j = nlohmann::json::parse(builder.text(nullptr));
    for (const auto& line : j["headline"]) headline += line.get<std::string>() + "\n";
    return headline;
  };
  EXPECT_NE(told(9.81, 0).find("It still moves at the end."), std::string::npos) << told(9.81, 0);
  EXPECT_NE(told(9.81, 0).find("4.9 um down"), std::string::npos)
      << told(9.81, 0);  // a length too small for a decimal of metres
  EXPECT_NE(told(0, 0).find("It is at rest at the end."), std::string::npos) << told(0, 0);
  EXPECT_NE(told(0, 1e-5).find("It is at rest at the end."), std::string::npos) << told(0, 1e-5);
  EXPECT_NE(told(0, 1e-3).find("It moves at no more than 1 mm/s at the end."), std::string::npos)
      << told(0, 1e-3);  // a creep, 3 m across
  EXPECT_NE(told(0, 0.2).find("It still moves at the end."), std::string::npos) << told(0, 0.2);
}

/// One that lay still in plan was told to have gone farthest, for all that another fell.
TEST(Recorder, TheBlockThatWentFarthestIsThatOfTheLongestWay) {
  SyntheticRun run = small();
  run.structure = false;
  const auto told = [&](double end, double fall, double slide) {
    io::SummaryBuilder builder(run.header());
    sim::HistoryRow row = run.row(0, 2);
    for (auto& v : row.velocity) v.setZero();
    builder.add(row);
    row.time = end;
    row.position[1] += Vec3(slide, 0, -fall);
    builder.add(row);
    return nlohmann::json::parse(builder.text(nullptr))["headline"].get<std::vector<std::string>>();
  };
  EXPECT_EQ(told(0.1, 0.049, 0)[0].substr(0, 47), "B2 went farthest: 0 m in plan, 49 mm down, at u");
  EXPECT_EQ(told(0.1, 0, 0.2)[0].substr(0, 32), "B2 went farthest: 200 mm in plan");
  EXPECT_EQ(told(0.1, -0.049, 0)[0].substr(0, 45), "B2 went farthest: 0 m in plan, 49 mm up, at u");
  EXPECT_EQ(told(1e-300, 0, 0)[1], "The run is too short to tell what rests.");
  EXPECT_EQ(told(0.1, 0, 0)[0], "No block moved.");
  EXPECT_EQ(told(0.1, 1e-13, 0)[0], "No block moved.");  // round-off of a block of a metre
}

/// Round-off over the kinetic energy of round-off was told to be 1e14.
TEST(Recorder, WhatTheSchemeTookIsMeasuredByMoreThanWhatStands) {
  SyntheticRun run = small();
  run.structure = false;
  const auto relative = [&](double kinetic) {
    io::SummaryBuilder builder(run.header());
    sim::HistoryRow row = run.row(0, 2);
    row.ledger.kinetic = kinetic;
    row.ledger.algorithmic = 1e-9;
    row.ledger.step_dependence = 0;
    builder.add(row);
    return nlohmann::json::parse(builder.text(nullptr))["energy"]["algorithmic_relative"].get<double>();
  };
  EXPECT_LT(relative(1e-23), 1e-3);
  EXPECT_EQ(relative(0), 0);
  EXPECT_NEAR(relative(1e6), 1e-15, 1e-21);
}

TEST(Recorder, TheResidualIsRelativeToWhatMovedOrCouldHave) {
  SyntheticRun run = small();
  run.structure = false;
  io::SummaryBuilder builder(run.header());
  sim::HistoryRow row = run.row(0, 2);
  row.ledger.kinetic = 1e-22;
  row.ledger.residual = 2e-12;
  builder.add(row);
  const auto summary = nlohmann::json::parse(builder.text(nullptr));
  EXPECT_LT(summary["energy"]["residual_relative"].get<double>(), 1e-6);
  EXPECT_NE(summary["confidence"][0]["basis"].get<std::string>().find("at 1 cm/s, which none reached"),
            std::string::npos)
      << summary["confidence"][0];
}
