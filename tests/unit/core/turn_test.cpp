#include "core/turn.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace talus {
namespace {

TEST(TurnBetween, TakesOneDirectionToTheOtherByTheLeastAngle) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 1000; ++k) {
    const Vec3 a(normal(random), normal(random), normal(random)),
        b(normal(random), normal(random), normal(random));
    const Quat q = turn_between(a, b);
    EXPECT_NEAR(q.norm(), 1, 1e-14);
    EXPECT_NEAR((q * a.normalized() - b.normalized()).norm(), 0, 1e-13) << k;
    EXPECT_NEAR(2 * std::atan2(q.vec().norm(), q.w()), std::atan2(a.cross(b).norm(), a.dot(b)), 1e-12) << k;
  }
}

TEST(TurnBetween, OfOneDirectionIsNone) {
  const Vec3 a(0.3, -0.2, 5);
  EXPECT_NEAR(turn_between(a, 7 * a).angularDistance(Quat::Identity()), 0, 1e-15);
}

TEST(TurnBetween, OfOppositeDirectionsIsHalfATurn) {
  for (const Vec3& a : {Vec3(1, 0, 0), Vec3(0, -2, 0), Vec3(0, 0, 3), Vec3(1, 1, 1), Vec3(1e-9, 4, -1e-9)})
    for (const double aside : {0.0, 1e-9, 1e-7, 1e-5}) {  // on either side of where the formula is left
      const Vec3 b = -a.normalized() + aside * Vec3(a.y(), a.z(), a.x()).cross(a).normalized();
      const Quat q = turn_between(a, b);
      EXPECT_NEAR(q.norm(), 1, 1e-14);
      // The way across is known to round-off over its length, and left out below 1e-8.
      EXPECT_NEAR((q * a.normalized() - b.normalized()).norm(), 0, 2e-8) << a.transpose() << " " << aside;
      EXPECT_NEAR(q.w(), 0, 1e-5);
    }
}

}  // namespace
}  // namespace talus
