// When a structure that rings alone goes on in its modes.
#include <gtest/gtest.h>

#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

TEST(ModalChoice, ModesAreSoughtOnceStepsAloneHaveCostAsMuch) {
  StructureSpec s = cantilever(2, 16);
  s.initial_velocity = Vec3(0.01, 0, 0);
  FemStructure pier(s, Vec3::Zero(), silent);
  const double stretch = 500 * pier.critical_step();
  int explicit_stretches = 0;
  std::string how = "explicit";
  for (double t = 0; how == "explicit" && t < 40 * stretch; t += stretch) {
    how = pier.advance_alone(t, stretch);
    explicit_stretches += how == "explicit" ? 1 : 0;
  }
  EXPECT_EQ(how, "modal");
  EXPECT_GE(explicit_stretches, 8);    // 4000 steps cost about as much as 24 modes of any structure
  EXPECT_LE(explicit_stretches, 12);
}
