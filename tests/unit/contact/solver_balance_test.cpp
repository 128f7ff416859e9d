// Impulses that hold bodies as they are: found where there are some, on inclines to the angle of friction,
// and not where there are none.
#include <gtest/gtest.h>

#include "solver_problems.hpp"

namespace talus::contact::testing {
namespace {

constexpr double h = 1.0 / 60, still = 1e-6 * 9.81 * h;  // [s], [m/s]

double fastest_of(const Builder& b) {
  double fastest = 0;
  for (std::size_t i = 0; i < b.problem.bodies.size(); ++i)
    fastest = std::max(fastest, b.velocity(static_cast<int>(i)).norm());
  return fastest;
}

/// Fastest body of what `balance` makes of the problem [m/s].
double moved(Builder& b) {
  ContactSolver solver;
  const bool found = solver.balance(b.problem, still, 0.01 * 9.81 * h, [&] { return fastest_of(b); });
  EXPECT_EQ(found, fastest_of(b) <= still);
  return fastest_of(b);
}

TEST(Balance, OfCubesOnAnIncline) {
  constexpr double friction = 0.5;
  for (const double slope : {0.0, 0.2, 0.49}) {  // tangents
    const double a = std::atan(slope);
    Builder b = cubes(4, 4, 1, friction, h, false, 9.81 * Vec3(0, std::sin(a), -std::cos(a)));
    EXPECT_LE(moved(b), still) << slope;
    EXPECT_LE(coulomb_residual(b.problem, true), still) << slope;  // of the exact law
  }
  const double a = std::atan(0.51);
  Builder b = cubes(4, 4, 1, friction, h, false, 9.81 * Vec3(0, std::sin(a), -std::cos(a)));
  EXPECT_GT(moved(b), 1e3 * still);
}

TEST(Balance, StopsWhatFrictionStopsWithinTheStep) {
  for (const double friction : {0.0, 0.3}) {
    Builder b = cubes(5, 5, 2, friction, h);
    const double speed = 1e-3;  // [m/s], of all; friction takes up to 0.05 m/s
    for (std::size_t i = 0; i < b.problem.bodies.size(); ++i) b.v_hat(static_cast<int>(i))[0] += speed;
    if (friction > 0)
      EXPECT_LE(moved(b), still);
    else
      EXPECT_NEAR(moved(b), speed, still);
  }
}

/// Between two walls that they fill cubes could press as hard as it takes to hold them; bodies that give do
/// not.
TEST(Balance, NotByForcesThatNothingAsksFor) {
  constexpr int row = 20;
  const double a = std::atan(0.8);
  Builder b = cubes(row, 1, 1, 0.5, h, false, 9.81 * Vec3(0, std::sin(a), -std::cos(a)));
  b.patch(-1, 0, b.centre[0] - 0.5 * X, 0.5 * Y, 0.5 * Z, X, 0.5);
  b.patch(-1, row - 1, b.centre[row - 1] + 0.5 * X, 0.5 * Y, 0.5 * Z, -X, 0.5);
  EXPECT_GT(moved(b), 1e3 * still);  // they slide down between the walls
}

/// What drift has left open by less than rest counts as closed, rows that contradict each other by less as
/// well; what is farther bears nothing.
TEST(Balance, RowsThatAreOffByLessThanRest) {
  for (const double off : {0.5, 100.0}) {
    Builder b = cubes(1, 1, 40, 0.5, h);
    for (std::size_t i = 0; i < b.problem.contacts.size(); i += 2)
      b.problem.contacts[i].bias[0] = off * still;  // two of four corners
    if (off < 1)
      EXPECT_LE(moved(b), still);
    else
      EXPECT_GT(moved(b), still);  // it leans on the others
  }
}

}  // namespace
}  // namespace talus::contact::testing
