// A structure that its weight cracks stands: gravity came slowly, and what it cracked is in balance before the run begins.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

/// A beam of 6 x 0.3 x 0.4 m between walls, with a bar of 20 mm in each corner. Elastic, its weight w brings w L^2 / (12 W) at the walls: 1.1 MPa at 9.81 m/s^2, beyond f_t = 2.9 MPa from 26 m/s^2 on.
StructureSpec beam_between_walls() {
  const std::string path = std::string(TALUS_BINARY_DIR) + "/preloaded_beam.csv";
  std::ofstream bars(path);
  bars << "bar,diameter,x,y,z,grade\n";
  for (const char* place : {"1,-0.1,0.05", "2,-0.1,0.35", "3,0.1,0.05", "4,0.1,0.35"})
    for (const char* x : {"-3", "3"}) bars << place[0] << ",0.02," << x << (place + 1) << ",B500B\n";
  bars.close();
  StructureSpec spec;
  spec.name = "beam";
  spec.kind = "box";
  spec.f_cm = 38e6;
  spec.poisson = 0.2;
  spec.density = 2450;
  spec.damage = "concrete";
  spec.aggregate = 0.016;
  spec.damping_ratio = 0.02;
  spec.size = Vec3(6, 0.3, 0.4);
  spec.cells = {40, 2, 6};
  spec.position = Vec3(0, 0, 0.2);
  spec.rebar_file = path;
  spec.supports = {{"-x", "", {}, {true, true, true}}, {"+x", "", {}, {true, true, true}}};
  return spec;
}

}  // namespace

/// It was left with the elastic answer, which its cracks do not balance: it shook from the start and could not fall asleep.
TEST(PreloadCracks, WhatCrackedUnderItsWeightStands) {
  const double g = 40;
  FemStructure s(beam_between_walls(), Vec3(0, 0, -g), silent);
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
