// Restitution of a spring with a dashpot that does not pull.
#include <gtest/gtest.h>

#include <cmath>

#include "contact/laws/impact_damping.hpp"

namespace talus::contact {
namespace {

/// The oscillator x'' + 2 zeta x' + x = 0 stepped until its force vanishes.
double stepped(double zeta) {
  double x = 0, v = 1;
  const double h = 1e-5;
  while (x < 1e-12 || x + 2 * zeta * v > 0) {
    const double xm = x + 0.5 * h * v, vm = v - 0.5 * h * (x + 2 * zeta * v);  // midpoint
    x += h * vm;
    v -= h * (xm + 2 * zeta * vm);
    if (x < 0) break;
  }
  return -v;
}

TEST(ImpactDamping, IsTheOscillatorsOwn) {
  for (const double zeta : {0.01, 0.3, 0.7, 0.95, 1.0, 1.3, 3.0})
    EXPECT_NEAR(restitution_of(zeta), stepped(zeta), 2e-4) << zeta;
  EXPECT_EQ(restitution_of(0), 1);
  EXPECT_NEAR(restitution_of(1), std::exp(-2.0), 1e-12);
}

TEST(ImpactDamping, InverseGoesBack) {
  for (const double e : {0.1, 0.1353, 0.4, 0.8, 0.999})
    EXPECT_NEAR(restitution_of(damping_ratio_for(e)), e, 1e-12) << e;
  EXPECT_NEAR(damping_ratio_for(1), 0, 1e-12);
  EXPECT_EQ(damping_ratio_for(0), damping_ratio_for(0.1));
}

}  // namespace
}  // namespace talus::contact
