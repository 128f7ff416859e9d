#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/error.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {
/// Deflection of the top under 100 kN along x, spread over the top face, by the static solve (as "gravity" of
/// a massless load: an implicit run to rest would say the same; the preload is what is tested).
double tip_deflection(int across, int along) {
  StructureSpec s = cantilever(across, along);
  s.poisson = 0;  // else the singular edge of the clamped face governs the order
  s.gravity_preload = true;
  // Lateral gravity g gives q = rho A g per length, tip = q L^4/(8 E I) + q L^2/(2 kappa G A).
  FemStructure structure(s, Vec3(1, 0, 0), silent);
  return structure.skin().probe_displacements()[0].x();
}
}  // namespace

TEST(Cantilever, StaticsConvergeToTimoshenko) {
  const double e = 33.55e9, nu = 0.0, rho = 2450, b = 1.5, l = 12, a = b * b, i = b * b * b * b / 12,
               g = e / (2 * (1 + nu));
  const double q = rho * a * 1.0;
  const double beam = q * l * l * l * l / (8 * e * i) + q * l * l / (2 * 5.0 / 6 * g * a);
  const double u2 = tip_deflection(2, 16), u4 = tip_deflection(4, 32), u8 = tip_deflection(8, 64);
  // Bending is exact at any size; what is left is shear that the clamped face holds from warping, singular at
  // its edge.
  EXPECT_GT(std::log2((u4 - u2) / (u8 - u4)), 1.5);
  const double limit = u8 + (u8 - u4) / 3;
  EXPECT_NEAR(limit, beam, 2e-3 * beam);
  EXPECT_NEAR(u2, beam, 3e-3 * beam);
}

TEST(Cantilever, TipLoadAndFrequencies) {
  // 100 kN at the tip: 4.115 mm (Timoshenko); 6.155, 36.19 Hz, each twice; held statically by letting a
  // constant load damp out.
  StructureSpec s = cantilever(6, 48);
  FemStructure structure(s, Vec3::Zero(), silent);
  const std::vector<double> w = structure.frequencies(6);
  ASSERT_GE(w.size(), 5u);
  EXPECT_NEAR(w[0] / (2 * M_PI), 6.155, 0.015 * 6.155);
  EXPECT_NEAR(w[1], w[0], 1e-6 * w[0]);
  EXPECT_NEAR(w[2] / (2 * M_PI), 36.19, 0.02 * 36.19);

  StructureSpec loaded = cantilever(4, 32);
  StructureSpec::Load load;
  load.region = Box3(Vec3(-0.75, -0.75, 11.999), Vec3(0.75, 0.75, 12.001));
  load.traction = Vec3(100e3 / 2.25, 0, 0);
  load.history = {{0, 0}, {2, 1}};  // so slow that it is statics
  loaded.loads.push_back(load);
  loaded.integrator = "modal";
  FemStructure pushed(loaded, Vec3::Zero(), silent);
  pushed.advance_alone(0, 2.0);
  EXPECT_NEAR(pushed.skin().probe_displacements()[0].x(), 4.115e-3, 0.03 * 4.115e-3);
  EXPECT_NEAR(pushed.loads().base_force().x(), 100e3, 2e3);
  EXPECT_NEAR(pushed.loads().base_moment().y(), 100e3 * 12, 2e4);
}

TEST(Preload, BaseCarriesTheWeight) {
  StructureSpec s = cantilever(2, 16);
  s.gravity_preload = true;
  FemStructure structure(s, Vec3(0, 0, -9.81), silent);
  const double weight = 2450 * 1.5 * 1.5 * 12 * 9.81;
  EXPECT_NEAR(structure.loads().base_force().z(), -weight, 1e-9 * weight);
  EXPECT_TRUE(structure.quiet());
  structure.advance_alone(0, 1e-3);
  EXPECT_LT(structure.energy().kinetic, 1e-15 * structure.energy().elastic);
}

TEST(Preload, ThickBarsInFineCellsFindBalance) {
  // Four bars of 30 mm in cells of 50 mm are stiffer than the concrete around them: the solve has to know
  // them.
  StructureSpec s = cantilever(4, 20);
  s.size = Vec3(0.2, 0.2, 1.0);
  s.poisson = 0;
  s.gravity_preload = true;
  s.rebar_rules.push_back({"longitudinal", "pier", 4, 0.03, 0.03});
  s.probes = {{"top", Vec3(0, 0, 1)}};
  std::vector<std::string> log;
  FemStructure structure(s, Vec3(0, 0, -9.81), [&](const std::string& line) { log.push_back(line); });
  EXPECT_TRUE(log.empty()) << log.front();
  EXPECT_TRUE(structure.quiet());
  const double steel = 4 * M_PI / 4 * 0.03 * 0.03, section = 0.2 * 0.2;
  const double weight = 9.81 * (2450 * (section - steel) + 7850 * steel),
               stiffness =
                   33.55e9 * section + 200e9 * steel;  // per metre; the law lays bars into whole cells
  EXPECT_NEAR(structure.loads().base_force().z(), -weight, 0.08 * weight);  // bars end a cover below the top
  EXPECT_NEAR(structure.skin().probe_displacements()[0].z(), -weight / (2 * stiffness),
              0.05 * weight / (2 * stiffness));
  structure.advance_alone(0, 1e-3);
  EXPECT_LT(structure.energy().kinetic, 1e-15 * structure.energy().elastic);
}

TEST(Explicit, WaveInARodTravelsAtC) {
  // A bar along x with sides free to slide only along it (nu = 0): c = sqrt(E / rho).
  StructureSpec s;
  s.name = "rod";
  s.kind = "box";
  s.young = 30e9;
  s.poisson = 0;
  s.density = 2500;
  s.size = Vec3(10, 0.1, 0.1);
  s.cells = {200, 1, 1};
  s.supports.push_back({"+x", "", {}, {true, true, true}});
  s.gravity_preload = false;
  s.integrator = "explicit";
  s.probes.push_back({"middle", Vec3(0, 0, 0)});
  StructureSpec::Load load;
  load.region = Box3(Vec3(-5.001, -1, -1), Vec3(-4.999, 1, 1));
  load.traction = Vec3(1e6, 0, 0);
  s.loads.push_back(load);
  FemStructure rod(s, Vec3::Zero(), silent);
  const double c = std::sqrt(30e9 / 2500), speed = 1e6 / (2500 * c);
  // u(middle, t) = speed (t - 5 m / c) once the front has passed.
  const double t = 8.0 / c;
  rod.advance_alone(0, t);
  EXPECT_NEAR(rod.skin().probe_displacements()[0].x(), speed * (t - 5.0 / c), 0.01 * speed * 3.0 / c);
  const StructureEnergy e = rod.energy();
  EXPECT_NEAR(e.kinetic + e.elastic, e.external_work, 1e-12 * e.external_work);
}

TEST(Explicit, FreeBodyKeepsMomentumAndEnergy) {
  StructureSpec s;
  s.name = "cube";
  s.kind = "box";
  s.young = 30e9;
  s.poisson = 0.2;
  s.density = 2500;
  s.size = Vec3(1, 1, 1);
  s.cells = {3, 3, 3};
  s.initial_velocity = Vec3(20, 0, 0);
  FemStructure cube(s, Vec3::Zero(), silent);
  const double h = cube.critical_step();
  // An eccentric blow makes it spin; then it flies freely through several turns of its elastic waves.
  const StructureEnergy start = cube.energy();
  cube.predict(0, h);
  int corner = -1;
  for (int n = 0; n < 64; ++n)
    if ((cube.skin().node_position(n) - Vec3(-0.5, -0.5, -0.5)).norm() < 1e-9) corner = n;
  ASSERT_GE(corner, 0);
  const NodeImpulse blow{corner, Vec3(100, 300, -50)};
  cube.correct(0, h, std::span(&blow, 1));
  const StructureEnergy hit = cube.energy();
  EXPECT_NEAR((hit.linear_momentum - start.linear_momentum - blow.impulse).norm(), 0,
              1e-9 * start.linear_momentum.norm());
  EXPECT_NEAR(hit.kinetic + hit.elastic - start.kinetic - start.elastic, hit.contact_work,
              1e-9 * start.kinetic);
  for (int i = 1; i < 2000; ++i) {
    cube.predict(i * h, h);
    cube.correct(i * h, h, {});
  }
  const StructureEnergy end = cube.energy();
  EXPECT_NEAR((end.linear_momentum - hit.linear_momentum).norm(), 0, 1e-11 * hit.linear_momentum.norm());
  EXPECT_NEAR((end.angular_momentum - hit.angular_momentum).norm(), 0, 1e-10 * hit.angular_momentum.norm());
  EXPECT_NEAR(end.kinetic + end.elastic + end.algorithmic + end.step_dependence,
              hit.kinetic + hit.elastic + hit.algorithmic + hit.step_dependence, 1e-9 * hit.kinetic);
  EXPECT_NEAR(end.kinetic + end.elastic, hit.kinetic + hit.elastic,
              5e-3 * (hit.kinetic - start.kinetic));  // the blow on one corner is far from linear
}

TEST(Integrators, Agree) {
  std::vector<double> tips;
  for (const char* how : {"explicit", "modal", "implicit"}) {
    StructureSpec s = cantilever(2, 16);
    s.integrator = how;
    StructureSpec::Load load;
    load.region = Box3(Vec3(-0.76, -0.75, 9), Vec3(-0.74, 0.75, 12));
    load.traction = Vec3(1e5, 0, 0);
    load.history = {{0, 0}, {0.02, 1}, {0.04, 0}};
    s.loads.push_back(load);
    FemStructure structure(s, Vec3::Zero(), silent);
    for (int i = 0; i < 60; ++i) structure.advance_alone(i * 1e-3, 1e-3);
    tips.push_back(structure.skin().probe_displacements()[0].x());
    const StructureEnergy e = structure.energy();
    EXPECT_NEAR(e.kinetic + e.elastic + e.damping_work + e.algorithmic + e.step_dependence, e.external_work,
                1e-9 * e.external_work)
        << how;
    EXPECT_LT(std::abs(e.algorithmic), 1e-3 * e.external_work) << how;
  }
  EXPECT_NEAR(tips[1], tips[0], 2e-3 * std::abs(tips[0]));
  EXPECT_NEAR(tips[2], tips[0], 1e-2 * std::abs(tips[0]));
}

TEST(State, RestoreBringsBackTheSameBits) {
  for (const char* how : {"explicit", "modal", "implicit"}) {
    StructureSpec s = cantilever(2, 8);
    s.integrator = how;
    s.gravity_preload = true;
    StructureSpec::Load load;
    load.region = Box3(Vec3(-0.76, -0.75, 9), Vec3(-0.74, 0.75, 12));
    load.traction = Vec3(1e5, 0, 0);
    s.loads.push_back(load);
    FemStructure structure(s, Vec3(0, 0, -9.81), silent);
    structure.advance_alone(0, 5e-3);
    std::vector<double> saved, first, second;
    structure.save(saved);
    structure.advance_alone(5e-3, 5e-3);
    structure.save(first);
    structure.restore(saved);
    structure.advance_alone(5e-3, 5e-3);
    structure.save(second);
    EXPECT_EQ(first, second) << how;
    EXPECT_NE(first, saved) << how;
  }
}

/// A cantilever of 0.5 x 0.5 x 8 m under its own weight lying down, Timoshenko's tip deflection: in one layer
/// of cells, long or short. A cell with mean dilatation alone sagged by 0.9 to 1.02 of it in cubes, one
/// layer, and a quarter in cells four times as long as deep.
TEST(Bending, OfOneLayerIsABeams) {
  const auto tip = [](int layers, int along) {
    StructureSpec s = cantilever(layers, along);
    s.size = Vec3(0.5, 0.5, 8);
    s.probes[0].at = Vec3(0, 0, 8);
    s.gravity_preload = true;
    s.poisson = 0.2;
    return FemStructure(s, Vec3(1, 0, 0), silent).skin().probe_displacements()[0].x();
  };
  const double area = 0.25, inertia = 0.0625 / 12, load = 2450 * area, shear = 33.55e9 / 2.4 * area * 5 / 6;
  const double beam = load * std::pow(8, 4) / (8 * 33.55e9 * inertia) + load * 64 / (2 * shear);
  for (const auto& [layers, along] : {std::pair(1, 4), {1, 8}, {1, 16}, {1, 40}, {2, 4}, {2, 16}, {3, 48}})
    EXPECT_NEAR(tip(layers, along) / beam, 1, along == 4 ? 0.025 : 0.01) << layers << " " << along;
}

/// One layer of cells whose faces across the beam lean: incompatible displacements (C3D8I of CalculiX) give
/// 0.99 of the beam at a lean of 27 degrees and 0.97 at 45.
TEST(Bending, OfCellsThatLeanIsABeams) {
  for (const double lean : {0.5, 1.0}) {
    const std::string file = std::string(TALUS_BINARY_DIR) + "/leaning_column.inp";
    std::ofstream out(file);
    out << "*NODE\n";
    for (int k = 0; k <= 10; ++k)
      for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i)
          out << 4 * k + 2 * j + i + 1 << ", " << i - 0.5 << ", " << j - 0.5 << ", "
              << k + lean * (i - 0.5) * std::min({1.0, k / 2.0, (10 - k) / 2.0}) << "\n";
    out << "*ELEMENT, TYPE=C3D8, ELSET=E\n";
    for (int k = 0; k < 10; ++k) {
      const int n = 4 * k + 1;
      out << k + 1 << ", " << n << ", " << n + 1 << ", " << n + 3 << ", " << n + 2 << ", " << n + 4 << ", "
          << n + 5 << ", " << n + 7 << ", " << n + 6 << "\n";
    }
    out << "*NSET, NSET=BOT\n1, 2, 3, 4\n";
    out.close();
    StructureSpec s;
    s.name = "column";
    s.kind = "mesh";
    s.file = file;
    s.young = 30e9;
    s.poisson = 0.2;
    s.density = 2500;
    s.supports.push_back({"", "BOT", {}, {true, true, true}});
    s.probes.push_back({"tip", Vec3(0, 0, 10)});
    s.gravity_preload = true;
    const double tip = FemStructure(s, Vec3(1, 0, 0), silent).skin().probe_displacements()[0].x();
    const double beam = 2500 * 1e4 / (8 * 30e9 / 12) + 2500 * 100 / (2 * 12.5e9 * 5 / 6);
    EXPECT_NEAR(tip / beam, lean < 1 ? 0.99 : 0.97, 0.03) << lean;
  }
}

TEST(Input, MissingSupportGroupAndEmptyLoadAreNamed) {
  StructureSpec s = cantilever(2, 4);
  s.supports[0] = {"", "", Box3(Vec3(50, 50, 50), Vec3(60, 60, 60)), {true, true, true}};
  EXPECT_THROW(FemStructure(s, Vec3::Zero(), silent), InputError);
  s = cantilever(2, 4);
  StructureSpec::Load load;
  load.region = Box3(Vec3(5, 5, 5), Vec3(6, 6, 6));
  load.traction = Vec3(1, 0, 0);
  s.loads.push_back(load);
  EXPECT_THROW(FemStructure(s, Vec3::Zero(), silent), InputError);
  s = cantilever(2, 4);
  s.cells = {1, 1, 2};
  s.f_cm = 38e6;
  s.young = 0;
  s.damage = "concrete";
  try {
    FemStructure structure(s, Vec3::Zero(), silent);
    FAIL() << "cells of 6 m passed";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("1.1"), std::string::npos) << e.what();  // 2 E G_F / f_t^2 = 1.12 m
  }
}

TEST(Surface, FollowsNodesAndClosesTheBody) {
  StructureSpec s = cantilever(2, 8);
  FemStructure structure(s, Vec3::Zero(), silent);
  const TriangleSurface& surface = structure.skin().surface();
  ASSERT_EQ(surface.triangles.size(), 4u * (2 * 4 + 4 * 16));
  double volume = 0;
  Vec3 area = Vec3::Zero();
  for (const auto& t : surface.triangles) {
    const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
    volume += a.dot(b.cross(c)) / 6;
    area += 0.5 * (b - a).cross(c - a);
  }
  EXPECT_NEAR(volume, 27.0, 1e-12 * 27);
  EXPECT_NEAR(area.norm(), 0, 1e-12);
}
