// Members of a structure: what the summary says of them, and that they come through the journal unchanged.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "io/member_track.hpp"
#include "io/records.hpp"
#include "io/summary.hpp"

namespace talus::io {
namespace {

using json = nlohmann::json;

Member pier() {
  Member m;
  m.name = "P2";
  m.length = 10;
  m.volume = 25;
  m.stations = {0, 5, 10};
  m.axial_preload = 3e6;
  m.shear_design = {1e6, 2e6};
  m.shear_mean = {1.5e6, 3e6};
  return m;
}

MemberState state(double shear_x, double shear_y, double drift) {
  MemberState s;
  s.axial = {3e6, 2.8e6, 2.6e6};
  s.shear = {{{0, 0}}, {{shear_x, shear_y}}, {{0, 0}}};
  s.moment = {{{0, 4e6}}, {{0, 0}}, {{0, 0}}};
  s.drift = {drift, 0};
  return s;
}

/// Greatest loads as a structure tells them: of V alone, at mid-height.
MemberPeaks peaks(double use_design, double use_mean, double crack_width) {
  MemberPeaks p;
  p.shear = {use_design * 1e6, 0.1, 5};
  p.use_design = {use_design, 0.1, 5};
  p.use_mean = {use_mean, 0.1, 5};
  p.crack_width = crack_width;
  return p;
}

TEST(MemberTrack, LoadsDriftAndClass) {
  MemberTrack track(pier());
  track.add(0, state(0, 0, 0.002), {});
  for (int i = 1; i <= 100; ++i) {
    const double t = 0.01 * i;
    MemberPeaks p = i >= 10 ? peaks(0.9, 0.6, 0.5e-3) : MemberPeaks{};
    p.drift = 0.048;
    track.add(t, state(0, 0, 0.002 + 0.01 + 0.004 * std::sin(2 * M_PI * t / 0.05)), p);
  }
  const auto j = track.summary({});
  EXPECT_EQ(j["shear_utilisation_design"]["value"], 0.9);
  EXPECT_EQ(j["shear_utilisation_mean"]["value"], 0.6);
  EXPECT_EQ(j["shear_utilisation_design"]["time"], 0.1);
  EXPECT_EQ(j["peak_shear"]["station"], 5);
  EXPECT_EQ(j["peak_drift"], 0.048);
  EXPECT_NEAR(j["residual_drift"][0].get<double>(), 0.010, 4e-4);  // two periods of the ringing average out
  EXPECT_EQ(j["damage_class_name"], "moderate");                   // 0.5 mm, V_dyn below V_Rd
}

TEST(MemberTrack, AMemberWhoseTopCameOffIsLostAndHasNoDrift) {
  MemberTrack track(pier());
  track.add(0, state(0, 0, 0), {});
  MemberPeaks p;
  p.drift = 0.02;
  track.add(0.5, state(0, 0, 0.02), p);
  track.add(1, state(0, 0, std::numeric_limits<double>::quiet_NaN()), p);
  const auto j = track.summary({});
  EXPECT_EQ(j["damage_class_name"], "lost");
  EXPECT_EQ(j["top_came_off"], true);
  EXPECT_TRUE(j["residual_drift"].is_null());
  EXPECT_TRUE(j["residual_drift_ratio"].is_null());
  EXPECT_NEAR(j["peak_drift"].get<double>(), 0.02, 1e-12);  // while it was there
}

// A span that has left its bearings at one end is lost, one that sags is closed by its deflection, one that
// cracked a little stays open.
TEST(MemberTrack, SpansAreJudgedByTheirDeflectionAndTheirSeats) {
  Member span = pier();
  span.span = true;
  const auto after = [&](double deflection, int unseated, double shift, double crack) {
    MemberTrack track(span);
    MemberState s;
    MemberPeaks peaks;
    track.add(0, s, peaks);
    s.drift = {0, -deflection}, s.ends_unseated = unseated, s.end_shift = shift;
    peaks.crack_width = crack;
    for (const double t : {0.91, 1.0}) track.add(t, s, peaks);
    return track.summary({});
  };
  const double length = span.length;
  EXPECT_EQ(after(0, 1, 0, 0)["damage_class_name"], "lost");
  EXPECT_EQ(after(0, 1, 0, 0)["function"], "closed");
  EXPECT_EQ(after(length / 200, 0, 0, 0)["function"], "closed");
  EXPECT_EQ(after(length / 500, 0, 0, 0)["function"], "restricted");
  EXPECT_EQ(after(length / 5000, 0, 0.06, 0)["function"], "closed");
  EXPECT_EQ(after(length / 5000, 0, 0, 5e-4)["function"], "restricted");  // class 2
  EXPECT_EQ(after(length / 5000, 0, 0, 2e-4)["function"], "open");        // class 1
  EXPECT_TRUE(MemberTrack(pier()).summary({})["function"].is_null());
}

/// Traffic stays off a span whose pier is severely damaged, however sound the span is itself; a pier that is
/// not below it says nothing.
TEST(MemberTrack, ASpanIsNoSaferThanWhatCarriesIt) {
  const auto damaged = [](int broken, double crack) {
    MemberTrack track(pier());
    MemberState s = state(0, 0, 0);
    MemberPeaks p;
    track.add(0, s, p);
    s.bars_broken = broken, p.crack_width = crack;
    for (const double t : {0.91, 1.0}) track.add(t, s, p);
    return track;
  };
  Member span = pier();
  span.name = "S1", span.span = true, span.carried_by = {0, 1};
  MemberTrack deck(span);
  for (const double t : {0.0, 0.91, 1.0}) deck.add(t, {}, {});
  const MemberTrack sound = damaged(0, 0), cracked = damaged(0, 5e-4), severe = damaged(1, 0);
  const auto with = [&](const MemberTrack& a, const MemberTrack& b, const MemberTrack& elsewhere) {
    const std::vector<MemberTrack> all{a, b, elsewhere, deck};
    return deck.summary(all);
  };
  EXPECT_EQ(with(sound, sound, severe)["function"], "open");
  EXPECT_EQ(with(sound, cracked, sound)["function"], "restricted");
  EXPECT_EQ(with(severe, cracked, sound)["function"], "closed");
  EXPECT_EQ(with(severe, sound, sound)["function_basis"], "P2, which carries it, has damage class 3 severe");
}

/// A class near one of its limits says which others it may as well be.
TEST(MemberTrack, AClassNearALimitMayBeAnother) {
  const auto after = [](double share, double use_design, double use_mean, int broken) {
    MemberTrack track(pier());
    MemberState s = state(0, 0, 0);
    track.add(0, s, {});
    s.lost_volume = share * pier().volume, s.bars_broken = broken;
    for (const double t : {0.91, 1.0}) track.add(t, s, peaks(use_design, use_mean, 0));
    return track;
  };
  struct Case {
    double share, use_design, use_mean;
    int broken, grade, least, most;
  };
  for (const Case& c :
       {Case{0.3, 0, 0, 0, 4, 4, 4}, Case{0.13, 0, 0, 0, 4, 3, 4}, Case{0.05, 0, 0, 0, 3, 3, 4},
        Case{0.03, 0, 0, 0, 3, 3, 3}, Case{0.015, 0, 0, 0, 3, 0, 3}, Case{0.015, 0, 0, 1, 3, 3, 3},
        Case{0, 1.1, 0.9, 0, 2, 0, 3}, Case{0, 3, 2, 0, 3, 3, 3}, Case{0, 0.5, 0.3, 0, 0, 0, 0}}) {
    const MemberTrack track = after(c.share, c.use_design, c.use_mean, c.broken);
    const auto j = track.summary({});
    EXPECT_EQ(j["damage_class"], c.grade) << c.share;
    EXPECT_EQ(j["damage_class_range"], (nlohmann::ordered_json{c.least, c.most}))
        << c.share << ' ' << c.use_design;
    EXPECT_EQ(track.verdict().doubt().empty(), c.least == c.most);
  }
}

TEST(MemberTrack, WhatIsElasticAloneHasNoDamageClass) {
  Member m = pier();
  m.shear_design = m.shear_mean = {0, 0};  // not of concrete
  MemberTrack track(m);
  track.add(0, state(0, 0, 0), {});
  track.add(1, state(1e8, 0, 0.1), {});
  EXPECT_TRUE(track.summary({})["damage_class"].is_null());
  EXPECT_TRUE(track.summary({})["damage_class_name"].is_null());
}

/// Concrete with damage = "none": cracks were not computed, which is no finding; what was computed is told.
TEST(MemberTrack, WhatWasComputedElasticIsNotJudged) {
  MemberTrack track(pier(), true);
  track.add(0, state(0, 0, 0), {});
  track.add(1, state(0, 0, 0), peaks(1.77, 1.2, 0));
  const auto j = track.summary({});
  EXPECT_TRUE(j["damage_class"].is_null());
  EXPECT_TRUE(j["damage_class_name"].is_null());
  const std::string basis = j["damage_class_basis"].get<std::string>();
  EXPECT_NE(basis.find("not computed"), std::string::npos) << basis;
  EXPECT_NE(basis.find("V_dyn/V_Rd with design strengths 1.77, with mean strengths 1.20"), std::string::npos)
      << basis;
  EXPECT_NEAR(j["shear_utilisation_design"]["value"].get<double>(), 1.77, 1e-12);
}

TEST(MemberTrack, ADriftUnderALoadThatStillActsIsNoResidualOne) {
  MemberTrack track(pier());
  track.add(0, state(0, 0, 0), {});
  track.add(1, state(0, 0, 0.2), {});
  EXPECT_EQ(track.summary({})["residual_drift_under_load"], false);
  EXPECT_NE(track.verdict().basis.find("residual drift"), std::string::npos) << track.verdict().basis;
  track.set_under_load(true);
  EXPECT_EQ(track.summary({})["residual_drift_under_load"], true);
  EXPECT_EQ(track.verdict().basis.find("residual drift"), std::string::npos) << track.verdict().basis;
  EXPECT_NE(track.verdict().basis.find("drift under a load that still acts"), std::string::npos)
      << track.verdict().basis;
}

/// A pier at rest, then as `change` makes it.
template <class Change>
MemberTrack changed(Change&& change) {
  MemberTrack track(pier());
  track.add(0, state(0, 0, 0), {});
  MemberState s = state(0, 0, 0);
  MemberPeaks p;
  change(s, p);
  track.add(1, s, p);
  return track;
}

TEST(MemberTrack, ClassesInTheirOrder) {
  const auto grade = [](auto change) {
    const MemberTrack track = changed(change);
    return track.summary({})["damage_class"].template get<int>();
  };
  EXPECT_EQ(grade([](MemberState&, MemberPeaks&) {}), 0);
  EXPECT_EQ(grade([](MemberState&, MemberPeaks& p) { p.crack_width = 0.2e-3; }), 1);
  EXPECT_EQ(grade([](MemberState& s, MemberPeaks&) { s.bars_yielded = 1; }), 2);
  EXPECT_EQ(grade([](MemberState&, MemberPeaks& p) { p = peaks(1.2, 0.8, 0); }),
            2);  // above design, below mean
  EXPECT_EQ(grade([](MemberState&, MemberPeaks& p) { p = peaks(1.6, 1.07, 0); }), 3);
  EXPECT_EQ(grade([](MemberState& s, MemberPeaks&) { s.bars_broken = 1; }), 3);
  EXPECT_EQ(grade([](MemberState& s, MemberPeaks&) { s.lost_volume = 0.3; }), 3);
  EXPECT_EQ(grade([](MemberState& s, MemberPeaks&) { s.drift = {0.2, 0}; }), 3);
  EXPECT_EQ(grade([](MemberState& s, MemberPeaks&) { s.drift = {0, 0.6}; }), 4);
  EXPECT_EQ(grade([](MemberState& s, MemberPeaks&) { s.lost_volume = 3; }), 4);
}

// Shear beyond the resistance and cracks of the runs that this one goes on from: damage stays.
TEST(MemberTrack, AClassIsOfTheRunsBeforeToo) {
  const auto verdict = [](MemberPeaks::Before before) {
    const MemberTrack track =
        changed([&](MemberState&, MemberPeaks& p) { p = peaks(0.5, 0.3, 0), p.before = before; });
    EXPECT_EQ(track.summary({})["shear_utilisation_mean"]["value"], 0.3);  // of this run
    EXPECT_EQ(track.summary({})["crack_width_peak"], 0);
    return track.verdict();
  };
  EXPECT_EQ(verdict({}).grade, 0);
  EXPECT_EQ(verdict({1.6, 1.07, 0}).grade, 3);
  EXPECT_EQ(verdict({1.6, 1.07, 0}).basis,
            "V_dyn above V_Rd with mean strengths in the run that it goes on from");
  EXPECT_EQ(verdict({1.2, 0.8, 0}).grade, 2);
  EXPECT_EQ(verdict({0, 0, 0.5e-3}).basis, "a crack of 0.5 mm in the run that it goes on from");
}

// Samples are a millisecond apart: what a row has between two of them is wider.
TEST(MemberTrack, TheWidestCrackIsNoLessThanThatOfARow) {
  MemberTrack track(pier());
  track.add(0, state(0, 0, 0), {});
  MemberState s = state(0, 0, 0);
  s.crack_width = 0.7e-3;
  track.add(1, s, peaks(0.1, 0.1, 0.6e-3));
  s.crack_width = 0.3e-3;
  track.add(2, s, peaks(0.1, 0.1, 0.6e-3));
  EXPECT_EQ(track.summary({})["crack_width_peak"], 0.7e-3);
  EXPECT_EQ(track.summary({})["crack_width_end"], 0.3e-3);
}

TEST(MemberTrack, TellsWhatAClassRestsOn) {
  const auto basis = [](auto change) {
    const MemberTrack track = changed(change);
    EXPECT_EQ(track.summary({})["damage_class_basis"].template get<std::string>(), track.verdict().basis);
    return track.verdict().basis;
  };
  EXPECT_EQ(basis([](MemberState&, MemberPeaks&) {}), "no crack above 0.1 mm, no bar yields");
  EXPECT_EQ(basis([](MemberState& s, MemberPeaks& p) { p = peaks(1.2, 0.8, 0.5e-3), s.bars_yielded = 1; }),
            "1 bar yielded, a crack of 0.5 mm, V_dyn above the design V_Rd");
  EXPECT_EQ(basis([](MemberState& s, MemberPeaks& p) {
              p = peaks(1.6, 1.1, 2e-3), s.bars_broken = 3, s.lost_volume = 5;
            }),
            "20 % of its volume gone");  // the highest class alone
  EXPECT_EQ(basis([](MemberState& s, MemberPeaks&) { s.lost_volume = 25; }),
            "100 % of its volume gone");  // no powers of ten
}

/// How bad it is stands on top: the class and the shear of every member, the worst first.
TEST(Headline, JudgesEveryMember) {
  sim::RunHeader header;
  header.blocks.resize(1);
  header.blocks[0].name = "B1";
  header.structures.resize(1);
  header.structures[0].name = "V";
  const auto lines = [&](std::vector<std::pair<const char*, MemberPeaks>> members, const char* plan = "") {
    header.structures[0].members.clear();
    header.structures[0].plan = plan;
    sim::HistoryRow row;
    row.position = {Vec3::Zero()}, row.velocity = {Vec3::UnitX()}, row.spin = {Vec3::Zero()};
    row.kinetic_translational = {1e6}, row.kinetic_rotational = {0};
    row.structures.resize(1);
    for (const auto& [name, p] : members) {
      header.structures[0].members.push_back(pier());
      header.structures[0].members.back().name = name;
      row.structures[0].members.push_back(state(0, 0, 0));
      row.structures[0].peaks.members.push_back(p);
    }
    SummaryBuilder builder(header);
    builder.add(row);
    sim::ContactRow contact;
    contact.time = 0.1, contact.dt = 1e-3, contact.force = Vec3(1e6, 0, 0), contact.normal = Vec3::UnitX(),
    contact.structure = 0, contact.block = 0;
    builder.add({&contact, 1});
    const std::string text = builder.text(nullptr);
    std::string all;
    for (const std::string& line : summary_headline(text)) all += line + "\n";
    return all;
  };
  const std::string several =
      lines({{"P1", peaks(0.3, 0.2, 0.2e-3)}, {"P2", peaks(1.62, 1.1, 2e-3)}, {"P3", peaks(0.1, 0.1, 0)}});
  EXPECT_NE(several.find("V, P2: damage class 3 of 4, severe (V_dyn above V_Rd with mean strengths). Shear "
                         "V_dyn/V_Rd = 1.62 at most"),
            std::string::npos)
      << several;
  EXPECT_NE(several.find("Near a limit: class 2 to 3 with other time steps or cells."), std::string::npos)
      << several;
  EXPECT_NE(several.find("Other members of V: P1 1 slight (V_dyn/V_Rd 0.30), 1 more of class 0."),
            std::string::npos)
      << several;
  const std::string one = lines({{"V", peaks(0.3, 0.2, 0)}});
  EXPECT_NE(one.find("V: damage class 0 of 4, no damage"), std::string::npos) << one;
  EXPECT_EQ(one.find("Other members"), std::string::npos) << one;
  // Of what is elastic a class would be none, whatever happens to it.
  const std::string elastic = lines({{"V", peaks(0.9, 0.7, 0)}}, "V: elastic, no damage history kept");
  EXPECT_EQ(elastic.find("damage class"), std::string::npos) << elastic;
  EXPECT_NE(elastic.find("V: V_dyn/V_Rd = 0.90 at most"), std::string::npos) << elastic;
}

/// A deck that a block strikes, the piers that carry it, one that stands apart.
TEST(Headline, TellsWhatCameThroughAnother) {
  sim::RunHeader header;
  header.blocks.resize(1);
  header.blocks[0].name = "B1", header.blocks[0].mass = 1000;
  for (const char* name : {"deck", "P1", "P2", "apart"}) {
    header.structures.emplace_back();
    header.structures.back().name = name;
  }
  header.structures[0].meets = {1, 2};
  header.structures[1].meets = header.structures[2].meets = {0};
  header.structures[1].members = {pier()};
  header.structures[1].members[0].name = "P1";
  sim::HistoryRow row;
  row.position = {Vec3::Zero()}, row.velocity = {Vec3::UnitX()}, row.spin = {Vec3::Zero()};
  row.kinetic_translational = {1e6}, row.kinetic_rotational = {0};
  row.structures.resize(4);
  row.structures[1].members = {state(0, 0, 0)};
  row.structures[1].peaks.members = {peaks(1.62, 1.1, 0)};
  row.structures[1].peaks.force = {2.92e6, 0.2, 0};
  const auto summary = [&](double force) {
    SummaryBuilder builder(header);
    builder.add(row);
    sim::ContactRow contact;
    contact.time = 0.1, contact.dt = 1e-3, contact.force = Vec3(0, 0, -force), contact.normal = Vec3::UnitZ(),
    contact.structure = 0, contact.block = 0;
    builder.add({&contact, 1});
    row.time = 0.3;
    builder.add(row);
    return json::parse(builder.text(nullptr));
  };
  json j = summary(3e6);
  std::string all;
  for (const auto& line : j["headline"]) all += line.get<std::string>() + "\n";
  EXPECT_NE(all.find("P1 was not struck itself, it was loaded through deck: 2.92 MN added to its base "
                     "reaction at most, at 0.200 s."),
            std::string::npos)
      << all;
  EXPECT_NE(all.find("P1: damage class 3 of 4"), std::string::npos) << all;
  EXPECT_NE(all.find("P2 was not hit."), std::string::npos) << all;  // nothing came through
  EXPECT_NE(all.find("apart was not hit."), std::string::npos) << all;
  EXPECT_EQ(j["structures"][1]["hit"], false);
  EXPECT_EQ(j["structures"][1]["loaded_through"], "deck");
  EXPECT_TRUE(j["structures"][0]["loaded_through"].is_null());
  EXPECT_TRUE(j["structures"][2]["loaded_through"].is_null());
  // A force that a solver's tolerance leaves is no impact.
  j = summary(1e-14);
  EXPECT_EQ(j["hit"], false);
  EXPECT_TRUE(j["impacts"].empty());
  all.clear();
  for (const auto& line : j["headline"]) all += line.get<std::string>() + "\n";
  EXPECT_NE(all.find("P1 was not hit; 2.92 MN added to its base reaction at most, at 0.200 s, by what it can "
                     "touch (deck) or by its own motion."),
            std::string::npos)
      << all;
}

/// A run that starts while its structure rings tells the permanent load's reaction, not that of the moment.
TEST(Summary, PreloadIsThatUnderPermanentLoad) {
  sim::RunHeader header;
  header.structures.resize(1);
  header.structures[0].name = "P";
  header.structures[0].permanent << 0, 0, -240e3, 1, 2, 3;
  header.structures[0].told_permanent = true;
  header.structures[0].meets = {0};
  header = decode_header(encode_header(header));
  sim::HistoryRow row;
  row.structures.resize(1);
  row.structures[0].base_force = Vec3(421e3, 458e3, 1487e3);
  SummaryBuilder builder(header);
  builder.add(row);
  const json j = json::parse(builder.text(nullptr));
  EXPECT_EQ(j["structures"][0]["preload_force"], json::array({0.0, 0.0, -240e3}));
  EXPECT_EQ(j["structures"][0]["preload_moment"], json::array({1.0, 2.0, 3.0}));
}

/// What the level of confidence rests on is what the run did.
TEST(Summary, ConfidenceFollowsMethodAndScheme) {
  sim::RunHeader header;
  header.structures.resize(1);
  header.structures[0].name = "P";
  const auto level = [&](const char* what, Steps steps, Taken taken) {
    sim::HistoryRow row;
    row.structures.resize(1);
    SummaryBuilder builder(header, steps, taken);
    builder.add(row);
    const json j = json::parse(builder.text(nullptr));
    for (const auto& entry : j["confidence"])
      if (entry["quantity"].get<std::string>().starts_with(what)) return entry["level"].get<std::string>();
    return std::string("none");
  };
  EXPECT_EQ(level("impulse and momentum", Steps::by_accuracy, Taken::both_ways), "verified");
  EXPECT_EQ(level("impulse and momentum", Steps::by_accuracy, Taken::one_way), "extrapolated");
  EXPECT_EQ(level("impulse and momentum", Steps::by_accuracy, Taken::nothing), "none");
  EXPECT_EQ(level("elastic response", Steps::by_accuracy, Taken::nothing), "none");
  EXPECT_EQ(level("motion of blocks", Steps::by_accuracy, Taken::both_ways), "verified");
  EXPECT_EQ(level("motion of blocks", Steps::scheme_1988, Taken::one_way), "extrapolated");
}

TEST(Records, MembersComeThroughUnchanged) {
  sim::RunHeader header;
  header.structures.emplace_back();
  header.structures[0].name = "V";
  header.structures[0].members = {pier()};
  const sim::RunHeader back = decode_header(encode_header(header));
  ASSERT_EQ(back.structures.at(0).members.size(), 1u);
  EXPECT_EQ(back.structures[0].members[0].name, "P2");
  EXPECT_EQ(back.structures[0].members[0].stations, pier().stations);
  EXPECT_EQ(back.structures[0].members[0].shear_mean, pier().shear_mean);
  sim::HistoryRow row;
  row.structures.resize(1);
  row.structures[0].spalled_volume = 0.25;
  row.structures[0].members = {state(1, 2, 3)};
  row.structures[0].members[0].bars_broken = 4;
  row.structures[0].peaks.moment = {7e6, 0.25, 0};
  row.structures[0].peaks.members = {peaks(0.9, 0.6, 1e-4)};
  row.structures[0].peaks.members[0].before = {1.1, 0.8, 2e-4};
  row.structures[0].peaks.probes = {{0.012, 0.03, 0}};
  RecordCodec writer, reader;
  const sim::HistoryRow read = reader.decode_history(writer.encode(row));
  EXPECT_EQ(read.structures.at(0).spalled_volume, 0.25);
  EXPECT_EQ(read.structures[0].members.at(0).shear, row.structures[0].members[0].shear);
  EXPECT_EQ(read.structures[0].members[0].drift, row.structures[0].members[0].drift);
  EXPECT_EQ(read.structures[0].members[0].bars_broken, 4);
  EXPECT_EQ(read.structures[0].peaks.moment.time, 0.25);
  EXPECT_EQ(read.structures[0].peaks.members.at(0).use_mean.value, 0.6);
  EXPECT_EQ(read.structures[0].peaks.members[0].use_mean.station, 5);
  EXPECT_EQ(read.structures[0].peaks.members[0].crack_width, 1e-4);
  EXPECT_EQ(read.structures[0].peaks.members[0].before.use_mean, 0.8);
  EXPECT_EQ(read.structures[0].peaks.members[0].before.crack_width, 2e-4);
  EXPECT_EQ(read.structures[0].peaks.probes.at(0).value, 0.012);
  EXPECT_EQ(read.structures[0].peaks.probes[0].time, 0.03);
}

/// A probe's greatest displacement is that of the steps, though no row has it.
TEST(Summary, ProbesAreToldOfAllSteps) {
  sim::RunHeader header;
  header.structures.resize(1);
  header.structures[0].probes = {"top"};
  SummaryBuilder builder(header, Steps::by_accuracy, Taken::both_ways);
  sim::HistoryRow row;
  row.structures.resize(1);
  row.structures[0].probe_displacement = {Vec3::Zero()};
  builder.add(row);
  row.time = 1;
  row.structures[0].probe_displacement = {Vec3(0.001, 0, 0)};
  row.structures[0].peaks.probes = {{0.012, 0.43, 0}};
  builder.add(row);
  const json probe = json::parse(builder.text(nullptr))["structures"][0]["probes"][0];
  EXPECT_EQ(probe["peak_displacement"], 0.012);
  EXPECT_EQ(probe["peak_time"], 0.43);
}

TEST(Records, PiecesComeThroughUnchanged) {
  std::vector<sim::RunHeader::BlockInfo> pieces(2);
  pieces[1].name = "V.fragment1";
  pieces[1].mass = 172, pieces[1].crushed = 96;
  const auto read = decode_blocks(encode_blocks(pieces));
  EXPECT_EQ(read.at(1).mass, 172);
  EXPECT_EQ(read[1].crushed, 96);
}

/// Piers of 10 m, 20 m apart: who is meant by a place on them, and nobody above their tops.
TEST(Members, StruckIsTheOneThatThePlaceLiesOn) {
  sim::RunHeader::StructureInfo viaduct;
  viaduct.members = {pier(), pier()};
  viaduct.members[0].name = "P1";
  viaduct.members[1].base = Vec3(20, 0, 0);
  EXPECT_EQ(struck_member(viaduct, Vec3(0.7, 0.2, 5))->name, "P1");
  EXPECT_EQ(struck_member(viaduct, Vec3(19, 0.5, 9.9))->name, "P2");
  EXPECT_EQ(struck_member(viaduct, Vec3(10, 0, 12)), nullptr);
}

/// With a deck from 11.5 m on, 1 m deep: below it a cap beam reaches out 3 m from its pier.
TEST(Members, StruckBelowTheDeckIsThePier) {
  sim::RunHeader::StructureInfo viaduct;
  viaduct.members = {pier(), pier(), pier()};
  viaduct.members[0].name = "P1";
  viaduct.members[1].base = Vec3(20, 0, 0);
  Member& deck = viaduct.members[2];
  deck.name = "S1";
  deck.span = true;
  deck.base = Vec3(0, 0, 12);
  deck.length = 20;
  deck.axis_x = Vec3::UnitY(), deck.axis_y = Vec3::UnitZ();  // along x
  deck.section = {8, 1};
  EXPECT_EQ(struck_member(viaduct, Vec3(10, 4, 12.2))->name, "S1");
  EXPECT_EQ(struck_member(viaduct, Vec3(0.5, 3, 11))->name, "P1");
  EXPECT_EQ(struck_member(viaduct, Vec3(19, -3, 11))->name, "P2");
  EXPECT_EQ(struck_member(viaduct, Vec3(19, 0.5, 9.9))->name, "P2");
}

}  // namespace
}  // namespace talus::io
