// When a cell of concrete leaves the mesh: cracks close and bear again, what carries nothing in any direction
// goes, and so does the gap beside a piece that comes off.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "fem/materials/material_damage.hpp"
#include "fem/materials/material_mc2010.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

constexpr double edge = 0.1;

/// A bar of cubic cells along z, free to contract, its lower end held.
StructureSpec bar(const char* law, int cells) {
  StructureSpec s;
  s.name = "bar";
  s.kind = "box";
  s.f_cm = 38e6;
  s.poisson = 1e-9;  // 0 would stand for the one of concrete
  s.density = 2450;
  s.size = Vec3(edge, edge, cells * edge);
  s.position = Vec3(edge / 2, edge / 2, cells * edge / 2);
  s.cells = {1, 1, cells};
  s.damage = law;
  s.rate_effect = false;
  s.gravity_preload = false;
  s.supports = {{"-x", "", {}, {true, false, false}},
                {"-y", "", {}, {false, true, false}},
                {"-z", "", {}, {false, false, true}}};
  return s;
}

/// Moves the nodes above a height by `speed` along z for a time; the others are held.
void move(FemStructure& body, double from, double speed, double duration) {
  const int steps = static_cast<int>(std::ceil(duration / body.critical_step()));
  const double h = duration / steps;
  for (int i = 0; i < steps; ++i) {
    body.predict(i * h, h);
    std::vector<NodeImpulse> push;
    for (int n = 0; n < static_cast<int>(body.mesh().nodes.size()); ++n)
      if (std::isfinite(body.skin().node_mass(n)) && body.skin().node_mass(n) > 0) {
        const Vec3 wanted(0, 0, body.mesh().nodes[n].z() > from ? speed : 0.0);
        push.push_back({n, body.skin().node_mass(n) * (wanted - body.skin().predicted_velocity(n))});
      }
    body.correct(i * h, h, push);
  }
}

}  // namespace

TEST(Erosion, ACrackOfACentimetreClosesAndBearsAgain) {
  FemStructure body(bar("concrete", 1), Vec3::Zero(), silent);
  move(body, 0.5 * edge, 1, 15e-3);  // 15 mm open
  EXPECT_GT(body.damage().largest, 0.99);
  // Its faces meet at a tenth of the opening at which nothing was left to grow, 0.36 mm.
  material::ConcreteDamage::Parameters p;
  p.concrete = material::mc2010({.f_cm = 38e6}, "cell");
  p.concrete.poisson = 0;
  p.cell = material::CellFrame::cube(edge);
  p.rate_effect = false;
  const material::ConcreteDamage law(p);
  material::ConcreteDamage::State torn;
  for (int i = 1; i <= 1500; ++i) law({0, 0, 1e-4 * i, 0, 0, 0}, {}, torn, torn);
  const double open = torn.permanent[2] * edge;
  EXPECT_NEAR(open, 3.6e-5, 2e-6);
  move(body, 0.5 * edge, -1, 15e-3 - open);
  move(body, 0.5 * edge, -0.1, 0.5e-3);  // and 0.05 mm beyond: a strain of 5e-4 of the sound cell
  EXPECT_EQ(body.damage().spalled, 0);
  const double strain = 5e-4, sound = material::mc2010({.f_cm = 38e6}, "cell").young * strain;
  const double pressure = -body.loads().base_force().z() / (edge * edge);
  EXPECT_GT(pressure, 0.85 * sound);  // the Model Code's curve lies so much below the tangent there
  EXPECT_LT(pressure, 1.02 * sound);
}

TEST(Erosion, TakesWhatIsCrackedAndCrushedNotWhatIsOneOfBoth) {
  // Under CDPM2 what is held at its sides does not crush.
  for (const auto& [law, crushed] :
       {std::pair{"concrete", false}, {"concrete", true}, {"concrete-cdpm2", false}}) {
    const HexMesh mesh = active_cells(bar(law, 1));
    const auto field = make_damage_field(law, mesh, material::mc2010({.f_cm = 30e6}, "material"), false, true,
                                         {0.1}, "cell_size");
    const DamageField::Spent when{0.1, 1, 5e-3};
    const auto spent_at = [&](double strain) {
      std::vector<double> u(32, 0.0), f(32, 0.0);
      for (int n = 0; n < 8; ++n) u[4 * n + 2] = strain * mesh.nodes[n].z();
      if (field->has(0))
        field->add_forces({.u = u.data()}, f.data());
      else
        field->try_cell(0, {.u = u.data()}, f.data());
      field->accept();
      return field->spent(when, {}).size();
    };
    for (int i = 1; crushed && i <= 80; ++i) {
      EXPECT_EQ(spent_at(-0.4 * i / 80), 0u) << law;  // pressed together it stays
    }
    std::size_t open = 0;
    for (int i = 1; i <= 40; ++i) open = spent_at(0.3 * i / 40);  // 30 mm
    EXPECT_EQ(open, crushed ? 1u : 0u) << law;
    EXPECT_TRUE(field->cracked_through(0)) << law;
  }
}

TEST(Erosion, FlatCellsGoAlsoWithABarAndTornOnesWithout) {
  const HexMesh mesh = active_cells(bar("concrete", 1));
  const auto spent_at = [&](double strain, const std::vector<char>& kept) {
    const auto field = make_damage_field("concrete", mesh, material::mc2010({.f_cm = 30e6}, "material"),
                                         false, true, {0.1}, "cell_size");
    std::vector<double> u(32, 0.0), f(32, 0.0);
    for (int n = 0; n < 8; ++n) u[4 * n + 2] = strain * mesh.nodes[n].z();
    EXPECT_TRUE(field->try_cell(0, {.u = u.data()}, f.data()));
    return field->spent({0.1, 1, 5e-3}, kept).size();
  };
  const std::vector<char> host{1};
  for (const auto& kept : {std::vector<char>{}, host}) {
    EXPECT_EQ(spent_at(-0.88, kept), 0u);
    EXPECT_EQ(spent_at(-0.92, kept), 1u);
  }
  EXPECT_EQ(spent_at(0.70, {}), 0u);
  EXPECT_EQ(spent_at(0.76, {}), 1u);
  EXPECT_EQ(spent_at(0.76, host), 0u);
}

TEST(Erosion, WhatAnOpenRowPartsComesOffAndTheRowGoesWithIt) {
  StructureSpec s = bar("concrete", 8);
  s.supports = {{"-z", "", {}, {true, true, true}}};
  FemStructure body(s, Vec3::Zero(), silent);
  const double upper = 0.35;  // the row from 0.3 to 0.4 m tears
  move(body, upper, 0.1, 40e-3);
  EXPECT_TRUE(body.take_fragments().empty());  // 4 mm
  EXPECT_EQ(body.damage().spalled, 0);
  move(body, upper, 0.1, 40e-3);
  const std::vector<Fragment> pieces = body.take_fragments();
  ASSERT_EQ(pieces.size(), 1u);
  // Of the row half of the mass lies at nodes that the piece holds.
  EXPECT_NEAR(pieces[0].mass, 4.5 * edge * edge * edge * s.density, 1e-9);
  EXPECT_NEAR(body.damage().spalled, 5 * edge * edge * edge, 1e-12);
}

TEST(Erosion, ARowThatOpensInABodyHeldOnBothSidesStays) {
  StructureSpec s = bar("concrete", 8);
  s.supports = {{"-z", "", {}, {true, true, true}}, {"+z", "", {}, {true, true, false}}};
  FemStructure body(s, Vec3::Zero(), silent);
  move(body, 0.35, 0.1, 80e-3);
  EXPECT_TRUE(body.take_fragments().empty());
  EXPECT_EQ(body.damage().spalled, 0);
}
