// The greatest loads and displacements of modal motion, whatever the intervals in which it is asked for.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

/// A cantilever without preload under 1 m/s^2 from the side for 0.5 s, six periods of its first mode.
LoadPeaks of_sudden_push(const std::string& integrator, double interval,
                         const Vec3& gravity = Vec3::UnitX()) {
  StructureSpec s = cantilever(2, 16);
  s.integrator = integrator;
  FemStructure pier(s, gravity, silent);
  for (int k = 0; k < static_cast<int>(std::lround(0.5 / interval)); ++k)
    pier.advance_alone(interval * k, interval);
  return pier.loads().peaks();
}

void expect_alike(const LoadPeaks& a, const LoadPeaks& b, double forces, double displacements) {
  ASSERT_EQ(a.members.size(), 1u);
  ASSERT_EQ(a.probes.size(), 1u);
  ASSERT_EQ(b.probes.size(), 1u);
  EXPECT_NEAR(a.force.value / b.force.value, 1, forces);
  EXPECT_NEAR(a.shear.value / b.shear.value, 1, forces);
  EXPECT_NEAR(a.moment.value / b.moment.value, 1, forces);
  EXPECT_NEAR(a.members[0].shear.value / b.members[0].shear.value, 1, forces);
  EXPECT_NEAR(a.members[0].moment.value / b.members[0].moment.value, 1, forces);
  EXPECT_NEAR(a.members[0].drift / b.members[0].drift, 1, displacements);
  EXPECT_NEAR(a.probes[0].value / b.probes[0].value, 1, displacements);
  EXPECT_NEAR(a.probes[0].time, b.probes[0].time, 0.34);  // whole periods apart, where it is undamped
}

}  // namespace

// Explicit steps hold what the 24 lowest modes leave out: a thousandth of the energy at most.
TEST(ModalPeaks, AreThoseOfExplicitSteps) {
  expect_alike(of_sudden_push("modal", 0.5), of_sudden_push("explicit", 0.5), 0.03, 0.01);
}

// Samples fall at other instants, of the fastest mode's amplitude at most 0.2^2 / 8 apart; means of forces
// begin at others.
TEST(ModalPeaks, DoNotHangOnTheInterval) {
  const LoadPeaks often = of_sudden_push("modal", 1e-3);
  for (const double interval : {0.05, 0.25, 0.5}) {
    SCOPED_TRACE(interval);
    expect_alike(of_sudden_push("modal", interval), often, 5e-3, 5e-3);
  }
}

// Gravity along the pier on top of the push: its moments have arms by what the load from the side displaces.
TEST(ModalPeaks, CountMomentsOfTheWeightAsExplicitStepsDo) {
  const Vec3 gravity(1, 0, -9.81);
  expect_alike(of_sudden_push("modal", 0.5, gravity), of_sudden_push("explicit", 0.5, gravity), 0.03, 0.02);
}

// All modes of one start in phase once a period: v / omega, at the quarter of a period.
TEST(ModalPeaks, AProbeReachesTheAmplitudeOfAFreeOscillation) {
  StructureSpec s = cantilever(1, 8);
  s.integrator = "modal";
  FemStructure shape(s, Vec3::Zero(), silent);
  const double omega = shape.frequencies(1)[0];
  s.initial_velocity = Vec3(0.1, 0, 0);
  FemStructure one(s, Vec3::Zero(), silent);
  one.advance_alone(0, 6 * M_PI / omega);
  FemStructure other(s, Vec3::Zero(), silent);
  double most = 0, u = 0;
  for (int k = 0; k < 3000; ++k) {
    other.advance_alone(2e-3 * M_PI / omega * k, 2e-3 * M_PI / omega);
    u = other.skin().probe_displacements()[0].norm();
    most = std::max(most, u);
  }
  EXPECT_NEAR(one.loads().peaks().probes.at(0).value / most, 1, 1e-3);
}

TEST(ModalPeaks, ProbesOfWhatIsThrownAreWatchedToo) {
  StructureSpec s = cantilever(1, 8);
  s.supports.clear();
  s.integrator = "explicit";
  s.initial_velocity = Vec3(3, 0, 4);
  FemStructure thrown(s, Vec3(0, 0, -16), silent);
  thrown.advance_alone(0,
                       0.5);  // back at the height of its start, 1.5 m on; highest at a quarter of a second
  EXPECT_NEAR(thrown.loads().peaks().probes.at(0).value, 1.5, 1e-3);
  thrown.advance_alone(0.5, 0.25);
  EXPECT_NEAR(thrown.loads().peaks().probes.at(0).value, std::hypot(2.25, 1.5), 2e-3);
  std::vector<double> state;
  thrown.save(state);
  FemStructure again(s, Vec3(0, 0, -16), silent);
  again.restore(state);
  EXPECT_EQ(again.loads().peaks().probes.at(0).value, thrown.loads().peaks().probes.at(0).value);
  EXPECT_EQ(again.loads().peaks().probes.at(0).time, thrown.loads().peaks().probes.at(0).time);
}
