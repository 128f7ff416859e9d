// A structure that its weight cracks stands: gravity came slowly, and what it cracked is in balance before the run begins.
#include <gtest/gtest.h>

#include <algorithm>

#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

/// It was left with the elastic answer, which its cracks do not balance: it shook from the start and could not fall asleep.
TEST(PreloadCracks, WhatCrackedUnderItsWeightStands) {
  const double g = 40;
  FemStructure s(beam_between_walls("preloaded_beam", 6), Vec3(0, 0, -g), silent);
  EXPECT_GT(s.damage_max(), 0.01);
  EXPECT_TRUE(s.quiet());
  EXPECT_EQ(s.advance_alone(0, 1), "asleep");
  const StructureEnergy before = s.energy();
  const double h = s.critical_step();
  double most = 0;
  for (int i = 0; i < 2000; ++i) {   // explicit steps all the same: nothing moves
    s.predict(i * h, h);
    s.correct(i * h, h, {});
    most = std::max(most, s.energy().kinetic);
  }
  EXPECT_LT(most, 1e-14 * before.elastic);
  EXPECT_LT(s.energy().damage_work - before.damage_work, 1e-9 * before.elastic);
  EXPECT_NEAR(s.base_force().z(), -6 * 0.3 * 0.4 * 2450 * g, 0.03 * 6 * 0.3 * 0.4 * 2450 * g);   // steel is heavier than what it takes the place of
}
