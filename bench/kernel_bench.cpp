// CPU time of the element kernels per element: the counter "us_per_element".
#include <benchmark/benchmark.h>

#include "fem/materials/damage_field.hpp"
#include "fem/materials/material_cdpm2.hpp"
#include "fem/materials/material_damage.hpp"
#include "fem/materials/material_mc2010.hpp"
#include "fem/structure_fem.hpp"

using namespace talus;
using namespace talus::fem;

namespace {

/// A pier with 4 n^3 cells; sheared: one Jacobian per cell; bent: eight.
HexMesh pier(int n, CellShape shape) {
  StructureSpec s;
  s.kind = "box";
  s.size = Vec3(1, 1, 4);
  s.cells = {n, n, 4 * n};
  HexMesh mesh = make_mesh(s);
  for (Vec3& x : mesh.nodes) {
    if (shape == CellShape::affine) x.x() += 0.2 * x.y();
    if (shape == CellShape::general) x.x() += 0.1 * x.y() * x.z();
  }
  return mesh;
}

AlignedVector waves(const HexMesh& mesh, double size) {
  AlignedVector u(4 * mesh.nodes.size(), 0.0);
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
    for (int c = 0; c < 3; ++c)
      u[4 * n + c] = size * std::sin(3.0 * mesh.nodes[n][c] + 2.0 * mesh.nodes[n][(c + 1) % 3]);
  return u;
}

void elastic(benchmark::State& state, CellShape shape, bool finite) {
  const HexMesh mesh = pier(static_cast<int>(state.range(0)), shape);
  ElementOperator op(mesh, 14e9, 18e9, false);
  const AlignedVector u = waves(mesh, 1e-4);
  AlignedVector f(u.size(), 0.0);
  for (auto _ : state) {
    op.add_internal_force(u.data(), f.data(), finite, finite);
    benchmark::DoNotOptimize(f.data());
  }
  state.counters["us_per_element"] = benchmark::Counter(
      1e-6 * static_cast<double>(mesh.hexes.size()) * static_cast<double>(state.iterations()),
      benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

/// A whole explicit step without contact: forces, velocities, energies.
void step(benchmark::State& state) {
  StructureSpec s;
  s.name = "P";
  s.kind = "column";
  s.young = 30e9;
  s.density = 2500;
  s.size = Vec3(2, 2, 8);
  const int n = static_cast<int>(state.range(0));
  s.cells = {n, n, 4 * n};
  s.supports.push_back({"-z", "", {}, {true, true, true}});
  s.gravity_preload = false;
  s.integrator = "explicit";
  s.initial_velocity = Vec3(0.01, 0, 0);
  FemStructure pier(s, Vec3::Zero(), [](const std::string&) {});
  const double h = pier.critical_step();
  double t = 0;
  for (auto _ : state) {
    pier.predict(t, h);
    pier.correct(t, h, {});
    t += h;
  }
  state.counters["us_per_element"] = benchmark::Counter(
      1e-6 * static_cast<double>(pier.elements()) * static_cast<double>(state.iterations()),
      benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

/// A whole explicit step in which the damage law is asked in every point: a free block of concrete that is
/// torn apart evenly, at 5 /s until all its cells have cracked, then at 0.5 /s. Everything: rates,
/// interlocking faces; plain: neither.
void damaged_step(benchmark::State& state, bool everything) {
  StructureSpec s;
  s.name = "P";
  s.kind = "box";
  s.f_cm = 38e6;
  s.density = 2450;
  s.damage = "concrete";
  s.erosion = false;
  s.rate_effect = everything;
  s.aggregate = everything ? 0.016 : 0;
  s.size = Vec3(1, 1, 4);
  const int n = static_cast<int>(state.range(0));
  s.cells = {n, n, 4 * n};
  s.integrator = "explicit";
  FemStructure body(s, Vec3::Zero(), [](const std::string&) {});
  const double h = body.critical_step(), volume = 4;
  const auto stretch = [&](double rate) {
    std::vector<NodeImpulse> impulses;
    for (int i = 0; i < static_cast<int>(body.mesh().nodes.size()); ++i)
      impulses.push_back(
          {i, rate * body.skin().node_mass(i) * body.mesh().nodes[static_cast<std::size_t>(i)]});
    return impulses;
  };
  double t = 0;
  const auto go = [&](const std::vector<NodeImpulse>& impulses) {
    body.predict(t, h);
    body.correct(t, h, impulses);
    t += h;
  };
  go(stretch(5));
  while (t < 1e-3) go({});
  go(stretch(-4.5));
  if (body.damage().volume < 0.99 * volume) state.SkipWithError("not all cells are cracked");
  std::vector<double> cracked;
  body.save(cracked);
  long steps = 0;
  for (auto _ : state) {
    if (++steps % 100 == 0) {
      state.PauseTiming();
      body.restore(cracked);
      state.ResumeTiming();
    }
    go({});
  }
  state.counters["us_per_element"] = benchmark::Counter(
      1e-6 * static_cast<double>(body.elements()) * static_cast<double>(state.iterations()),
      benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

material::DamageCell& at(material::DamageCell& cell) { return cell; }
material::Cdpm2::State* at(std::array<material::Cdpm2::State, 8>& points) { return points.data(); }

/// A concrete law in the eight points of a cell, all of them growing damage.
template <class Law, class History>
void law(benchmark::State& state) {
  typename Law::Parameters p;
  p.concrete = material::mc2010(38e6);
  const Law concrete(p);
  const material::CellFrame frame = material::CellFrame::cube(0.1);
  History history{};
  alignas(64) double shape[6][8], strain[6][8], stress[6][8], energy[8], lost[8];
  for (int q = 0; q < 8; ++q)
    for (int k = 0; k < 6; ++k) shape[k][q] = std::sin(1.0 + 3 * q + 5 * k);
  double size = 0;
  for (auto _ : state) {
    size = size < 2e-3 ? size + 1e-6 : 0;
    for (int k = 0; k < 6; ++k)
      for (int q = 0; q < 8; ++q) strain[k][q] = size * shape[k][q];
    concrete.stress8(&strain[0][0], nullptr, frame, at(history), at(history), &stress[0][0], energy, lost);
    benchmark::DoNotOptimize(stress);
  }
}

}  // namespace

BENCHMARK_CAPTURE(elastic, brick, CellShape::brick, false)->Arg(8)->Arg(24);
BENCHMARK_CAPTURE(elastic, affine, CellShape::affine, false)->Arg(8)->Arg(24);
BENCHMARK_CAPTURE(elastic, general, CellShape::general, false)->Arg(8)->Arg(24);
BENCHMARK_CAPTURE(elastic, brick_lagrangian, CellShape::brick, true)->Arg(8);
BENCHMARK(law<material::ConcreteDamage, material::DamageCell>)->Name("law/damage");
BENCHMARK(law<material::Cdpm2, std::array<material::Cdpm2::State, 8>>)->Name("law/cdpm2");
BENCHMARK(step)->Arg(8)->Arg(24);
BENCHMARK_CAPTURE(damaged_step, everything, true)->Arg(8);
BENCHMARK_CAPTURE(damaged_step, plain, false)->Arg(8);

BENCHMARK_MAIN();
