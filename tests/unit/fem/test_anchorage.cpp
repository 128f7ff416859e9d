// Bars at what holds the structure: rules run to it, files are warned, and the base section yields where its
// steel says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "fem/members/members.hpp"
#include "fem/rebar/bar_anchorage.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

constexpr double bar_diameter = 0.02, cover = 0.03, side = 0.5, height = 1.5;
constexpr int bar_count = 8;

StructureSpec column() {
  StructureSpec s;
  s.name = "column";
  s.kind = "column";
  s.f_cm = 38e6;
  s.density = 2450;
  s.size = Vec3(side, side, height);
  s.cells = {4, 4, 12};
  s.damage = "concrete";
  s.rate_effect = false;
  s.supports.push_back({"-z", "", {}, {true, true, true}});
  s.rebar_rules.push_back({"longitudinal", "pier", bar_count, bar_diameter, cover, 0, 500e6, 0.05, 0});
  return s;
}

std::vector<std::string> warnings(const StructureSpec& spec) {
  std::vector<std::string> found;
  FemStructure structure(spec, Vec3::Zero(), [&](const std::string& line) {
    if (line.find("bars") != std::string::npos && line.starts_with("warning")) found.push_back(line);
  });
  return found;
}

/// Moment of the section without axial force when its outermost steel strains by `strain`: bars ideally
/// plastic, concrete by a parabola and a rectangle.
double section_moment(double strain) {
  const double at = side / 2 - cover - bar_diameter / 2, area = M_PI / 4 * bar_diameter * bar_diameter,
               f_c = 38e6, eps_c = 2.2e-3;
  const double rows[3] = {-at, 0, at};
  const int in_row[3] = {3, 2, 3};
  double low = -side / 2, high = 0.99 * at, moment = 0;  // of the neutral axis
  for (int k = 0; k < 60; ++k) {
    const double axis = 0.5 * (low + high), curvature = strain / (at - axis);
    double force = 0;
    moment = 0;
    for (int r = 0; r < 3; ++r) {
      const double f = in_row[r] * area * std::clamp(200e9 * curvature * (rows[r] - axis), -500e6, 500e6);
      force += f, moment += f * rows[r];
    }
    constexpr int strips = 2000;
    for (int i = 0; i < strips; ++i) {
      const double y = side * ((i + 0.5) / strips - 0.5), e = -curvature * (y - axis) / eps_c;
      if (e <= 0) continue;
      const double f = -f_c * (e < 1 ? 2 * e - e * e : 1) * side * side / strips;
      force += f, moment += f * y;
    }
    (force > 0 ? low : high) = axis;  // more compression is wanted: the axis moves towards the tension side
  }
  return moment;
}

}  // namespace

TEST(Anchorage, RulesRunToHeldSectionsOnly) {
  const auto ends = [](StructureSpec s) {
    const HexMesh mesh = make_mesh(s);
    rebar::Member m = find_piers(s).at(0).shape;
    mark_held_ends(m, mesh, find_supports(s, mesh));
    const rebar::Bar bar = rebar::longitudinal_bars(m, {bar_count, bar_diameter, cover, 0, {}}).at(0);
    return std::array{bar.points.front().z(), bar.points.back().z()};
  };
  StructureSpec s = column();
  EXPECT_EQ(ends(s)[0], 0);
  EXPECT_NEAR(ends(s)[1], height - cover, 1e-12);
  s.supports.push_back({"+z", "", {}, {true, true, true}});
  EXPECT_NEAR(ends(s)[1], height, 1e-12);
  s.supports = {{"-z", "", {}, {false, false, true}}};  // a roller holds no bar
  EXPECT_NEAR(ends(s)[0], cover, 1e-12);
}

TEST(Anchorage, FilesThatStopShortAreWarnedOf) {
  StructureSpec s = column();
  s.rebar_rules.clear();
  s.rebar_file = std::string(TALUS_BINARY_DIR) + "/anchorage.csv";
  const auto write = [&](double from) {
    std::ofstream(s.rebar_file) << "bar,diameter,x,y,z,grade\nL1,0.02,0.2,0.2," << from
                                << ",B500B\nL1,0.02,0.2,0.2,1.4,B500B\n";
  };
  write(0.05);
  const auto told = warnings(s);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("(L1) stops up to 0.05 m before a held face"), std::string::npos) << told[0];
  write(0);
  EXPECT_TRUE(warnings(s).empty());
}

TEST(Anchorage, TheBaseSectionYieldsWhereItsSteelSays) {
  StructureSpec s = column();
  const double arm = height - 0.0625, expected = section_moment(0.01);
  // On half a cell's height below the top, pushed slowly against the first period of some 8 ms.
  StructureSpec::Load load;
  load.region = Box3(Vec3(-side / 2 - 0.01, -side, height - 0.125 - 0.001),
                     Vec3(-side / 2 + 0.01, side, height + 0.001));
  load.traction = Vec3(1.3 * expected / arm / (side * 0.125), 0, 0);
  load.history = {{0, 0}, {0.2, 1}};
  s.loads.push_back(load);
  s.damping_ratio = 0.3;
  s.probes.push_back({"top", Vec3(0, 0, height)});
  FemStructure structure(s, Vec3::Zero(), silent);
  const double h = structure.critical_step();
  double most = 0, t = 0;
  for (long step = 0; t < 0.2 && structure.skin().probe_displacements()[0].x() < 0.02; ++step, t += h) {
    structure.predict(t, h), structure.correct(t, h, {});
    if (step % 50 == 0) most = std::max(most, std::abs(structure.loads().base_moment().y()));
  }
  EXPECT_GT(most / expected, 0.93);
  EXPECT_LT(most / expected, 1.15);
}

// A tied column pushed at its top bears the moment of its foot over its height; by rule M_Rd of the same
// section, as the hand calculation, and N_Rd = f_cd A_c + f_yd A_s.
TEST(Capacity, LateralForceIsTheMomentOfTheFootOverTheHeight) {
  StructureSpec s = column();
  s.rebar_rules.push_back({"stirrups", "pier", 0, 0.010, 0.02, 0.1, 500e6, 0.05, 0});
  FemStructure structure(s, Vec3::Zero(), silent);
  const SectionResistance rule = structure.capacity().section_resistances().at(0);
  const double hand = section_moment(0.01), steel = bar_count * M_PI / 4 * bar_diameter * bar_diameter;
  for (const int axis : {0, 1}) {
    EXPECT_NEAR(rule.mean.moment[static_cast<std::size_t>(axis)] / hand, 1, 0.05);
    EXPECT_LT(rule.design.moment[static_cast<std::size_t>(axis)],
              rule.mean.moment[static_cast<std::size_t>(axis)]);
  }
  EXPECT_NEAR(rule.design.compression / (side * side * 30e6 / 1.2 + steel * 400e6), 1,
              0.05);  // bars at 2 per mille
  EXPECT_NEAR(rule.design.tension / (steel * 500e6), 1, 1e-6);
  const std::vector<PushDown> over = structure.capacity().push_over();
  ASSERT_EQ(over.size(), 2u);
  EXPECT_EQ(over[1].axis, 1);
  for (const PushDown& p : over) {
    EXPECT_GT(p.capacity * height / hand, 0.9);
    EXPECT_LT(p.capacity * height / hand, 1.25);
  }
  EXPECT_NEAR(over[0].capacity / over[1].capacity, 1, 0.01);  // a square section
}
