// When a structure that rings alone goes on in its modes.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

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
  EXPECT_GE(explicit_stretches, 8);  // 4000 steps cost about as much as 24 modes of any structure
  EXPECT_LE(explicit_stretches, 12);
}

/// Most of what a blow on one node of a damped pier leaves is in modes that no search reaches. Once it has
/// decayed to a thousandth of what moved most the modes that are there go on: no search doubles them for
/// nothing.
TEST(ModalChoice, WhatModesLeaveOutDecays) {
  StructureSpec s = cantilever(3, 24);
  s.damping_ratio = 0.02;
  std::vector<std::string> told;
  FemStructure pier(s, Vec3::Zero(), [&](const std::string& text) { told.push_back(text); });
  const Structure::Snapshot all = pier.snapshot();
  std::vector<NodeImpulse> blow;
  for (int i = 0; i < static_cast<int>(all.nodes.size()); ++i) {
    const Vec3& x = all.nodes[static_cast<std::size_t>(i)];
    if (x.z() > 12 - 1e-9) blow.push_back({i, Vec3(30, 0, 0)});
    if ((x - Vec3(0.75, 0.75, 8)).norm() < 1e-6) blow.push_back({i, Vec3(0, 0, 2000)});
  }
  const double h = pier.critical_step(), stretch = 200 * h;
  pier.predict(0, h);
  pier.correct(0, h, blow);
  double t = h;
  const double start = pier.energy().kinetic;
  std::string how = "explicit";
  for (; how == "explicit" && t < 10; t += stretch) how = pier.advance_alone(t, stretch);
  EXPECT_EQ(how, "modal");
  EXPECT_EQ(told.size(), 2u)
      << told.back();  // 24 and 48 modes; without the wait 384, of which three times as many steps are worth
  EXPECT_LT(std::abs(pier.energy().algorithmic), 0.01 * start);
}
