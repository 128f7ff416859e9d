// One contact that slips: Newton's method on the direction and the iteration it replaces find the same
// impulse, which obeys the law.
#include <gtest/gtest.h>

#include <random>

#include "contact/solver/solver_sweep.hpp"

namespace talus::contact::testing {
namespace {

using detail::solve_one;

detail::Touch random_touch(std::mt19937& random, double friction) {
  std::normal_distribution<double> normal;
  Mat3 root;
  for (int i = 0; i < 9; ++i) root(i / 3, i % 3) = 0.3 * normal(random);
  detail::Touch t;
  t.W = Mat3::Identity() + root * root.transpose();
  t.compliance.setZero();
  t.w = t.W.trace() / 3;
  t.slip = detail::eliminate_normal(t.W);
  t.law.mu = friction;
  return t;
}

TEST(SlipOfOneContact, DirectionAndIterationAgree) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int slips = 0;
  for (int k = 0; k < 2000; ++k) {
    const detail::Touch t = random_touch(random, 0.1 + 0.5 * (k % 3));
    const Vec3 q(-std::abs(normal(random)), 2 * normal(random), 2 * normal(random)),
        start(1, 0.1 * normal(random), 0);
    const Vec3 by_direction = solve_one(t, q, start, {30, 1e-9, true}),
               by_turns = solve_one(t, q, start, {4000, 1e-15, false});
    EXPECT_LT((by_direction - by_turns).norm(), 1e-6 * (1 + by_turns.norm())) << "contact " << k;
    const Vec3 u = q + t.W * by_direction;
    const double bound = t.law.mu * by_direction.x(), tangential = by_direction.tail<2>().norm();
    if (by_direction.x() == 0 || tangential < bound * (1 - 1e-9)) continue;
    ++slips;
    EXPECT_NEAR(u.x(), 0, 1e-8) << "contact " << k;
    EXPECT_NEAR(tangential, bound, 1e-9 * bound) << "contact " << k;
    EXPECT_NEAR(u.tail<2>().dot(by_direction.tail<2>()), -u.tail<2>().norm() * tangential,
                1e-6 * (1 + u.norm()) * tangential)
        << "contact " << k;
  }
  EXPECT_GT(slips, 500);
}

TEST(SlipOfOneContact, WithoutFrictionOnlyTheNormal) {
  std::mt19937 random(1);
  detail::Touch t = random_touch(random, 0);
  const Vec3 p = solve_one(t, Vec3(-2, 1, 1), Vec3::Zero());
  EXPECT_NEAR(p.x() * t.W(0, 0), 2, 1e-12);
  EXPECT_TRUE(p.tail<2>().isZero(0));
}

}  // namespace
}  // namespace talus::contact::testing
