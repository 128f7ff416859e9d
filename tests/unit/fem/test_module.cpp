// The structure module, and with it deal.II and CHOLMOD, is mapped when a structure is made, and not before.
#include <gtest/gtest.h>

#include <ctime>
#include <fstream>
#include <string>

#include "contact/structures/structure.hpp"
#include "core/error.hpp"

using namespace talus;

namespace {
bool mapped(const std::string& what) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);)
    if (line.find(what) != std::string::npos) return true;
  return false;
}

StructureSpec pier() {  // scene S5: a pier under a triangular pulse
  StructureSpec s;
  s.name = "P";
  s.kind = "column";
  s.young = 30e9;
  s.poisson = 0.2;
  s.density = 2500;
  s.size = Vec3(2, 2, 10);
  s.cells = {8, 8, 40};
  s.supports.push_back({"-z", "", {}, {true, true, true}});
  s.gravity_preload = false;
  s.probes.push_back({"top", Vec3(0, 0, 10)});
  StructureSpec::Load load;
  load.region = Box3(Vec3(-1.01, -0.5, 7.5), Vec3(-0.99, 0.5, 8.5));
  load.traction = Vec3(2e6, 0, 0);
  load.history = {{0, 0}, {0.005, 1}, {0.01, 0}};
  s.loads.push_back(load);
  return s;
}
}  // namespace

TEST(Module, IsMappedOnlyWhenAStructureIsMade) {
  ASSERT_FALSE(mapped("libdeal"));
  ASSERT_FALSE(mapped("libtalus_fem"));
  StructureSpec s = pier();
  s.cells = {2, 2, 4};
  const auto structure = load_structure(s, Vec3::Zero(), [](const std::string&) {});
  EXPECT_TRUE(mapped("libtalus_fem"));
  EXPECT_TRUE(mapped("libdeal"));
  EXPECT_EQ(structure->elements(), 16);
  s.section = "round";
  s.loads.clear();
  s.cells = {3, 3, 4};
  EXPECT_EQ(load_structure(s, Vec3::Zero(), [](const std::string&) {})->elements(),
            (3 * 3 + 12) * 4);  // a core of 3 x 3, a ring
}

TEST(Module, InputErrorsCrossItsBorder) {
  StructureSpec s = pier();
  s.kind = "pyramid";
  EXPECT_THROW(load_structure(s, Vec3::Zero(), [](const std::string&) {}), InputError);
}

// 4.108 mm at 27.3 ms: CalculiX, C3D8, implicit, the same mesh.
TEST(Module, PierUnderPulseAgreesWithCalculix) {
  for (const char* how : {"explicit", "auto"}) {
    StructureSpec s = pier();
    s.integrator = how;
    const auto structure = load_structure(s, Vec3::Zero(), [](const std::string&) {});
    double peak = 0, when = 0;
    for (int i = 0; i < 100; ++i) {
      const double dt = 5e-4;
      structure->advance_alone(i * dt, dt);
      const double u = structure->skin().probe_displacements()[0].x();
      if (u > peak) peak = u, when = (i + 1) * dt;
    }
    EXPECT_NEAR(peak, 4.108e-3, 0.005 * 4.108e-3) << how;
    EXPECT_NEAR(when, 27.3e-3, 0.5e-3) << how;
    const StructureEnergy e = structure->energy();
    EXPECT_NEAR(e.kinetic + e.elastic + e.damping_work, e.external_work, 1e-9 * e.external_work) << how;
  }
}
