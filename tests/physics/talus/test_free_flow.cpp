// Free flight of a block that turns and strains: momentum exactly, the frame turns as fast as its spin says.
#include <gtest/gtest.h>

#include "dda/kinematics.hpp"
#include "helpers/shapes.hpp"

namespace talus::dda {
namespace {

struct Block {
  Model model;
  State state;
  Block() {
    auto shape = std::make_shared<Polyhedron>(test::cuboid(Vec3(4, 5, 5.75)));
    Model::Block b;
    b.shape = shape;
    b.volume = 115;
    b.mass = 2500 * b.volume;
    b.second_moment = b.mass / 12 * Vec3(16, 25, 33.0625).asDiagonal();
    b.inertia = b.second_moment.trace() * Mat3::Identity() - b.second_moment;
    b.deformable = true;
    b.young = 3e9;
    b.poisson = 0.3;
    model.blocks.push_back(b);
    model.gravity.setZero();
    state.c = {Vec3(1, 2, 3)};
    state.v = {Vec3(4, -5, 6)};
    state.w = {Vec3(0.3, -0.2, 0.1)};
    state.q = {Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 2).normalized()))};
    state.eps = {Vec6::Zero()};
    Vec6 rate;
    rate << 0.1, -0.05, 0.02, 0.4, -0.3, 0.2;  // what a hard blow on an edge gives
    state.eps_rate = {rate};
  }
  double energy() const {
    const BlockEnergy e = dda::energy(model, state, 0);
    return e.translational + e.rotational + e.straining + e.strain_energy;
  }
  Vec3 angular() const {
    Vec3 p, L;
    momentum(model, state, 0, p, L);
    return L - state.c[0].cross(p);
  }
  void step(double h, FlowRule rule = FlowRule::exact) {
    const FreeFlow f = free_flow(model, state, 0, h, rule);
    state.c[0] = f.pose.c;
    state.q[0] = f.q;
    state.eps[0] = f.eps;
    state.v[0] = f.velocity.head<3>();
    state.w[0] = f.velocity.segment<3>(3);
    state.eps_rate[0] = f.velocity.tail<6>();
  }
};

TEST(FreeFlow, StrainingBlockKeepsItsAngularMomentum) {
  for (const double h : {1e-2, 1e-3, 1e-4}) {
    Block b;
    const Vec3 start = b.angular();
    for (int n = 0; n < 500; ++n) b.step(h);
    EXPECT_LT((b.angular() - start).norm(), 1e-12 * start.norm()) << "h " << h;
  }
}

TEST(FreeFlow, FrameTurnsAsItsSpinSays) {
  // The turn of one step against the trapezoid of the spin, while the strain rates turn the frame as well.
  double last = 0;
  for (const double h : {4e-4, 2e-4, 1e-4}) {
    Block b;
    const Vec3 w0 = b.state.w[0];
    const Quat q0 = b.state.q[0];
    b.step(h);
    const Eigen::AngleAxisd turn(b.state.q[0] * q0.conjugate());
    const double off = (turn.angle() * turn.axis() - 0.5 * h * (w0 + b.state.w[0])).norm();
    EXPECT_LT(off, 2e-3 * turn.angle()) << "h " << h;
    if (last > 0) { EXPECT_GT(last / off, 3.8) << "h " << h; }
    last = off;
  }
}

TEST(FreeFlow, KeepsItsEnergyToTheOrderOfTheStep) {
  // Terms of the size of the strain, here 1e-3, times the spin (Coriolis) are in.
  for (const double h : {2e-4, 5e-5}) {
    Block b;
    const double start = b.energy();
    for (int n = 0; n * h < 0.02; ++n) {
      b.step(h);
      ASSERT_LT(std::abs(b.energy() / start - 1), 2e-3 * h) << "h " << h;
    }
  }
}

/// Steps that hold several periods: the trapezoid of the strains and the turning of their frame drive each
/// other, strains by their rates at the end do not.
TEST(FreeFlow, StrainsByTheirRatesAtTheEndMakeNoEnergy) {
  const auto course = [](FlowRule rule) {
    Block b;
    b.state.w[0] = Vec3(5, 20, 40);
    b.state.eps_rate[0] *= 40;
    const double first = b.energy();
    double most = 0;
    for (int n = 0; n < 300; ++n) {
      const FreeFlow f = free_flow(b.model, b.state, 0, 1e-2, rule);
      b.step(1e-2, rule);
      const BlockEnergy e = energy(b.model, b.state, 0);
      EXPECT_NEAR(internal_energy(b.model.blocks[0], f), e.rotational + e.straining + e.strain_energy,
                  1e-12 * first);
      most = std::max(most, b.energy() / first);
    }
    return most;
  };
  EXPECT_GT(course(FlowRule::exact), 1.1);
  EXPECT_LT(course(FlowRule::strain_at_end), 1 + 1e-9);
}

TEST(FreeFlow, SoftStickThatSpinsKeepsItsEnergy) {
  // What it strains by swings fast beside its spin, which turns the frame of the strains: without the
  // Coriolis force, and what strains add to the inertia, that grows turn by turn.
  for (const double h : {4e-5, 1e-5}) {
    Block b;
    Model::Block& stick = b.model.blocks[0];
    stick.volume = 0.7 * 0.03 * 0.02;
    stick.mass = 2600 * stick.volume;
    stick.second_moment = stick.mass / 12 * Vec3(0.7 * 0.7, 0.03 * 0.03, 0.02 * 0.02).asDiagonal();
    stick.inertia = stick.second_moment.trace() * Mat3::Identity() - stick.second_moment;
    stick.young = 2.4e7;
    b.state.w = {Vec3(10, 60, -80)};
    b.state.eps_rate = {20 * Vec6(b.state.eps_rate[0])};
    const double start = b.energy();
    double most = 0;
    for (int n = 0; n * h < 0.1; ++n) {
      b.step(h);
      most = std::max(most, std::abs(b.energy() / start - 1));
    }
    EXPECT_LT(most, 20 * h) << "h " << h;
  }
}

}  // namespace
}  // namespace talus::dda
