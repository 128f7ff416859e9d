// The leapfrog's energy depends on its step: what changes with the step alone is reported apart from
// numerical dissipation.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

double mechanical(const StructureEnergy& e) { return e.kinetic + e.elastic + e.gravity_potential; }

/// A slab of 8 x 8 x 2 cells, held below, struck at one node of its top by a tenth of a newton second: cells
/// of its skin ring.
struct Struck {
  FemStructure slab;
  double t = 0, h, given = 0;
  explicit Struck(const std::string& integrator = "explicit")
      : slab(spec(integrator), Vec3::Zero(), silent), h(0.05 * slab.critical_step()) {
    int top = 0;
    for (int n = 0; n < static_cast<int>(slab.mesh().nodes.size()); ++n)
      if ((slab.skin().node_position(n) - Vec3(0, 0, 0.25)).norm() < 1e-9) top = n;
    const NodeImpulse blow{top, Vec3(3, 1, -10)};
    slab.predict(0, h);
    slab.correct(0, h, std::span(&blow, 1));
    t = h;
    given = slab.energy().contact_work;
    go(200, h);
  }
  static StructureSpec spec(const std::string& integrator) {
    StructureSpec s;
    s.name = "slab";
    s.kind = "box";
    s.young = 33e9;
    s.size = Vec3(2, 2, 0.5);
    s.cells = {8, 8, 2};
    s.supports.push_back({"-z", "", {}, {true, true, true}});
    s.gravity_preload = false;
    s.integrator = integrator;
    return s;
  }
  void step(double length) {
    slab.predict(t, length);
    slab.correct(t, length, {});
    t += length;
    h = length;
  }
  void go(int steps, double length) {
    for (int i = 0; i < steps; ++i) step(length);
  }
  /// Grown or shortened by that factor from step to step.
  void change(double to, double factor) {
    while (factor > 1 ? h * factor < to : h * factor > to) step(h * factor);
    step(to);
  }
  void balanced() const {
    const StructureEnergy e = slab.energy();
    EXPECT_NEAR(mechanical(e) + e.algorithmic + e.step_dependence, given, 1e-10 * given);
  }
};

}  // namespace

/// The step grows as it does after a blow, to 0.9 of the stable one, and shrinks again. The ringing's energy
/// reads a third lower in between, which was booked as the scheme's.
TEST(StepDependence, OfSlowlyChangingStepsIsTold) {
  Struck s;
  const double stable = s.slab.critical_step();
  for (int round = 0; round < 3; ++round) {
    s.change(0.9 * stable, 1.02);
    s.balanced();
    EXPECT_GT(s.slab.energy().step_dependence, 0.1 * s.given);
    EXPECT_LT(std::abs(s.slab.energy().algorithmic), 0.01 * s.given) << round;
    s.go(300, s.h);
    EXPECT_LT(std::abs(s.slab.energy().algorithmic), 0.01 * s.given) << round;  // nothing at a constant step
    s.change(0.05 * stable, 1 / 1.02);
    s.balanced();
    EXPECT_LT(std::abs(s.slab.energy().step_dependence), 0.01 * s.given) << round;
    EXPECT_LT(std::abs(s.slab.energy().algorithmic), 0.01 * s.given) << round;
  }
}

/// A step that jumps reads the energy of the phases that it meets; on the average over many jumps what is
/// told is right.
TEST(StepDependence, OfJumpsIsRightOnTheAverage) {
  double told = 0, left = 0;
  for (int delay = 0; delay < 24; ++delay) {
    Struck s;
    s.go(7 * delay, s.h);
    s.go(1, 0.5 * s.slab.critical_step());
    s.balanced();
    told += s.slab.energy().step_dependence / s.given / 24;
    left += s.slab.energy().algorithmic / s.given / 24;
  }
  EXPECT_GT(told, 0.02);
  EXPECT_LT(std::abs(left), 0.1 * told);
}

/// On to modes, which know no step: what the leapfrog read too little comes back, up to what a motion near
/// the stable step gains as that step jumps.
TEST(StepDependence, ComesBackWithTheModes) {
  Struck s("modal");
  s.change(0.9 * s.slab.critical_step(), 1.02);
  s.slab.advance_alone(s.t, 1e-4);
  const StructureEnergy e = s.slab.energy();
  EXPECT_NEAR(mechanical(e) + e.algorithmic + e.step_dependence, s.given, 1e-10 * s.given);
  EXPECT_LT(std::abs(e.step_dependence), 0.05 * s.given);
  EXPECT_LT(std::abs(e.algorithmic), 0.02 * s.given);
}

/// A run that goes on from a saved state goes on with the same bits.
TEST(StepDependence, GoesOnWithTheState) {
  Struck one, other;
  one.change(0.3 * one.slab.critical_step(), 1.02);
  std::vector<double> state;
  one.slab.save(state);
  other.slab.restore(state);
  other.t = one.t, other.h = one.h;
  for (Struck* s : {&one, &other}) s->change(0.9 * s->slab.critical_step(), 1.02);
  EXPECT_EQ(one.slab.energy().step_dependence, other.slab.energy().step_dependence);
  EXPECT_EQ(one.slab.energy().algorithmic, other.slab.energy().algorithmic);
}
