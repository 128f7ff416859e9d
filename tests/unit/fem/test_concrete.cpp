// CDPM2 in a structure, history only where it is needed, and errors of concrete structures.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>

#include "core/error.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

/// A cube of one cell, 0.1 m, of the concrete of the reference values (f_c 30 MPa, f_t 3 MPa), on rollers
/// along three faces.
StructureSpec cube(const std::string& damage) {
  StructureSpec s;
  s.name = "cube";
  s.kind = "box";
  s.f_cm = 30e6;
  s.tensile_strength = 3e6;
  s.density = 2450;
  s.size = Vec3::Constant(0.1);
  s.position = Vec3::Constant(0.05);
  s.cells = {1, 1, 1};
  s.damage = damage;
  s.rate_effect = false;
  s.erosion = false;
  s.gravity_preload = false;
  s.supports = {{"-x", "", {}, {true, false, false}},
                {"-y", "", {}, {false, true, false}},
                {"-z", "", {}, {false, false, true}}};
  return s;
}

/// Greatest axial stress while the upper face moves down, the lateral faces kept at a pressure or moved in
/// proportion [Pa].
double peak_stress(const StructureSpec& spec, double pressure, double last_strain) {
  StructureSpec s = spec;
  // The pressure acts on all free faces, first alone; the axial drive comes on top of it.
  const double ramp = 2e-3, wide = 1;
  for (int axis = 0; axis < 2; ++axis) {
    StructureSpec::Load load;
    load.region = Box3(Vec3::Constant(-wide), Vec3::Constant(wide));
    load.region.min()[axis] = 0.0999;
    load.traction = -pressure * Vec3::Unit(axis);
    load.history = {{0, 0}, {ramp, 1}};
    s.loads.push_back(load);
  }
  FemStructure body(s, Vec3::Zero(), silent);
  std::vector<int> top;
  for (int n = 0; n < 8; ++n)
    if (body.mesh().nodes[n].z() > 0.05) top.push_back(n);
  const double h = body.critical_step(), rate = 0.2, area = 0.01;
  // Under the hydrostatic pressure alone the cube shortens by p (1 - 2 nu) / E along each axis.
  const double rest = pressure * (1 - 0.4) / (21.5e9 * std::cbrt(3.0));
  double peak = 0, t = 0, strain = 0;
  while (strain < last_strain) {
    body.predict(t, h);
    const double speed = t < ramp ? rest / ramp : rate;
    strain += speed * h;
    std::vector<NodeImpulse> push;
    for (int n : top) {
      const Vec3 v = body.skin().predicted_velocity(n);
      Vec3 p = -0.02 * body.skin().node_mass(n) * v;  // a little damping of the lateral motion
      p.z() = body.skin().node_mass(n) * (-speed * 0.1 - v.z());
      push.push_back({n, p});
    }
    body.correct(t, h, push);
    t += h;
    if (t > 1.2 * ramp) peak = std::max(peak, -body.loads().base_force().z() / area);
  }
  return peak;
}

}  // namespace

TEST(StructureCdpm2, ConfinementRaisesThePeakAsTheSurfaceSays) {
  // Reference values of the surface with full hardening (Grassl 2013); hardening beyond it lifts a simulated
  // peak, damage before it lowers it: by 0.2, 0.7 and 2.1 %.
  for (const auto& [pressure, expected] : {std::pair{0.0, 30e6}, {3e6, 45.6e6}, {10e6, 72.9e6}})
    EXPECT_NEAR(peak_stress(cube("concrete-cdpm2"), pressure, pressure > 0 ? 0.025 : 0.006) / expected, 1,
                pressure > 5e6 ? 0.03 : 0.01)
        << pressure;
  // The damage law softens all the same, and knows confinement only in what is crushed.
  EXPECT_LT(peak_stress(cube("concrete"), 10e6, 0.01), 60e6);
}

TEST(Erosion, BooksDoNotKnowWhereZeroIs) {
  const auto lost = [](double z) {
    StructureSpec s = cantilever(2, 8);
    s.size = Vec3(0.4, 0.4, 1.6), s.young = 0, s.f_cm = 38e6, s.damage = "concrete",
    s.position = Vec3(0, 0, z), s.probes.clear();
    StructureSpec::Load load;
    load.region = Box3(Vec3(-0.201, -0.3, z + 0.59), Vec3(-0.199, 0.3, z + 1.01));
    load.traction = Vec3(60e6, 0, 0);
    load.history = {{0, 0}, {0.5e-3, 1}, {2e-3, 1}, {2.5e-3, 0}};
    s.loads.push_back(load);
    FemStructure column(s, Vec3(0, 0, -9.81), silent);
    const double h = column.critical_step(), start = column.energy().gravity_potential;
    for (double t = 0; t < 15e-3; t += h) column.predict(t, h), column.correct(t, h, {});
    const StructureEnergy e = column.energy();
    return std::array{e.eroded_energy, e.gravity_potential - start, column.damage().spalled};
  };
  const auto low = lost(0), high = lost(1000);
  ASSERT_GT(low[2], 0.02);  // m^3
  EXPECT_NEAR(high[0] / low[0], 1, 1e-3);
  EXPECT_NEAR(high[1], low[1], 1e-3 * low[0]);
}

TEST(StructureCdpm2, BiaxialStrength) {
  // Equal strains along two axes, free along the third: equibiaxial compression, 1.16 f_c.
  StructureSpec s = cube("concrete-cdpm2");
  FemStructure body(s, Vec3::Zero(), silent);
  const double h = body.critical_step(), rate = 0.1;
  double peak = 0, t = 0;
  while (t * rate < 0.006) {
    body.predict(t, h);
    std::vector<NodeImpulse> push;
    for (int n = 0; n < 8; ++n) {
      if (!std::isfinite(body.skin().node_mass(n))) continue;  // the held corner
      const Vec3 x = body.mesh().nodes[n], v = body.skin().predicted_velocity(n);
      Vec3 p = -0.02 * body.skin().node_mass(n) * v;
      for (int c : {0, 2})
        if (x[c] > 0.05) p[c] = body.skin().node_mass(n) * (-rate * 0.1 - v[c]);
      push.push_back({n, p});
    }
    body.correct(t, h, push);
    t += h;
    peak = std::max(peak, -body.loads().base_force().z() / 0.01);
  }
  EXPECT_NEAR(peak / 30e6, 1.160, 0.06 * 1.16);
}

TEST(StructureCdpm2, StateIsRestoredToTheSameBits) {
  StructureSpec s = cube("concrete-cdpm2");
  s.size = Vec3(0.3, 0.1, 0.1);
  s.cells = {3, 1, 1};
  FemStructure a(s, Vec3::Zero(), silent), b(s, Vec3::Zero(), silent);
  const double h = a.critical_step();
  const auto pull = [&](FemStructure& body, int from, int to) {
    for (int i = from; i < to; ++i) {
      body.predict(i * h, h);
      std::vector<NodeImpulse> p;
      for (int n = 0; n < static_cast<int>(body.mesh().nodes.size()); ++n)
        if (body.mesh().nodes[n].x() > 0.19)
          p.push_back({n, body.skin().node_mass(n) * (Vec3(0.05, 0, 0) - body.skin().predicted_velocity(n))});
      body.correct(i * h, h, p);
    }
  };
  pull(a, 0, 300);
  ASSERT_GT(a.damage().largest, 0.1);
  std::vector<double> state, end_a, end_b;
  a.save(state);
  b.restore(state);
  pull(a, 300, 400), pull(b, 300, 400);
  a.save(end_a), b.save(end_b);
  EXPECT_EQ(end_a, end_b);
}

TEST(History, OnlyCellsThatTheLawHasTouchedKeepOne) {
  // A long bar pulled at its end by a short pulse: the cells near the fixed end crack, the others stay
  // without history.
  StructureSpec s = cube("concrete");
  s.size = Vec3(1.0, 0.1, 0.1);
  s.position = Vec3(0.5, 0.05, 0.05);
  s.cells = {10, 1, 1};
  s.supports = {{"-x", "", {}, {true, true, true}}};
  StructureSpec elastic = s;
  elastic.damage = "none";
  FemStructure bar(s, Vec3::Zero(), silent), none(elastic, Vec3::Zero(), silent);
  std::vector<double> virgin, without, after;
  bar.save(virgin), none.save(without);
  const double h = bar.critical_step();
  for (int i = 0; i < 40; ++i) {
    bar.predict(i * h, h);
    std::vector<NodeImpulse> p;
    for (int n = 0; n < static_cast<int>(bar.mesh().nodes.size()); ++n)
      if (i < 8 && bar.mesh().nodes[n].x() > 0.99)
        p.push_back({n, bar.skin().node_mass(n) * (Vec3(0.45, 0, 0) - bar.skin().predicted_velocity(n))});
    bar.correct(i * h, h, p);
  }
  const auto snapshot = bar.snapshot();
  const auto damaged = std::count_if(snapshot.damage_tension.begin(), snapshot.damage_tension.end(),
                                     [](double d) { return d > 0; });
  bar.save(after);
  const std::size_t per_cell = 1 + sizeof(material::DamageCell) / sizeof(double);
  ASSERT_GT(damaged, 0);
  EXPECT_LT(damaged, 10);
  EXPECT_EQ(after.size() - virgin.size(), per_cell * static_cast<std::size_t>(damaged));
  // Without a law there is not even the list of cells that live, nor their count, nor what broke off and
  // left: 5 numbers, two momenta.
  EXPECT_EQ(virgin.size() - without.size(), 6 + 2 * 3 + s.cells[0] + bar.mesh().nodes.size() + 1);
}

TEST(History, CellsThatTheLimitsRuleOutWouldNotDamage) {
  StructureSpec s = cube("concrete");
  s.cells = {4, 4, 4};
  const HexMesh mesh = make_mesh(s);
  const material::Concrete c = material::mc2010({.f_cm = 38e6}, "test");
  const auto field = make_damage_field("concrete", mesh, c, false, false, {0.1}, "test");
  ElementOperator op(mesh, c.young / (2 * (1 + c.poisson)), c.young / (3 * (1 - 2 * c.poisson)), false);
  const ElasticLimits limits = field->elastic_limits();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> d(-1, 1);
  int ruled_out = 0, asked = 0;
  for (int trial = 0; trial < 200; ++trial) {
    // A mean strain, mostly compressive, and a little of every other kind.
    Mat3 h;
    for (int i = 0; i < 9; ++i) h(i / 3, i % 3) = 1e-4 * d(random);
    h(2, 2) -= 2e-4 * (1 + d(random));
    AlignedVector u(4 * mesh.nodes.size(), 0.0), f(u.size(), 0.0);
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
      const Vec3 x = h * mesh.nodes[n] + 5e-7 * Vec3(d(random), d(random), d(random));
      for (int k = 0; k < 3; ++k) u[4 * n + k] = x[k];
    }
    op.add_internal_force(u.data(), f.data(), false, true);
    std::vector<int> above, left;
    op.cells_above(limits.energy, above);
    op.add_internal_force(u.data(), f.data(), false, true, &limits);
    op.cells_above(limits.energy, left);
    for (int cell : above) {
      if (std::binary_search(left.begin(), left.end(), cell)) {
        ++asked;
        continue;
      }
      ++ruled_out;
      ASSERT_FALSE(field->try_cell(cell, {.u = u.data()}, f.data()));
    }
  }
  EXPECT_GT(ruled_out, 500);
  EXPECT_GT(asked, 500);
}

namespace {
/// The problem that building the structure reports.
Problem first_problem(const StructureSpec& s) {
  try {
    FemStructure body(s, Vec3(0, 0, -9.81), silent);
  } catch (const InputError& e) { return e.problems()[0]; }
  ADD_FAILURE() << "accepted";
  return {};
}
}  // namespace

TEST(ConcreteInput, CellsThatWouldSnapBackNameTheSizeNeeded) {
  StructureSpec s = cube("concrete");
  s.size = Vec3(3, 3, 12);
  s.cells = {2, 2, 8};
  const Problem base = first_problem(s);
  EXPECT_EQ(base.key, "structure.cube.cell_size");
  EXPECT_NE(base.rule.find("2 E G_F / f_t^2 = 0.92"), std::string::npos)
      << base.rule;  // 2 x 31.01e9 x 134.6 / 3e6^2
  EXPECT_NE(base.remedy.find("use cells of 0.52"), std::string::npos) << base.remedy;
  // CDPM2 softens from the elastic strain on: half of it.
  s.cells = {6, 6, 24};
  s.damage = "concrete-cdpm2";
  const Problem advanced = first_problem(s);
  EXPECT_NE(advanced.rule.find("E G_F / f_t^2 = 0.46"), std::string::npos) << advanced.rule;
}

TEST(ConcreteInput, StrengthOutsideTheModelIsNamed) {
  StructureSpec s = cube("concrete");
  s.f_cm = 12e6;
  const Problem p = first_problem(s);
  EXPECT_EQ(p.key, "structure.cube.material.f_cm");
  EXPECT_NE(p.rule.find("20 to 130 MPa"), std::string::npos);
}

TEST(ConcreteInput, BarsOutsideTheConcreteAreNamed) {
  const std::string path = std::string(TALUS_BINARY_DIR) + "/outside_bars.csv";
  std::ofstream(path)
      << "bar,diameter,x,y,z,grade\nL1,0.01,0.05,0.05,0.02,B500B\nL1,0.01,0.05,0.05,0.35,B500B\n";
  StructureSpec s = cube("concrete");
  s.rebar_file = path;
  const Problem p = first_problem(s);
  EXPECT_EQ(p.file, path);
  EXPECT_NE(p.key.find("bar L1"), std::string::npos) << p.key;
  EXPECT_NE(p.rule.find("outside the concrete"), std::string::npos);
}

/// Axes inside, surfaces not: a bar of 12 cm along a member of 10 cm, and a stirrup of 2 cm half a centimetre
/// below the surface.
TEST(ConcreteInput, BarsWiderThanTheirMemberAreNamed) {
  const std::string path = std::string(TALUS_BINARY_DIR) + "/wide_bars.csv";
  std::ofstream(path) << "bar,diameter,x,y,z,grade\nL1,0.12,0.05,0.05,0,B500B\nL1,0.12,0.05,0.05,0.3,B500B\n"
                         "S1,0.02,0.005,0.02,0.05,B500B\nS1,0.02,0.08,0.02,0.05,B500B\nS1,0.02,0.08,0.08,0."
                         "05,B500B\nS1,0.02,0.005,0.08,0.05,B500B\nS1,0.02,0.005,0.02,0.05,B500B\n"
                         "fits,0.02,0.05,0.05,0,B500B\nfits,0.02,0.05,0.05,0.3,B500B\n";
  StructureSpec s = cube("concrete");
  s.size.z() = 0.3;
  s.position.z() = 0.15;
  s.rebar_file = path;
  try {
    FemStructure body(s, Vec3::Zero(), silent);
    ADD_FAILURE() << "accepted";
  } catch (const InputError& e) {
    ASSERT_EQ(e.problems().size(), 2u);
    EXPECT_EQ(e.problems()[0].key, "structure.cube.rebar bar L1");
    EXPECT_EQ(e.problems()[1].key, "structure.cube.rebar bar S1");
    EXPECT_EQ(e.problems()[1].line, 4);
    EXPECT_NE(e.problems()[0].rule.find("120 mm thick"), std::string::npos) << e.problems()[0].rule;
  }
}

/// The cells of a round column hold what their flat faces leave of its circle, and no more: a hoop 2 cm
/// outside of it was taken by the nearest cells.
TEST(ConcreteInput, HoopsWiderThanTheirRoundColumnAreNamed) {
  for (const double radius : {0.72, 0.77}) {
    const std::string path = std::string(TALUS_BINARY_DIR) + "/wide_hoop.csv";
    std::ofstream hoop(path);
    hoop << "bar,diameter,x,y,z,grade\n";
    for (int i = 0; i <= 24; ++i)
      hoop << "H1,0.012," << radius * std::cos(M_PI * (i % 24) / 12) << ","
           << radius * std::sin(M_PI * (i % 24) / 12) << ",2,B500B\n";
    hoop.close();
    StructureSpec s = cube("concrete");
    s.kind = "column";
    s.section = "round";
    s.position = Vec3::Zero();
    s.size = Vec3(1.5, 1.5, 4);
    s.cells = {0, 0, 0};
    s.cell_size = 0.3;
    s.rebar_file = path;
    if (radius < 0.75) {
      EXPECT_NO_THROW(FemStructure(s, Vec3::Zero(), silent));
    } else {
      EXPECT_NE(first_problem(s).key.find("bar H1"), std::string::npos);
    }
  }
}

/// A beam of depth h = 0.4 m held at both ends, without bars: rho g L^2 / (2 h) at the ends is 0.5 MPa for a
/// span of 4 m and 17 MPa for 24 m.
TEST(ConcreteInput, PlainConcreteThatItsWeightCracksIsWarnedOf) {
  for (const double span : {4.0, 24.0}) {
    StructureSpec s = cube("concrete");
    s.position = Vec3(0, 0, 0);
    s.size = Vec3(span, 0.4, 0.4);
    s.cells = {static_cast<int>(span / 0.2), 2, 4};
    s.gravity_preload = true;
    s.supports.assign(2, {});
    s.supports[0].face = "-x";
    s.supports[1].face = "+x";
    bool warned = false;
    const FemStructure beam(s, Vec3(0, 0, -9.81), [&](const std::string& line) {
      warned = warned || line.find("without bars, is stretched beyond f_t") != std::string::npos;
    });
    EXPECT_EQ(warned, span > 10) << span;
  }
}

/// A column of area 0.04 m^2 that four bars of 40 mm at 900 MPa press with 4.52 MN: 113 MPa less what it
/// shortens, against f_cm = 30 MPa; with 90 MPa a tenth.
TEST(ConcreteInput, PrestressThatCrushesIsWarnedOf) {
  for (const double prestress : {90e6, 900e6}) {
    StructureSpec s = cube("concrete");
    s.kind = "column";
    s.position = Vec3::Zero();
    s.size = Vec3(0.2, 0.2, 1);
    s.cells = {2, 2, 10};
    s.gravity_preload = true;
    s.supports.assign(1, {});
    s.supports[0].face = "-z";
    s.rebar_rules.assign(1, {});
    StructureSpec::RebarRule& bars = s.rebar_rules[0];
    bars.kind = "longitudinal", bars.bars = 4, bars.diameter = 0.040, bars.cover = 0.02, bars.yield = 1600e6,
    bars.prestress = prestress;
    bool warned = false;
    const FemStructure column(s, Vec3(0, 0, -9.81), [&](const std::string& line) {
      warned = warned || line.find("is pressed beyond f_cm") != std::string::npos;
    });
    EXPECT_EQ(warned, prestress > 500e6) << prestress;
  }
}

TEST(ConcreteInput, ManyBarsOutsideAreCounted) {
  const std::string path = std::string(TALUS_BINARY_DIR) + "/many_outside_bars.csv";
  std::ofstream bars(path);
  bars << "bar,diameter,x,y,z,grade\n";
  for (int i = 0; i < 40; ++i)
    for (const char* z : {"0.02", "0.35"}) bars << "L" << i << ",0.01,0.05,0.05," << z << ",B500B\n";
  bars.close();
  StructureSpec s = cube("concrete");
  s.rebar_file = path;
  try {
    FemStructure body(s, Vec3(0, 0, -9.81), silent);
    ADD_FAILURE() << "accepted";
  } catch (const InputError& e) {
    EXPECT_EQ(e.problems().size(), 5u);
    EXPECT_NE(e.problems().back().rule.find("so do 35 more bars"), std::string::npos)
        << e.problems().back().rule;
  }
}

/// Hoops near the surface of a round column pass outside the flat faces of its cells.
TEST(ConcreteInput, HoopsOfARoundColumnAreHeldByItsFlatFacedCells) {
  for (const double cell : {0.15, 0.3, 0.5}) {
    StructureSpec s = cube("concrete");
    s.kind = "column";
    s.section = "round";
    s.size = Vec3(1.5, 1.5, 4);
    s.cells = {0, 0, 0};
    s.cell_size = cell;
    StructureSpec::RebarRule hoops;
    hoops.kind = "stirrups", hoops.diameter = 0.012, hoops.cover = 0.04, hoops.spacing = 0.2;
    StructureSpec::RebarRule bars;
    bars.kind = "longitudinal", bars.bars = 16, bars.diameter = 0.028, bars.cover = 0.05;
    s.rebar_rules = {bars, hoops};
    FemStructure column(s, Vec3(0, 0, -9.81), silent);
    const Structure::Snapshot now = column.snapshot();
    double hoop = 0;  // level pieces
    for (const auto& [a, b] : now.bars) {
      const Vec3 d =
          now.bar_points[static_cast<std::size_t>(b)] - now.bar_points[static_cast<std::size_t>(a)];
      if (std::abs(d.z()) < 1e-3 * d.norm()) hoop += d.norm();
    }
    const double one = 2 * M_PI * (0.75 - 0.046);
    EXPECT_NEAR(hoop / (20 * one), 1, 0.06) << cell;
  }
}

TEST(MeshInput, UnsupportedCellsAndInvertedOnesAreNamed) {
  StructureSpec s = cube("none");
  s.young = 30e9;
  s.f_cm = 0;
  s.kind = "mesh";
  s.supports.clear();
  s.file = std::string(TALUS_BINARY_DIR) + "/quadratic.inp";
  std::ofstream(s.file) << "*NODE\n1,0,0,0\n*ELEMENT, TYPE=C3D20\n1,1\n";
  const Problem kind = first_problem(s);
  EXPECT_EQ(kind.line, 3);
  EXPECT_NE(kind.value.find("C3D20"), std::string::npos);
  EXPECT_NE(kind.rule.find("C3D8"), std::string::npos);
  s.file = std::string(TALUS_BINARY_DIR) + "/inverted.inp";
  std::ofstream(s.file) << "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n*"
                           "ELEMENT, TYPE=C3D8\n1,5,6,7,8,1,2,3,4\n";
  const Problem inverted = first_problem(s);
  EXPECT_NE(inverted.key.find("cell 1"), std::string::npos) << inverted.key;
  EXPECT_NE(inverted.rule.find("inverted"), std::string::npos) << inverted.rule;
  EXPECT_EQ(inverted.file, s.file);
}

namespace {
/// Cells of 10 mm in a row along x whose two halves are moved apart as rigid bodies: the cell between them is
/// the crack, and the bar is pulled out of the left half; a bend anchors it in the right one.
struct PullOut {
  explicit PullOut(const std::string& bond) {
    spec.name = "pull";
    spec.kind = "box";
    spec.f_cm = 38e6;
    spec.size = Vec3(0.3, 0.1, 0.1);
    spec.position = Vec3(0.15, 0.05, 0.05);
    spec.cells = {30, 1, 1};
    spec.bond = bond;
    spec.rate_effect = false;
    spec.rebar_file = std::string(TALUS_BINARY_DIR) + "/pull_out.csv";
    std::ofstream(spec.rebar_file)
        << "bar,diameter,x,y,z,grade\nL1,0.02,0.05,0.05,0.05,1500/1600/0.2\nL1,0.02,0.2,0.05,0.05,1500/1600/"
           "0.2\nL1,0.02,0.2,0.05,0.08,1500/1600/0.2\n";
    mesh = make_mesh(spec);
    Supports free;
    free.held.assign(mesh.nodes.size(), {false, false, false});
    bars = std::make_unique<Bars>(spec, mesh, free, std::vector<rebar::Member>{}, [](const std::string&) {});
    live.assign(mesh.hexes.size(), 1);
    u.assign(4 * mesh.nodes.size(), 0.0), f = u;
  }
  /// Force across the crack of width w at mid-length.
  double pull(double w) {
    std::fill(f.begin(), f.end(), 0.0);
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) u[4 * n] = mesh.nodes[n].x() > 0.1501 ? w : 0.0;
    bars->add_forces(u.data(), 0, live, f.data());
    bars->accept();
    dissipated += bars->dissipation();
    double force = 0;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
      if (mesh.nodes[n].x() > 0.1501) force += f[4 * n];
    return force;
  }
  StructureSpec spec;
  HexMesh mesh;
  std::unique_ptr<Bars> bars;
  std::vector<char> live;
  AlignedVector u, f;
  double dissipated = 0;
};
}  // namespace

TEST(Bond, PullOutFollowsTheModelCode) {
  // Embedded 0.1 m and half of the cracked cell (5.25 diameters) in the left half: the bar is so stiff that
  // its slip is nearly uniform, the crack's width less the little that it stretches; the force is tau(slip)
  // times the surface.
  PullOut test("mc2010");
  const double surface = M_PI * 0.02 * 0.105, strength = 2.5e6 * std::sqrt(38.0);
  double work = 0, before = 0, last = 0;
  const int steps = 800;
  for (int i = 1; i <= steps; ++i) {
    const double w = 12e-3 * i / steps, force = test.pull(w);
    // Less the stretch up to the bend, and of the embedded part, whose force grows linearly.
    const double slip = w - force / (200e9 * M_PI / 4 * 0.02 * 0.02) * (0.045 + 0.105 / 3);
    work += 0.5 * (force + before) * (w - last);
    before = force, last = w;
    if (i % 20) continue;
    const double tau = slip <= 1e-3   ? strength * std::pow(slip / 1e-3, 0.4)
                       : slip <= 2e-3 ? strength
                       : slip <= 1e-2 ? strength * (1 - 0.6 * (slip - 2e-3) / 8e-3)
                                      : 0.4 * strength;
    EXPECT_NEAR(force / (tau * surface), 1, 0.02) << "slip " << slip;
  }
  // Work is stored or dissipated.
  EXPECT_NEAR((test.bars->stored() + test.dissipated) / work, 1, 0.02);
  EXPECT_TRUE(test.bars->slips());
}

TEST(Bond, PerfectBondStrainsTheBarInTheCrackAlone) {
  PullOut test("perfect");
  const double w = 5e-5, cell = 0.01, area = M_PI / 4 * 0.02 * 0.02;
  EXPECT_NEAR(test.pull(w), area * 200e9 * w / cell, 1e-3 * area * 200e9 * w / cell);
  EXPECT_FALSE(test.bars->slips());
}

TEST(Bond, StateIsRestoredToTheSameBits) {
  PullOut a("mc2010"), b("mc2010");
  for (int i = 1; i <= 20; ++i) a.pull(1e-4 * i);
  std::vector<double> state;
  a.bars->save(state, false);
  StateReader reader(state);
  b.bars->restore(reader, false);
  EXPECT_TRUE(reader.empty());
  EXPECT_EQ(a.pull(1.5e-3), b.pull(1.5e-3));
}

TEST(Prestress, CompressesTheConcreteBeforeAnyLoad) {
  // A bar stressed to 800 MPa in a prism that is free to shorten: steel and concrete balance, N = A_s s_0 /
  // (1 + n rho).
  StructureSpec s = cube("none");
  s.damage = "none";
  s.size = Vec3(0.2, 0.2, 1.0);
  s.position = Vec3(0.1, 0.1, 0.5);
  s.cells = {2, 2, 10};
  s.rebar_file = std::string(TALUS_BINARY_DIR) + "/prestress.csv";
  std::ofstream(s.rebar_file) << "bar,diameter,x,y,z,grade,prestress\nL1,0.02,0.1,0.1,0,1500/1600/"
                                 "0.05,8e8\nL1,0.02,0.1,0.1,1,1500/1600/0.05,8e8\n";
  s.gravity_preload = true;
  FemStructure prism(s, Vec3(0, 0, -1e-9), silent);
  const double steel = M_PI / 4 * 0.02 * 0.02, e_c = 21.5e9 * std::cbrt(3.0), n = 200e9 / e_c;
  const double strain = -steel * 800e6 / (e_c * 0.04) / (1 + n * steel / 0.04);
  // Between the sections at 0.3 and 0.7 m: the ends, where the bar's force enters at a point, deform
  // otherwise.
  double shortened = 0;
  int count = 0;
  const std::vector<Vec3> u = prism.snapshot().displacement;
  for (std::size_t i = 0; i < prism.mesh().nodes.size(); ++i) {
    const double z = prism.mesh().nodes[i].z();
    if (std::abs(z - 0.7) < 1e-6) shortened += u[i].z(), ++count;
    if (std::abs(z - 0.3) < 1e-6) shortened -= u[i].z();
  }
  EXPECT_NEAR(shortened / count / 0.4, strain, 0.02 * std::abs(strain));
}
