// What rows read within a step.
#include <gtest/gtest.h>

#include <memory>

#include "coupling/motion/motion.hpp"
#include "helpers/shapes.hpp"

namespace talus::coupling {
namespace {

/// A cube whose step goes all the way by the velocity of its end, as those of large islands do, falls: its
/// momentum goes with its weight, and no row has more energy than the start. With the end's velocity from the
/// start on a row told of the energy that the fall was yet to give, 930 J of a collapsing arch of 40 kJ.
TEST(Motion, RowsWithinAStepHaveNoMoreEnergyThanItsEnds) {
  constexpr double h = 0.05, spin = 3;
  dda::Model model;
  dda::Model::Block& block = model.blocks.emplace_back();
  block.shape = std::make_shared<Polyhedron>(test::unit_cube());
  block.mass = 2500, block.volume = 1;
  block.second_moment = 2500.0 / 12 * Mat3::Identity(), block.inertia = 2500.0 / 6 * Mat3::Identity();
  dda::BlockState start, end;
  end.v = h * model.gravity;
  end.c = h * end.v;
  start.w = Vec3(0, 0, spin), end.w = Vec3(0, 0, 0.5 * spin);
  end.q = Quat(Eigen::AngleAxisd(h * 0.5 * spin, Vec3::UnitZ()));
  const MotionSegment segment = motion_segment(model, 0, 0, h, start, end);
  ASSERT_EQ(segment.path, MotionSegment::Path::straight);
  const auto energy = [&](const dda::BlockState& s) {
    const dda::BlockEnergy e = dda::energy(block, model.gravity, s);
    return e.translational + e.rotational + e.potential;
  };
  for (const double r : {0.01, 0.25, 0.5, 0.9}) {
    const dda::BlockState now = evaluate(segment, r * h, model);
    EXPECT_LT((now.v - r * h * model.gravity).norm(), 1e-12) << r;
    EXPECT_NEAR(now.w.z(), spin * (1 - 0.5 * r), 1e-12) << r;
    EXPECT_LT(energy(now), energy(start)) << r;
  }
}

}  // namespace
}  // namespace talus::coupling
