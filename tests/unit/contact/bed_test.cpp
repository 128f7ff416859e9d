// Law of the columns of a bed: volume, crushing, unloading, and the halves that a leapfrog counts.
#include "contact/bed.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace talus::contact {
namespace {

constexpr double k = 5e7, p = 5e5, yield = p / k;
const Vec3 up = Vec3::UnitZ();

std::vector<Column> wedge() {   // four columns of 0.1 m^2, the deepest at 0.04 m
  std::vector<Column> c;
  for (const double depth : {0.01, 0.02, 0.03, 0.04}) c.push_back({0.1, depth, Vec3::Zero(), up});
  return c;
}

TEST(Bed, ElasticForceIsStiffnessTimesVolume) {
  const Bed bed(wedge(), up, 0.04, k, std::numeric_limits<double>::infinity(), 0.04, 0);
  EXPECT_DOUBLE_EQ(bed.force(0.04), k * 0.1 * (0.01 + 0.02 + 0.03 + 0.04));
  EXPECT_DOUBLE_EQ(bed.stored(0.04), 0.5 * k * 0.1 * (1 + 4 + 9 + 16) * 1e-4);
  EXPECT_DOUBLE_EQ(bed.force(0.035), k * 0.1 * (0.005 + 0.015 + 0.025 + 0.035));
  EXPECT_DOUBLE_EQ(bed.force(0.0), 0);
  EXPECT_DOUBLE_EQ(bed.work(0.05), bed.stored(0.05));
  EXPECT_DOUBLE_EQ(bed.before(0.03), bed.stored(0.03));
}

TEST(Bed, CrushingForceIsPressureTimesArea) {
  const Bed bed(wedge(), up, 0.04, k, yield, 0.04, 0.04 - yield);
  EXPECT_DOUBLE_EQ(bed.force(0.04), p * 0.4);
  EXPECT_DOUBLE_EQ(bed.force(0.041), p * 0.4);
  EXPECT_NEAR(bed.work(0.041) - bed.stored(0.041), p * 0.4 * 0.001, 1e-9);
  EXPECT_NEAR(bed.crushing_before(0.039), -p * 0.4 * 0.001, 1e-9);
  EXPECT_DOUBLE_EQ(bed.crushed_after(0.041), 0.041 - yield);
  // On the way back all give way together, and nothing is left after p / k.
  EXPECT_NEAR(bed.force(0.035), 0.5 * p * 0.4, 1e-6);
  EXPECT_NEAR(bed.force(0.03), 0, 1e-6);
}

TEST(Bed, CraterCarriesNothingAboveItsFloor) {
  const Bed bed(wedge(), up, 0.04, k, yield, 0.04, 0.05);
  EXPECT_DOUBLE_EQ(bed.force(0.04), 0);
  EXPECT_DOUBLE_EQ(bed.force(0.049), 0);
  EXPECT_GT(bed.force(0.051), 0);
}

TEST(Bed, WorkIsTheIntegralOfTheForceAlongAFacet) {
  std::vector<Column> c = wedge();
  const Vec3 lift = Vec3(0.5, 0, 1), normal = lift.normalized();
  for (Column& q : c) q.lift = lift;
  const Bed bed(c, normal, 0.04, k, yield, 0.04, 0);
  const int n = 2000;
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += bed.force(0.04 + 0.01 * (i + 0.5) / n) * 0.01 / n;
  EXPECT_NEAR(bed.work(0.05) - bed.work(0.04), sum, 1e-6 * sum);
}

}  // namespace
}  // namespace talus::contact
