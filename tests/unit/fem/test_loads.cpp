// Loads on patches of the surface that cut through faces.
#include <gtest/gtest.h>

#include "fem/setup.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

TEST(PatchLoads, TakeTheAreaInsideTheRegionWhereverTheEdgesLie) {
  for (const double margin : {0.0, 0.01, 0.0431, 0.17}) {
    StructureSpec s = cantilever(6, 48);
    StructureSpec::Load load;
    load.region = Box3(Vec3(-0.76, -0.5 - margin, 6.5 - margin), Vec3(-0.74, 0.5 + margin, 7.5 + margin));
    load.traction = Vec3(2e6, 0, 0);
    s.loads.push_back(load);
    const HexMesh mesh = test::active_cells(s);
    const std::vector<char> live(mesh.hexes.size(), 1);
    const PatchLoad found = find_loads(s, mesh, skin(mesh, live)).at(0);
    const double expected = (1 + 2 * margin) * (1 + 2 * margin);
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
    for (std::size_t k = 0; k < found.node.size(); ++k) {
      force += found.force[k];
      moment += (mesh.nodes[found.node[k]] - Vec3(-0.75, 0, 7)).cross(found.force[k]);
    }
    EXPECT_NEAR(found.area / expected, 1, 1e-5) << margin;  // the region is widened by 1e-7 of the structure
    EXPECT_NEAR(force.x() / (2e6 * expected), 1, 1e-5) << margin;
    EXPECT_LT(moment.norm(), 1e-4 * force.x()) << margin;
  }
}

// A pier that stands under its weight is not at rest under a load that is there from the start, with or
// without a history: it swings to twice the static deflection.
TEST(PatchLoads, OneThatIsConstantMovesWhatStandsUnderItsWeight) {
  using History = std::vector<std::pair<double, double>>;
  for (const History& history : {History{}, History{{0, 1}}, History{{0, 0}}}) {
    StructureSpec s = cantilever(2, 16);
    s.gravity_preload = true;
    StructureSpec::Load load;
    load.region = Box3(Vec3(-0.76, -0.8, 11), Vec3(-0.74, 0.8, 12));
    load.traction = Vec3(1e5, 0, 0);
    load.history = history;
    s.loads.push_back(load);
    FemStructure pier(s, Vec3(0, 0, -9.81), silent);
    const bool pushed = history.empty() || history[0].second != 0;
    EXPECT_EQ(pier.quiet(), !pushed) << history.size();
    if (!pushed) continue;
    double most = 0;
    for (int k = 0; k < 20; ++k) {  // half a period is 0.081 s
      pier.advance_alone(0.01 * k, 0.01);
      most = std::max(most, pier.skin().probe_displacements()[0].x());
    }
    const double bending = 33.55e9 * std::pow(1.5, 4) / 12,
                 at_rest = 1.5e5 * 11.5 * 11.5 * (3 * 12 - 11.5) /
                           (6 * bending);  // of the top under a force at 11.5 m
    EXPECT_NEAR(most, 2 * at_rest, 0.2 * at_rest);
  }
}

// What presses on a damped pier by impulses, as a block does, and a traction of the same size bring the same
// base force. Impulses met the nodes' mass alone and all other forces the mass and the damping: alpha h / 2,
// here 2 %, was missing.
TEST(PatchLoads, ImpulsesPressAsTractionsDo) {
  StructureSpec s = cantilever(1, 4);
  s.size = Vec3(1, 1, 2);
  s.probes[0].at = Vec3(0, 0, 2);
  s.damping_ratio = 0.3;
  FemStructure pier(s, Vec3::Zero(), silent);
  const double h = 0.8 * pier.critical_step(), force = 1e6;
  std::vector<NodeImpulse> impulses;
  const TriangleSurface& skin = pier.skin().surface();
  for (std::size_t v = 0; v < skin.nodes.size(); ++v)
    if (skin.nodes[v].count == 1 && skin.vertices[v].z() > 1.99)
      impulses.push_back({skin.nodes[v].node[0], Vec3(0, 0, -0.25 * force * h)});
  ASSERT_EQ(impulses.size(), 4u);
  for (int i = 0; i < 3000; ++i) {
    pier.predict(i * h, h);
    pier.correct(i * h, h, impulses);
  }
  EXPECT_NEAR(pier.loads().base_force().z(), -force, 1e-6 * force);
  EXPECT_NEAR(pier.energy().damping_work, pier.energy().contact_work - pier.energy().elastic,
              1e-3 * pier.energy().elastic);
}

// With small strains weight and motion superpose: a velocity at the start swings a pier as far with gravity's
// preload as without.
TEST(InitialVelocity, MovesWhatStandsUnderItsWeight) {
  double most[2] = {0, 0};
  for (const bool weight : {false, true}) {
    StructureSpec s = cantilever(2, 16);
    s.gravity_preload = weight;
    s.initial_velocity = Vec3(1, 0, 0);
    FemStructure pier(s, weight ? Vec3(0, 0, -9.81) : Vec3(Vec3::Zero()), silent);
    EXPECT_FALSE(pier.quiet());
    for (int k = 0; k < 10; ++k) {
      pier.advance_alone(0.01 * k, 0.01);
      most[weight] = std::max(most[weight], pier.skin().probe_displacements()[0].x());
    }
  }
  EXPECT_GT(most[0], 0.03);
  EXPECT_NEAR(most[1], most[0], 1e-6 * most[0]);
}
