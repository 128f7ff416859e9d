#include <gtest/gtest.h>

#include <cmath>

#include "core/error.hpp"
#include "fem/materials/material_steel.hpp"

namespace talus::material {
namespace {

TEST(Steel, BilinearCurveAndFracture) {
  Steel::Parameters p;
  p.rate_effect = false;
  const Steel law(p);
  Steel::State state;
  const double eps_y = p.yield / p.young, slope = (p.ultimate - p.yield) / (p.fracture_strain - eps_y);
  double work = 0, lost = 0, before = 0, eps = 0;
  for (int i = 1; i < 5000; ++i) {
    const double next = p.fracture_strain * i / 5000.0;
    const auto r = law(next, 0, state, state);
    EXPECT_NEAR(r.stress, next <= eps_y ? p.young * next : p.yield + slope * (next - eps_y), 1e-6 * p.yield);
    work += 0.5 * (r.stress + before) * (next - eps);
    lost += r.dissipation;
    EXPECT_NEAR(work, r.energy + lost, 1e-4 * work + 1);
    before = r.stress;
    eps = next;
  }
  const auto broken = law(1.001 * p.fracture_strain, 0, state, state);
  EXPECT_EQ(broken.stress, 0);
  EXPECT_EQ(state.broken, 1);
  EXPECT_GT(broken.dissipation, 0);
  EXPECT_EQ(law(0, 0, state, state).stress, 0);
}

TEST(Steel, CycleShowsTheBauschingerEffectAndTheTangentIsTheDerivative) {
  Steel::Parameters p;
  p.rate_effect = false;
  p.ultimate = 700e6;
  const Steel law(p);
  Steel::State state;
  const double top = law(0.02, 0, state, state).stress;
  double strain = 0.02, stress = top;
  Steel::State walk = state;
  while (true) {  // unload until it yields the other way
    strain -= 1e-5;
    const auto r = law(strain, 0, walk, walk);
    ASSERT_GE(r.dissipation, 0);
    stress = r.stress;
    if (r.tangent < 0.9 * p.young) break;
  }
  EXPECT_NEAR(stress, top - 2 * p.yield, 4e-3 * p.yield);
  for (const double e : {0.001, 0.015, 0.03}) {
    Steel::State a, b, c;
    const auto r = law(e, 0, Steel::State{}, a);
    const double fd =
        (law(e + 1e-8, 0, Steel::State{}, b).stress - law(e - 1e-8, 0, Steel::State{}, c).stress) / 2e-8;
    EXPECT_NEAR(fd / r.tangent, 1, 1e-5);
  }
}

TEST(Steel, RateFactorIsFrozenAtYield) {
  EXPECT_NEAR(steel_yield_at_rate(500e6, 1), 500e6 + 6e6 * std::log(1 / 5e-5), 1);
  EXPECT_EQ(steel_yield_at_rate(500e6, 1e-9), 500e6);
  Steel::Parameters p;
  p.ultimate = p.yield * 1.0000001;
  const Steel law(p);
  Steel::State state;
  const auto fast = law(0.004, 1.0, state, state);
  EXPECT_NEAR(fast.stress, steel_yield_at_rate(p.yield, 1), 1e3);
  EXPECT_NEAR(law(0.005, 0.0, state, state).stress, fast.stress, 1e3);
}

TEST(Steel, PrestressIsThereAtZeroStrain) {
  Steel::Parameters p = steel_grade("Y1860");
  p.prestress = 1200e6;
  p.rate_effect = false;
  const Steel law(p);
  Steel::State state;
  EXPECT_EQ(law(0, 0, state, state).stress, 1200e6);
  EXPECT_NEAR(law(-0.001, 0, state, state).stress, 1200e6 - 195e6, 1);
  const double room = (p.yield - p.prestress) / p.young;
  EXPECT_NEAR(law(room, 0, state, state).stress, p.yield, 1);
  EXPECT_EQ(state.plastic, 0);
}

TEST(Steel, GradesAndBadInput) {
  EXPECT_DOUBLE_EQ(steel_grade("B500B").ultimate, 540e6);
  const auto own = steel_grade("464/630/0.1");
  EXPECT_DOUBLE_EQ(own.yield, 464e6);
  EXPECT_DOUBLE_EQ(own.ultimate, 630e6);
  EXPECT_DOUBLE_EQ(own.fracture_strain, 0.1);
  for (const char* bad : {"", "B5000", "464", "464/630", "464/400/0.1", "464/630/0.1x", "5/6/0.1"})
    EXPECT_THROW(steel_grade(bad), InputError) << bad;
  const auto rule = [](const char* grade) -> std::string {
    try {
      steel_grade(grade);
    } catch (const InputError& e) { return e.problems().at(0).rule; }
    return "accepted";
  };
  EXPECT_EQ(rule("B5000"), "not a known steel grade");
  EXPECT_EQ(rule("600/500/0.05"), "f_u must be at least f_y, and at most 4000 MPa");
  EXPECT_EQ(rule("50/60/0.05"), "f_y must be between 100 and 3000 MPa");
  EXPECT_EQ(rule("500/540/0.002"), "eps_u must be between the yield strain, 0.0025, and 1");
  Steel::Parameters p;
  p.yield = -1;
  EXPECT_THROW(Steel{p}, InputError);
  p = {};
  p.prestress = 600e6;
  EXPECT_THROW(Steel{p}, InputError);
  p = {};
  p.fracture_strain = 1e-3;
  EXPECT_THROW(Steel{p}, InputError);
}

TEST(BondSlip, EnvelopeAndUnloading) {
  const BondSlip law(38e6);
  const double top = 2.5 * std::sqrt(38.0) * 1e6;
  EXPECT_NEAR(law.strength(), top, 1);
  BondSlip::State state;
  double slip = 0;
  for (int i = 1; i <= 1200; ++i) {
    slip = i * 1e-5;
    const auto r = law(slip, state, state);
    const double expected = slip <= 1e-3    ? top * std::pow(slip / 1e-3, 0.4)
                            : slip <= 2e-3  ? top
                            : slip <= 10e-3 ? top * (1 - 0.6 * (slip - 2e-3) / 8e-3)
                                            : 0.4 * top;
    EXPECT_NEAR(r.stress, std::min(expected, 200e9 * slip), 1e-9 * top);
    EXPECT_GE(r.dissipation, 0);
  }
  const double there = law(slip, state, state).stress;
  EXPECT_NEAR(law(slip - 1e-5, state, state).stress, there - 200e9 * 1e-5, 1);
  const auto back = law(slip - 1e-3, state, state);
  EXPECT_NEAR(back.stress, -0.25 * 0.4 * top, 1);
  EXPECT_GT(back.dissipation, 0);
}

/// Back through the origin the stress rises from a quarter of the envelope to all of it by the unloading
/// stiffness. With a jump at 0 slips had no balance there, and bars of a cracking tie ended the run.
TEST(BondSlip, GoesThroughTheOriginWithoutAJump) {
  const BondSlip law(38e6);
  for (const double side : {1.0, -1.0}) {
    BondSlip::State state;
    for (int i = 0; i <= 100; ++i) law(side * i * 5e-6, state, state);  // half a millimetre out
    const double full = law.envelope(5e-4), step = 2e-8;
    double last = law(side * 5e-4, state, state).stress, least = 0;
    for (int i = 1; i <= 50000; ++i) {  // and as far to the other side
      const double slip = side * (5e-4 - i * step);
      const BondSlip::State before = state;
      const double stress = law(slip, before, state).stress;
      EXPECT_LE(std::abs(stress - last), 200e9 * step * (1 + 1e-6)) << slip;
      EXPECT_NEAR(stress - law(slip + 1e-3 * side * step, before, state).stress,
                  -1e-3 * side * step * law.tangent(slip, before), 1.01e-3 * 200e9 * step)
          << slip;
      law(slip, before, state);
      last = stress;
      least = std::min(least, side * stress);
    }
    EXPECT_NEAR(least, -full, 1e-3 * full);
  }
}

/// A deck held at one height over a seat that rises by a hundredth, or falls, is pulled along it: what the
/// pull does is stored in the normal spring or rubbed off.
TEST(Bearing, BooksCloseOnASeatThatRises) {
  Bearing::Parameters p;
  p.normal_stiffness = 1e9, p.shear_stiffness = 1e7, p.friction = 0.3;
  const Bearing law(p);
  for (const double slope : {-0.01, 0.0, 0.01}) {
    Bearing::State state;
    const int steps = 20000;
    double work = 0, lost = 0, pull = 0;
    const double first = law(2e-3, {0, 0}, state, state, {slope, 0}).energy;
    Bearing::Result r;
    for (int i = 1; i <= steps; ++i) {
      r = law(2e-3 + slope * state.slip[0], {0.1 * i / steps, 0}, state, state, {slope, 0});
      work += 0.5 * (pull - r.shear[0]) * 0.1 / steps;
      pull = -r.shear[0];
      lost += r.dissipation;
    }
    EXPECT_GT(lost, 0);
    EXPECT_NEAR(pull / r.normal, 0.3 + slope, 1e-6);
    EXPECT_NEAR(work, r.energy - first + lost, 1e-3 * work) << slope;
  }
}

/// On a seat steeper than its friction a foot that is pressed slides down by no more than what takes the
/// pressure off: it slid by 0.19 m at a depth of 4.5 mm, lifted, came back and was pressed again, and each
/// time 0.13 MJ were counted as rubbed off.
TEST(Bearing, OnASteepSeatSlidesNoFartherThanItsDepth) {
  Bearing::Parameters p;
  p.normal_stiffness = 5e8, p.shear_stiffness = 5e6, p.friction = 0.3;
  const Bearing law(p);
  for (const double slope : {-0.7, -0.35, 0.35, 0.7}) {
    Bearing::State state;
    const double depth = 4.5e-3;
    const Bearing::Result r = law(depth, {0, 0}, state, state, {slope, 0});
    const double way = state.slip[0], left = depth + slope * way;
    EXPECT_LT(slope * way, 0);
    EXPECT_GT(left, 0);
    EXPECT_NEAR(r.normal, p.normal_stiffness * left, 1e-9 * r.normal);
    EXPECT_NEAR(r.shear[0] + r.normal * slope, std::copysign(0.3 * r.normal, slope),
                1e-9 * r.normal);  // t - N s = mu N, along the way
    EXPECT_NEAR(r.dissipation, 0.3 * r.normal * std::abs(way), 1e-9 * r.dissipation);
    EXPECT_LT(r.dissipation + r.energy,
              0.5 * p.normal_stiffness * depth * depth);                        // no more than the depth held
    const Bearing::Result again = law(left, {0, 0}, state, state, {slope, 0});  // and stays there
    EXPECT_NEAR(again.normal, r.normal, 1e-6 * r.normal);
    EXPECT_NEAR(state.slip[0], way, 1e-6 * std::abs(way));
  }
}

TEST(Bearing, SticksSlidesLiftsAndFallsOff) {
  Bearing::Parameters p;
  p.normal_stiffness = 1e9;
  p.shear_stiffness = 1e7;
  p.friction = 0.3;
  p.seat_along = {-INFINITY, 0.4};
  const Bearing law(p);
  Bearing::State state;
  auto r = law(1e-3, {0.01, 0}, state, state);
  EXPECT_DOUBLE_EQ(r.normal, 1e6);
  EXPECT_NEAR(r.shear[0], -1e5, 1e-6);
  EXPECT_EQ(r.dissipation, 0);
  r = law(1e-3, {0.1, 0.1}, state, state);
  EXPECT_NEAR(std::hypot(r.shear[0], r.shear[1]), 0.3e6, 1e-6);
  EXPECT_GT(r.dissipation, 0);
  r = law(-1e-3, {0.1, 0.1}, state, state);
  EXPECT_EQ(r.normal, 0);
  EXPECT_NEAR(std::hypot(r.shear[0], r.shear[1]), 0, 1e-9);
  EXPECT_GT(law(1e-3, {-0.41, 0.1}, state, state).normal, 0);  // on to the cap beam, not off it
  r = law(1e-3, {0.41, 0.1}, state, state);
  EXPECT_EQ(r.normal, 0);
  EXPECT_EQ(state.lost, 1);
  EXPECT_EQ(law(1e-3, {0, 0}, state, state).normal, 0);  // it does not climb back
  p.seat_across = {-0.2, 0.5};                           // the cap beam's ends
  const Bearing near_an_end(p);
  state = {};
  EXPECT_GT(near_an_end(1e-3, {0, 0.49}, state, state).normal, 0);
  EXPECT_GT(near_an_end(1e-3, {0, -0.19}, state, state).normal, 0);
  EXPECT_EQ(near_an_end(1e-3, {0, -0.21}, state, state).normal, 0);
  EXPECT_EQ(state.lost, 1);
}

}  // namespace
}  // namespace talus::material
