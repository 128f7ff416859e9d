// What spins give back for the way of a projection: exact where the impulses are those of the way, bounded where bodies are jammed.
#include <gtest/gtest.h>

#include "coupling/moved_moments.hpp"

namespace talus::coupling {
namespace {

Vec3 sum(const std::vector<Vec3>& moments) {
  Vec3 total = Vec3::Zero();
  for (const Vec3& m : moments) total += m;
  return total;
}

/// sum m d x v.
Vec3 gained(const std::vector<MovedBody>& bodies) {
  Vec3 total = Vec3::Zero();
  for (const MovedBody& b : bodies) total += b.mass * b.way.cross(b.velocity);
  return total;
}

/// Bodies in a row along x, each pushed from the one before by p kg m, beside `balance` that each pair passes on around a ring and that moves nothing.
struct Row {
  std::vector<MovedBody> bodies;
  std::vector<MovedPair> pairs;

  Row(const std::vector<double>& p, double balance) {
    for (std::size_t i = 0; i <= p.size(); ++i) {
      const double x = static_cast<double>(i);
      bodies.push_back({1 + x, 0.5 + x, Vec3::Zero(), Vec3(0.3 * x, std::sin(2 * x), 1 - x * x)});
    }
    for (std::size_t i = 0; i < p.size(); ++i) {
      push(static_cast<int>(i), static_cast<int>(i + 1), p[i]);
      pairs.back().impulse.x() += balance;
    }
    pairs.push_back({static_cast<int>(p.size()), 0, Vec3(balance, 0, 0)});
  }
  void push(int a, int b, double p) {
    pairs.push_back({a, b, Vec3(p, 0, 0)});
    bodies[static_cast<std::size_t>(a)].way.x() -= p / bodies[static_cast<std::size_t>(a)].mass;
    bodies[static_cast<std::size_t>(b)].way.x() += p / bodies[static_cast<std::size_t>(b)].mass;
  }
};

const std::vector<double> small{1e-4, -2e-4, 3e-4};

TEST(MovedMoments, FreeBodiesGiveBackWhatTheyGained) {
  for (const double balance : {0.0, 1e-4, 1.0, 1e6}) {
    const Row row(small, balance);
    const std::vector<Vec3> moments = moved_moments(row.bodies, row.pairs);
    EXPECT_LT((sum(moments) - gained(row.bodies)).norm(), 1e-15 * std::max(1.0, balance < 1 ? balance : 0.0)) << balance;
    EXPECT_GT(gained(row.bodies).norm(), 1e-4);
  }
}

TEST(MovedMoments, AreTheSameForEveryObserver) {
  for (const double balance : {0.0, 1e6}) {
    Row row(small, balance);
    const std::vector<Vec3> at_rest = moved_moments(row.bodies, row.pairs);
    for (MovedBody& b : row.bodies) b.velocity += Vec3(3, -2, 5);
    const std::vector<Vec3> passing = moved_moments(row.bodies, row.pairs);
    for (std::size_t i = 0; i < at_rest.size(); ++i) EXPECT_LT((at_rest[i] - passing[i]).norm(), 1e-16 + 1e-12 * at_rest[i].norm());
  }
}

/// A ring of jammed bodies whose impulses balance each other: without the bound they turned pieces of a viaduct to 190 rad/s within a millisecond.
TEST(MovedMoments, ImpulsesThatMoveNothingTurnNothing) {
  const Row row(small, 1e6);
  const std::vector<Vec3> moments = moved_moments(row.bodies, row.pairs);
  double fastest = 0;
  for (const MovedBody& a : row.bodies)
    for (const MovedBody& b : row.bodies) fastest = std::max(fastest, (a.velocity - b.velocity).norm());
  for (std::size_t i = 0; i < moments.size(); ++i) EXPECT_LE(moments[i].norm(), row.bodies[i].mass * row.bodies[i].way.norm() * fastest) << i;
}

/// Of two bodies that move along together none turns, whatever others of their island do.
TEST(MovedMoments, WhatMovesAlongTogetherIsNotTurned) {
  Row row({1e-4}, 0);
  row.bodies[1].velocity = row.bodies[0].velocity;
  row.bodies.push_back({5, 5, Vec3::Zero(), Vec3(-7, 0, 0)});
  for (const Vec3& m : moved_moments(row.bodies, row.pairs)) EXPECT_EQ(m, Vec3::Zero());
}

}  // namespace
}  // namespace talus::coupling
