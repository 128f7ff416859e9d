// Many blocks: where the open-close iteration settles and where it cycles; momentum; step control.
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "core/turn.hpp"
#include "scene1988.hpp"

using namespace talus;
using namespace talus::dda;
using namespace talus::dda::test;

namespace {

/// Running bond, six courses of four bricks 0.4 x 0.2 x 0.2 m, given a little random velocity; dt is 1 ms.
Scene wall(double stiffness_number) {
  const double dt = 1e-3, mass = 2500 * 0.4 * 0.2 * 0.2, L = 0.4, H = 0.2;
  const double kn = stiffness_number * mass / (dt * dt);
  Scene s(0.6, kn, kn / 2.5);
  s.planes.push_back({});
  for (int r = 0; r < 6; ++r) {
    const double z = H * (r + 0.5);
    if (r % 2 == 0) {
      for (int c = 0; c < 4; ++c) s.add_box(Vec3(L, H, H), Vec3(L * (c + 0.5), 0, z));
    } else {
      s.add_box(Vec3(L / 2, H, H), Vec3(L / 4, 0, z));
      for (int c = 1; c < 4; ++c) s.add_box(Vec3(L, H, H), Vec3(L * c, 0, z));
      s.add_box(Vec3(L / 2, H, H), Vec3(4 * L - L / 4, 0, z));
    }
  }
  std::uint32_t seed = 12345;
  for (Vec3& v : s.state.v)
    for (int k = 0; k < 3; ++k) {
      seed = seed * 1664525u + 1013904223u;
      v[k] = 1e-2 * (static_cast<double>(seed >> 8) / (1 << 24) - 0.5);
    }
  return s;
}

struct Outcome {
  int steps = 0, unsettled = 0, cuts = 0, substeps = 0, iterations = 0;
  bool failed = false;
  double worst_ledger = 0;
};

Outcome run(double stiffness_number, bool may_cut, int steps = 10) {
  Scene s = wall(stiffness_number);
  Shi1988Settings settings;
  if (!may_cut) settings.smallest_step = 1;
  const Shi1988 method(settings);
  Outcome out;
  double total = 0, start = 0;
  for (int i = 0; i < s.state.size(); ++i)
    total += s.model.blocks[static_cast<std::size_t>(i)].mass *
             (0.5 * s.state.v[static_cast<std::size_t>(i)].squaredNorm() +
              9.81 * s.state.c[static_cast<std::size_t>(i)].z());
  start = total;
  try {
    for (int k = 0; k < steps; ++k) {
      const Shi1988Report r = s.step(method, 1e-3);
      ++out.steps;
      out.unsettled += r.unsettled;
      out.cuts += r.step_cuts;
      out.substeps += r.substeps;
      out.iterations += r.iterations;
      total -= Scene::dissipated(r);
      out.worst_ledger = std::max(out.worst_ledger, std::abs(total - Scene::total(r)) / start);
    }
  } catch (const NumericalFailure&) { out.failed = true; }
  std::printf(
      "k dt^2/m %.0e, cuts %s: %d steps%s, %d sub-steps, %d unsettled, %d cuts, %.1f iterations a sub-step, "
      "ledger %.1e\n",
      stiffness_number, may_cut ? "allowed" : "barred", out.steps, out.failed ? ", then inside out" : "",
      out.substeps, out.unsettled, out.cuts,
      out.substeps ? static_cast<double>(out.iterations) / out.substeps : 0.0, out.worst_ledger);
  return out;
}

}  // namespace

TEST(Walls1988, SettlesOnSoftWalls) {
  const Outcome o = run(1e-3, false);
  EXPECT_EQ(o.unsettled, 0);
  EXPECT_FALSE(o.failed);
  EXPECT_LT(o.iterations, 6 * o.substeps);
  EXPECT_LT(o.worst_ledger, 1e-10);
}

TEST(Walls1988, CyclesOnStiffWalls) {
  const Outcome one = run(1, false);
  EXPECT_GE(one.unsettled, 4);
  for (const double stiff : {10.0, 100.0}) {
    const Outcome o = run(stiff, false);
    EXPECT_TRUE(o.failed || o.unsettled == o.substeps) << stiff;  // not a single step settles
    EXPECT_EQ(o.unsettled, o.substeps);
  }
}

TEST(Walls1988, StepCutsBuySettling) {
  const Outcome soft = run(1e-3, true), stiff = run(100, true);
  EXPECT_EQ(soft.cuts, 0);
  EXPECT_EQ(soft.substeps, 10);
  EXPECT_GT(stiff.cuts, 5);
  EXPECT_GT(stiff.substeps, 30);
  EXPECT_LT(stiff.worst_ledger, 1e-9);
}

TEST(Walls1988, UnsettledStepsAreCountedNotHidden) {
  Scene s = wall(10);
  Shi1988Settings settings;
  settings.smallest_step = 1;
  const Shi1988Report r = s.step(Shi1988(settings), 1e-3);
  EXPECT_EQ(r.substeps, 1);
  EXPECT_EQ(r.unsettled, 1);
  EXPECT_FALSE(r.settled());
  EXPECT_GE(r.iterations, settings.iteration_cap);
}

TEST(Walls1988, IterativeSolverGivesTheFactorisedMotion) {
  Scene direct = wall(1e-2), iterative = direct;
  Shi1988Settings settings;
  const Shi1988 a(settings);
  settings.direct_limit = 0;
  const Shi1988 b(settings);
  for (int k = 0; k < 5; ++k) {
    direct.step(a, 1e-3);
    iterative.step(b, 1e-3);
  }
  for (std::size_t i = 0; i < direct.state.v.size(); ++i)
    EXPECT_LT((direct.state.v[i] - iterative.state.v[i]).norm(), 1e-9) << i;
}

TEST(Walls1988, CrossedEdgesKeepLinearMomentum) {
  // Two boxes, each on edge, meet with crossing edges, without gravity: forces are equal and opposite.
  Scene s(0.3, 1e8, 4e7);
  s.model.gravity.setZero();
  const Quat lower(Eigen::AngleAxisd(M_PI / 4, Vec3::UnitX())),
      upper(Eigen::AngleAxisd(M_PI / 4, Vec3::UnitY()));
  const double half = std::sqrt(0.5);
  s.add_box(Vec3(2, 1, 1), Vec3(0, 0, -half), lower);
  s.add_box(Vec3(1, 2, 1), Vec3(0.1, 0.05, half + 0.002), upper);
  s.state.v[1] = Vec3(0.2, -0.1, -2);
  const Vec3 before = s.model.blocks[1].mass * s.state.v[1];
  const Shi1988 method;
  int touched = 0;
  double total = 0.5 * s.model.blocks[1].mass * s.state.v[1].squaredNorm();
  for (int k = 0; k < 200; ++k) {
    const Shi1988Report r = s.step(method, 2e-4);
    touched += r.closed;
    total -= Scene::dissipated(r);
    EXPECT_NEAR(total, Scene::total(r), 1e-9 * 1e4);
  }
  EXPECT_GT(touched, 5);
  EXPECT_LT((s.model.blocks[0].mass * s.state.v[0] + s.model.blocks[1].mass * s.state.v[1] - before).norm(),
            1e-9 * before.norm());
  EXPECT_GT(s.state.v[1].z() - s.state.v[0].z(), 0);  // they part
}

TEST(Walls1988, VertexMeetsVertexWithoutPassingThrough) {
  Scene s(0.3, 1e9, 4e8);
  s.model.gravity.setZero();
  // Corner up against corner down, body diagonals on one line.
  const Quat up = turn_between(Vec3(1, 1, 1), Vec3::UnitZ()),
             down = turn_between(Vec3(1, 1, 1), -Vec3::UnitZ());
  const double reach = std::sqrt(3.0) / 2;
  s.add_box(Vec3(1, 1, 1), Vec3(0, 0, -reach), up);
  s.add_box(Vec3(1, 1, 1), Vec3(1e-4, 2e-4, reach + 0.001), down);
  s.state.v[1].z() = -1;
  const Shi1988 method;
  double penetration = 0;
  for (int k = 0; k < 400; ++k) penetration = std::max(penetration, s.step(method, 1e-4).max_penetration);
  EXPECT_GT(penetration, 0);  // they did meet
  EXPECT_LT(penetration, 0.02);
  EXPECT_GT(s.state.c[1].z() - s.state.c[0].z(), 1.0);  // and did not pass
}

TEST(Walls1988, DisplacementRatioCutsLongSteps) {
  Scene s(0.3, 1e8, 4e7);
  s.add_box(Vec3(1, 1, 1), Vec3(0, 0, 100));
  s.state.v[0].z() = -10;
  Shi1988Settings settings;
  settings.displacement_ratio = 0.01;
  settings.half_height = 1;
  const Shi1988Report r = s.step(Shi1988(settings), 0.1);
  EXPECT_GT(r.step_cuts, 0);
  EXPECT_LE(r.max_displacement, 3 * 0.01 * 1.0 + 1e-12);
  EXPECT_NEAR(s.state.c[0].z(), 100 - 10 * 0.1 - 0.5 * 9.81 * 0.01, 1e-11);  // the whole step is covered
}

TEST(Walls1988, FixedBlocksCarry) {
  Scene s(0.5, 1e9, 4e8);
  s.add_box(Vec3(4, 4, 1), Vec3(0, 0, -0.5));
  s.model.blocks[0].fixed = true;
  s.add_box(Vec3(1, 1, 1), Vec3(0, 0, 0.5));
  const Shi1988 method;
  for (int k = 0; k < 600; ++k) s.step(method, 1e-3);
  EXPECT_EQ(s.state.c[0], Vec3(0, 0, -0.5));
  double carried = 0;
  for (const auto& c : s.history.contacts) carried += c.force.z();
  EXPECT_NEAR(carried, 2500 * 9.81, 1e-3 * 2500 * 9.81);
}
