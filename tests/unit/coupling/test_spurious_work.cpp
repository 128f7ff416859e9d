// What the residual of a contact problem gives to what moves: closed forms of a few bodies.
#include <gtest/gtest.h>

#include "coupling/solution/spurious_work.hpp"

namespace talus::coupling {
namespace {

/// Points of mass 2 kg, each with three directions; contacts along z as the first direction of their frame.
struct Points {
  contact::ContactProblem problem;
  Mat3 mass = 2 * Mat3::Identity(), inverse = 0.5 * Mat3::Identity();

  int body(const Vec3& v) {
    contact::ProblemBody b;
    b.ndof = 3;
    b.offset = static_cast<int>(problem.v.size());
    b.mass = mass.data();
    b.mass_inverse = inverse.data();
    problem.bodies.push_back(b);
    problem.v.insert(problem.v.end(), v.data(), v.data() + 3);
    return static_cast<int>(problem.bodies.size()) - 1;
  }
  /// u = v_over - v_under in (z, x, y); `under` negative: the ground.
  void contact(int over, int under, const Vec3& impulse) {
    contact::ProblemContact c;
    c.first_term = static_cast<int>(problem.terms.size());
    c.friction = 0.5;
    c.impulse = impulse;
    for (const int body : {over, under}) {
      if (body < 0) continue;
      Mat3 j;
      j << 0, 0, 1, 1, 0, 0, 0, 1, 0;
      if (body == under) j = -j;
      problem.terms.push_back({body, static_cast<int>(problem.jacobians.size())});
      problem.jacobians.insert(problem.jacobians.end(), j.data(), j.data() + 9);
      ++c.terms;
    }
    problem.contacts.push_back(c);
  }
};

TEST(SpuriousWork, LoadsThatSinkOrPartAndFrictionThatDrives) {
  Points p;
  p.contact(p.body(Vec3(0.1, 0, -1e-3)), -1, Vec3(10, 3, 0));  // sinks, driven: 0.01 + 0.3
  p.contact(p.body(Vec3(0.1, 0, 2e-3)), -1, Vec3(10, -3, 0));  // parts, braked: 0.02
  EXPECT_NEAR(spurious_work(p.problem, 0), 0.33, 1e-12);
}

TEST(SpuriousWork, WhatSinksAtRestDrivesNothingBesideWhatMoves) {
  // A pile of two sinks by 1e-5 m/s below 1e4 N s; another block slides on the ground, as it should.
  Points p;
  const int lower = p.body(Vec3(0, 0, -1e-5)), upper = p.body(Vec3(0, 0, -2e-5));
  p.contact(lower, -1, Vec3(1e4, 0, 0));
  p.contact(upper, lower, Vec3(5e3, 0, 0));
  p.contact(p.body(Vec3(1, 0, 0)), -1, Vec3(10, -5, 0));
  EXPECT_NEAR(spurious_work(p.problem, 0), 0.15, 1e-12);
  EXPECT_NEAR(spurious_work(p.problem, 1e-9), 0, 1e-15);
}

TEST(SpuriousWork, WhatRestsPassesItsSinkingOnToWhatMovesOnIt) {
  // The same pile, and a block that slides on it: the whole sinks below it, 4 N s times 2e-5 m/s.
  Points p;
  const int lower = p.body(Vec3(0, 0, -1e-5)), upper = p.body(Vec3(0, 0, -2e-5));
  p.contact(lower, -1, Vec3(1e4, 0, 0));
  p.contact(upper, lower, Vec3(5e3, 0, 0));
  p.contact(p.body(Vec3(1, 0, -2e-5)), upper, Vec3(4, -2, 0));
  EXPECT_NEAR(spurious_work(p.problem, 1e-9), 8e-5, 1e-12);
}

TEST(SpuriousWork, NeverMoreThanAllContactsDo) {
  // What counts as at rest slides fast below what moves faster: friction at the face between them is not
  // spurious.
  Points p;
  const int slow = p.body(Vec3(0.1, 0, 0));
  p.contact(slow, -1, Vec3(10, -5, 0));
  p.contact(p.body(Vec3(1, 0, 0)), slow, Vec3(10, -5, 0));
  EXPECT_NEAR(spurious_work(p.problem, 0.02), 0, 1e-15);
}

}  // namespace
}  // namespace talus::coupling
