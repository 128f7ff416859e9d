// A structure that its weight cracks stands: gravity came slowly, and what it cracked is in balance before
// the run begins.
#include <gtest/gtest.h>

#include <algorithm>

#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

/// It was left with the elastic answer, which its cracks do not balance: it shook from the start and could
/// not fall asleep.
TEST(PreloadCracks, WhatCrackedUnderItsWeightStands) {
  const double g = 40;
  FemStructure s(beam_between_walls("preloaded_beam", 6), Vec3(0, 0, -g), silent);
  EXPECT_GT(s.damage().largest, 0.01);
  EXPECT_TRUE(s.quiet());
  EXPECT_EQ(s.advance_alone(0, 1), "asleep");
  const StructureEnergy before = s.energy();
  const double h = s.critical_step();
  double most = 0;
  for (int i = 0; i < 2000; ++i) {  // explicit steps all the same: nothing moves
    s.predict(i * h, h);
    s.correct(i * h, h, {});
    most = std::max(most, s.energy().kinetic);
  }
  EXPECT_LT(most, 1e-14 * before.elastic);
  EXPECT_LT(s.energy().damage_work - before.damage_work, 1e-9 * before.elastic);
  EXPECT_NEAR(s.loads().base_force().z(), -6 * 0.3 * 0.4 * 2450 * g,
              0.03 * 6 * 0.3 * 0.4 * 2450 * g);  // steel is heavier than what it takes the place of
}

/// Four prestressed bars shorten a column by P L / (E_c A_c + E_s A_s), at rest from the start, without
/// gravity as well. Without gravity there was no preload: the bars let go at t = 0.
TEST(PreloadCracks, PrestressIsInBalanceWithoutGravity) {
  const double stress = 1e9, area = 4 * M_PI * 0.02 * 0.02 / 4;
  const std::string path = std::string(TALUS_BINARY_DIR) + "/prestressed_column.csv";
  std::ofstream out(path);
  out << "bar,diameter,x,y,z,grade,prestress\n";
  for (const double x : {-0.15, 0.15})
    for (const double y : {-0.15, 0.15})
      for (const double z : {0.0, 2.0})
        out << "P" << x << y << ",0.02," << x << ',' << y << ',' << z << ",Y1770," << stress << '\n';
  out.close();
  for (const std::string damage : {"none", "concrete"}) {
    StructureSpec spec;
    spec.name = "column";
    spec.kind = "column";
    spec.f_cm = 38e6;
    spec.young = 30e9;
    spec.poisson = 0;
    spec.damage = damage;
    spec.aggregate = 0.016;
    spec.size = Vec3(0.5, 0.5, 2);
    spec.cells = {1, 1, 4};  // with a bar in each of several cells the top would not stay plane
    spec.rebar_file = path;
    spec.supports.push_back({"-z", "", {}, {true, true, true}});
    spec.probes.push_back({"top", Vec3(0, 0, 2)});
    FemStructure s(spec, Vec3::Zero(), silent);
    const double shortening = stress * area * 2 / (30e9 * 0.25 + 195e9 * area);
    EXPECT_NEAR(s.skin().probe_displacements()[0].z(), -shortening, 2e-3 * shortening) << damage;
    EXPECT_EQ(s.advance_alone(0, 1), "asleep") << damage;
    EXPECT_LT(s.loads().base_force().norm(), 1e-9 * stress * area) << damage;
  }
}
