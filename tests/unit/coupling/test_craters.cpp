// Planes of what a block has crushed: what they take from the springs is what is crushed, and what turns
// presses where it still lies.
#include "coupling/ground/craters.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <span>
#include <vector>

namespace talus::coupling {
namespace {

constexpr double limit = 2e-3, side = 0.1;
constexpr std::uint64_t first = std::uint64_t{11} << 60;

/// One cell under a facet at depth d = mean + slope a, as two triangles.
contact::Footprint cell(double mean, double slope) {
  contact::Footprint part;
  const auto corner = [](double a, double b) { return Vec3(a * side / 2, b * side / 2, 0); };
  const Vec3 x[4] = {corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)};
  for (const auto& [i, j, k] : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
    contact::Column c;
    c.area = side * side / 2;
    c.place = {x[i], x[j], x[k]};
    for (std::size_t q = 0; q < 3; ++q) c.depth[q] = c.spring[q] = mean + slope * c.place[q].x();
    c.lift = Vec3(slope, 0, 1);
    part.columns.push_back(c);
  }
  return part;
}

struct Sums {
  double volume = 0, energy = 0, greatest = 0, least = 1;
};  // int s, int s^2/2, of s

Sums sums(const contact::Footprint& part) {
  Sums all;
  for (const contact::Column& c : part.columns) {
    const Vec3 s(std::max(c.spring[0], 0.0), std::max(c.spring[1], 0.0), std::max(c.spring[2], 0.0));
    all.volume += c.area * s.mean();
    all.energy += c.area / 24 * (s.sum() * s.sum() + s.squaredNorm());
    all.greatest = std::max(all.greatest, s.maxCoeff());
    all.least = std::min({all.least, c.spring[0], c.spring[1], c.spring[2]});
  }
  return all;
}

/// A block over the cell from pose to pose; craters go from one to the next as in a run.
struct Cell {
  std::vector<ContactMemory> memory;
  contact::Footprint part;
  void lie(double mean, double slope) {
    part = cell(mean, slope);
    const std::vector<Crater> craters = crush(std::span(&part, 1), first, memory, limit, false);
    if (craters.empty()) return;
    memory.clear();
    for (const Crater& c : craters) {
      ContactMemory& m = memory.emplace_back();
      m.feature = c.feature, m.place = c.floor, m.crushed = c.depth;
    }
  }
};

TEST(Craters, WhatSinksEvenlyIsCrushedToItsLimit) {
  Cell c;
  c.lie(0.5 * limit, 0);
  EXPECT_TRUE(c.memory.empty());
  c.lie(1.5 * limit, 0);
  EXPECT_NEAR(c.part.crushed, 0.5 * limit * side * side, 1e-15);
  c.lie(2.5 * limit, 0);
  EXPECT_NEAR(c.part.crushed, limit * side * side, 1e-15);
  EXPECT_NEAR(sums(c.part).least, limit, 1e-15);
  c.lie(2 * limit, 0);
  EXPECT_EQ(c.part.crushed, 0);
  EXPECT_NEAR(sums(c.part).greatest, 0.5 * limit, 1e-15);
}

/// Where the block yields in part of the cell only, the rest is compressed by its depth.
TEST(Craters, YieldsInPart) {
  Cell c;
  const double slope = 2 * limit / side;  // from 0 to 2 L
  c.lie(limit, slope);
  EXPECT_NEAR(c.part.crushed, 0.25 * limit * side * side, 1e-12 * side);
  const Sums s = sums(c.part);
  EXPECT_NEAR(s.greatest, limit, 1e-15);
  EXPECT_NEAR(s.volume, 0.75 * limit * side * side, 1e-12 * side);
}

/// A crushed cell under a block that turns to and fro about an axis beside it, unloading: it gives back what
/// it took.
TEST(Craters, WhatTurnsGivesBackWhatItTook) {
  Cell c;
  c.lie(3 * limit, 0);
  const double energy = sums(c.part).energy;
  double work = 0, before = sums(c.part).volume;
  const int n = 400;
  for (int i = 1; i <= n; ++i) {  // the axis at -0.1 m: work is int s dd
    const double turned = -5e-3 * i / n, last = -5e-3 * (i - 1) / n;
    double moment = 0;
    c.lie(3 * limit + 0.1 * turned, turned);
    for (const contact::Column& q : c.part.columns)
      for (std::size_t k = 0; k < 3; ++k)
        moment +=
            q.area / 12 * (q.spring[k] + q.spring[0] + q.spring[1] + q.spring[2]) * (q.place[k].x() + 0.1);
    work += moment * (turned - last);
    EXPECT_EQ(c.part.crushed, 0);
  }
  EXPECT_NEAR(sums(c.part).energy - energy, work, 5e-3 * energy);
  EXPECT_LT(sums(c.part).volume, before);
}

/// Turned about its middle under full pressure one side sinks and the other rises: springs lose what is
/// crushed, the mean pressure stays at most p, and nothing goes on without motion.
TEST(Craters, WhatIsCrushedIsWhatTheSpringsLose) {
  Cell c;
  c.lie(3 * limit, 0);
  const Sums start = sums(c.part);
  double crushed = 0, work = 0;
  const int n = 1000;
  for (int i = 1; i <= n; ++i) {
    const double step = 0.02 / n;
    c.lie(3 * limit, step * i);
    crushed += c.part.crushed;
    for (const contact::Column& q : c.part.columns)
      for (std::size_t k = 0; k < 3; ++k)
        work += q.area / 12 * (q.spring[k] + q.spring[0] + q.spring[1] + q.spring[2]) * q.place[k].x() * step;
    EXPECT_LE(sums(c.part).volume, limit * side * side * (1 + 1e-12));
  }
  const Sums end = sums(c.part);
  EXPECT_GT(crushed, 0);
  EXPECT_NEAR(work, limit * crushed + end.energy - start.energy, 5e-3 * limit * crushed);
  c.lie(3 * limit, 0.02);
  EXPECT_LT(c.part.crushed, 1e-12 * crushed);
  EXPECT_NEAR(sums(c.part).energy, end.energy, 1e-12 * end.energy);
}

/// Another facet over the same cell goes on with what the first one leaves of its depth.
TEST(Craters, ANeighbourGoesOn) {
  Cell c;
  c.lie(3 * limit, 0);
  contact::Footprint both = cell(2.5 * limit, 0);
  both.columns[1].facet = 1;
  const std::vector<Crater> craters = crush(std::span(&both, 1), first, c.memory, limit, false);
  ASSERT_EQ(craters.size(), 2u);
  for (const contact::Column& q : both.columns)
    for (const double s : q.spring) EXPECT_NEAR(s, 0.5 * limit, 1e-15);
  EXPECT_EQ(both.crushed, 0);
}

}  // namespace
}  // namespace talus::coupling
