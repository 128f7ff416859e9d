// Newton's restitution by the speed of the approach.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "contact/laws/law.hpp"

namespace talus {
namespace {

TEST(RestitutionLaw, FallsToHalfAtItsSpeed) {
  ContactLaw law;
  EXPECT_EQ(law.restitution_at(3), 0);  // none given
  law.restitution = 0.6;
  EXPECT_EQ(law.restitution_at(3), 0.6);  // the same at all speeds
  law.restitution_half_speed = 9.144;
  EXPECT_EQ(law.restitution_at(0), 0.6);
  EXPECT_DOUBLE_EQ(law.restitution_at(9.144), 0.3);
  EXPECT_DOUBLE_EQ(law.restitution_at(2 * 9.144), 0.12);
  EXPECT_EQ(law.restitution_at(-5), law.restitution_at(5));
}

/// It only falls, the rebound is fastest, e_0 v_h / 2, from v_h, and no speed makes it other than a number.
TEST(RestitutionLaw, NeverGivesMoreThanAtRest) {
  ContactLaw law;
  law.restitution = 1;
  law.restitution_half_speed = 5;
  double last = 1, fastest = 0;
  for (double v = 1e-12; v < 1e300; v *= 1.7) {
    const double e = law.restitution_at(v);
    EXPECT_GE(e, 0);
    EXPECT_LE(e, last);
    last = e;
    fastest = std::max(fastest, e * v);
  }
  EXPECT_LE(fastest, 2.5);
  EXPECT_DOUBLE_EQ(law.restitution_at(5) * 5, 2.5);
  EXPECT_EQ(law.restitution_at(std::numeric_limits<double>::max()), 0);
}

/// Two laws are the same if all that they hold is.
TEST(RestitutionLaw, LawsThatDifferInItAreNotTheSame) {
  ContactLaw a;
  a.restitution = 0.5;
  ContactLaw b = a;
  EXPECT_EQ(a, b);
  b.restitution_half_speed = 9.144;
  EXPECT_NE(a, b);
}

}  // namespace
}  // namespace talus
