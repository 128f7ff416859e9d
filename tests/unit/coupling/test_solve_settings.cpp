// How closely the contact problem of a step is solved.
#include <gtest/gtest.h>

#include "coupling/solution/solve_settings.hpp"

namespace talus::coupling {
namespace {

constexpr double h = 1.0 / 60;  // [s]

/// A heap of blocks of 1 m that stands.
StepToSolve standing() {
  StepToSolve step;
  step.h = h;
  step.heap = true;
  step.length = 1;
  step.speed = 4.4;  // sqrt(2 g L)
  step.gravity = 9.81;
  step.accuracy = 1e-3;
  return step;
}

/// What moves by next to nothing is solved as closely as what moves: it would be driven by what is left.
TEST(Closeness, OfWhatCreepsNoMoreIsLeftThanOfWhatMoves) {
  StepToSolve step = standing();
  for (const double fastest : {1.0, 1e-2, 1e-4}) {
    step.fastest = fastest;
    const contact::SolveSettings settings = how_closely(step);
    EXPECT_LE(settings.sufficient, 5.001 * settings.tolerance) << fastest;  // half of what a step may be off
    EXPECT_LE(settings.tolerance, 2e-3) << fastest;
  }
}

}  // namespace
}  // namespace talus::coupling
