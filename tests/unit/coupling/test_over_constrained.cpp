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

}  // namespace
}  // namespace talus::coupling
