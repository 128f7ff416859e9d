// Members of a structure: what the summary says of them, and that they come through the journal unchanged.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "io/member_track.hpp"
#include "io/records.hpp"

namespace talus::io {
namespace {

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

TEST(MemberTrack, UtilisationDriftAndClass) {
  MemberTrack track(pier());
  track.add(0, state(0, 0, 0.002));
  for (int i = 1; i <= 100; ++i) {
    const double t = 0.01 * i;
    MemberState s = i == 10 ? state(0.6e6, -1.6e6, 0.05) : state(0, 0, 0.002 + 0.01 + 0.004 * std::sin(2 * M_PI * t / 0.05));
    s.crack_width = i >= 10 ? 0.5e-3 : 0;
    track.add(t, s);
  }
  const auto j = track.summary();
  EXPECT_NEAR(j["shear_utilisation_design"]["value"].get<double>(), std::hypot(0.6, 0.8), 1e-12);
  EXPECT_NEAR(j["shear_utilisation_mean"]["value"].get<double>(), std::hypot(0.4, 1.6 / 3), 1e-12);
  EXPECT_NEAR(j["shear_utilisation_design"]["time"].get<double>(), 0.1, 1e-12);
  EXPECT_EQ(j["peak_shear"]["station"], 5);
  EXPECT_NEAR(j["peak_drift"].get<double>(), 0.048, 1e-12);           // without the permanent load's 2 mm
  EXPECT_NEAR(j["residual_drift"][0].get<double>(), 0.010, 4e-4);     // two periods of the ringing average out
  EXPECT_EQ(j["damage_class_name"], "moderate");                      // 0.5 mm, V_dyn = V_Rd at most
}

TEST(MemberTrack, AMemberWhoseTopCameOffIsLostAndHasNoDrift) {
  MemberTrack track(pier());
  track.add(0, state(0, 0, 0));
  track.add(0.5, state(0, 0, 0.02));
  track.add(1, state(0, 0, std::numeric_limits<double>::quiet_NaN()));
  const auto j = track.summary();
  EXPECT_EQ(j["damage_class_name"], "lost");
  EXPECT_EQ(j["top_came_off"], true);
  EXPECT_TRUE(j["residual_drift"].is_null());
  EXPECT_TRUE(j["residual_drift_ratio"].is_null());
  EXPECT_NEAR(j["peak_drift"].get<double>(), 0.02, 1e-12);   // while it was there
}

TEST(MemberTrack, WhatIsElasticAloneHasNoDamageClass) {
  Member m = pier();
  m.shear_design = m.shear_mean = {0, 0};   // not of concrete
  MemberTrack track(m);
  track.add(0, state(0, 0, 0));
  track.add(1, state(1e8, 0, 0.1));
  EXPECT_TRUE(track.summary()["damage_class"].is_null());
  EXPECT_TRUE(track.summary()["damage_class_name"].is_null());
}

/// A damaged journal's row may have forces of fewer stations than another: what all have counts.
TEST(MemberTrack, StationsThatNotAllHaveAreLeftOut) {
  MemberTrack track(pier());
  MemberState s = state(2e6, 0, 0);
  s.shear.resize(1);
  s.moment.clear();
  track.add(0, s);
  EXPECT_EQ(track.summary()["peak_shear"]["value"], 0);
}

TEST(MemberTrack, ClassesInTheirOrder) {
  const auto grade = [](auto change) {
    MemberTrack track(pier());
    track.add(0, state(0, 0, 0));
    MemberState s = state(0, 0, 0);
    change(s);
    track.add(1, s);
    return track.summary()["damage_class"].template get<int>();
  };
  EXPECT_EQ(grade([](MemberState&) {}), 0);
  EXPECT_EQ(grade([](MemberState& s) { s.crack_width = 0.2e-3; }), 1);
  EXPECT_EQ(grade([](MemberState& s) { s.bars_yielded = 1; }), 2);
  EXPECT_EQ(grade([](MemberState& s) { s.shear[1] = {1.2e6, 0}; }), 2);   // above design, below mean
  EXPECT_EQ(grade([](MemberState& s) { s.shear[1] = {1.6e6, 0}; }), 3);
  EXPECT_EQ(grade([](MemberState& s) { s.bars_broken = 1; }), 3);
  EXPECT_EQ(grade([](MemberState& s) { s.lost_volume = 0.3; }), 3);
  EXPECT_EQ(grade([](MemberState& s) { s.drift = {0.2, 0}; }), 3);
  EXPECT_EQ(grade([](MemberState& s) { s.drift = {0, 0.6}; }), 4);
  EXPECT_EQ(grade([](MemberState& s) { s.lost_volume = 3; }), 4);
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
  RecordCodec writer, reader;
  const sim::HistoryRow read = reader.decode_history(writer.encode(row));
  EXPECT_EQ(read.structures.at(0).spalled_volume, 0.25);
  EXPECT_EQ(read.structures[0].members.at(0).shear, row.structures[0].members[0].shear);
  EXPECT_EQ(read.structures[0].members[0].drift, row.structures[0].members[0].drift);
  EXPECT_EQ(read.structures[0].members[0].bars_broken, 4);
}

}  // namespace
}  // namespace talus::io
