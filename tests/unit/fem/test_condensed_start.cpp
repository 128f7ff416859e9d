// From explicit steps to condensed ones: what presses goes on pressing, and what rings faster than the long
// step resolves moves nothing that a contact holds.
#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <vector>

#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

std::vector<int> top_nodes(const FemStructure& s, double top = 12) {
  std::vector<int> nodes;
  const Structure::Snapshot all = s.snapshot();
  for (int i = 0; i < static_cast<int>(all.nodes.size()); ++i)
    if (all.nodes[static_cast<std::size_t>(i)].z() > top - 1e-9) nodes.push_back(i);
  return nodes;
}

/// Explicit steps with the same force on each of the nodes; the time reached.
double press(FemStructure& s, std::span<const int> nodes, const Vec3& force, double h, int steps,
             double t = 0) {
  std::vector<NodeImpulse> impulses;
  for (const int n : nodes) impulses.push_back({n, h * force});
  for (int i = 0; i < steps; ++i) {
    s.predict(t, h);
    s.correct(t, h, impulses);
    t += h;
  }
  return t;
}

constexpr double whatever = 1e300;  // displacements may be wrong by [m]

StructureSpec damped_pier(double ratio) {
  StructureSpec s = cantilever(2, 8);
  s.damping_ratio = ratio;
  return s;
}

}  // namespace

/// A pier at rest under a load on its top. Velocities brought from the half step to the step without the
/// load's impulse had h F / (2 m) upwards at each node that bears it, here 0.04 m/s.
TEST(CondensedStart, WhatIsPressedInBalanceIsNotKicked) {
  FemStructure s(damped_pier(1), Vec3::Zero(), silent);
  const std::vector<int> top = top_nodes(s);
  ASSERT_EQ(top.size(), 9u);
  const double h = s.critical_step();
  const double t = press(s, top, Vec3(0, 0, -2e5), h, static_cast<int>(1.2 / h));
  double fastest = 0, before = 0;
  for (const int n : top) before = std::max(before, s.skin().node_velocity(n).norm());
  ASSERT_LT(before, 1e-9);
  ASSERT_GT(s.condensed().longest_step(t, 1e-3, whatever), 0);
  s.condensed().predict(t, 20 * h);
  for (const int n : top) fastest = std::max(fastest, s.skin().node_velocity(n).norm());
  EXPECT_LT(fastest, 1e-9);
}

/// A node that was struck rings at a rate that the condensed step does not resolve. A contact that holds it
/// in that step leaves it where it is; by the midpoint rule it went on by H v / 2.
TEST(CondensedStart, HeldNodeStaysWhereItIs) {
  FemStructure s(damped_pier(0.02), Vec3::Zero(), silent);
  const int node = top_nodes(s).front();
  const double h = s.critical_step(), H = 100 * h;
  double t = press(s, std::vector<int>{node}, Vec3(0, 0, -1e6), h, 1);
  t = press(s, {}, Vec3::Zero(), h, 20, t);
  ASSERT_GT(s.condensed().longest_step(t, 1e-3, whatever), 0);
  s.condensed().predict(t, H);
  const Vec3 place = s.skin().node_position(node);
  const std::vector<int> held{node};
  const Vec3 p = -s.condensed().compliance(held).ldlt().solve(s.skin().predicted_velocity(node));
  const std::vector<NodeImpulse> impulses{{node, p}};
  ASSERT_TRUE(s.condensed().correct(t, H, impulses));
  EXPECT_LT(s.skin().node_velocity(node).norm(), 1e-12);
  EXPECT_LT((s.skin().node_position(node) - place).norm(), 1e-14);
}

/// Of a pier that a blow of one step has left ringing at rates that the condensed step does not resolve the
/// start would take nearly all: it waits until damping has left a hundredth, ten times the accuracy. One that
/// sways in its first mode keeps its motion, and begins at once.
TEST(CondensedStart, WhatIsNotResolvedDecaysFirst) {
  const double accuracy = 1e-3;
  FemStructure s(damped_pier(0.02), Vec3::Zero(), silent);
  const std::vector<int> top = top_nodes(s);
  const double h = s.critical_step(), H = 100 * h;
  double t = press(s, std::vector<int>{top.front()}, Vec3(0, 0, -1e6), h, 1), largest = s.energy().kinetic;
  for (int i = 0; i < 40; ++i) {
    t = press(s, {}, Vec3::Zero(), h, 1, t);
    largest = std::max(largest, s.energy().kinetic);
  }
  ASSERT_GT(s.condensed().longest_step(t, accuracy, whatever), 0);
  EXPECT_FALSE(s.condensed().may_begin(t, H, accuracy));
  EXPECT_EQ(s.condensed().longest_step(t, accuracy, whatever), 0);  // not before it can have decayed
  int tries = 1;
  const double refused = t;
  while (t < 10 && !(s.condensed().longest_step(t, accuracy, whatever) > 0 &&
                     s.condensed().may_begin(t, H, accuracy))) {
    tries += s.condensed().longest_step(t, accuracy, whatever) > 0;
    t = press(s, {}, Vec3::Zero(), h, 50, t);
  }
  const double decay = 2 * 0.02 * s.frequencies(1).front();
  EXPECT_GT(t, refused + 1 / decay);
  EXPECT_LT(t, refused + 6 / decay);
  EXPECT_LT(tries, 30);
  const double before = s.energy().algorithmic;
  s.condensed().predict(t, H);
  ASSERT_TRUE(s.condensed().correct(t, H, {}));
  EXPECT_LT(s.energy().algorithmic - before, 2 * 10 * accuracy * largest);

  FemStructure sways(damped_pier(0.02), Vec3::Zero(), silent);
  t = press(sways, top, Vec3(1e4, 0, 0), h, static_cast<int>(0.5 * M_PI / sways.frequencies(1).front() / h));
  t = press(sways, {}, Vec3::Zero(), h, 20, t);
  const StructureEnergy held = sways.energy();
  const double step = sways.condensed().longest_step(t, accuracy, whatever);
  ASSERT_GT(step, 0);
  EXPECT_TRUE(sways.condensed().may_begin(t, step, accuracy));
  sways.condensed().predict(t, step);
  ASSERT_TRUE(sways.condensed().correct(t, step, {}));
  EXPECT_LT(sways.energy().algorithmic - held.algorithmic,
            0.03 * (held.kinetic + held.elastic));  // 0.012 of the first mode, (omega h)^2 by backward Euler,
                                                    // and most of the second one
}

/// A pier that is struck again and again: all starts together take no more than one may, and each waits
/// longer for it.
TEST(CondensedStart, ManyStartsShareWhatTheyMayTake) {
  const double accuracy = 1e-3;
  FemStructure s(damped_pier(0.02), Vec3::Zero(), silent);
  const std::vector<int> struck{top_nodes(s).front()};
  const double h = s.critical_step(), H = 100 * h;
  double t = 0, largest = 0, taken = 0;
  constexpr int blows = 6;
  for (int blow = 0; blow < blows; ++blow) {
    s.condensed().struck(t);
    t = press(s, struck, Vec3(0, 0, -1e6), h, 1, t);
    for (int i = 0; i < 40; ++i) {
      t = press(s, {}, Vec3::Zero(), h, 1, t);
      largest = std::max(largest, s.energy().kinetic);
    }
    const double end = t + 10;
    while (t < end && !(s.condensed().longest_step(t, accuracy, whatever) > 0 &&
                        s.condensed().may_begin(t, H, accuracy)))
      t = press(s, {}, Vec3::Zero(), h, 50, t);
    ASSERT_LT(t, end) << blow;  // it does begin
    const double before = s.energy().algorithmic;
    s.condensed().predict(t, H);
    taken += s.energy().algorithmic - before;
    ASSERT_TRUE(s.condensed().correct(t, H, {}));
    t += H;
  }
  RecordProperty("taken", std::to_string(taken / (10 * accuracy * largest)));
  EXPECT_GT(taken, 0.3 * 10 * accuracy * largest);
  EXPECT_LT(taken, 1.2 * 10 * accuracy * largest);  // by the first alone up to one, by each alone up to six
}

/// A pier that was let go rings on alone: no contact holds a node of it, and its long steps begin with all of
/// its motion.
TEST(CondensedStart, WhatRingsAloneKeepsItsEnergy) {
  StructureSpec spec = damped_pier(0.02);
  spec.integrator = "implicit";
  FemStructure s(spec, Vec3::Zero(), silent);
  const double h = s.critical_step();
  double t = press(s, top_nodes(s), Vec3(1e5, 0, 0), h, 200);
  t = press(s, {}, Vec3::Zero(), h, 400, t);
  const StructureEnergy before = s.energy();
  for (int i = 0; i < 20; ++i) s.advance_alone(t + 2e-3 * i, 2e-3);
  EXPECT_LT(std::abs(s.energy().algorithmic - before.algorithmic), 5e-4 * (before.kinetic + before.elastic));
}

namespace {

/// What a structure has when it begins to ring on alone, and at the end.
struct RingDown {
  StructureEnergy before, after;
  int condensed = 0;  // of the pieces
};

RingDown ring_alone(FemStructure& s, double t, int pieces, double length) {
  RingDown r;
  r.before = s.energy();
  for (int i = 0; i < pieces; ++i) r.condensed += s.advance_alone(t + length * i, length) == "condensed";
  r.after = s.energy();
  return r;
}

/// A beam between walls, cracked by a blow of 5 ms on one side of its upper face, off its middle: it rings in
/// bending both ways and in torsion. From 50 ms after the blow on, for a quarter of a second.
RingDown ring_down_of_cracked_beam(const std::string& integrator) {
  StructureSpec spec = beam_between_walls("ringing_beam_" + integrator, 3);
  spec.rate_effect = spec.erosion = spec.gravity_preload = false;
  spec.integrator = integrator;
  FemStructure s(spec, Vec3::Zero(), silent);
  std::vector<int> struck;
  const Structure::Snapshot all = s.snapshot();
  for (int i = 0; i < static_cast<int>(all.nodes.size()); ++i)
    if (const Vec3& x = all.nodes[static_cast<std::size_t>(i)];
        std::abs(x.x() - 0.7) < 0.3 && x.z() > 0.4 - 1e-6 && x.y() > -0.01)
      struck.push_back(i);
  const double h = s.critical_step();
  double t = press(s, struck, Vec3(0, 120e3, -400e3) / static_cast<double>(struck.size()), h,
                   static_cast<int>(0.005 / h));
  t = press(s, {}, Vec3::Zero(), h, static_cast<int>(0.05 / h), t);
  EXPECT_GT(s.damage().volume, 0.5);
  return ring_alone(s, t, 125, 2e-3);
}

}  // namespace

/// Long steps in which cracks open, close and rub do not follow them: the cracks took 1.5 times as much, and
/// the scheme a third of what the beam held. What rings on alone goes by explicit steps as long as its cracks
/// rub, begins long steps with all of its motion, and loses what it loses by explicit steps throughout.
TEST(CondensedStart, RubbingCracksAreFollowed) {
  const RingDown by_choice = ring_down_of_cracked_beam("auto"),
                 reference = ring_down_of_cracked_beam("explicit");
  EXPECT_GT(by_choice.condensed, 0);
  EXPECT_EQ(reference.condensed, 0);
  const double held = reference.before.kinetic + reference.before.elastic,
               rubbed = reference.after.damage_work - reference.before.damage_work;
  ASSERT_GT(rubbed, 0.1 * held);
  EXPECT_NEAR(by_choice.after.damage_work - by_choice.before.damage_work, rubbed, 0.05 * rubbed);
  EXPECT_LT(std::abs(by_choice.after.algorithmic - by_choice.before.algorithmic), 0.08 * held);
}

namespace {

/// A cantilever of 0.5 x 0.5 x 5 m with a bar of 20 mm in each corner, cracked across by a push of 4 ms at
/// its top: it rings with cracks that open on one side and close on the other. From 0.3 s after the push on,
/// for 0.3 s.
RingDown ring_down_of_cracked_cantilever(const std::string& integrator) {
  std::vector<std::array<Vec3, 2>> bars;
  for (const double x : {-0.2, 0.2})
    for (const double y : {-0.2, 0.2}) bars.push_back({Vec3(x, y, 0), Vec3(x, y, 5)});
  StructureSpec spec = cantilever(2, 16);
  spec.size = Vec3(0.5, 0.5, 5);
  spec.probes.clear();
  spec.f_cm = 38e6;
  spec.damage = "concrete";
  spec.rate_effect = spec.erosion = false;
  spec.damping_ratio = 0.005;
  spec.integrator = integrator;
  spec.rebar_file = bars_of_20_mm("ringing_cantilever_" + integrator, bars);
  FemStructure s(spec, Vec3::Zero(), silent);
  const std::vector<int> top = top_nodes(s, 5);
  const double h = s.critical_step();
  double t =
      press(s, top, Vec3(1000e3, 0, 0) / static_cast<double>(top.size()), h, static_cast<int>(0.004 / h));
  t = press(s, {}, Vec3::Zero(), h, static_cast<int>(0.3 / h), t);
  EXPECT_GT(s.damage().volume, 0.05);
  return ring_alone(s, t, 75, 4e-3);
}

}  // namespace

/// Long steps with the stiffness K of the uncracked column took 3970 of 5508 J by h/2 (K - K_now), where
/// damping by a ratio of 0.005 takes 1058 J.
TEST(CondensedStart, CracksThatOpenAndCloseKeepTheirEnergy) {
  const RingDown ringing = ring_down_of_cracked_cantilever("implicit"),
                 reference = ring_down_of_cracked_cantilever("explicit");
  const auto held = [](const StructureEnergy& e) { return e.kinetic + e.elastic; };
  const double start = held(reference.before),
               damped = reference.after.damping_work - reference.before.damping_work;
  ASSERT_GT(damped, 0.05 * start);
  EXPECT_EQ(reference.condensed, 0);
  EXPECT_LT(std::abs(ringing.after.algorithmic - ringing.before.algorithmic), 0.1 * damped + 0.01 * start);
  EXPECT_NEAR(ringing.after.damping_work - ringing.before.damping_work, damped, 0.1 * damped);
  EXPECT_NEAR(held(ringing.after), held(reference.after), 0.1 * start);
}

/// A column cracked across by a pull, then pressed: its cracks are closed. Without Poisson's effect, and with
/// faces that interlock, concrete is up to 2 + nu times as stiff in shear there as sound concrete is: with K
/// of that, what was left of its motion grew from step to step, to 15 J a step of 930 J after eleven, and the
/// laws ended it.
TEST(CondensedStart, ClosedCracksAreNotStifferThanK) {
  StructureSpec spec = cantilever(3, 24);
  spec.damping_ratio = 0.02;
  spec.f_cm = 38e6;
  spec.damage = "concrete";
  spec.aggregate = 0.016;
  spec.rate_effect = spec.erosion = false;
  std::vector<std::array<Vec3, 2>> bars;
  for (const double x : {-0.6, -0.3, 0.0, 0.3, 0.6})
    for (const double y : {-0.6, -0.3, 0.0, 0.3, 0.6}) bars.push_back({Vec3(x, y, 0), Vec3(x, y, 12)});
  spec.rebar_file = bars_of_20_mm("pulled_column", bars);
  FemStructure s(spec, Vec3::Zero(), silent);
  const std::vector<int> top = top_nodes(s);
  const double h = s.critical_step(), each = 1.0 / static_cast<double>(top.size());
  const Vec3 load(0, 0, -1e6);
  double t = press(s, top, each * Vec3(0, 0, 5e6), h, static_cast<int>(0.002 / h));
  t = press(s, top, each * load, h, static_cast<int>(2.0 / h), t);
  ASSERT_GT(s.damage().volume, 10);
  const double H = 200 * h;
  std::vector<NodeImpulse> impulses;
  for (const int n : top) impulses.push_back({n, H * each * load});
  const auto mechanical = [&] {  // with that of the load, which does not change
    const StructureEnergy e = s.energy();
    return e.kinetic + e.elastic - e.contact_work;
  };
  for (int i = 0; i < 50; ++i, t += H) {
    const double taken = s.energy().algorithmic, before = mechanical();
    ASSERT_GT(s.condensed().longest_step(t, 1e-2, whatever), 0) << i;
    s.condensed().predict(t, H);
    ASSERT_TRUE(s.condensed().correct(t, H, impulses)) << i;
    EXPECT_GT(s.energy().algorithmic, taken) << i;
    EXPECT_LE(mechanical(), before) << i;
  }
}
