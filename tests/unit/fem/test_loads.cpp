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
    const HexMesh mesh = make_mesh(s);
    const std::vector<char> live(mesh.hexes.size(), 1);
    const PatchLoad found = find_loads(s, mesh, skin(mesh, neighbours(mesh), live)).at(0);
    const double expected = (1 + 2 * margin) * (1 + 2 * margin);
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
    for (std::size_t k = 0; k < found.node.size(); ++k) {
      force += found.force[k];
      moment += (mesh.nodes[found.node[k]] - Vec3(-0.75, 0, 7)).cross(found.force[k]);
    }
    EXPECT_NEAR(found.area / expected, 1, 1e-5) << margin;   // the region is widened by 1e-7 of the structure
    EXPECT_NEAR(force.x() / (2e6 * expected), 1, 1e-5) << margin;
    EXPECT_LT(moment.norm(), 1e-4 * force.x()) << margin;
  }
}
