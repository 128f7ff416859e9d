// Members: section forces, shear resistance, push-down; piers of every section, decks of every kind.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/error.hpp"
#include "fem/members/members.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

TEST(Members, SectionForcesOfACantileverUnderItsWeightAcrossAndAlong) {
  // Gravity at an angle: every section carries what lies above, in planes of nodes (every second one) and
  // between them.
  StructureSpec s = cantilever(3, 20);
  s.gravity_preload = true;
  const double g = 9.81, across = 2.0, w = 2450 * 1.5 * 1.5;
  FemStructure pier(s, Vec3(across, 0, -g), silent);
  ASSERT_EQ(pier.loads().members().size(), 1u);
  const Member& m = pier.loads().members()[0];
  ASSERT_EQ(m.stations.size(), 9u);
  EXPECT_DOUBLE_EQ(m.length, 12);
  EXPECT_NEAR(m.volume, 27, 1e-9);
  const MemberState state = pier.loads().states()[0];
  for (int k = 0; k < 9; ++k) {
    const double above = 12 - m.stations[k];
    EXPECT_NEAR(state.axial[k], w * g * above, 1e-6 * w * g * 12) << k;
    EXPECT_NEAR(state.shear[k][0], w * across * above, 1e-6 * w * across * 12) << k;
    EXPECT_NEAR(state.shear[k][1], 0, 1e-6 * w * g * 12);
    EXPECT_NEAR(state.moment[k][1], w * across * above * above / 2, 1e-3 * w * across * 72) << k;
    EXPECT_NEAR(state.moment[k][0], 0, 1e-5 * w * across * 72 + 1);
  }
  EXPECT_NEAR(state.drift[0], w * across * std::pow(12, 4) / (8 * 33.55e9 * std::pow(1.5, 4) / 12),
              0.03 * state.drift[0]);
  EXPECT_EQ(m.shear_design[0], 0);  // no concrete
}

/// A beam on two lines at its ends under its weight q: V = q (L/2 - x), M = q x (L - x) / 2, at both ends, in
/// planes of nodes and between them, whatever the number of cells.
TEST(Members, SectionForcesOfASimpleBeamUnderItsWeight) {
  for (const int cells : {16, 20, 24, 25}) {
    StructureSpec s;
    s.name = "beam", s.kind = "box";
    s.young = 30e9, s.poisson = 0, s.density = 2500;
    s.size = Vec3(10, 1, 1);
    s.cells = {cells, 2, 2};
    for (const double x : {-5.0, 5.0})
      s.supports.push_back(
          {"", "", Box3(Vec3(x - 1e-3, -1, -0.501), Vec3(x + 1e-3, 1, -0.499)), {x < 0, true, true}});
    s.gravity_preload = true;
    FemStructure beam(s, Vec3(0, 0, -9.81), silent);
    const Member& m = beam.loads().members()[0];
    const MemberState state = beam.loads().states()[0];
    const double q = 2500 * 9.81, L = 10;
    const int vertical = std::abs(m.axis_x.z()) > 0.5 ? 0 : 1;
    const double sign = state.shear[0][vertical] > 0 ? 1 : -1,
                 turn = state.moment[4][1 - vertical] > 0 ? 1 : -1;
    for (std::size_t k = 0; k < m.stations.size(); ++k) {
      const double x = m.stations[k];
      EXPECT_NEAR(sign * state.shear[k][vertical], q * (L / 2 - x), 1e-5 * q * L) << cells << ' ' << k;
      EXPECT_NEAR(state.shear[k][1 - vertical], 0, 1e-5 * q * L) << cells << ' ' << k;
      EXPECT_NEAR(turn * state.moment[k][1 - vertical], q * x * (L - x) / 2, 2e-3 * q * L * L / 8)
          << cells << ' ' << k;
    }
  }
}

TEST(Members, ShearResistanceByHand) {
  // 1.5 m deep along x, 3 m wide; two rows of eight bars of 25 mm at +-0.65 m, stirrups of 12 mm each 0.2 m
  // with legs along x of 1.4 m.
  Pier pier;
  pier.shape.width = 1.5, pier.shape.depth = 3, pier.shape.length = pier.clear = 10;
  std::vector<rebar::Bar> bars;
  for (int side : {-1, 1})
    for (int i = 0; i < 8; ++i) {
      rebar::Bar b;
      b.diameter = 0.025;
      b.points = {Vec3(side * 0.65, -1.4 + 0.4 * i, 0.05), Vec3(side * 0.65, -1.4 + 0.4 * i, 9.95)};
      bars.push_back(b);
    }
  for (int i = 0; i < 50; ++i) {
    rebar::Bar b;
    b.diameter = 0.012;
    const double z = 0.1 + 0.2 * i;
    b.points = {Vec3(-0.7, -1.45, z), Vec3(0.7, -1.45, z), Vec3(0.7, 1.45, z), Vec3(-0.7, 1.45, z),
                Vec3(-0.7, -1.45, z)};
    bars.push_back(b);
  }
  const rebar::ShearInput in = shear_input(pier, bars, 5.0, 0, 2e6);
  EXPECT_DOUBLE_EQ(in.width, 3);
  EXPECT_NEAR(in.effective_depth, 0.75 + 0.65, 1e-12);
  EXPECT_NEAR(in.tension_area, 8 * M_PI / 4 * 0.025 * 0.025, 1e-12);
  EXPECT_NEAR(in.stirrup_area_per_length, 2 * M_PI / 4 * 0.012 * 0.012 / 0.2, 1e-12);
  const rebar::ShearResistance r = rebar::shear_resistance(in, {30e6, 1.2, 1.0, 1.0});
  // V_Rd,s = A_sw/s z f_ywd cot t with cot t = 2.5, z = 1.26 m: 1.131e-3 x 1.26 x 500e6 x 2.5 = 1.78 MN
  EXPECT_NEAR(r.stirrups, 1.78e6, 0.002 * 1.78e6);
  // V_Rd,c = (0.15 k (100 rho f_ck)^(1/3) + 0.15 s_cp) b d, k 1.378, rho 0.000935: (0.15 x 1.378 x 1.411 +
  // 0.15 x 0.444) x 4.2 = 1.505 MN; the least value (0.035 k^1.5 f_ck^0.5 + 0.15 s_cp) = 0.377: 1.583 MN
  // governs
  EXPECT_NEAR(r.concrete, 1.583e6, 0.01e6);
}

namespace {
constexpr double two_legs = 2 * M_PI / 4 * 0.012 * 0.012;

/// A square column of `size`, its ties of 12 mm at `levels`.
std::pair<Pier, std::vector<rebar::Bar>> tied(double size, double height, const std::vector<double>& levels) {
  Pier pier;
  pier.shape.width = pier.shape.depth = size, pier.shape.length = pier.clear = height;
  std::vector<rebar::Bar> ties;
  const double a = size / 2 - 0.046;
  for (double z : levels) {
    rebar::Bar b;
    b.diameter = 0.012;
    b.points = {Vec3(-a, -a, z), Vec3(a, -a, z), Vec3(a, a, z), Vec3(-a, a, z), Vec3(-a, -a, z)};
    ties.push_back(b);
  }
  return {pier, ties};
}
}  // namespace

// EN 1992-1-1 6.2.3: A_sw / s of regular stirrups, whatever the spacing, the height of the column and the
// section asked for.
TEST(Members, StirrupsByRuleGiveTheirAreaOverTheirSpacing) {
  for (double spacing : {0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6})
    for (double height : {2.0, 3.0, 3.1, 3.37}) {
      rebar::Member m;
      m.width = m.depth = 0.4, m.length = height;
      Pier pier;
      pier.shape = m, pier.clear = height;
      rebar::StirrupRule rule;
      rule.diameter = 0.012, rule.cover = 0.04, rule.spacing = spacing;
      const auto ties = rebar::stirrups(m, rule);
      for (double at : {0.0, 0.1, 0.25 * height, 0.5 * height, height - 0.03, height})
        EXPECT_NEAR(shear_input(pier, ties, at, 0, 0).stirrup_area_per_length / (two_legs / spacing), 1, 1e-9)
            << spacing << ' ' << height << ' ' << at;
    }
}

TEST(Members, StirrupsAtUnevenLevelsShareTheLengthBetweenThem) {
  // By turns 0.1 and 0.3 m apart: 0.2 m each. Then none from 2.1 m on: a tie stands for one spacing beyond
  // it, no more.
  const auto [pier, ties] = tied(0.4, 6, {0.1, 0.2, 0.5, 0.6, 0.9, 1.0, 1.3, 1.4, 1.7, 1.8, 2.1});
  EXPECT_NEAR(shear_input(pier, ties, 1.0, 0, 0).stirrup_area_per_length, two_legs / 0.2, 1e-9);
  EXPECT_EQ(shear_input(pier, ties, 4.0, 1, 0).stirrup_area_per_length, 0);
  // Two ties at one level, the second a diameter above, count both; so do the turns of a spiral that is one
  // bar.
  auto [same, double_ties] = tied(
      0.4, 3, {0.15, 0.162, 0.45, 0.462, 0.75, 0.762, 1.05, 1.062, 1.35, 1.362, 1.65, 1.662, 1.95, 1.962});
  EXPECT_NEAR(shear_input(same, double_ties, 1.1, 0, 0).stirrup_area_per_length, 2 * two_legs / 0.3, 1e-9);
  rebar::Bar spiral;
  spiral.diameter = 0.012;
  for (int i = 0; i <= 4 * 20; ++i)
    spiral.points.push_back(Vec3((i + 1) / 2 % 2 ? 0.154 : -0.154, i / 2 % 2 ? 0.154 : -0.154, 0.15 * i / 4));
  EXPECT_NEAR(shear_input(same, {spiral}, 1.5, 0, 0).stirrup_area_per_length, two_legs / 0.15,
              0.01 * two_legs / 0.15);
}

TEST(Members, ShearInputOfARoundAndAHollowPier) {
  Pier pier;
  pier.shape.width = pier.shape.depth = 2, pier.clear = pier.shape.length = 8;
  pier.wall = 0.3;
  const rebar::ShearInput hollow = shear_input(pier, {}, 4, 0, 0);
  EXPECT_DOUBLE_EQ(hollow.width, 0.6);
  EXPECT_NEAR(hollow.gross_area, 4 - 1.4 * 1.4, 1e-12);
  pier.wall = 0;
  pier.shape.section = rebar::Member::Section::round;
  const rebar::ShearInput round = shear_input(pier, {}, 4, 0, 0);
  // d = r + 2 r_s / pi with r_s = 0.9 r; the segment of that depth has 2.476 m^2 (of pi)
  EXPECT_NEAR(round.effective_depth, 1.573, 1e-3);
  EXPECT_NEAR(round.width * round.effective_depth, 2.650, 0.01);
}

namespace {
StructureSpec short_column() {
  StructureSpec s;
  s.name = "column";
  s.kind = "column";
  s.f_cm = 38e6;
  s.density = 2450;
  s.size = Vec3(0.4, 0.4, 1.6);
  s.cells = {2, 2, 8};
  s.damage = "concrete";
  s.supports.push_back({"-z", "", {}, {true, true, true}});
  s.rebar_rules.push_back({"longitudinal", "pier", 4, 0.025, 0.04, 0, 500e6, 0.05, 0});
  s.rebar_rules.push_back({"stirrups", "pier", 0, 0.010, 0.04, 0.1, 500e6, 0.05, 0});
  return s;
}
}  // namespace

TEST(PushDown, OfASoundColumnIsItsConcreteAndSteel) {
  std::vector<std::string> told;
  FemStructure column(short_column(), Vec3(0, 0, -9.81),
                      [&told](const std::string& line) { told.push_back(line); });
  std::vector<double> before, after;
  column.save(before);
  const PushDown p = column.capacity().push_down().at(0);
  column.save(after);
  EXPECT_EQ(before, after);  // the structure itself is left alone
  const double steel = 4 * M_PI / 4 * 0.025 * 0.025, stress = std::min(500e6, 0.0023 * 200e9);
  const double expected = 0.16 * 38e6 + steel * stress;
  EXPECT_NEAR(p.capacity / expected, 1, 0.03);
  EXPECT_NEAR(p.at / 1.6, 2.3e-3, 0.4e-3);
  EXPECT_LT(p.curve.back()[1], 0.95 * p.capacity);  // it has passed its peak
  // What nothing has harmed is not pressed again.
  EXPECT_EQ(column.capacity().push_down().at(0).curve, p.curve);
  EXPECT_NE(told.back().find("unharmed"), std::string::npos) << told.back();
}

TEST(PushDown, OfACrushedColumnIsLower) {
  StructureSpec s = short_column();
  // A pulse of 10 MPa on the right half of one side at mid-height.
  StructureSpec::Load load;
  load.region = Box3(Vec3(-0.201, -0.3, 0.59), Vec3(-0.199, 0.3, 1.01));
  load.traction = Vec3(10e6, 0, 0);
  load.history = {{0, 0}, {0.5e-3, 1}, {2e-3, 1}, {2.5e-3, 0}};
  s.loads.push_back(load);
  FemStructure column(s, Vec3(0, 0, -9.81), silent);
  const double sound = column.capacity().push_down().at(0).capacity;
  const double h = column.critical_step();
  double t = 0;
  for (; t < 6e-3; t += h) column.predict(t, h), column.correct(t, h, {});
  ASSERT_GT(column.damage().largest, 0.9);
  const double now = column.capacity().push_down().at(0).capacity;

  EXPECT_LT(now, 0.95 * sound);
  EXPECT_GT(now, 0.05 * sound);
}

TEST(PushDown, NeedsADamageLawAndAMember) {
  EXPECT_THROW(FemStructure(cantilever(1, 4), Vec3::Zero(), silent).capacity().push_down(), InputError);
}

namespace {
StructureSpec viaduct(std::vector<std::pair<std::string, double>> parameters) {
  StructureSpec s;
  s.name = "V";
  s.kind = "viaduct";
  s.young = 33.55e9;
  s.density = 2450;
  s.cell_size = 1.0;
  s.supports.push_back({"-z", "", {}, {true, true, true}});
  s.parameters = {{"spans", 2},        {"span_length", 12}, {"pier_height", 6},
                  {"pier_width", 1.6}, {"pier_depth", 1.6}, {"cap_width", 2.4}};
  s.parameters.insert(s.parameters.end(), parameters.begin(), parameters.end());
  return s;
}

double mesh_volume(const FemStructure& f) {
  const std::vector<double> v = cell_volumes(f.mesh());
  return std::accumulate(v.begin(), v.end(), 0.0);
}
}  // namespace

TEST(ViaductShapes, VolumeWeightAndRestOfEverySectionAndDeck) {
  const double pi = 3.14159265358979323846, caps = 3 * 2.4 * 8 * 1.0, solid = 2 * (12 - 0.05) * 8 * 1.5;
  struct Case {
    const char* name;
    StructureSpec spec;
    double volume;
  };
  std::vector<Case> cases;
  cases.push_back({"rectangular", viaduct({}), 3 * 6 * 1.6 * 1.6 + caps + solid});
  StructureSpec round = viaduct({});
  round.section = "round";
  cases.push_back({"round", round, 3 * 6 * pi * 0.64 + caps + solid});
  StructureSpec pairs = viaduct({{"piers_per_bent", 2}, {"pier_spacing", 4}});
  pairs.section = "round";
  cases.push_back({"pairs of round piers", pairs, 6 * 6 * pi * 0.64 + caps + solid});
  StructureSpec by_diameter = viaduct({{"pier_diameter", 1.6}});
  by_diameter.section = "round";
  std::erase_if(by_diameter.parameters,
                [](const auto& p) { return p.first == "pier_width" || p.first == "pier_depth"; });
  cases.push_back({"round by pier_diameter", by_diameter, 3 * 6 * pi * 0.64 + caps + solid});
  StructureSpec hollow = viaduct({});
  hollow.section = "hollow";
  hollow.wall_thickness = 0.3;
  cases.push_back({"hollow", hollow, 3 * 6 * (1.6 * 1.6 - 1.0) + caps + solid});
  cases.push_back({"T-girders", viaduct({{"girders", 4}, {"girder_width", 0.5}, {"slab_thickness", 0.3}}),
                   3 * 6 * 1.6 * 1.6 + caps + 2 * 11.95 * (8 * 0.3 + 4 * 0.5 * 1.2)});
  cases.push_back(
      {"box girder",
       viaduct({{"girders", 2}, {"girder_width", 0.5}, {"slab_thickness", 0.3}, {"bottom_slab", 0.25}}),
       3 * 6 * 1.6 * 1.6 + caps + 2 * 11.95 * (8 * 0.3 + 2 * 0.5 * 1.2 + (4 - 0.5) * 0.25)});
  // On skew supports cap beams are longer; on a grade piers are higher from one to the next.
  const double skew = 0.6, grade = 0.03, skew_caps = caps / std::cos(skew);
  cases.push_back({"skew", viaduct({{"skew", skew}}), 3 * 6 * 1.6 * 1.6 + skew_caps + solid});
  cases.push_back({"grade", viaduct({{"grade", -grade}}), (18 - 36 * grade) * 1.6 * 1.6 + caps + solid});
  StructureSpec both = viaduct({{"skew", -skew}, {"grade", grade}, {"girders", 4}, {"girder_width", 0.5}});
  both.section = "round";
  both.rotation = Eigen::AngleAxisd(1.1, Vec3::UnitZ()).toRotationMatrix();
  both.position = Vec3(300, -200, 50);
  cases.push_back({"skew girders on a grade", both,
                   (18 + 36 * grade) * pi * 0.64 + skew_caps + 2 * 11.95 * (8 * 0.3 + 4 * 0.5 * 1.2)});
  for (const Case& c : cases) {
    FemStructure bridge(c.spec, Vec3(0, 0, -9.81), silent);
    EXPECT_NEAR(mesh_volume(bridge), c.volume, 1e-6 * c.volume) << c.name;
    const double weight = 2450 * 9.81 * c.volume;
    EXPECT_NEAR(bridge.loads().base_force().z(), -weight, 1e-6 * weight) << c.name;
    EXPECT_TRUE(bridge.quiet()) << c.name;
    EXPECT_TRUE(bridge.take_fragments().empty()) << c.name;
    double carried = 0;
    for (const Member& m : bridge.loads().members()) carried += m.span ? 0 : m.axial_preload;
    EXPECT_NEAR(carried, weight, 0.02 * weight) << c.name;  // less half the lowest layer of each pier
  }
}

/// A skew slab rests on its obtuse corners: at the first support, whose line is turned anticlockwise, the
/// corner to the right of the axis is obtuse, at the second one that to the left. The mirror image bears the
/// same.
TEST(ViaductShapes, SkewDecksRestOnTheirObtuseCorners) {
  std::array<double, 4> last{};
  for (const double skew : {0.0, 0.7, -0.7}) {
    StructureSpec s = viaduct({{"piers_per_bent", 2}, {"pier_spacing", 5}, {"skew", skew}});
    std::erase_if(s.parameters, [](const auto& p) { return p.first == "spans"; });
    s.parameters.emplace_back("spans", 1);
    s.cell_size = 0.8;
    FemStructure bridge(s, Vec3(0, 0, -9.81), silent);
    std::array<double, 4> carried{};  // P1.1 and P1.2, to the right and left of the axis; P2.1 and P2.2
    const std::vector<Member>& members = bridge.loads().members();
    for (std::size_t k = 0; k < 4; ++k) carried[k] = members[k].axial_preload;
    EXPECT_NEAR(carried[0], carried[3], 1e-3 * carried[0]) << skew;
    EXPECT_NEAR(carried[1], carried[2], 1e-3 * carried[1]) << skew;
    if (skew == 0) {
      EXPECT_NEAR(carried[0], carried[1], 1e-3 * carried[0]);
    } else if (skew > 0) {
      EXPECT_GT(carried[0], 1.1 * carried[1]);
    } else {
      for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(carried[k], last[k ^ 1], 1e-3 * carried[k]);
    }
    last = carried;
  }
}

/// Piers stand on the lines of the supports, decks end along them, and no deck touches a cap beam.
TEST(ViaductShapes, SkewAndGradeArePlacedByTheirAngles) {
  const double skew = 0.5, grade = 0.04;
  const StructureSpec s = viaduct(
      {{"piers_per_bent", 2}, {"pier_spacing", 5}, {"skew", skew}, {"grade", grade}, {"deck_width", 10}});
  const ViaductPlan plan = viaduct_plan(s);
  ASSERT_EQ(plan.piers.size(), 6u);
  for (std::size_t k = 0; k < 6; ++k) {
    const double x = 12.0 * static_cast<double>(k / 2), along = k % 2 == 0 ? -2.5 : 2.5;
    EXPECT_NEAR(
        (plan.piers[k].shape.base - Vec3(x - along * std::sin(skew), along * std::cos(skew), 0)).norm(), 0,
        1e-12);
    EXPECT_NEAR(plan.piers[k].clear, 6 + grade * x, 1e-12);
  }
  EXPECT_NEAR((plan.soffits[1].end - plan.soffits[1].start - 11.95 * Vec3(1, 0, grade)).norm(), 0, 1e-12);
  const HexMesh mesh = make_mesh(s);
  double lowest = 1e9;  // of the second deck over the cap beam that it shares with the first
  for (std::size_t c = 0; c < mesh.hexes.size(); ++c)
    for (const int n : mesh.hexes[c]) {
      const Vec3& x = mesh.nodes[static_cast<std::size_t>(n)];
      if (mesh.component[c] != 4) continue;
      const double from_support = (x.x() - 12) * std::cos(skew) + x.y() * std::sin(skew);
      EXPECT_GT(from_support, 0);
      if (from_support < 1.2) lowest = std::min(lowest, x.z());
    }
  EXPECT_GT(lowest, 6 + grade * 12 + 1.0);
  StructureSpec reinforced = s;  // bars by rule lie within their parts, or this throws
  reinforced.f_cm = 38e6, reinforced.young = 0;
  for (const char* part : {"pier", "cap", "deck"})
    reinforced.rebar_rules.push_back({"longitudinal", part, 8, 0.02, 0.05, 0, 500e6, 0.05, 0});
  EXPECT_NO_THROW(FemStructure(reinforced, Vec3(0, 0, -9.81), silent));
  for (const auto& [key, value] : {std::pair{"skew", 1.4}, {"grade", 0.6}, {"grade", 0.09}})
    EXPECT_THROW(viaduct_plan(viaduct({{key, value}})), InputError) << key;
}

/// A simple span under its weight, w each metre between pads that stand a from its ends: M = w (L^2 / 8 - a L
/// / 2) in the middle, V = w (L / 2 - x).
TEST(ViaductShapes, SpansAreMembers) {
  StructureSpec s = viaduct({{"girders", 4}, {"girder_width", 0.5}, {"slab_thickness", 0.3}});
  s.young = 0, s.f_cm = 38e6, s.cell_size = 0.5;
  s.rebar_rules.push_back({"longitudinal", "deck", 4, 0.032, 0.05, 0, 500e6, 0.05, 0});
  FemStructure bridge(s, Vec3(0, 0, -9.81), silent);
  ASSERT_EQ(bridge.loads().members().size(), 5u);
  const Member& span = bridge.loads().members()[3];
  EXPECT_EQ(span.name, "S1");
  EXPECT_TRUE(span.span);
  EXPECT_NEAR(span.length, 11.95, 1e-9);
  const double area = 8 * 0.3 + 4 * 0.5 * 1.2, load = 2450 * 9.81 * area,
               rest = std::min(0.4 * (2.4 - 0.05), 0.6);
  EXPECT_NEAR(span.volume, area * 11.95, 1e-6 * span.volume);
  const MemberState state = bridge.loads().states()[3];
  EXPECT_NEAR(std::abs(state.moment[4][0]), load * (11.95 * 11.95 / 8 - rest / 2 * 11.95 / 2),
              0.05 * load * 11.95 * 11.95 / 8);
  EXPECT_NEAR(std::abs(state.shear[2][1]), load * 11.95 / 4,
              0.15 * load * 11.95 / 2);  // less the weight of one layer of cells
  EXPECT_LT(state.drift[1], 0);
  EXPECT_EQ(state.ends_unseated, 0);
  // EN 1992-1-1 6.2.2 without ties: d = 1.5 - 0.05 - 0.016 m, b_w the four webs, 16 bars below.
  const double d = 1.5 - 0.066, k = 1 + std::sqrt(0.2 / d), ratio = 16 * M_PI / 4 * 0.032 * 0.032 / (2.0 * d);
  EXPECT_NEAR(span.shear_design[1], 0.18 / 1.2 * k * std::cbrt(100 * ratio * 30) * 1e6 * 2.0 * d, 0.02e6);
  EXPECT_EQ(bridge.loads().members()[0].span, false);
}

/// A force on one pier of three: the base moment is that pier's, about its own foot.
TEST(ViaductShapes, BaseMomentIsOfOnePierAboutItsFoot) {
  StructureSpec s = viaduct({{"spans", 2}});
  s.cell_size = 0.8;
  s.damping_ratio = 0.5;
  StructureSpec::Load load;  // 1 MPa on a band of the second pier
  load.region = Box3(Vec3(11.19, -0.9, 2), Vec3(11.21, 0.9, 4));
  load.traction = Vec3(0, 1e5, 0);
  load.history = {{0, 0}, {0.3, 1}, {10, 1}};
  s.loads.push_back(load);
  FemStructure bridge(s, Vec3(0, 0, -9.81), silent);
  bridge.advance_alone(0, 0.6);
  const LoadPeaks p = bridge.loads().peaks();
  EXPECT_EQ(p.moment_member, 1);
  EXPECT_NEAR((p.moment_at - Vec3(12, 0, 0)).norm(), 0, 1e-9);
  const double force = bridge.loads().base_force().y();  // all of it
  EXPECT_GT(p.moment.value, 1.0 * std::abs(force));
  EXPECT_LT(p.moment.value, 4.5 * std::abs(force));  // the arm is 3 m, not the 12 m to the end of the bridge
}

/// Elastic concrete that is bent beyond f_t says so: sigma = 6 M / (b h^2), at the outer points of four cells
/// across 1 - (1 - 1/sqrt(3))/4 of it, and as much less up the first of 24 along.
TEST(Members, ElasticConcreteSaysWhatItBears) {
  for (const double factor : {0.2, 1.25, 2.0}) {
    StructureSpec s = cantilever(4, 24);
    s.f_cm = 38e6, s.young = 0, s.damage = "none";
    s.gravity_preload = false;
    StructureSpec::Load load;
    load.region = Box3(Vec3(-10, -10, s.size.z() - 1e-3), Vec3(10, 10, s.size.z() + 1e-3));
    const double f_t = 2.896e6, depth = s.size.x();
    load.traction =
        Vec3(factor * f_t * depth / (6 * s.size.z()), 0, 0);  // of a square section: M = f_t h^3 / 6
    load.history = {{0, 0}, {0.5, 1}, {10, 1}};
    s.loads.push_back(load);
    FemStructure pier(s, Vec3::Zero(), silent);
    pier.advance_alone(0, 0.6);
    const StressPeak p = pier.loads().peaks().tension;
    EXPECT_NEAR(p.strength, f_t, 1e-3 * f_t);
    if (factor < 1) {
      EXPECT_LT(p.value, p.strength);
    } else {
      EXPECT_GT(p.value, p.strength);
      EXPECT_LT(p.at.z(), 0.2 * s.size.z());
      EXPECT_GT(p.share, 0);
      EXPECT_LT(p.share, 0.3);
    }
  }
}

TEST(ViaductShapes, PiersReachTheGround) {
  StructureSpec s = viaduct({{"deck_level", 12}});
  std::erase_if(s.parameters, [](const auto& p) { return p.first == "pier_height"; });
  s.ground = [](double x, double) { return 0.1 * x; };
  FemStructure bridge(s, Vec3(0, 0, -9.81), silent);
  ASSERT_EQ(bridge.loads().members().size(), 5u);  // three piers, two spans
  const double top = 12 - 1.5 - 0.1 - 1.0;
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(bridge.loads().members()[i].length, top - 0.1 * 12 * i, 1e-9);
  s.ground = [](double, double) { return std::nan(""); };
  EXPECT_THROW(FemStructure(s, Vec3(0, 0, -9.81), silent), InputError);
}

TEST(ViaductShapes, MeasuresThatDoNotFitAreErrors) {
  StructureSpec thick = viaduct({{"girders", 2}, {"slab_thickness", 0.9}, {"bottom_slab", 0.7}});
  EXPECT_THROW(FemStructure(thick, Vec3::Zero(), silent), InputError);
  StructureSpec alone = viaduct({{"bottom_slab", 0.3}});
  EXPECT_THROW(FemStructure(alone, Vec3::Zero(), silent), InputError);
  StructureSpec narrow = viaduct({});
  narrow.section = "round";
  for (auto& [key, value] : narrow.parameters)
    if (key == "cap_width") value = 1.65;
  EXPECT_THROW(FemStructure(narrow, Vec3::Zero(), silent), InputError);
  EXPECT_THROW(viaduct_plan(viaduct({{"pier_diameter", 1.6}})), InputError);  // not round
  StructureSpec twice = viaduct({{"pier_diameter", 1.5}});                    // and a pier_width of 1.6 m
  twice.section = "round";
  EXPECT_THROW(viaduct_plan(twice), InputError);
  // A deck's end rests on half of the cap beam less half of the joint of 5 cm: 0.975 m of 2 m.
  for (const double seat : {0.97, 0.98}) {
    StructureSpec long_seat = viaduct({{"bearing_seat", seat}});
    for (auto& [key, value] : long_seat.parameters)
      if (key == "cap_width") value = 2.0;
    if (seat < 0.975)
      EXPECT_NO_THROW(viaduct_plan(long_seat));
    else
      EXPECT_THROW(viaduct_plan(long_seat), InputError);
  }
  StructureSpec close = viaduct({});  // cap beams of 2 m every 2 m
  for (auto& [key, value] : close.parameters)
    if (key == "cap_width" || key == "span_length") value = 2.0;
  EXPECT_THROW(viaduct_plan(close), InputError);
}
