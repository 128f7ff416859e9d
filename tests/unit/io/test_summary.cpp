// The summary of a run as a whole: numerical energy errors, their remedies, what came off.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <string>
#include <vector>

#include "io/recorder.hpp"
#include "io/results.hpp"
#include "synthetic.hpp"

using namespace talus;
using talus::test::small;
using talus::test::SyntheticRun;

TEST(Summary, SummaryWarnsOfNumericalDissipation) {
  sim::RunHeader header = small().header();
  const auto warnings = [&](double algorithmic) {
    io::SummaryBuilder builder(header);
    for (int i = 0; i <= 4; ++i) {
      sim::HistoryRow row = small().row(0.1 * i, static_cast<int>(header.blocks.size()));
      row.ledger.kinetic = 1e6;
      row.ledger.algorithmic = i > 2 ? algorithmic : 0;
      builder.add(row);
    }
    return io::summary_warnings(builder.text(nullptr));
  };
  EXPECT_TRUE(warnings(9.9e3).empty());
  EXPECT_TRUE(warnings(-9.9e3).empty());
  ASSERT_EQ(warnings(2.5e4).size(), 1u);
  EXPECT_NE(warnings(2.5e4)[0].find("numerical dissipation of 25 kJ, 2.5 %"), std::string::npos)
      << warnings(2.5e4)[0];
  EXPECT_NE(warnings(2.5e4)[0].find("between t = 0.2 and 0.3 s"), std::string::npos) << warnings(2.5e4)[0];
  EXPECT_NE(warnings(-2.5e4)[0].find("numerical energy gain"), std::string::npos);
}

/// Prestress that is let go, or a structure that settles, moves more energy than its motion ever has at once:
/// the error is one of what was moved.
TEST(Summary, NumericalEnergyErrorsAreOfTheEnergyThatWasMoved) {
  const sim::RunHeader header = small().header();
  const auto warnings = [&](double strain) {
    io::SummaryBuilder builder(header);
    for (int i = 0; i <= 4; ++i) {
      sim::HistoryRow row = small().row(0.1 * i, static_cast<int>(header.blocks.size()));
      row.ledger.kinetic = 1e4;
      row.ledger.strain = i == 0 ? 5e6 : 5e6 - strain;
      row.ledger.algorithmic = i > 2 ? 6.8e4 : 0;
      builder.add(row);
    }
    return io::summary_warnings(builder.text(nullptr));
  };
  EXPECT_TRUE(warnings(7e6).empty());
  ASSERT_EQ(warnings(2e6).size(), 1u);
  EXPECT_NE(warnings(2e6)[0].find("3.4 % of the largest change of stored energy, 2 MJ"), std::string::npos)
      << warnings(2e6)[0];
}

/// A structure that no block struck and that another met was not left alone, though it has no support that
/// could tell.
TEST(Summary, StructuresThatMeetSaySo) {
  sim::RunHeader header = small().header();
  header.blocks.clear();
  header.structures.resize(1);
  header.structures.push_back(header.structures[0]);
  header.structures[0].name = "still", header.structures[1].name = "flying";
  header.structures[0].meets = {1}, header.structures[1].meets = {0};
  io::Outcome outcome;
  outcome.audit.met = {{0.02, Vec3(0, 0, -3e3)}, {0.02, Vec3(0, 0, 3e3)}};
  const io::Outcome again = io::decode_outcome(io::encode_outcome(outcome));
  ASSERT_EQ(again.audit.met.size(), 2u);
  io::SummaryBuilder builder(header);
  const auto lines = io::summary_headline(builder.text(&again));
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  EXPECT_NE(all.find("No block struck still; it met flying at 0.02 s, impulse of all contacts 3 kN s."),
            std::string::npos)
      << all;
  EXPECT_EQ(all.find("was not hit"), std::string::npos) << all;
}

TEST(Summary, TheSummarySaysWhetherTheSchemeTakesMoreThanItsWarningAllows) {
  const auto warned = [&](double algorithmic) {
    io::SummaryBuilder builder(small().header());
    for (int i = 0; i <= 4; ++i) {
      sim::HistoryRow row = small().row(0.1 * i, static_cast<int>(small().header().blocks.size()));
      row.ledger.kinetic = 1e6;
      row.ledger.algorithmic = algorithmic * i / 4;
      builder.add(row);
    }
    return nlohmann::json::parse(builder.text(nullptr))["energy"]["algorithmic_warned"].get<bool>();
  };
  EXPECT_FALSE(warned(9.9e3));
  EXPECT_TRUE(warned(2.5e4));
  EXPECT_TRUE(warned(-2.5e4));
}

TEST(Summary, AnElasticStructureHasNoDamageClassAndTheHeadlineSaysSo) {
  sim::RunHeader header;
  header.structures.emplace_back();
  header.structures[0].name = "wall";
  header.structures[0].loaded = true;
  header.structures[0].plan = "wall: elastic, no damage history kept";
  io::SummaryBuilder builder(header);
  sim::HistoryRow row;
  row.structures.resize(1);
  builder.add(row);
  std::string all;
  for (const std::string& line : io::summary_headline(builder.text(nullptr))) all += line + "\n";
  EXPECT_NE(all.find("wall is elastic in this run: damage was not computed, there is no damage class"),
            std::string::npos)
      << all;
}

/// A time is named only if more than half of it fell there; what goes on all the time has none, nor has what
/// went the other way.
TEST(Summary, TheTimeOfNumericalDissipationIsNamedOnlyWhereMostOfItIs) {
  const sim::RunHeader header = small().header();
  const auto warning = [&](std::vector<double> taken) {
    io::SummaryBuilder builder(header);
    double sum = 0;
    for (std::size_t i = 0; i <= taken.size(); ++i) {
      sim::HistoryRow row = small().row(0.1 * static_cast<double>(i), static_cast<int>(header.blocks.size()));
      row.ledger.kinetic = 1e6;
      row.ledger.algorithmic = i == 0 ? 0 : sum += taken[i - 1];
      builder.add(row);
    }
    return io::summary_warnings(builder.text(nullptr)).at(0);
  };
  const std::string most = "most of it between";
  EXPECT_NE(warning({5e3, 16e3, 9e3}).find(most + " t = 0.1 and 0.2 s"), std::string::npos)
      << warning({5e3, 16e3, 9e3});
  EXPECT_EQ(warning({5e3, 14e3, 11e3}).find(most), std::string::npos);
  EXPECT_EQ(warning({-60e3, 25e3, 55e3}).find("t = 0 and 0.1"), std::string::npos);
}

/// Structures go in sub-steps of their own, which simulation.step does not shorten; springs are a remedy
/// where there are some.
TEST(Summary, TheRemedyForEnergyThatTheSchemeTakesIsOneForWhatTheRunHas) {
  const auto warning = [&](bool blocks, bool structures, double springs) {
    sim::RunHeader header = small().header();
    if (!blocks) header.blocks.clear();
    if (!structures) header.structures.clear();
    io::SummaryBuilder builder(header, io::Steps::fixed);
    for (int i = 0; i < 2; ++i) {
      sim::HistoryRow row = small().row(0.1 * i, static_cast<int>(header.blocks.size()));
      if (!structures) row.structures.clear();
      row.ledger.kinetic = 1e6;
      row.ledger.algorithmic = 2.5e4 * i;
      row.ledger.contact = springs;
      builder.add(row);
    }
    return io::summary_warnings(builder.text(nullptr)).at(0);
  };
  const auto says = [](const std::string& text, std::initializer_list<const char*> there,
                       std::initializer_list<const char*> not_there) {
    for (const char* part : there) EXPECT_NE(text.find(part), std::string::npos) << part << " in " << text;
    for (const char* part : not_there)
      EXPECT_EQ(text.find(part), std::string::npos) << part << " in " << text;
  };
  const char* const step = "simulation.step";
  const char* const fraction = "structure.critical_step_fraction";
  const char* const stiffness = "normal_stiffness";
  const char* const exchanges = "coupling.exchanges_per_rise";
  says(warning(false, true, 0), {fraction}, {step, stiffness, exchanges});
  says(warning(true, false, 0), {step}, {fraction, stiffness, exchanges});
  says(warning(true, true, 10), {step, stiffness, fraction, exchanges}, {});
}

/// A remedy names keys that the run has: where steps are fixed, accuracy does nothing; the scheme of 1988
/// knows none.
TEST(Summary, TheRemedyForNumericalEnergyGainNamesKeysOfTheRun) {
  const sim::RunHeader header = small().header();
  const auto says = [&](io::Steps steps, const char* what) {
    io::SummaryBuilder builder(header, steps);
    for (int i = 0; i < 2; ++i) {
      sim::HistoryRow row = small().row(0.1 * i, static_cast<int>(header.blocks.size()));
      row.ledger.kinetic = 1e6;
      row.ledger.algorithmic = -2.2e6 * i;
      builder.add(row);
    }
    return io::summary_warnings(builder.text(nullptr)).at(0).find(what) != std::string::npos;
  };
  using io::Steps;
  EXPECT_TRUE(says(Steps::by_accuracy, "a lower simulation.accuracy"));
  EXPECT_FALSE(says(Steps::by_accuracy, "simulation.step"));
  EXPECT_TRUE(says(Steps::fixed, "a shorter simulation.step"));
  EXPECT_TRUE(says(Steps::scheme_1988, "a shorter simulation.step"));
  EXPECT_FALSE(says(Steps::scheme_1988, "accuracy"));
}

/// A span or a piece that comes off heads the page, also where no block struck: how many, how heavy, since
/// when, how deep the heaviest fell.
TEST(Headline, TellsWhatCameOff) {
  SyntheticRun run = small();
  const auto told = [&](int pieces, bool loaded) {
    sim::RunHeader header = run.header();
    header.structures[0].loaded = loaded;
    header.terrain = {};
    io::SummaryBuilder builder(header);
    builder.add(run.row(0.1, 2));
    std::vector<sim::RunHeader::BlockInfo> list(static_cast<std::size_t>(pieces), run.fragment_info());
    for (std::size_t i = 0; i < list.size(); ++i)
      list[i].from = 0, list[i].name = "P2.fragment" + std::to_string(i + 1),
      list[i].mass = i == 1 ? 50e3 : 2e3;
    builder.extend(list);
    for (int k = 0; k < 2; ++k) {
      sim::HistoryRow row = run.row(0.25 + 0.2 * k, 2 + pieces);
      for (int i = 2; i < 2 + pieces; ++i)
        row.position[static_cast<std::size_t>(i)] = Vec3(0, 0, 5 - 1.25 * k);
      builder.add(row);
    }
    std::string all;
    for (const std::string& line : io::summary_headline(builder.text(nullptr))) all += line + "\n";
    return all;
  };
  EXPECT_EQ(told(0, true).find("came off"), std::string::npos);
  EXPECT_NE(told(1, true).find("1 piece of 2 t came off P2 at 0.250 s; it fell 1.25 m.\n"), std::string::npos)
      << told(1, true);
  EXPECT_NE(told(3, false).find("3 pieces of 54 t in all came off P2, the first at 0.250 s; the heaviest, "
                                "P2.fragment2 of 50 t, fell 1.25 m.\n"),
            std::string::npos)
      << told(3, false);
}

namespace {

/// Blows of blocks on structure 0 at times, each of so many steps of a millisecond and one force.
struct Blow {
  int block;
  double start, speed, kinetic, rotational, force;
  int steps = 1;
};

nlohmann::json summary_of(const sim::RunHeader& header, const std::vector<Blow>& blows) {
  io::SummaryBuilder builder(header);
  builder.add(small().row(0.1, static_cast<int>(header.blocks.size())));
  for (const Blow& b : blows)
    for (int k = 0; k < b.steps; ++k) {
      sim::ContactRow c;
      c.dt = 1e-3, c.time = b.start + (k + 1) * c.dt;
      c.block = b.block;
      c.force = Vec3(b.force * (k + 1), 0, 0);
      c.normal = Vec3::UnitX();
      c.arrival = {.known = k == 0,
                   .velocity = Vec3(b.speed, 0, 0),
                   .spin = Vec3::Zero(),
                   .translational = b.kinetic - b.rotational,
                   .rotational = b.rotational};
      builder.add({&c, 1});
    }
  return nlohmann::json::parse(builder.text(nullptr));
}

}  // namespace

/// A pebble that touches first, or a block that rests and is pushed, was all that the headline told of.
TEST(Summary, TheHeadlineTellsOfTheBlowWithMostEnergy) {
  sim::RunHeader header = small().header();
  const Blow touched{0, 0.2, 0.01, 12, 0, 1e5}, struck{1, 0.5, 12.3, 61.5e3, 1.4e3, 5e6},
      again{0, 0.7, 1, 9e3, 0, 9e6};
  const auto first = [&](const std::vector<Blow>& blows) {
    return summary_of(header, blows)["headline"][0].get<std::string>();
  };
  EXPECT_EQ(first({touched, struck, again}),
            "B2 struck P2 at 0.5 s with 12.3 m/s and 61.5 kJ (60.1 kJ of translation, 1.4 kJ of rotation); 3 "
            "impacts in all, this one with the most energy, the first by B1 at 0.2 s.");
  EXPECT_EQ(first({struck}),
            "B2 struck P2 at 0.5 s with 12.3 m/s and 61.5 kJ (60.1 kJ of translation, 1.4 kJ of rotation); 1 "
            "impact in all.");
  // A piece of another structure heads the page only where no block struck.
  header.blocks[1].fragment = true;
  EXPECT_TRUE(first({touched, struck}).starts_with("B1 struck P2 at 0.2 s")) << first({touched, struck});
  EXPECT_TRUE(first({struck}).starts_with("B2 struck P2 at 0.5 s")) << first({struck});
}

/// What rotates with the round-off of a difference of energies does not rotate.
TEST(Summary, RoundOffIsNoRotation) {
  const auto j = summary_of(small().header(), {{0, 0.2, 0.04, 1.35, -2.2e-16, 1e5}});
  EXPECT_EQ(j["impacts"][0]["kinetic_rotational"], 0);
  EXPECT_NE(j["headline"][0].get<std::string>().find("(1.35 J of translation, 0 J of rotation)"),
            std::string::npos)
      << j["headline"][0];
}

/// Hertz's force is of the speed at which a block came. It was compared with what the block bore while it
/// rested and the structure pushed it: here 1, 2, 3 ... kN over a millisecond each, of which the blow has 2 m
/// v = 10 N s, those of the first four.
TEST(Summary, HertzIsComparedWithTheBlowAndNotWithWhatRests) {
  sim::RunHeader header = small().header();
  header.structures[0].young = 30e9;
  header.blocks[0].mass = 20;
  const auto j = summary_of(header, {{0, 0.2, 0.25, 0.625, 0, 1e3, 200}});
  EXPECT_EQ(j["impacts"][0]["peak_force"], 200e3);
  const auto hertz = std::ranges::find_if(j["formulas"], [](const auto& f) { return f["id"] == "hertz"; });
  ASSERT_TRUE(hertz != j["formulas"].end());
  EXPECT_LT((*hertz)["value"].get<double>(), 200e3);
  EXPECT_NEAR((*hertz)["computed"].get<double>(), 4e3, 1e-6);
  for (const auto& warning : j["warnings"])
    EXPECT_EQ(warning.get<std::string>().find("Hertz"), std::string::npos) << warning;
}

/// A structure that nothing holds has no base.
TEST(Summary, WhatNothingHoldsHasNoBaseReaction) {
  sim::RunHeader header = small().header();
  header.blocks.clear();
  header.structures[0].loaded = true;
  const auto first = [&](double reaction) {
    io::SummaryBuilder builder(header);
    sim::HistoryRow row = small().row(0.1, 0);
    row.structures[0].peaks.force = {reaction, 0.05, 0};
    row.structures[0].probe_displacement = {Vec3(1.47, 0, 0), Vec3::Zero()};
    builder.add(row);
    return nlohmann::json::parse(builder.text(nullptr))["headline"][0].get<std::string>();
  };
  EXPECT_EQ(first(2e3),
            "P2 under its prescribed load: 2 kN added to the base reaction at most, at 0.050 s; top "
            "moved 1.47 m at most.");
  EXPECT_EQ(first(0), "P2 under its prescribed load: no support took any of it; top moved 1.47 m at most.");
}

/// What the warning of numerical energy errors is of, the summary has as well: a load that is put on slowly
/// moves little at a time.
TEST(Summary, TheNumericalEnergyErrorIsOfOneScale) {
  const auto energy = [&](double strain, double work) {
    io::SummaryBuilder builder(small().header());
    for (int i = 0; i <= 4; ++i) {
      sim::HistoryRow row = small().row(0.1 * i, static_cast<int>(small().header().blocks.size()));
      row.ledger = {};
      row.ledger.kinetic = 1e6;
      row.ledger.strain = i == 0 ? 0 : strain;
      row.ledger.external_work = i == 0 ? 0 : work;
      row.ledger.algorithmic = 2e4 * i / 4;
      builder.add(row);
    }
    return nlohmann::json::parse(builder.text(nullptr))["energy"];
  };
  EXPECT_NEAR(energy(0, 0)["algorithmic_relative"].get<double>(), 0.02, 1e-12);
  EXPECT_TRUE(energy(0, 0)["algorithmic_warned"].get<bool>());
  EXPECT_NEAR(energy(4e6, 0)["algorithmic_relative"].get<double>(), 0.005, 1e-12);
  EXPECT_FALSE(energy(4e6, 0)["algorithmic_warned"].get<bool>());
  EXPECT_NEAR(energy(4e6, -8e6)["algorithmic_relative"].get<double>(), 0.0025, 1e-12);
  EXPECT_FALSE(energy(0, -8e6)["algorithmic_warned"].get<bool>());
}
