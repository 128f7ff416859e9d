// Greatest loads by means over a window: closed forms of the mean, and what a structure tells whatever asks
// it and however often.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "fem/members/load_track.hpp"
#include "fem/members/running_mean.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

double mean_of(const RunningMean& m) { return m.mean()[0]; }
bool add(RunningMean& m, double duration, double value) { return m.add(duration, std::array{value}); }

}  // namespace

TEST(RunningMean, AStepArrivesAsARampWhateverTheStepsAre) {
  for (const double step : {1e-5, 3.7e-5, 1e-4, 2.9e-4}) {
    RunningMean mean(1.5e-3, 1e-4);
    mean.begin(std::array{2.0});
    double t = 0;
    while (t < 4e-3) {
      t += step;
      if (!add(mean, step, 5.0)) continue;
      EXPECT_NEAR(mean_of(mean), 2 + 3 * std::min(t / 1.5e-3, 1.0), 1e-9) << step << ' ' << t;
    }
    EXPECT_NEAR(mean_of(mean), 5, 1e-12);
  }
}

TEST(RunningMean, AStepLongerThanTheWindowStandsAlone) {
  RunningMean mean(1.5e-3, 1e-4);
  mean.begin(std::array{1.0});
  ASSERT_TRUE(add(mean, 1e-2, 7));
  EXPECT_NEAR(mean_of(mean), 7, 1e-12);
  ASSERT_TRUE(add(mean, 5e-4, 1));
  EXPECT_NEAR(mean_of(mean), (7 * 1.0 + 1 * 0.5) / 1.5, 1e-12);
}

TEST(RunningMean, GoesOnFromWhatWasSavedToTheSameBits) {
  RunningMean one(1.5e-3, 1e-4), other(1.5e-3, 1e-4);
  one.begin(std::array{0.3});
  for (int k = 0; k < 57; ++k) add(one, 3.1e-5, std::sin(k));
  std::vector<double> state;
  one.save(state);
  StateReader reader(state);
  other.restore(reader);
  ASSERT_TRUE(reader.empty());
  for (int k = 0; k < 57; ++k) {
    ASSERT_EQ(add(one, 3.1e-5, std::cos(k)), add(other, 3.1e-5, std::cos(k)));
    ASSERT_EQ(mean_of(one), mean_of(other));
  }
}

// One sample after every millisecond that passes has crack widths, whatever the steps are.
TEST(LoadTrack, WidthsAreDueOnceAMillisecond) {
  for (const double step : {3.5e-5, 6e-5, 2.2e-4, 7e-4}) {
    LoadTrack track;
    track.begin(std::array<double, 9>{}, {}, {});
    int due = 0;
    double t = 0;
    while (t < 0.02) {
      t += step;
      if (!track.due(step)) {
        track.pass(step);
        continue;
      }
      due += track.widths_due(t, step) ? 1 : 0;
      track.sample(t, step, {}, {});
    }
    EXPECT_NEAR(due, 20, 1) << step;
  }
}

// A blow that is over before the window is: its impulse over the window, by steps of any length; what stood
// there before is no part of it.
TEST(LoadTrack, AShortBlowIsItsImpulseOverTheWindow) {
  for (const double step : {1e-5, 6e-5}) {
    LoadTrack track;
    std::array<double, 9> at_rest{}, struck{};  // one foot
    at_rest[2] = struck[2] = -4e6;
    struck[0] = 10e6, struck[7] = 30e6;
    track.begin(at_rest, {}, {});
    for (int k = 0; k < static_cast<int>(std::lround(6e-3 / step)); ++k) {
      const double t = (k + 1) * step;
      track.react(t, step, t > 1.2e-3 * (1 + 1e-9) && t <= 1.5e-3 * (1 + 1e-9) ? struck : at_rest);
    }
    const LoadPeaks& p = track.peaks();
    EXPECT_NEAR(p.shear.value, 10e6 * 3e-4 / load_window, 1e-6 * 10e6) << step;
    EXPECT_NEAR(p.force.value, p.shear.value, 1) << step;
    EXPECT_NEAR(p.moment.value, 30e6 * 3e-4 / load_window, 1e-6 * 30e6) << step;
    EXPECT_NEAR(p.shear.time, 1.5e-3 - load_window / 2, load_window) << step;
  }
}

namespace {

/// A pier that a traction strikes for some milliseconds, asked for its motion in pieces of `interval`; its
/// greatest loads.
LoadPeaks loads_of_a_blow(double interval, const std::string& integrator = "explicit") {
  StructureSpec s = cantilever(3, 24);
  s.integrator = integrator;
  StructureSpec::Load load;
  load.region = Box3(Vec3(-0.76, -0.5, 5.5), Vec3(-0.74, 0.5, 6.5));
  load.traction = Vec3(1e6, 0, 0);
  load.history = {{0, 0}, {0.002, 1}, {0.004, 0}};
  s.loads.push_back(load);
  FemStructure pier(s, Vec3(0, 0, -9.81), silent);
  for (int k = 0; k < static_cast<int>(std::lround(0.06 / interval)); ++k)
    pier.advance_alone(interval * k, interval);
  return pier.loads().peaks();
}

}  // namespace

TEST(LoadTrack, GreatestLoadsDoNotHangOnHowOftenTheyAreAskedFor) {
  const LoadPeaks often = loads_of_a_blow(2e-4), seldom = loads_of_a_blow(2e-2);
  ASSERT_EQ(often.members.size(), 1u);
  EXPECT_GT(often.shear.value, 0.2e6);
  EXPECT_NEAR(seldom.shear.value / often.shear.value, 1, 5e-3);
  EXPECT_NEAR(seldom.moment.value / often.moment.value, 1, 5e-3);
  EXPECT_NEAR(seldom.members[0].shear.value / often.members[0].shear.value, 1,
              2e-2);  // samples fall at other instants
  EXPECT_NEAR(seldom.members[0].moment.value / often.members[0].moment.value, 1, 2e-2);
  EXPECT_NEAR(seldom.members[0].drift / often.members[0].drift, 1, 1e-2);
}

// A load that comes within three periods of the first mode is carried as at rest: V = F, M = F z below it.
TEST(LoadTrack, ASlowLoadIsItsStatics) {
  for (const std::string integrator : {"explicit", "implicit", "modal"}) {
    StructureSpec s = cantilever(3, 24);
    s.integrator = integrator;
    StructureSpec::Load load;
    load.region = Box3(Vec3(-0.76, -0.5, 5.5), Vec3(-0.74, 0.5, 6.5));
    load.traction = Vec3(1e6, 0, 0);
    load.history = {
        {0, 0}, {0.4875, 1}, {1, 1}};  // a whole number of periods of 0.1625 s: it stands still then
    s.loads.push_back(load);
    FemStructure pier(s, Vec3(0, 0, -9.81), silent);
    for (int k = 0; k < 60; ++k) pier.advance_alone(0.01 * k, 0.01);
    const LoadPeaks p = pier.loads().peaks();
    EXPECT_NEAR(p.shear.value, 1e6, 0.03e6) << integrator;
    EXPECT_NEAR(p.moment.value, 6e6, 0.18e6) << integrator;
    EXPECT_NEAR(p.members.at(0).shear.value, 1e6, 0.05e6) << integrator;
    EXPECT_NEAR(p.members[0].moment.value, 6e6, 0.05 * 6e6) << integrator;
    EXPECT_LT(p.members[0].moment.station, 0.1) << integrator;
  }
}

TEST(LoadTrack, GoesOnFromASavedStateAndStartsOver) {
  StructureSpec s = cantilever(2, 16);
  s.initial_velocity = Vec3(1, 0, 0);
  s.integrator = "explicit";
  FemStructure one(s, Vec3(0, 0, -9.81), silent), other(s, Vec3(0, 0, -9.81), silent);
  one.advance_alone(0, 0.003);
  std::vector<double> state;
  one.save(state);
  other.restore(state);
  one.advance_alone(0.003, 0.01);
  other.advance_alone(0.003, 0.01);
  EXPECT_GT(one.loads().peaks().shear.value, 0);
  EXPECT_EQ(one.loads().peaks().shear.value, other.loads().peaks().shear.value);
  EXPECT_EQ(one.loads().peaks().members.at(0).shear.value, other.loads().peaks().members.at(0).shear.value);
  // A new run counts from the same permanent load, though it rings, and knows of what was before what acts as
  // it starts.
  const double before = one.loads().peaks().shear.value;
  const Vec6 permanent = one.loads().permanent_reaction();
  one.start_over();
  EXPECT_EQ(one.loads().permanent_reaction(), permanent);
  EXPECT_EQ(one.loads().peaks().shear.time, 0);
  EXPECT_LE(one.loads().peaks().shear.value, before);
  EXPECT_GT((one.loads().base_force() - permanent.head<3>()).norm(), 1e3);
}

// What a section had to carry in the runs before stands beside what it carries in this one.
TEST(LoadTrack, KeepsTheUseOfTheRunsBefore) {
  Member pier;
  pier.stations = {0};
  pier.shear_design = {1e6, 1e6}, pier.shear_mean = {2e6, 2e6};
  const std::array members{pier};
  const auto carrying = [](double shear, double crack_width) {
    MemberState s;
    s.axial = {0}, s.shear = {{{shear, 0}}}, s.moment = {{{0, 0}}};
    s.crack_width = crack_width;
    return std::array{s};
  };
  LoadTrack track;
  const std::array<double, 6> none{};
  track.begin(none, members, carrying(0, 0));
  track.sample(0.01, 0.01, members, carrying(3e6, 2e-3));
  track.begin_again(none, members, carrying(0.5e6, 1e-3));
  track.sample(0.01, 0.01, members, carrying(1e6, 0.5e-3));
  const auto expect = [](const MemberPeaks& p, double design, double mean, double width) {
    EXPECT_NEAR(p.before.use_design, design, 1e-12);
    EXPECT_NEAR(p.before.use_mean, mean, 1e-12);
    EXPECT_NEAR(p.before.crack_width, width, 1e-15);
  };
  expect(track.peaks().members.at(0), 3, 1.5, 2e-3);
  EXPECT_NEAR(track.peaks().members[0].use_mean.value, 0.5, 1e-12);
  track.begin_again(none, members, carrying(0, 0));  // the greatest of all
  expect(track.peaks().members.at(0), 3, 1.5, 2e-3);
  std::vector<double> state;
  track.save(state);
  LoadTrack other;
  StateReader reader(state);
  other.restore(reader);
  expect(other.peaks().members.at(0), 3, 1.5, 2e-3);
}
