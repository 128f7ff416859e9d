// How closely the contact problem of a step is solved, and what of it is taken where the search stalls.
#include <gtest/gtest.h>

#include "coupling/solution/solve_settings.hpp"

namespace talus::coupling {
namespace {

constexpr double h = 1.0 / 60;  // [s]

/// Points that stand, of 1 kg, each pressed from below and from above by rows that contradict each other by
/// `off` [m/s]: u = v_z + b and -v_z + b with b = -off. No impulses leave less than that; the search is given
/// up.
struct Jammed {
  contact::ContactProblem problem;
  Mat3 unit = Mat3::Identity();

  Jammed(int points, double off) {
    for (int i = 0; i < points; ++i) {
      contact::ProblemBody b;
      b.ndof = 3;
      b.offset = 3 * i;
      b.mass = b.mass_inverse = unit.data();
      problem.bodies.push_back(b);
      problem.v_hat.insert(problem.v_hat.end(), {0, 0, 0});
      for (const double sign : {1.0, -1.0}) {
        contact::ProblemContact c;
        c.first_term = static_cast<int>(problem.terms.size());
        c.terms = 1;
        c.friction = 0.5;
        c.bias = Vec3(-off, 0, 0);
        problem.contacts.push_back(c);
        problem.terms.push_back({i, static_cast<int>(problem.jacobians.size())});
        Mat3 rows = Mat3::Zero();  // n, t1, t2: along z, x, y
        rows(0, 2) = sign;
        rows(1, 0) = rows(2, 1) = 1;
        problem.jacobians.insert(problem.jacobians.end(), rows.data(), rows.data() + 9);
      }
    }
  }
};

/// A heap of blocks of 1 m that stands.
StepToSolve standing() {
  StepToSolve step;
  step.h = h;
  step.heap = step.blocks = true;
  step.length = 1;
  step.speed = 4.4;  // sqrt(2 g L)
  step.gravity = 9.81;
  step.accuracy = 1e-3;
  return step;
}

/// 80 contacts in a heap that comes to rest, its fastest block at 0.25 m/s, which no impulses solve closer
/// than `off` [m/s].
contact::SolveReport stalled_at(double off, bool large, bool* certified = nullptr) {
  Jammed jammed(40, off);
  StepToSolve step = standing();
  step.large = large;
  step.fastest = 0.25;
  const contact::SolveSettings settings = how_closely(step);
  contact::ContactSolver solver;
  contact::SolveReport report = solver.solve(jammed.problem, settings);
  const bool rests = judge(step, settings, {}, report);
  if (certified != nullptr) *certified = rests;
  return report;
}

TEST(Closeness, OfALargeHeapAFiftiethOfWhatMovesIsTakenWhereTheSearchStalls) {
  const contact::SolveReport near = stalled_at(0.01 * 0.25, true), far = stalled_at(0.05 * 0.25, true),
                             small = stalled_at(0.01 * 0.25, false);
  EXPECT_TRUE(near.converged);
  EXPECT_TRUE(near.stalled);
  EXPECT_EQ(near.tier, 'C');
  EXPECT_NEAR(near.residual, 0.01, 1e-3);  // told as it is
  EXPECT_FALSE(far.converged);
  EXPECT_FALSE(small.converged);
  EXPECT_FALSE(stalled_at(1e-4 * 0.25, true).stalled);  // within what is sufficient
}

/// It is solved over the next steps: what moves by less than that residual may be about to move.
TEST(Closeness, WhatALargeHeapStallsAtProvesNoRest) {
  bool stalled = true, sufficient = false;
  EXPECT_TRUE(stalled_at(0.01 * 0.25, true, &stalled).converged);
  EXPECT_FALSE(stalled);
  EXPECT_TRUE(stalled_at(1e-4 * 0.25, true, &sufficient).converged);
  EXPECT_TRUE(sufficient);
}

TEST(Closeness, OfALargeHeapTwiceAsMuchIsLeftAStep) {
  StepToSolve step = standing();
  step.fastest = 4;
  const double small = how_closely(step).tolerance, sufficient = how_closely(step).sufficient;
  step.large = true;
  EXPECT_NEAR(how_closely(step).tolerance, 2 * small, 1e-12);
  EXPECT_NEAR(how_closely(step).sufficient, sufficient, 1e-12);  // what a search ends at is the same
  step.h = 0;
  step.large = false;
  const double impulse = how_closely(step).tolerance;
  step.large = true;
  EXPECT_EQ(how_closely(step).tolerance, impulse);
}

TEST(Closeness, OfALargeHeapThatCreepsNearlyAThirdIsTakenWhereTheSearchStalls) {
  StepToSolve step = standing();
  step.large = true;
  double last = 0;
  for (const double fastest : {4.0, 1.0, 0.1, 1e-2, 1e-3, 1e-4}) {
    step.fastest = fastest;
    const contact::SolveSettings settings = how_closely(step);
    EXPECT_GE(settings.stalled, std::max(0.02, last)) << fastest;
    EXPECT_LE(settings.stalled, 0.3) << fastest;  // less than what moves, so that creep dies out
    last = settings.stalled;
  }
}

/// What moves by next to nothing is solved as closely as what moves: it would be driven by what is left.
TEST(Closeness, OfWhatCreepsNoMoreIsLeftThanOfWhatMoves) {
  for (const bool large : {false, true}) {
    StepToSolve step = standing();
    step.large = large;
    for (const double fastest : {1.0, 1e-2, 1e-4}) {
      step.fastest = fastest;
      const contact::SolveSettings settings = how_closely(step);
      EXPECT_LE(settings.sufficient, 2 * settings.tolerance) << fastest;
      EXPECT_LE(settings.tolerance, 2e-3) << fastest;
    }
  }
}

}  // namespace
}  // namespace talus::coupling
