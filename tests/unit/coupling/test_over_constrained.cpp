// Bodies that are asked to leave two sides at once.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "coupling/solution/over_constrained.hpp"

namespace talus::coupling {
namespace {

constexpr double asked = 0.01;  // speed that the rows ask for [m/s]

/// A body of 1 kg and 3 degrees of freedom, and rows on it that ask to be led out along their normals.
struct Jam {
  MatX mass = MatX::Identity(3, 3);
  contact::ContactProblem problem;
  std::vector<Touch> touches;

  Jam() {
    contact::ProblemBody body;
    body.ndof = 3;
    problem.bodies = {body};
    problem.v_hat = {0, 0, -0.1};
  }
  void row(const Partner& a, const Vec3& normal, double bias) {
    Touch t;
    t.a = a;
    t.b = 0;
    t.at.gap = -1e-5;
    t.normal = normal;
    t.frame = contact_frame(normal);
    t.row = static_cast<int>(problem.contacts.size());
    contact::ProblemContact c;
    c.first_term = static_cast<int>(problem.terms.size());
    c.terms = 1;
    c.friction = 0.5;
    c.bias[0] = bias;
    problem.terms.push_back({0, static_cast<int>(problem.jacobians.size())});
    const Mat3 j = t.frame.transpose();
    problem.jacobians.insert(problem.jacobians.end(), j.data(), j.data() + 9);
    problem.contacts.push_back(c);
    touches.push_back(t);
  }
  contact::SolveReport solve() {
    problem.bodies[0].mass = problem.bodies[0].mass_inverse = mass.data();
    contact::ContactSolver solver;
    return solver.solve(problem, {});
  }
  double largest_impulse() const {
    double most = 0;
    for (const contact::ProblemContact& c : problem.contacts) most = std::max(most, c.impulse.norm());
    return most;
  }
};

const Partner skin{Partner::Kind::structure, 0}, ground{Partner::Kind::terrain, 0},
    neighbour{Partner::Kind::block, 1}, other{Partner::Kind::block, 2};

TEST(Jammed, BetweenTwoSidesIsNotLedOut) {
  Jam jam;
  jam.row(skin, Vec3::UnitX(), -asked);
  jam.row(skin, -Vec3::UnitX(), -asked);
  jam.row(ground, Vec3::UnitZ(), 0);
  Jam asks = jam;
  EXPECT_FALSE(asks.solve().converged);  // what it is spared
  for (int side : {0, 1})
    jam.problem.contacts[static_cast<std::size_t>(side)].impulse[0] = 1e6;  // of an earlier step
  spare_jammed(jam.touches, 1e-7, 0, jam.problem);
  EXPECT_TRUE(jam.solve().converged);
  EXPECT_LT(jam.largest_impulse(), 0.2);  // the body brings 0.1 N s
}

/// Of the rows that are spared, and of no other.
TEST(Jammed, WhatIsKeptOfAStartIsAsked) {
  Jam jam;
  jam.row(skin, Vec3::UnitX(), -asked);
  jam.row(skin, -Vec3::UnitX(), -asked);
  jam.row(ground, Vec3::UnitZ(), 0);
  for (contact::ProblemContact& c : jam.problem.contacts) c.impulse = Vec3(8, 2, -4);
  spare_jammed(jam.touches, 1e-7, 0.75, jam.problem);
  for (int side : {0, 1})
    EXPECT_EQ(jam.problem.contacts[static_cast<std::size_t>(side)].impulse, Vec3(6, 1.5, -3));
  EXPECT_EQ(jam.problem.contacts[2].impulse, Vec3(8, 2, -4));
}

TEST(Jammed, WhatIsFreeOnTheOtherSideIsLedOut) {
  Jam jam;
  jam.row(skin, Vec3::UnitX(), -asked);
  jam.row(ground, Vec3::UnitZ(), 0);
  spare_jammed(jam.touches, 1e-7, 0, jam.problem);
  EXPECT_EQ(jam.problem.contacts[0].bias[0], -asked);
  EXPECT_TRUE(jam.solve().converged);
  EXPECT_NEAR(jam.problem.v[0], asked, 1e-9);
}

TEST(Jammed, ReboundsAreSparedInANotchAlone) {
  Jam stack;  // struck from below, something else lies on it
  stack.row(neighbour, Vec3::UnitZ(), -asked);
  stack.row(other, -Vec3::UnitZ(), 0);
  spare_jammed(stack.touches, 1e-7, 0, stack.problem);
  EXPECT_EQ(stack.problem.contacts[0].bias[0], -asked);
  Jam notch;
  notch.row(neighbour, Vec3::UnitZ(), -asked);
  notch.row(neighbour, -Vec3::UnitZ(), 0);
  spare_jammed(notch.touches, 1e-7, 0, notch.problem);
  EXPECT_EQ(notch.problem.contacts[0].bias[0], 0);
}

TEST(Jammed, AskedForNoMotionAProblemHasASolution) {
  Jam jam;
  for (int k = 0; k < 3; ++k)
    jam.row(skin, Vec3(std::cos(2 * M_PI * k / 3), std::sin(2 * M_PI * k / 3), 0), -asked);
  Jam asks = jam;
  EXPECT_FALSE(asks.solve().converged);
  EXPECT_TRUE(ask_for_no_motion(jam.touches, jam.problem, 1e-4));
  EXPECT_TRUE(jam.solve().converged);
  EXPECT_FALSE(ask_for_no_motion(jam.touches, jam.problem, 1e-4));  // nothing is asked any more
}

/// A thousandth of the speeds around, not of those that gravity might give: among what rests nothing is led
/// out.
TEST(Jammed, LedOutAsFastAsThereIsMotion) {
  constexpr double h = 1e-4;
  EXPECT_EQ(left_inside(-1e-4, 0, h), -1e-4);
  EXPECT_DOUBLE_EQ(left_inside(-1e-4, 2, h), -1e-4 + 2e-3 * h);
  EXPECT_DOUBLE_EQ(left_inside(-1e-7, 20, h), -0.95e-7);  // no more than a twentieth of it
  EXPECT_EQ(left_inside(1e-6, 2, h), 0);
}

/// Sides that press on each other through the body start from what they had: the least impulses solve the
/// rows that give, any such those that do not.
TEST(Jammed, ImpulsesThatBalanceEachOtherAreNotHandedOn) {
  const auto pressed = [](bool gives) {
    Jam jam;
    jam.row(skin, Vec3::UnitX(), 0);
    jam.row(skin, -Vec3::UnitX(), 0);
    jam.row(ground, Vec3::UnitZ(), 0);
    for (int side : {0, 1}) jam.problem.contacts[static_cast<std::size_t>(side)].impulse[0] = 1e6;
    jam.problem.bodies[0].mass_inverse = jam.mass.data();
    if (gives) give_a_little(jam.touches, 1e-3, jam.problem);
    EXPECT_TRUE(jam.solve().converged);
    return jam.largest_impulse();
  };
  EXPECT_GT(pressed(false), 1e5);
  EXPECT_LT(pressed(true), 0.2);  // the body brings 0.1 N s
}

}  // namespace
}  // namespace talus::coupling
