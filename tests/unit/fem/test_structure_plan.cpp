// What a structure is said to become before it is made, and what no machine has the memory for.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <fstream>

#include "core/error.hpp"
#include "fem/structure_plan.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using talus::fem::test::cantilever;

namespace {

StructureSpec planned_viaduct(double cell_size) {
  StructureSpec s;
  s.name = "V";
  s.kind = "viaduct";
  s.young = 30e9;
  s.cell_size = cell_size;
  s.section = "hollow";
  s.wall_thickness = 0.5;
  s.parameters = {{"spans", 2},        {"span_length", 40}, {"pier_height", 30},
                  {"pier_width", 2.5}, {"pier_depth", 4},   {"deck_width", 12},
                  {"deck_depth", 2.5}, {"girders", 4},      {"slab_thickness", 0.25},
                  {"cap_height", 1.5}, {"abutments", 1}};
  s.supports.push_back({"-z", "", {}, {true, true, true}});
  return s;
}

std::string problem_of(const StructureSpec& spec) {
  try {
    plan_of(spec, Vec3(0, 0, -9.81));
  } catch (const InputError& e) { return e.what(); }
  return "";
}

/// A process of its own: libraries of other tests have threads, which a fork leaves behind in whatever they
/// hold.
void begin_anew() { GTEST_FLAG_SET(death_test_style, "threadsafe"); }

void address_space(rlim_t bytes) {
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
}

rlim_t in_use() {
  std::ifstream statm("/proc/self/statm");
  rlim_t pages = 0;
  statm >> pages;
  return pages * 4096;
}

}  // namespace

TEST(StructurePlan, CountsWithoutACell) {
  const StructureSpec s = planned_viaduct(0.5);
  const StructurePlan plan = plan_of(s, Vec3(0, 0, -9.81));
  EXPECT_NEAR(plan.cells / static_cast<double>(make_mesh(s).hexes.size()), 1, 0.05);
  EXPECT_NE(plan.text.find("permanent load"), std::string::npos) << plan.text;
  StructureSpec box = cantilever(4, 32);
  EXPECT_EQ(plan_of(box, Vec3(0, 0, -9.81)).cells, 512);
  EXPECT_NE(plan_of(box, Vec3(0, 0, -9.81)).text.find("no static solution"), std::string::npos);
}

TEST(StructurePlan, SaysWhichCellsTheConcreteCannotHave) {
  StructureSpec s = cantilever(1, 6);
  s.f_cm = 38e6, s.damage = "concrete";
  EXPECT_NE(problem_of(s).find("snap back"), std::string::npos);
  s.cells = {2, 2, 16};  // of 0.75 m: the edges would do, the diagonals of 1.3 m do not
  EXPECT_NE(problem_of(s).find("along its diagonal"), std::string::npos);
  s.cells = {3, 3, 24};
  EXPECT_EQ(problem_of(s), "");
}

TEST(StructurePlan, RefusesWhatThereIsNoMemoryFor) {
  begin_anew();
  EXPECT_EXIT(
      {
        address_space(in_use() + (500ul << 20));
        const std::string said = problem_of(planned_viaduct(0.125));
        std::exit(said.find("structure.V.cell_size") != std::string::npos &&
                          said.find("GB are free") != std::string::npos
                      ? 0
                      : 1);
      },
      testing::ExitedWithCode(0), "");
}

TEST(StructurePlan, AFactorThatHasNoRoomIsAnErrorOfTheInput) {
  begin_anew();
  EXPECT_EXIT(
      {
        StructureSpec s = cantilever(20, 80);  // 105,840 degrees of freedom: a factor of some 700 MB
        s.gravity_preload = true;
        address_space(in_use() + (300ul << 20));
        int code = 1;
        try {
          FemStructure structure(s, Vec3(0, 0, -9.81), test::silent);
        } catch (const InputError& e) {
          code = std::string(e.what()).find("structure.pier.cells") != std::string::npos &&
                         std::string(e.what()).find("are free") != std::string::npos
                     ? 0
                     : 2;
        }
        std::exit(code);
      },
      testing::ExitedWithCode(0), "");
}

TEST(HeldEverywhere, NothingIsSolvedFor) {
  StructureSpec s = cantilever(4, 1);
  s.supports.push_back({"+z", "", {}, {true, true, true}});
  s.gravity_preload = true, s.damping_ratio = 0.02;
  FemStructure structure(s, Vec3(0, 0, -9.81), test::silent);
  EXPECT_EQ(structure.dofs(), 0);
  EXPECT_GT(structure.critical_step(), 0);
  EXPECT_TRUE(std::isfinite(structure.critical_step()));
  structure.advance_alone(0, 1e-3);
  EXPECT_EQ(structure.skin().probe_displacements()[0], Vec3::Zero());
}

/// Two columns of 12 and 12.05 m in one mesh: inverse iteration comes to the lower frequency by a factor of
/// 0.983 a step.
TEST(FirstFrequency, OfTwinsIsTheLower) {
  const std::string path = std::string(TALUS_BINARY_DIR) + "/twins.inp";
  {
    std::ofstream out(path);
    out << "*NODE\n";
    const int across = 2, along = 16;
    const auto number = [&](int tower, int i, int j, int k) {
      return 1 + ((tower * (along + 1) + k) * (across + 1) + j) * (across + 1) + i;
    };
    for (int tower = 0; tower < 2; ++tower)
      for (int k = 0; k <= along; ++k)
        for (int j = 0; j <= across; ++j)
          for (int i = 0; i <= across; ++i)
            out << number(tower, i, j, k) << ',' << 10 * tower + 0.75 * i << ',' << 0.5 * j << ','
                << k * (tower == 0 ? 12.05 : 12.0) / along << '\n';
    out << "*ELEMENT, TYPE=C3D8\n";
    int cell = 0;
    for (int tower = 0; tower < 2; ++tower)
      for (int k = 0; k < along; ++k)
        for (int j = 0; j < across; ++j)
          for (int i = 0; i < across; ++i) {
            out << ++cell;
            for (int up = 0; up < 2; ++up)
              out << ',' << number(tower, i, j, k + up) << ',' << number(tower, i + 1, j, k + up) << ','
                  << number(tower, i + 1, j + 1, k + up) << ',' << number(tower, i, j + 1, k + up);
            out << '\n';
          }
  }
  StructureSpec s = cantilever(2, 16);
  s.kind = "mesh", s.file = path, s.damping_ratio = 0.02, s.probes.clear();
  FemStructure both(s, Vec3::Zero(), test::silent);
  StructureSpec alone = cantilever(2, 16);
  alone.size = Vec3(1.5, 1.0, 12.05), alone.damping_ratio = 0.02;
  FemStructure taller(alone, Vec3::Zero(), test::silent);
  const auto said = [](const FemStructure& structure) {
    const std::string plan = structure.plan();
    const std::size_t at = plan.find("of the first mode, ");
    return at == std::string::npos ? std::string("none") : plan.substr(at, plan.find("Hz", at) - at);
  };
  EXPECT_EQ(said(both), said(taller));
}
