// The contact solver against closed forms: inclines, stacks, impacts, cohesion, flow rules.
#include <gtest/gtest.h>

#include "solver_problems.hpp"

namespace talus::contact::testing {
namespace {

constexpr double g = 9.81;

SolveReport solve(Builder& b, double tolerance = 1e-12, bool exact = true, double scale = 1) {
  ContactSolver solver;
  SolveSettings settings;
  settings.tolerance = tolerance;
  settings.exact_coulomb = exact;
  settings.velocity_scale = scale;
  const SolveReport report = solver.solve(b.problem, settings);
  EXPECT_TRUE(report.converged) << "residual " << report.residual << " newton " << report.newton << " outer "
                                << report.outer;
  EXPECT_LE(coulomb_residual(b.problem, exact), 2 * tolerance * scale);
  return report;
}

// A unit cube on a plane inclined by `slope`, in axes of the plane: gravity is tilted instead.
Builder incline(double slope, double mu, double h, const Vec3& v0 = Vec3::Zero()) {
  const Vec3 gravity(g * std::sin(slope), 0, -g * std::cos(slope));
  Builder b;
  b.box(Vec3(0, 0, 0.5), Vec3::Ones(), 2500, v0 + h * gravity);
  b.patch(-1, 0, Vec3::Zero(), 0.5 * X, 0.5 * Y, Z, mu);
  return b;
}

TEST(ContactSolverClosedForm, BlockOnInclineSlides) {
  const double a = 35 * M_PI / 180, mu = std::tan(28 * M_PI / 180), h = 0.01;
  Builder b = incline(a, mu, h);
  solve(b);
  const double expected = h * g * (std::sin(a) - mu * std::cos(a));
  EXPECT_NEAR(b.velocity(0).x(), expected, 1e-12 * expected + 1e-14);
  EXPECT_NEAR(b.velocity(0).z(), 0, 1e-13);
  EXPECT_NEAR(b.velocity(0).y(), 0, 1e-13);
}

TEST(ContactSolverClosedForm, BlockOnInclineSticksByAMillionth) {
  const double a = 26.565 * M_PI / 180, h = 0.01;  // tan a = 0.49999...; sticks at 0.5, slides at 0.49
  Builder sticks = incline(a, 0.5, h);
  solve(sticks, 1e-13);
  EXPECT_LT(sticks.velocity(0).norm(), 1e-11);  // the margin of 1e-6 amplifies the residual
  Builder slides = incline(a, 0.49, h);
  solve(slides);
  EXPECT_NEAR(slides.velocity(0).x(), h * g * (std::sin(a) - 0.49 * std::cos(a)), 1e-12);
}

// A cube between two walls that it just fits: they could press on it as hard as they like, and nothing makes
// them.
TEST(ContactSolverClosedForm, WallsOfASnugChannelDoNotSqueezeWhatSlides) {
  const double a = 20 * M_PI / 180, mu = 0.3, h = 0.01;
  Builder b = incline(a, mu, h);
  b.patch(-1, 0, Vec3(0, -0.5, 0.5), 0.5 * X, 0.5 * Z, Y, mu);
  b.patch(-1, 0, Vec3(0, 0.5, 0.5), 0.5 * X, 0.5 * Z, -Y, mu);
  solve(b);
  EXPECT_NEAR(b.velocity(0).x(), h * g * (std::sin(a) - mu * std::cos(a)),
              1e-7 * h * g);  // a quarter of it with what sweeps leave between the walls
}

// In a step that an onset cut short a spring along the face gives 1e8 times what the dashpot of the normal
// does: no mean of the two may be what round-off is measured by.
TEST(ContactSolverClosedForm, ShearSpringOfAStepCutShortTakesWhatItsLawSays) {
  const double mass = 0.52, mu = 0.75, along = 1.75e11, normal = 884;
  const Vec3 arriving(-4.33, 3.3, 1.47);
  Builder b;
  b.body(mass * Mat3::Identity(), arriving);
  ProblemContact& c = b.contact(mu);
  b.term(0, Mat3::Identity());
  c.compliance = Vec3(normal, along, along);
  c.bias = arriving;
  const SolveReport report = solve(b, 1e-12, true, 6);
  EXPECT_LT(report.newton, 60);  // hundreds before, and no solution
  const double w = 1 / mass;
  EXPECT_NEAR(c.impulse.x(), 2 * 4.33 / (w + normal), 1e-14);
  EXPECT_NEAR(c.impulse.y(), -2 * 3.3 / (w + along), 1e-12 * 2 * 3.3 / along);
  EXPECT_NEAR(c.impulse.z(), -2 * 1.47 / (w + along), 1e-12 * 2 * 3.3 / along);
}

TEST(ContactSolverClosedForm, SlidingBlockDoesNotLiftUnlessAssociated) {
  const double mu = 0.5, h = 0.01, v = 3;
  Builder exact = incline(0, mu, h, Vec3(v, 0, 0));
  solve(exact);
  EXPECT_NEAR(exact.velocity(0).x(), v - mu * g * h, 1e-12);
  EXPECT_NEAR(exact.velocity(0).z(), 0, 1e-12);
  // Without the shift the cone is the flow rule: u_n = mu |u_t|, the block rises by mu h v in a step.
  Builder convex = incline(0, mu, h, Vec3(v, 0, 0));
  solve(convex, 1e-12, false);
  EXPECT_NEAR(convex.velocity(0).z(), mu * convex.velocity(0).head<2>().norm(), 1e-9);
  EXPECT_GT(convex.velocity(0).z(), 0.3 * mu * v);
  // The same by contact.
  Builder flagged = incline(0, mu, h, Vec3(v, 0, 0));
  for (auto& c : flagged.problem.contacts) c.associated = true;
  solve(flagged, 1e-12, true);
  EXPECT_NEAR(flagged.velocity(0).z(), convex.velocity(0).z(), 1e-10);
}

TEST(ContactSolverClosedForm, LargeFrictionSlidesAndStops) {
  for (double mu : {0.0, 1.0, 10.0}) {
    const double h = 1e-3, v = 3;
    Builder b;
    b.box(Vec3(0, 0, 0.005), Vec3(1, 1, 0.01), 2500, Vec3(v, 0, -g * h));
    b.patch(-1, 0, Vec3::Zero(), 0.5 * X, 0.5 * Y, Z, mu);
    solve(b);
    EXPECT_NEAR(b.velocity(0).x(), v - mu * g * h, 1e-10) << mu;
    EXPECT_NEAR(b.velocity(0).z(), 0, 1e-11);
  }
}

TEST(ContactSolverClosedForm, StackCarriesItsWeight) {
  const int N = 50;
  const double h = 0.01, weight = 2500 * g;
  Builder b = cubes(1, 1, N, 0.5, h);
  solve(b, 1e-12);
  for (int k = 0; k < N; ++k) {
    double sum = 0;
    for (int q = 0; q < 4; ++q) sum += b.problem.contacts[4 * k + q].impulse.x();
    EXPECT_NEAR(sum / h / weight / (N - k), 1, 1e-8) << k;
  }
}

TEST(ContactSolverClosedForm, CentralImpactOfUnequalMasses) {
  for (double ratio : {1.0, 1e4, 1e8}) {
    Builder b;
    b.box(Vec3(0, 0, 0), Vec3::Ones(), 1000, Vec3(2, 0, 0));
    b.box(Vec3(1, 0, 0), Vec3::Ones(), 1000 * ratio, Vec3(-1, 0, 0));
    const double e = 0.5;
    b.patch(0, 1, Vec3(0.5, 0, 0), 0.5 * Y, 0.5 * Z, X, 0.3);
    for (auto& c : b.problem.contacts) c.bias.x() = e * -3.0;
    solve(b, 1e-12);
    const double centre = (2 - ratio) / (1 + ratio);
    EXPECT_NEAR(b.velocity(0).x(), centre - e * 3 * ratio / (1 + ratio), 1e-11);
    EXPECT_NEAR(b.velocity(1).x(), centre + e * 3 / (1 + ratio), 1e-11);
  }
}

TEST(ContactSolverClosedForm, HeavyOnLight) {
  // A block of 1e8 times the mass rests on a light one: the floor carries both.
  for (double ratio : {1e4, 1e8}) {
    Builder b;
    const double h = 0.01;
    b.box(Vec3(0, 0, 0.5), Vec3::Ones(), 1, Vec3(0, 0, -g * h));
    b.box(Vec3(0, 0, 1.5), Vec3::Ones(), ratio, Vec3(0, 0, -g * h));
    b.patch(-1, 0, Vec3(0, 0, 0), 0.5 * X, 0.5 * Y, Z, 0.5);
    b.patch(0, 1, Vec3(0, 0, 1), 0.5 * X, 0.5 * Y, Z, 0.5);
    solve(b, 1e-10);
    double sum = 0;
    for (int q = 0; q < 4; ++q) sum += b.problem.contacts[q].impulse.x();
    EXPECT_NEAR(sum / (g * h * (1 + ratio)), 1, 1e-6);
  }
}

TEST(ContactSolverClosedForm, WedgeOnTwoPlanes) {
  // Planes of strike along y through two dips, a wedge sliding along a line of plunge; frictionless and with
  // friction.
  const double h = 0.01;
  for (double mu : {0.0, 0.2, 0.9}) {
    const double half = 50 * M_PI / 180, plunge = 0.6;
    const Vec3 n1(-std::cos(half), 0, std::sin(half)), n2(std::cos(half), 0, std::sin(half));
    Builder b;
    const Vec3 gravity(0, g * std::sin(plunge), -g * std::cos(plunge));
    b.box(Vec3(0, 0, 0.6), Vec3::Ones(), 2500, h * gravity);
    // Three points a plane, balanced about the centre so that no turning arises without friction.
    for (const Vec3& n : {n1, n2}) {
      const Vec3 t = n.cross(Y), foot = b.centre[0] - 0.5 * n;
      b.touch(-1, 0, foot + 0.5 * Y, n, mu);
      b.touch(-1, 0, foot - 0.5 * Y, n, mu);
      b.touch(-1, 0, foot + 0.3 * t + 0.5 * Y, n, mu);
      b.touch(-1, 0, foot + 0.3 * t - 0.5 * Y, n, mu);
      b.touch(-1, 0, foot - 0.3 * t + 0.5 * Y, n, mu);
      b.touch(-1, 0, foot - 0.3 * t - 0.5 * Y, n, mu);
    }
    solve(b, 1e-12);
    // Each plane: N = m g cos(plunge) / (2 sin(half)) on each.
    const double N = g * std::cos(plunge) / (2 * std::sin(half));
    const double a = std::max(0.0, g * std::sin(plunge) - mu * 2 * N);
    EXPECT_NEAR(b.velocity(0).y(), h * a, 1e-11) << mu;
    EXPECT_NEAR(b.velocity(0).x(), 0, 1e-11);
  }
}

TEST(ContactSolverClosedForm, CohesionAndTension) {
  // Horizontal pull on a resting block: it slips at T = c A + N tan phi.
  const double m = 2500, mu = 0.4, c = 4000;
  const double limit = c + mu * m * g;  // [N], with N = m g
  for (double factor : {0.999, 1.001}) {
    const double h = 0.01;
    Builder b;
    b.box(Vec3(0, 0, 0.05), Vec3(3.1622776601683795, 3.1622776601683795, 0.1), 2500,
          Vec3(h * factor * limit / m, 0, -g * h));
    b.patch(-1, 0, Vec3(0, 0, 0.05), X, Y, Z, mu);  // at the centroid's height: no overturning
    for (auto& q : b.problem.contacts) {
      q.cohesion = c * h / 4;
      q.tension = 1e6;
    }
    solve(b, 1e-12);
    const double expected = factor < 1 ? 0 : h * 0.001 * limit / m;
    EXPECT_NEAR(b.velocity(0).x(), expected, 1e-11);
    EXPECT_NEAR(b.velocity(0).z(), 0, 1e-11);
  }
  // Pull upwards against the tension cut-off.
  for (double factor : {0.99, 1.01}) {
    const double T = 5000, h = 0.01;
    Builder b;
    b.box(Vec3(0, 0, 0.5), Vec3::Ones(), m, Vec3(0, 0, h * factor * T / m));
    b.patch(-1, 0, Vec3(0, 0, 0), 0.5 * X, 0.5 * Y, Z, mu);
    for (auto& q : b.problem.contacts) {
      q.tension = T * h / 4;
      q.cohesion = T * h;
    }
    solve(b, 1e-12);
    EXPECT_NEAR(b.velocity(0).z(), factor < 1 ? 0 : h * 0.01 * T / m, 1e-12);
  }
}

TEST(ContactSolverClosedForm, CompliantRowIsAnImplicitSpring) {
  // One block on four springs k, end-of-step law p = -(u_n + gap/h) / R, R = 1/(k h^2) * h ... : p (1/m_eff +
  // R) = -u_hat.
  const double m = 2500, R = 3e-4, h = 0.01;
  Builder b;
  b.box(Vec3(0, 0, 0.5), Vec3::Ones(), m, Vec3(0, 0, -g * h));
  b.patch(-1, 0, Vec3(0, 0, 0), 0.5 * X, 0.5 * Y, Z, 0.3);
  for (auto& q : b.problem.contacts) q.compliance = Vec3(R, 2 * R, 2 * R);
  solve(b, 1e-13);
  const double p = g * h / (4 / m + R);  // each
  for (auto& q : b.problem.contacts) EXPECT_NEAR(q.impulse.x(), p, 1e-9 * p);
  EXPECT_NEAR(b.velocity(0).z(), -R * p, 1e-12);
}

TEST(ContactSolverClosedForm, PainleveRodIsSolved) {
  // Slender rod, tip sliding ahead at a steep friction: n^T W (n + mu t) < 0, no bounded acceleration; the
  // impulse exists.
  const double L = 1, m = 1, theta = std::atan(2.0), h = 1e-3;
  for (double mu : {0.5, 1.2, 1.5, 5.0, 10.0}) {
    MatX A = MatX::Zero(6, 6);
    A.diagonal() << m, m, m, m * L * L / 12, m * L * L / 12, m * L * L / 12;
    VecX v_hat(6);
    v_hat << 2, 0, -g * h, 0, 0, 0;
    Builder b;
    b.body(A, v_hat, Vec3::Zero());
    const Vec3 tip(0.5 * L * std::cos(theta), 0, -0.5 * L * std::sin(theta));
    b.touch(-1, 0, tip, Z, mu);
    solve(b, 1e-11);
    // The energy after is not above the one of free flow.
    double before = 0, after = 0;
    for (int k = 0; k < 6; ++k) {
      before += A(k, k) * v_hat[k] * v_hat[k];
      after += A(k, k) * b.problem.v[k] * b.problem.v[k];
    }
    EXPECT_LE(after, before * (1 + 1e-12));
    EXPECT_GE(b.problem.contacts[0].impulse.x(), 0);
  }
}

TEST(ContactSolverClosedForm, HeldBodyAndNodes) {
  // A block of 6 degrees of freedom on four structure nodes (3 each), one of them held: the momentum balance
  // is exact.
  const double h = 0.01, m = 2500;
  Builder b;
  b.box(Vec3(0, 0, 0.5), Vec3::Ones(), m, Vec3(0, 0, -1));
  for (int q = 0; q < 4; ++q) b.body(MatX::Identity(3, 3) * 300.0, VecX::Zero(3));
  int node = 1;
  for (double s : {-0.5, 0.5})
    for (double t : {-0.5, 0.5}) {
      b.touch(-1, 0, Vec3(s, t, 0), Z, 0.5);
      b.term(node++, -Builder::frame(Z));
    }
  solve(b, 1e-12);
  EXPECT_NEAR(b.velocity(0).z(), -m / (m + 1200), 1e-11);
  for (int q = 1; q < 5; ++q) EXPECT_NEAR(b.velocity(q).z(), -m / (m + 1200), 1e-11);
  // The same with all nodes held (mass inverse zero): the block stops.
  for (int q = 1; q < 5; ++q) {
    b.store.emplace_back(9, 0.0);
    b.problem.bodies[q].mass_inverse = b.store.back().data();
  }
  solve(b, 1e-12);
  EXPECT_NEAR(b.velocity(0).z(), 0, 1e-11);
  for (int q = 1; q < 5; ++q) EXPECT_EQ(b.velocity(q).z(), 0);
  (void)h;
}

/// A block on four of the 40 nodes of a condensed skin, and impulses of its contacts. With a held node more
/// the root of the skin's compliance is found column by column, without by blocks.
std::vector<Vec3> block_on_skin(int held) {
  constexpr int nodes = 40;
  const int m = 3 * (nodes + held);
  Builder b;
  b.box(Vec3(0, 0, 0.5), Vec3::Ones(), 2500, Vec3(0.4, -0.1, -1), Vec3(0.2, 0.3, 0.1));
  std::mt19937 random(11);
  std::normal_distribution<double> value;
  MatX half(3 * nodes, 3 * nodes);
  for (double& x : half.reshaped()) x = value(random);
  MatX W = MatX::Zero(m, m);
  W.topLeftCorner(3 * nodes, 3 * nodes) =
      1e-4 / (3 * nodes) * half * half.transpose() + 1e-4 * MatX::Identity(3 * nodes, 3 * nodes);
  b.body(MatX::Identity(m, m), VecX::Constant(m, 0.01));
  b.problem.bodies[1].mass = nullptr;
  b.store.emplace_back(W.data(), W.data() + W.size());
  b.problem.bodies[1].mass_inverse = b.store.back().data();
  int node = 7;
  for (const double s : {-0.5, 0.5})
    for (const double t : {-0.5, 0.5}) {
      b.touch(-1, 0, Vec3(s, t, 0), Z, 0.5);
      MatX J = MatX::Zero(3, m);
      J.middleCols(3 * node, 3) = -Builder::frame(Z);
      b.term(1, J);
      node += 9;
    }
  solve(b, 1e-13);
  std::vector<Vec3> impulses;
  for (const ProblemContact& c : b.problem.contacts) impulses.push_back(c.impulse);
  return impulses;
}

TEST(ContactSolverClosedForm, SkinOfManyNodes) {
  const std::vector<Vec3> by_blocks = block_on_skin(0), by_columns = block_on_skin(1);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_GT(by_blocks[i].x(), 100);
    EXPECT_LT((by_blocks[i] - by_columns[i]).norm(), 1e-9 * by_blocks[i].norm()) << i;
  }
}

}  // namespace
}  // namespace talus::contact::testing
