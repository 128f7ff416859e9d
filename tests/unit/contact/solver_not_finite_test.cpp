// A problem of which a figure is no number has no solution, and none is told: to the comparisons of the law
// such a contact would be open.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "contact/solver/solver_law.hpp"
#include "contact/solver/solver_normal.hpp"
#include "solver_problems.hpp"

namespace talus::contact::testing {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN(),
                 without_bound = std::numeric_limits<double>::infinity();

/// Boxes side by side on the ground, four contacts each, and one without any body at the end.
Builder boxes(int count, double friction) {
  Builder b;
  for (int k = 0; k < count; ++k) {
    const int me = b.box(Vec3(2 * k, 0, 0.5), Vec3::Ones(), 2500, 0.01 * Vec3(1, 0, -9.81));
    b.patch(-1, me, b.centre[me] - 0.5 * Z, 0.5 * X, 0.5 * Y, Z, friction);
  }
  return b;
}

TEST(NotFinite, ResidualsAreNoNumbersEither) {
  detail::Law law;
  law.mu = 0.5;
  for (const bool exact : {true, false}) {
    law.exact = exact;
    for (int i = 0; i < 3; ++i)
      for (const double bad : {none, without_bound, -without_bound}) {
        Vec3 u(0.1, 0.2, 0.3);
        u[i] = bad;
        EXPECT_TRUE(std::isnan(detail::natural_residual(law, u, Vec3::Zero(), {1, 1}, 0))) << i << " " << bad;
      }
  }
  EXPECT_EQ(detail::natural_residual(law, Vec3(0.1, 0, 0), Vec3::Zero(), {1, 1}, 0), 0);
}

TEST(NotFinite, OneContactIsNotLostAmongThoseAfterIt) {
  Builder b = boxes(3, 0.5);
  ASSERT_TRUE(ContactSolver().solve(b.problem, {}).converged);
  EXPECT_LT(coulomb_residual(b.problem, true), 1e-9);
  b.problem.contacts.front().bias.x() = none;
  EXPECT_TRUE(std::isnan(coulomb_residual(b.problem, true)));
  detail::System system;
  system.assemble(b.problem, true);
  std::vector<double> v;
  const std::vector<Vec3> p(12, Vec3::Zero());
  system.velocities(p, v);
  EXPECT_TRUE(std::isnan(system.residual(v, p)));
}

class NotFiniteProblem : public ::testing::TestWithParam<std::tuple<int, double>> {};

TEST_P(NotFiniteProblem, IsToldUnsolvedAndKeepsItsOwnSize) {
  const auto [count, friction] = GetParam();
  ContactSolver solver;
  Builder larger = boxes(count + 7, friction);
  ASSERT_TRUE(solver.solve(larger.problem, {}).converged);  // whose impulses the solver keeps
  for (const bool velocity : {true, false}) {
    Builder b = boxes(count, friction);
    if (velocity)
      b.problem.v_hat[2] = none;
    else
      b.problem.contacts[1].bias.x() = none;
    const SolveReport r = solver.solve(b.problem, {});
    EXPECT_FALSE(r.converged);
    EXPECT_FALSE(r.residual < 1);
    EXPECT_EQ(r.newton, 0);  // nothing is searched for
    for (const ProblemContact& c : b.problem.contacts)
      EXPECT_EQ(c.impulse, Vec3::Zero());  // and nothing of the problem before
  }
  Builder again = boxes(count, friction);
  EXPECT_TRUE(solver.solve(again.problem, {}).converged);
}

INSTANTIATE_TEST_SUITE_P(Sizes, NotFiniteProblem,
                         ::testing::Combine(::testing::Values(3, 30), ::testing::Values(0.0, 0.5)));

/// A wild start is no reason to give up.
TEST(NotFinite, AStartWithoutBoundIsLeft) {
  Builder b = boxes(3, 0.5);
  for (ProblemContact& c : b.problem.contacts) c.impulse = Vec3(1e308, 0, 0);
  EXPECT_TRUE(ContactSolver().solve(b.problem, {}).converged);
}

/// It has a compliance of its own and meets nothing that moves.
TEST(NotFinite, AContactWithoutBodiesIsSwept) {
  Builder b = boxes(2, 0);
  b.contact(0).compliance = Vec3::Ones();
  b.problem.contacts.back().bias.x() = -2;
  detail::System system;
  system.assemble(b.problem, true);
  std::vector<Vec3> p(9, Vec3::Zero());
  std::vector<double> v;
  system.velocities(p, v);
  detail::NormalSweeps sweeps;
  sweeps.run(system, p, v, 1e-12, 300);
  EXPECT_NEAR(p[8].x(), 2, 1e-12);
  system.velocities(p, v);
  EXPECT_LT(system.residual(v, p), 1e-11);
}

}  // namespace
}  // namespace talus::contact::testing
