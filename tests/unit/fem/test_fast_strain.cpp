// Cells that strain by many times their peak strain within one sub-step: what the forces did is what the law
// took.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "fem/materials/material_mc2010.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

constexpr double cell_edge = 0.1, face_area = cell_edge * cell_edge;

struct Torn {
  double dissipated, algorithmic, removed;
  std::string told;
};  // [J], [m^3]

/// One cell of 0.1 m, all nodes driven along z at a steady strain rate [1/s].
Torn drive(const char* law, double rate, double last_strain, bool rate_effect, double poisson = 1e-9) {
  StructureSpec s;
  s.name = "cell";
  s.kind = "box";
  s.f_cm = 38e6;
  s.poisson = poisson;  // 0 would stand for the one of concrete
  s.density = 2450;
  s.size = Vec3::Constant(cell_edge);
  s.position = Vec3::Constant(cell_edge / 2);
  s.cells = {1, 1, 1};
  s.damage = law;
  s.rate_effect = rate_effect;
  s.erosion = false;
  s.gravity_preload = false;
  s.supports = {{"-x", "", {}, {true, false, false}},
                {"-y", "", {}, {false, true, false}},
                {"-z", "", {}, {false, false, true}}};
  std::string told;
  FemStructure body(s, Vec3::Zero(), [&](const std::string& line) { told += line; });
  const double duration = std::abs(last_strain / rate);
  const int steps = std::max(10, static_cast<int>(std::ceil(duration / body.critical_step())));
  const double h = duration / steps;
  for (int i = 0; i <= steps; ++i) {  // one more: the books are those of the state before it
    const double t = i * h;
    body.predict(t, h);
    std::vector<NodeImpulse> push;
    for (int n = 0; n < 8; ++n) {
      const double height = body.mesh().nodes[n].z();
      if (std::isfinite(body.skin().node_mass(n)))
        push.push_back(
            {n, body.skin().node_mass(n) * (Vec3(0, 0, rate * height) - body.skin().predicted_velocity(n))});
    }
    body.correct(t, h, push);
  }
  const StructureEnergy e = body.energy();
  return {e.damage_work, e.algorithmic, body.damage().spalled, told};
}

}  // namespace

TEST(FastStrain, ATornCellTakesItsFractureEnergyAtAnyRate) {
  const double expected = material::mc2010({.f_cm = 38e6}, "cell").fracture_energy * face_area;
  for (const bool rate_effect : {false, true})
    for (const double rate : {1e1, 1e2, 1e3, 1e4}) {  // up to fifty peak strains per sub-step
      const Torn torn = drive("concrete", rate, 0.05, rate_effect);
      EXPECT_NEAR(torn.dissipated / expected, 1, 0.01) << rate << (rate_effect ? " with rate effect" : "");
      EXPECT_LT(std::abs(torn.algorithmic) / expected, 0.01)
          << rate << (rate_effect ? " with rate effect" : "");
    }
}

TEST(FastStrain, ForcesDoTheWorkOfPlasticFlow) {
  const Torn slow = drive("concrete-cdpm2", -10, -0.08, false, 0.2);
  for (const double rate : {-1e2, -1e3}) {
    const Torn fast = drive("concrete-cdpm2", rate, -0.08, false, 0.2);
    EXPECT_NEAR(fast.dissipated / slow.dissipated, 1, 0.03)
        << rate;  // its return is of first order in the increment
    EXPECT_LT(std::abs(fast.algorithmic) / slow.dissipated, 0.01) << rate;
  }
}

TEST(FastStrain, ForcesDoTheWorkOfCrushing) {
  for (const double poisson : {1e-9, 0.2}) {  // with sides that stand free of pressure, and confined
    const Torn slow = drive("concrete", -10, -0.08, false, poisson);
    for (const double rate : {-1e2, -1e3, -1e4}) {
      const Torn fast = drive("concrete", rate, -0.08, false, poisson);
      EXPECT_NEAR(fast.dissipated / slow.dissipated, 1, 0.01) << poisson << ' ' << rate;
      EXPECT_LT(std::abs(fast.algorithmic) / slow.dissipated, 0.01) << poisson << ' ' << rate;
    }
  }
}

TEST(FastStrain, WithoutErosionACellGoesOnceItIsTorn) {
  const Torn stretched = drive("concrete", 1e3, 0.70, false), torn = drive("concrete", 1e3, 0.76, false);
  EXPECT_EQ(stretched.removed, 0);
  EXPECT_EQ(stretched.told.find("removed"), std::string::npos);
  EXPECT_NEAR(torn.removed, cell_edge * cell_edge * cell_edge, 1e-12);
  EXPECT_NE(torn.told.find("although erosion is off"), std::string::npos);
}
