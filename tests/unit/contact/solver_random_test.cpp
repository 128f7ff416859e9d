// Properties of the contact solver on random problems: the exact-Coulomb residual, the cone, the dynamics,
// the agreement of the dense and the sparse path, determinism.
#include <gtest/gtest.h>

#include "solver_problems.hpp"

namespace talus::contact::testing {
namespace {

SolveReport report_of(ContactProblem& problem, double tolerance, bool exact = true,
                      ContactSolver* reuse = nullptr) {
  ContactSolver fresh;
  ContactSolver& solver = reuse ? *reuse : fresh;
  SolveSettings settings;
  settings.tolerance = tolerance;
  settings.exact_coulomb = exact;
  return solver.solve(problem, settings);
}

// Residual recomputed from the definition, apart from the solver's own code: complementarity by hand.
double complementarity_defect(const ContactProblem& q) {
  double worst = 0;
  for (const ProblemContact& c : q.contacts) {
    Vec3 u = c.bias + c.compliance.cwiseProduct(c.impulse);
    for (int k = c.first_term; k < c.first_term + c.terms; ++k) {
      const ProblemBody& b = q.bodies[q.terms[k].body];
      u += Eigen::Map<const MatX>(q.jacobians.data() + q.terms[k].jacobian, 3, b.ndof) *
           Eigen::Map<const VecX>(q.v.data() + b.offset, b.ndof);
    }
    const double slip = u.tail<2>().norm(), limit = c.friction * c.impulse.x() + c.cohesion;
    // Signorini: no approach beyond the tolerance; friction: maximum dissipation, u_t . p_t = -limit |u_t|.
    worst = std::max(
        {worst, -u.x(), c.impulse.x() > 1e-9 * (1 + c.impulse.norm()) && c.tension == 0 ? u.x() : 0.0});
    if (limit > 0)
      worst = std::max(worst, (u.tail<2>().dot(c.impulse.tail<2>()) + limit * slip) / (limit + 1e-3));
    worst = std::max(worst, c.impulse.tail<2>().norm() > limit * (1 + 1e-9) + 1e-7
                                ? 1.0
                                : 0.0);  // a residual of 1e-10 m/s of a cube of 1 t
  }
  return worst;
}

int kind_of(unsigned seed) { return static_cast<int>(seed / 7) % 4; }

/// One to eight cubes in motion: hard, compliant, cohesive, or with restitution and any frictions.
Builder small_island(unsigned seed) {
  std::mt19937 random(seed);
  const int nx = 1 + random() % 2, ny = 1 + random() % 2, nz = 1 + random() % 2;
  Builder b = pile(nx, ny, nz, frictions[seed % 7], 0.005, 0.3, seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const int kind = kind_of(seed);
  for (auto& c : b.problem.contacts) {
    if (kind == 1) c.compliance = 1e-4 * Vec3(unit(random), 1, 1) * unit(random);
    if (kind == 2) {
      c.cohesion = 20 * unit(random);
      c.tension = 10 * unit(random);
    }
    if (kind == 3) {
      c.friction = frictions[random() % 7];
      c.bias.x() = 0.05 * (unit(random) - 0.2);
    }
  }
  return b;
}

TEST(ContactSolverRandom, SmallIslandsOfEveryKind) {
  int worst_newton = 0, interior = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    Builder b = small_island(seed);
    const SolveReport report = report_of(b.problem, 1e-10);
    EXPECT_TRUE(report.converged) << "seed " << seed << " mu " << frictions[seed % 7] << " kind "
                                  << kind_of(seed) << " residual " << report.residual;
    EXPECT_LE(coulomb_residual(b.problem, true), 2e-10);
    if (report.converged && kind_of(seed) == 0) {
      EXPECT_LE(complementarity_defect(b.problem), 1e-7) << seed;
    }
    worst_newton = std::max(worst_newton, report.newton);
    if (report.method != Method::newton) ++interior;
  }
  RecordProperty("worst_newton", worst_newton);
  RecordProperty("interior_point", interior);
  EXPECT_LE(interior, 60);
}

TEST(ContactSolverRandom, FrictionOfTenIsSolvedOrReportedAsNotSolved) {
  // Eight cubes jammed by friction 10.
  for (const unsigned seed : {9680u, 10635u, 11570u, 12032u, 12312u, 12718u, 12914u, 13264u, 13642u}) {
    Builder b = small_island(seed);
    const SolveReport report = report_of(b.problem, 1e-10);
    EXPECT_EQ(report.converged, coulomb_residual(b.problem, true) <= 2e-10)
        << "seed " << seed << " residual " << report.residual;
  }
}

TEST(ContactSolverRandom, PilesConverge) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    Builder b = pile(4 + seed % 3, 5, 2, seed % 2 ? 0.53 : 0.3, 0.005, 0.2, seed);
    const SolveReport report = report_of(b.problem, 1e-9);
    EXPECT_TRUE(report.converged) << seed << " residual " << report.residual;
    EXPECT_LE(coulomb_residual(b.problem, true), 2e-9);
  }
}

TEST(ContactSolverRandom, ConvexProblemAlwaysConverges) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Builder b = pile(1 + seed % 5, 3, 2, seed % 4 == 0 ? 2.0 : 0.5, 0.005, 0.5, seed);
    const SolveReport report = report_of(b.problem, 1e-9, false);
    EXPECT_TRUE(report.converged) << seed << " residual " << report.residual;
    EXPECT_LE(coulomb_residual(b.problem, false), 2e-9);
  }
}

TEST(ContactSolverRandom, DenseAndSparsePathsAgree) {
  // Seven blocks or fewer are one dense front. The same island beside a far tower is in the sparse path; the
  // velocities of the strongly convex problem are unique.
  for (unsigned seed = 0; seed < 20; ++seed) {
    Builder alone = pile(2, 2, 1, 0.5, 0.005, 0.3, seed), both = pile(2, 2, 1, 0.5, 0.005, 0.3, seed);
    const int island = static_cast<int>(both.problem.bodies.size());
    int below = -1;
    for (int k = 0; k < 10; ++k) {
      const int me = both.box(Vec3(50, 0, k + 0.5), Vec3::Ones(), 2500, Vec3(0, 0, -0.05));
      both.patch(below, me, Vec3(50, 0, k), 0.5 * X, 0.5 * Y, Z, 0.5);
      below = me;
    }
    ASSERT_TRUE(report_of(alone.problem, 1e-11, false).converged);
    ASSERT_TRUE(report_of(both.problem, 1e-11, false).converged);
    for (int k = 0; k < 6 * island; ++k) EXPECT_NEAR(alone.problem.v[k], both.problem.v[k], 1e-8) << seed;
  }
}

TEST(ContactSolverRandom, EarlierCallsLeaveNoTrace) {
  ContactSolver used;
  Builder first = pile(3, 3, 2, 0.5, 0.005, 0.3, 1), second = cubes(1, 1, 20, 0.5, 0.01);
  report_of(first.problem, 1e-8, true, &used);
  report_of(second.problem, 1e-8, true, &used);
  Builder a = pile(4, 3, 2, 0.53, 0.005, 0.3, 7), b = pile(4, 3, 2, 0.53, 0.005, 0.3, 7);
  report_of(a.problem, 1e-8, true, &used);
  report_of(b.problem, 1e-8);
  for (std::size_t k = 0; k < a.problem.v.size(); ++k) EXPECT_EQ(a.problem.v[k], b.problem.v[k]);
  for (std::size_t k = 0; k < a.problem.contacts.size(); ++k)
    EXPECT_EQ(a.problem.contacts[k].impulse, b.problem.contacts[k].impulse);
}

TEST(ContactSolverRandom, InfeasibleProblemIsNotCalledConverged) {
  // A block between two planes that must both recede from it at once: no velocity satisfies both.
  Builder b;
  b.box(Vec3(0, 0, 0), Vec3::Ones(), 2500, Vec3::Zero());
  b.touch(-1, 0, Vec3(0, 0, -0.5), Z, 0).bias.x() = -1;
  b.touch(-1, 0, Vec3(0, 0, 0.5), -Z, 0).bias.x() = -1;
  const SolveReport report = report_of(b.problem, 1e-10);
  EXPECT_FALSE(report.converged);
  for (double x : b.problem.v) EXPECT_TRUE(std::isfinite(x));
}

}  // namespace
}  // namespace talus::contact::testing
