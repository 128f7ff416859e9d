// What proves rest: a heap that stands, solved to 1e-6 g h where the search stalls, and nothing beyond it.
#include <gtest/gtest.h>

#include "coupling/solution/solve_settings.hpp"
#include "coupling/step/bodies.hpp"

namespace talus::coupling {
namespace {

constexpr double h = 1.0 / 60;  // [s]

dda::Model on_earth() {
  dda::Model model;
  model.gravity = Vec3(0, 0, -9.81);
  return model;
}

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
  step.still = step.heap = step.blocks = true;
  step.length = 1;
  step.speed = 4.4;  // sqrt(2 g L)
  step.at_rest = rest_speed(on_earth(), h);
  step.gravity = 9.81;
  step.accuracy = 1e-3;
  return step;
}

struct Solved {
  bool taken, certified;
  double residual;  // [m/s]
};

/// A heap of 80 contacts that no impulses solve closer than `off` [m/s].
Solved solved(double off) {
  Jammed jammed(40, off);
  const StepToSolve step = standing();
  const contact::SolveSettings settings = how_closely(step);
  contact::ContactSolver solver;
  contact::SolveReport report = solver.solve(jammed.problem, settings);
  return {report.converged || accepted(step, settings, {}, report), report.converged,
          report.residual * settings.velocity_scale};
}

TEST(Closeness, AHeapWhoseSearchStallsRestsWithinWhatABlockAtRestMayMoveBy) {
  const double allowed = 1e-6 * 9.81 * h;
  const Solved less = solved(0.5 * allowed);
  EXPECT_GT(less.residual, 0.4 * allowed);  // it did stall, far above 1e-9 of the island's speed
  EXPECT_TRUE(less.taken);
  EXPECT_TRUE(less.certified);
  const Solved more = solved(2 * allowed);
  EXPECT_TRUE(more.taken) << more.residual;  // the step goes on
  EXPECT_FALSE(more.certified);              // and proves nothing
  EXPECT_FALSE(solved(5 * allowed).certified);
  EXPECT_FALSE(solved(1e-2).taken);  // the caller makes better rows or a shorter step
}

/// What moves by next to nothing is solved as closely as what moves: it would be driven by what is left.
TEST(Closeness, OfWhatCreepsNoMoreIsLeftThanOfWhatMoves) {
  StepToSolve step = standing();
  step.still = false;
  for (const double fastest : {1.0, 1e-2, 1e-4}) {
    step.fastest = fastest;
    const contact::SolveSettings settings = how_closely(step);
    EXPECT_LE(settings.sufficient, 2 * settings.tolerance) << fastest;
    EXPECT_LE(settings.tolerance, 2e-3) << fastest;
  }
}

TEST(Closeness, WhatIsSolvedToRoundOffProvesRest) {
  const Solved free = solved(0);
  EXPECT_TRUE(free.certified);
}

}  // namespace
}  // namespace talus::coupling
