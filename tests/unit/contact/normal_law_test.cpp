// What every kind of normal law owes: its slope and its work are those of its force, and what it says of
// itself (ContactLaw) is so. A new kind belongs into all_laws().
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "contact/laws/normal_law.hpp"

namespace talus::contact {
namespace {

constexpr double area = 0.2;  // of the contact point [m^2]

struct Named {
  std::string name;
  ContactLaw law;
  double stiffness;
  double deepest;  // to which it is looked at [m]
};

std::vector<Named> all_laws() {
  ContactLaw linear, hertz, crushing, layer, table;
  linear.stiffness = crushing.stiffness = layer.stiffness = ContactLaw::Stiffness::per_area;
  linear.normal_stiffness = crushing.normal_stiffness = layer.normal_stiffness = 5e7;
  hertz.kind = ContactLaw::Kind::hertz;
  crushing.kind = layer.kind = ContactLaw::Kind::crushing;
  crushing.crushing_pressure = layer.crushing_pressure = 2e5;  // crushes from 4 mm on
  layer.yield_gradient = 5e6, layer.yield_thickness = 0.05;
  table.kind = ContactLaw::Kind::table;
  table.table = {{0, 0}, {1e-3, 1e4}, {5e-3, 3e4}, {2e-2, 2e5}};
  return {{"linear", linear, 5e7 * area, 0.1},
          {"hertz", hertz, 3e9, 0.1},
          {"crushing", crushing, 5e7 * area, 0.1},
          {"layer", layer, 5e7 * area, 0.1},
          {"table", table, 1, 0.1}};
}

NormalLaw at_point(const Named& of) {
  NormalLaw n;
  n.law = &of.law;
  n.stiffness = of.stiffness;
  n.limit = of.law.crushing_pressure * area;
  return n;
}

TEST(NormalLaw, SlopeAndWorkAreThoseOfTheForce) {
  for (const Named& of : all_laws()) {
    const NormalLaw law = at_point(of);
    const double d = 1e-8;
    for (double x = 1.37e-4; x < of.deepest; x += 1.73e-3) {  // beside the kinks
      const double f = law.force(x);
      EXPECT_NEAR((law.work(x + d) - law.work(x - d)) / (2 * d), f, 1e-5 * f) << of.name << ", " << x;
      EXPECT_NEAR((law.force(x + d) - law.force(x - d)) / (2 * d), law.slope(x), 1e-5 * f / x)
          << of.name << ", " << x;
    }
    EXPECT_EQ(law.force(-1e-3) > 0 || law.work(-1e-3) > 0, false) << of.name;
  }
}

/// What does not crush gives all of its work back.
TEST(NormalLaw, WhatCrushesKeepsAPart) {
  for (const Named& of : all_laws()) {
    const NormalLaw law = at_point(of);
    const double x = of.deepest;
    EXPECT_EQ(law.crushed_after(x) > 0, of.law.crushes()) << of.name;
    EXPECT_EQ(law.stored(x) < (1 - 1e-9) * law.work(x), of.law.crushes()) << of.name;
  }
}

TEST(NormalLaw, ExponentIsThatOfTheForce) {
  for (const Named& of : all_laws()) {
    const NormalLaw law = at_point(of);
    const double n = std::log2(law.force(2e-3) / law.force(1e-3));  // before what crushes does
    if (of.law.exponent() > 0)
      EXPECT_NEAR(n, of.law.exponent(), 1e-12) << of.name;
    else
      EXPECT_NE(n, 1) << of.name;
  }
}

/// No slope on the way that the energy or the weight goes is greater.
TEST(NormalLaw, StiffestBoundsTheWay) {
  for (const Named& of : all_laws()) {
    const NormalLaw law = at_point(of);
    for (const double end : {1e-3, 3e-3, 2e-2}) {
      const double most =
          std::max(law.stiffest(law.work(end), 0, 1e-12), law.stiffest(0, law.force(end), 1e-12));
      for (double x = 1e-5; x < end; x += 7.3e-5)
        EXPECT_LE(law.slope(x), most * (1 + 1e-9)) << of.name << ", " << x << " of " << end;
    }
  }
}

}  // namespace
}  // namespace talus::contact
