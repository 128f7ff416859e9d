// Momenta of what a projection of positions moves: kept where nothing fixed holds it, the same for every
// observer.
#include <gtest/gtest.h>

#include <array>

#include "coupling/drift/moved_moments.hpp"

namespace talus::coupling {
namespace {

/// Bodies of masses 1 to 1e12 kg in a row along x, with ways of their own.
std::vector<MovedBody> row() {
  std::vector<MovedBody> bodies;
  for (int i = 0; i < 5; ++i) {
    const double x = i;
    bodies.push_back({std::pow(1e3, x), false, 1e-4 * Vec3(std::cos(x), std::sin(3 * x), 1 - x),
                      Vec3(0.3 * x, std::sin(2 * x), 1 - x * x)});
  }
  return bodies;
}

const std::vector<MovedPair> chain{{0, 1}, {1, 2}, {2, 3}, {3, 4}};

struct Totals {
  Vec3 mass_ways = Vec3::Zero(), gained = Vec3::Zero(), given = Vec3::Zero();
  double size = 0;
};

Totals totals(const std::vector<MovedBody>& bodies, const std::vector<Vec3>& moments) {
  Totals s;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const MovedBody& b = bodies[i];
    s.mass_ways += b.mass * b.way;
    s.gained += b.mass * b.way.cross(b.velocity);
    s.given += moments[i];
    s.size += b.mass * b.way.norm() * b.velocity.norm();
  }
  return s;
}

TEST(KeepMomenta, CentreOfMassStaysAndSpinsGiveBackWhatWaysGain) {
  std::vector<MovedBody> bodies = row();
  const std::vector<Vec3> moments = keep_momenta(bodies, chain);
  const Totals s = totals(bodies, moments);
  EXPECT_LT(s.mass_ways.norm(), 1e-13 * s.size);
  EXPECT_LT((s.given - s.gained).norm(), 1e-13 * s.size);
  EXPECT_GT(s.gained.norm(), 1e-3 * s.size);
}

TEST(KeepMomenta, AreTheSameForEveryObserver) {
  std::vector<MovedBody> bodies = row(), passing = row();
  for (MovedBody& b : passing) b.velocity += Vec3(3, -2, 5);
  const std::vector<Vec3> moments = keep_momenta(bodies, chain), seen = keep_momenta(passing, chain);
  for (std::size_t i = 0; i < moments.size(); ++i) {
    EXPECT_EQ(bodies[i].way, passing[i].way);
    EXPECT_LT((moments[i] - seen[i]).norm(), 1e-12 * bodies[i].mass * bodies[i].way.norm());
  }
}

/// What moves by the least ways is not moved beyond twice the farthest of them.
TEST(KeepMomenta, WaysStayAsShortAsTheyWere) {
  std::vector<MovedBody> bodies = row();
  double farthest = 0;
  for (const MovedBody& b : bodies) farthest = std::max(farthest, b.way.norm());
  keep_momenta(bodies, chain);
  for (const MovedBody& b : bodies) EXPECT_LE(b.way.norm(), 2 * farthest);
}

TEST(KeepMomenta, FixedThingsTakeUpAny) {
  for (const bool held : {true, false}) {
    std::vector<MovedBody> bodies = row();
    std::vector<MovedPair> pairs = chain;
    if (held)
      bodies[2].held = true;
    else
      pairs.push_back({-1, 2});
    const std::vector<MovedBody> before = bodies;
    for (const Vec3& m : keep_momenta(bodies, pairs)) EXPECT_EQ(m, Vec3::Zero());
    for (std::size_t i = 0; i < bodies.size(); ++i) EXPECT_EQ(bodies[i].way, before[i].way);
  }
}

/// Of two bodies that move along together none turns, whatever others of their island do.
TEST(KeepMomenta, ClustersDoNotKnowOfEachOther) {
  std::vector<MovedBody> bodies = row();
  bodies[1].velocity = bodies[0].velocity;
  const std::array pairs{MovedPair{0, 1}, MovedPair{-1, 4}};
  const std::vector<Vec3> moments = keep_momenta(bodies, pairs);
  EXPECT_LT(moments[0].norm() + moments[1].norm(), 1e-16);
  EXPECT_EQ(moments[4], Vec3::Zero());
}

}  // namespace
}  // namespace talus::coupling
