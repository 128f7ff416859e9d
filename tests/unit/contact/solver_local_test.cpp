// Sweeps where they are needed: what a disturbance does not reach stays as it is, and frictionless piles take hardly a factorisation.
#include <gtest/gtest.h>

#include "contact/solver_sweep.hpp"
#include "solver_problems.hpp"

namespace talus::contact::testing {
namespace {

TEST(LocalSweeps, VisitOnlyWhatADisturbanceReaches) {
  // Two towers, both solved; then the impulses of the first one's lowest face are taken away.
  Builder b;
  for (int tower = 0; tower < 2; ++tower)
    for (int k = 0; k < 3; ++k) {
      const int me = b.box(Vec3(5 * tower, 0, k + 0.5), Vec3::Ones(), 2500, 0.01 * Vec3(0, 0, -9.81));
      b.patch(k == 0 ? -1 : me - 1, me, b.centre[me] - 0.5 * Z, 0.5 * X, 0.5 * Y, Z, 0.5);
    }
  ContactSolver solver;
  SolveSettings settings;
  ASSERT_TRUE(solver.solve(b.problem, settings).converged);
  detail::System system;
  system.assemble(b.problem, true);
  std::vector<Vec3> p;
  for (const ProblemContact& c : b.problem.contacts) p.push_back(c.impulse);
  const std::vector<Vec3> solved = p;
  for (int i = 0; i < 4; ++i) p[i].setZero();
  std::vector<double> v;
  system.velocities(p, v);
  EXPECT_GT(system.residual(v, p), 1e-2);
  detail::LocalSweeps local;
  local.run(system, p, v, 1e-6, 1000);
  system.velocities(p, v);
  EXPECT_LT(system.residual(v, p), 1e-5);
  for (int i = 12; i < 24; ++i) EXPECT_EQ(p[i], solved[i]) << "contact " << i << " of the tower that nobody touched";
}

TEST(LocalSweeps, LeaveLittleOfAFrictionlessPile) {
  Builder b = pile(8, 8, 2, 0, 0.005, 0.3, 5);
  ContactSolver solver;
  SolveSettings settings;
  settings.tolerance = 1e-3;
  settings.exact_coulomb = false;
  const SolveReport report = solver.solve(b.problem, settings);
  EXPECT_TRUE(report.converged);
  EXPECT_LE(report.newton, 4);
  for (const ProblemContact& c : b.problem.contacts) {   // Signorini by hand
    double u = c.bias.x();
    for (int k = c.first_term; k < c.first_term + c.terms; ++k) {
      const ContactTerm& t = b.problem.terms[static_cast<std::size_t>(k)];
      const ProblemBody& body = b.problem.bodies[static_cast<std::size_t>(t.body)];
      for (int j = 0; j < body.ndof; ++j)
        u += b.problem.jacobians[static_cast<std::size_t>(t.jacobian + 3 * j)] * b.problem.v[static_cast<std::size_t>(body.offset + j)];
    }
    EXPECT_GE(c.impulse.x(), 0);
    EXPECT_GT(u, -5e-3);
    if (c.impulse.x() > 10) {
      EXPECT_LT(u, 5e-3);
    }
    EXPECT_TRUE(c.impulse.tail<2>().isZero(0));
  }
}

}  // namespace
}  // namespace talus::contact::testing
