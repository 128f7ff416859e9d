// Sweeps where they are needed: what a disturbance does not reach stays as it is, and frictionless piles take
// hardly a factorisation.
#include <gtest/gtest.h>

#include "contact/solver/solver_normal.hpp"
#include "contact/solver/solver_sweep.hpp"
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
  for (int i = 12; i < 24; ++i)
    EXPECT_EQ(p[i], solved[i]) << "contact " << i << " of the tower that nobody touched";
}

TEST(NormalSweeps, LeaveLittleOfAFrictionlessPile) {
  Builder b = pile(8, 8, 2, 0, 0.005, 0.3, 5);
  ContactSolver solver;
  SolveSettings settings;
  settings.tolerance = 1e-3;
  settings.exact_coulomb = false;
  const SolveReport report = solver.solve(b.problem, settings);
  EXPECT_TRUE(report.converged);
  EXPECT_LE(report.newton, 4);
  for (const ProblemContact& c : b.problem.contacts) {  // Signorini by hand
    double u = c.bias.x();
    for (int k = c.first_term; k < c.first_term + c.terms; ++k) {
      const ContactTerm& t = b.problem.terms[static_cast<std::size_t>(k)];
      const ProblemBody& body = b.problem.bodies[static_cast<std::size_t>(t.body)];
      for (int j = 0; j < body.ndof; ++j)
        u += b.problem.jacobians[static_cast<std::size_t>(t.jacobian + 3 * j)] *
             b.problem.v[static_cast<std::size_t>(body.offset + j)];
    }
    EXPECT_GE(c.impulse.x(), 0);
    EXPECT_GT(u, -5e-3);
    if (c.impulse.x() > 10) { EXPECT_LT(u, 5e-3); }
    EXPECT_TRUE(c.impulse.tail<2>().isZero(0));
  }
}

TEST(NormalSweeps, AreAllThatIsDoneWhereTheCallerGoesOnFromWhatTheyLeave) {
  // A correction of drift: Newton's method would leave more than sweeps did, at eight factorisations. Where
  // the sweeps' gain twice more does not get there, it has to.
  ContactSolver solver;
  SolveSettings settings;
  settings.sufficient = 0.1;
  settings.exact_coulomb = false;
  const auto solved_to = [&](double tolerance) {
    Builder b = pile(8, 8, 2, 0, 0.005, 0.3, 5);
    settings.tolerance = tolerance;
    return solver.solve(b.problem, settings);
  };
  const SolveReport swept = solved_to(1e-5);
  EXPECT_TRUE(swept.converged);
  EXPECT_GT(swept.residual, 1e-5);
  EXPECT_LE(swept.residual * swept.residual * swept.residual, 1e-5);
  EXPECT_EQ(swept.newton, 0);
  EXPECT_GT(solved_to(1e-13).newton, 0);
}

TEST(NormalSweeps, CarryTheWeightOfATallTowerDown) {
  // Each face of 30 cubes carries what stands on it, which sweeps alone pass on by a face at a time.
  constexpr int floors = 30;
  Builder b = cubes(1, 1, floors, 0, 0.01);
  detail::System system;
  system.assemble(b.problem, false);
  const std::vector<Vec3> none(system.touch.size(), Vec3::Zero());
  std::vector<Vec3> p = none, plain = none;
  std::vector<double> v, from_impulses;
  system.velocities(p, v);
  detail::NormalSweeps sweeps;
  sweeps.run(system, p, v, 1e-4, 300);
  system.velocities(p, from_impulses);
  for (std::size_t k = 0; k < v.size(); ++k)
    EXPECT_NEAR(v[k], from_impulses[k], 1e-9);  // the field was kept up
  const double residual = system.residual(from_impulses, p);
  EXPECT_LE(residual, 1.1e-4);
  system.velocities(plain, v);
  detail::sweep(system, plain, v, 300);
  EXPECT_GT(system.residual(v, plain), 3 * residual);
}

/// Largest natural-map residual, every contact by all of its rows [m/s].
double residual_by_all_rows(const detail::System& system, const std::vector<double>& v,
                            const std::vector<Vec3>& p) {
  double worst = 0;
  for (int i = 0; i < system.contacts(); ++i) {
    const detail::Touch& t = system.touch[static_cast<std::size_t>(i)];
    const Vec3& impulse = p[static_cast<std::size_t>(i)];
    worst =
        std::max(worst, detail::natural_residual(
                            t.law, system.relative(t, v.data()) + t.bias + t.compliance.cwiseProduct(impulse),
                            impulse, t.scale(), 0));
  }
  return worst;
}

TEST(OpenContacts, AreSolvedAsTheyAreByTheirNormalRow) {
  Builder b = pile(6, 6, 3, 0.6, 0.005, 0.3, 5);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> any(-1, 1);
  for (double& v : b.problem.v_hat) v += 0.2 * any(random);
  detail::System system;
  system.assemble(b.problem, true);
  std::vector<Vec3> p(system.touch.size(), Vec3::Zero());
  std::vector<double> v;
  system.velocities(p, v);
  int open = 0, closed = 0;
  for (const detail::Touch& t : system.touch) {
    const bool stays = system.open_still(t, Vec3::Zero(), v.data());
    ++(stays ? open : closed);
    if (!stays) continue;
    const Vec3 u = system.relative(t, v.data()) + t.bias;
    EXPECT_EQ(detail::solve_one(t, u, Vec3::Zero()), Vec3(0, 0, 0));
    EXPECT_LE(detail::natural_residual(t.law, u, Vec3::Zero(), t.scale(), 0), 1e-15);
    EXPECT_FALSE(system.open_still(t, Vec3(1, 0, 0), v.data()));  // it bears something
  }
  EXPECT_GT(open, 20);
  EXPECT_GT(closed, 20);
  for (int sweeps = 0; sweeps < 3; ++sweeps) {
    EXPECT_NEAR(system.residual(v, p), residual_by_all_rows(system, v, p), 1e-9);
    detail::sweep(system, p, v, 5);
  }
}

TEST(OpenContacts, OfWhichSlidingPressesMayJam) {
  // A rod of 2 m that leans on its end: sliding turns it into the ground where mu |W_nt| > W_nn, and then it
  // has two solutions while it parts.
  for (const double mu : {0.1, 0.5, 1.0, 2.0, 5.0}) {
    Builder b;
    const int rod = b.box(Vec3(0, 0, 0.5), Vec3(0.05, 0.05, 2), 2500, Vec3::Zero());
    b.touch(-1, rod, Vec3(0.6, 0, 0), Z, mu);
    detail::System system;
    system.assemble(b.problem, true);
    const detail::Touch& t = system.touch[0];
    const double coupling = std::hypot(t.W(0, 1), t.W(0, 2)) / t.W(0, 0);
    ASSERT_GT(coupling, 0.25);
    EXPECT_EQ(t.opens, mu * coupling < 1) << mu;
  }
}

TEST(NormalSweeps, BodiesOfAnySizeAndHeldPartners) {
  // A point mass on a fixed plane under a spring-like compliance: p = (v_hat + b) / (1/m + R), and none where
  // it parts.
  Builder b;
  const double m = 4, R = 0.5;
  const int me = b.body(m * Mat3::Identity(), Vec3(0, 0, -3));
  for (const double sign : {1.0, -1.0}) {
    ProblemContact& c = b.contact(0);
    c.compliance = Vec3(R, R, R);
    b.term(me, Builder::frame(sign * Z));
  }
  detail::System system;
  system.assemble(b.problem, false);
  std::vector<Vec3> p(2, Vec3::Zero());
  std::vector<double> v;
  system.velocities(p, v);
  detail::NormalSweeps sweeps;
  sweeps.run(system, p, v, 1e-12, 200);
  EXPECT_NEAR(p[0].x(), 3 / (1 / m + R), 1e-10);
  EXPECT_EQ(p[1].x(), 0);
}

}  // namespace
}  // namespace talus::contact::testing
