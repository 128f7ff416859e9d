/// What tearing plain concrete costs over G_F A, whatever the mesh: bars of cells that lean, bars cut from
/// lattices that are turned, and beams in three-point bending.
///
///   T = (work of the held nodes - kinetic and stored energy - damping) / (G_F A):   damage and numerical
///   dissipation together, 1 in a perfect law on a perfect mesh
///
/// talus_localisation_bench [concrete|concrete-cdpm2 [aggregate in m [part of a case's name]]]: a table in
/// Markdown, for each case T with the largest stress (load over A) in MPa. A: the thinnest row of a leaning
/// bar, the mean section of a lattice's bar, the ligament of a beam. Central differences, held nodes moved
/// at a constant speed after 2 ms.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "fem/kernels/element_operator.hpp"
#include "fem/materials/damage_field.hpp"
#include "fem/materials/material_mc2010.hpp"

namespace {
using namespace talus;
using namespace talus::fem;

constexpr double density = 2450, alpha = 200;  // [kg/m^3]; mass-proportional damping [1/s]

struct Model {
  HexMesh mesh;
  std::vector<std::array<bool, 3>> held;
  std::vector<Vec3> direction;  // of the motion of held nodes
  double area = 0, travel = 0, speed = 0.03;

  void hold(const std::function<void(const Vec3&, std::array<bool, 3>&, Vec3&)>& by) {
    held.assign(mesh.nodes.size(), {false, false, false});
    direction.assign(mesh.nodes.size(), Vec3::Zero());
    for (std::size_t a = 0; a < mesh.nodes.size(); ++a) by(mesh.nodes[a], held[a], direction[a]);
    mesh.local = mesh.nodes;
  }
};

/// nx x ny x nz cells of a grid whose nodes are at `place`, those that are `in`.
HexMesh grid(int nx, int ny, int nz, const std::function<Vec3(int, int, int)>& place,
             const std::function<bool(int, int, int)>& in) {
  HexMesh mesh;
  std::vector<int> number(static_cast<std::size_t>((nx + 1) * (ny + 1) * (nz + 1)), -1);
  const auto node = [&](int i, int j, int k) {
    int& n = number[static_cast<std::size_t>((k * (ny + 1) + j) * (nx + 1) + i)];
    if (n < 0) n = static_cast<int>(mesh.nodes.size()), mesh.nodes.push_back(place(i, j, k));
    return n;
  };
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        if (in(i, j, k))
          mesh.hexes.push_back({node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k),
                                node(i, j, k + 1), node(i + 1, j, k + 1), node(i + 1, j + 1, k + 1),
                                node(i, j + 1, k + 1)});
  return mesh;
}

/// A bar of 0.2 x 0.2 x 1 m whose rows lean by `angle` away from its ends; one row is thinner by a tenth.
Model leaning_bar(double angle, double h, bool guided) {
  const double width = 0.2, length = 1, thin = 0.95, lean = std::tan(angle);
  const int across = static_cast<int>(std::lround(width / h)),
            along = static_cast<int>(std::lround(length / h)) | 1;
  Model m;
  m.mesh = grid(
      across, across, along,
      [&](int i, int j, int k) {
        const double x = width * (static_cast<double>(i) / across - 0.5),
                     y = width * (static_cast<double>(j) / across - 0.5), z = length * k / along;
        const double part = std::clamp((0.5 - std::abs(z - 0.5)) / 0.3, 0.0, 1.0),
                     scale = k == along / 2 || k == along / 2 + 1 ? thin : 1.0;
        return Vec3(x * scale, y * scale, z + lean * x * part);
      },
      [](int, int, int) { return true; });
  m.hold([&](const Vec3& x, std::array<bool, 3>& held, Vec3& direction) {
    if (x.z() < 1e-9) held = {true, true, true};
    if (x.z() > length - 1e-9) held = {guided, guided, true}, direction = Vec3::UnitZ();
  });
  m.area = width * width * thin * thin;
  m.travel = 1.5e-3;
  return m;
}

/// A bar of 0.4 x 0.1 x 1 m made of the cells of a lattice turned by `angle`; its ends of 0.2 m are rigid and
/// guided.
Model turned_lattice(double angle, double h) {
  const double width = 0.4, length = 1, depth = 0.1, head = 0.2;
  const int n = static_cast<int>(std::lround(1.6 / h)),
            layers = std::max(1, static_cast<int>(std::lround(depth / h)));
  const auto place = [&](double i, int j, double k) {
    const double x = (i - n / 2.0 + 0.13) * h, z = (k - n / 2.0) * h;
    return Vec3(std::cos(angle) * x - std::sin(angle) * z, depth * j / layers,
                std::sin(angle) * x + std::cos(angle) * z + 0.5);
  };
  double volume = 0;
  Model m;
  m.mesh = grid(n, layers, n, place, [&](int i, int, int k) {
    const Vec3 middle = place(i + 0.5, 0, k + 0.5);
    const bool in = std::abs(middle.x()) < width / 2 && middle.z() > 0 && middle.z() < length;
    if (in && std::abs(middle.z() - 0.5) < head) volume += h * h * depth / layers;
    return in;
  });
  m.hold([&](const Vec3& x, std::array<bool, 3>& held, Vec3& direction) {
    if (x.z() < head) held = {true, true, true};
    if (x.z() > length - head) held = {true, true, true}, direction = Vec3::UnitZ();
  });
  m.area = volume / (2 * head);
  m.travel = 1.5e-3;
  return m;
}

/// A beam of 0.4 x 0.1 m on a span of some 1.2 m, an odd number of columns of cells, the middle one cut to
/// half its height or not.
Model bent_beam(double h, bool notched) {
  const double height = 0.4, depth = 0.1;
  const int up = static_cast<int>(std::lround(height / h)),
            layers = std::max(1, static_cast<int>(std::lround(depth / h))),
            half = static_cast<int>(std::lround(0.6 / h));
  const double start = -(half + 0.5) * h;
  Model m;
  m.mesh = grid(
      2 * half + 1, layers, up,
      [&](int i, int j, int k) { return Vec3(start + i * h, depth * j / layers, k * h); },
      [&](int i, int, int k) { return !(notched && i == half && k < up / 2); });
  m.hold([&](const Vec3& x, std::array<bool, 3>& held, Vec3& direction) {
    if (x.z() < 1e-9 && std::abs(x.x() - start) < 1e-9) held = {true, true, true};
    if (x.z() < 1e-9 && std::abs(x.x() + start) < 1e-9) held = {false, true, true};
    if (x.z() > height - 1e-9 && std::abs(x.x()) < 0.51 * h)
      held = {false, false, true}, direction = -Vec3::UnitZ();
  });
  m.area = (notched ? 0.5 : 1.0) * height * depth;
  m.travel = 6e-3;
  m.speed = 0.06;
  return m;
}

struct Torn {
  double taken, strength;
};  // T; [Pa]

Torn tear(const Model& model, double cell, const std::string& law, double aggregate) {
  material::Concrete c = material::mc2010(38e6);
  c.aggregate = aggregate;
  const HexMesh& mesh = model.mesh;
  const double shear = c.young / 2 / (1 + c.poisson), bulk = c.young / 3 / (1 - 2 * c.poisson);
  const std::size_t nodes = mesh.nodes.size();
  AlignedVector u(4 * nodes, 0.0), v = u, f = u, mass = u;
  double shortest = 1e9;
  for (std::size_t e = 0; e < mesh.hexes.size(); ++e) {
    const std::array<double, 8> share = corner_volumes(mesh, static_cast<int>(e));
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t d = 0; d < 3; ++d)
        mass[4 * static_cast<std::size_t>(mesh.hexes[e][a]) + d] += density * share[a];
    const Mat3 inverse = jacobian(mesh, static_cast<int>(e), Vec3::Zero()).inverse();
    shortest = std::min(shortest, 2 / inverse.rowwise().norm().maxCoeff());
  }
  ElementOperator elastic(mesh, shear, bulk, false);
  const auto field = make_damage_field(law, mesh, c, false, false, {cell}, "cell");
  const ElasticLimits limits = field->elastic_limits();
  const double step = 0.4 * shortest / std::sqrt((bulk + 4 * shear / 3) / density);
  double work = 0, damped = 0, most = 0, travelled = 0;
  std::vector<int> candidates;
  for (long n = 0; travelled < model.travel; ++n) {
    std::fill(f.begin(), f.end(), 0.0);
    const Motion motion{u.data(), v.data(), n > 0 ? step : 0, false};
    elastic.add_internal_force(u.data(), f.data(), false, true, &limits);
    field->add_forces(motion, f.data());
    elastic.cells_above(limits.energy, candidates);
    for (const int e : candidates) {
      if (!field->try_cell(e, motion, f.data())) continue;
      elastic.add_internal_force_of({e}, u.data(), f.data(), false, -1);
      elastic.set_on(e, false);
    }
    field->accept();
    const double speed = model.speed * std::min(1.0, static_cast<double>(n) * step / 2e-3);
    double load = 0;
    for (std::size_t a = 0; a < nodes; ++a)
      for (std::size_t d = 0; d < 3; ++d) {
        const std::size_t i = 4 * a + d;
        const double before = v[i];
        if (model.held[a][d]) {
          v[i] = speed * model.direction[a][static_cast<long>(d)];
          const double reaction =
              mass[i] * (v[i] - before) / step + f[i] + alpha * mass[i] * 0.5 * (v[i] + before);
          load += reaction * model.direction[a][static_cast<long>(d)];
          work += reaction * 0.5 * (v[i] + before) * step;
        } else {
          v[i] = (before * (1 - 0.5 * alpha * step) - step * f[i] / mass[i]) / (1 + 0.5 * alpha * step);
        }
        damped += alpha * mass[i] * 0.25 * (v[i] + before) * (v[i] + before) * step;
      }
    most = std::max(most, load);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] += step * v[i];
    travelled += step * speed;
  }
  double kinetic = 0;
  for (std::size_t i = 0; i < u.size(); ++i) kinetic += 0.5 * mass[i] * v[i] * v[i];
  return {
      (work - damped - kinetic - elastic.total_energy() - field->stored()) / (c.fracture_energy * model.area),
      most / model.area};
}

}  // namespace

int main(int argc, char** argv) {
  const std::string law = argc > 1 ? argv[1] : "concrete";
  const double aggregate = argc > 2 ? std::stod(argv[2]) : 0.016;
  const std::string part = argc > 3 ? argv[3] : "";
  const auto row = [&](const std::string& name, const std::vector<double>& cells,
                       const std::function<Model(double)>& make) {
    if (name.find(part) == std::string::npos) return;
    fmt::print("| {} |", name);
    for (const double h : cells) {
      std::fflush(stdout);  // the next may take minutes
      const Torn t = tear(make(h), h, law, aggregate);
      fmt::print(" {:.2f} ({:.2f}) |", t.taken, t.strength / 1e6);
    }
    fmt::print("\n");
    std::fflush(stdout);
  };
  fmt::print("| {} | 0.1 m | 0.05 m | 0.033 m |\n|---|---|---|---|\n", law);
  for (const bool guided : {false, true})
    for (const int degrees : {0, 15, 30, 45})
      row(fmt::format("bar, cells lean by {} degrees, heads {}", degrees, guided ? "guided" : "free"),
          {0.1, 0.05, 0.1 / 3}, [&](double h) { return leaning_bar(degrees * M_PI / 180, h, guided); });
  for (const int degrees : {0, 15, 30, 45})
    row(fmt::format("bar, lattice turned by {} degrees, heads guided", degrees), {0.1, 0.05},
        [&](double h) { return turned_lattice(degrees * M_PI / 180, h); });
  row("notched beam, bending", {0.1, 0.05}, [&](double h) { return bent_beam(h, true); });
  row("beam, bending", {0.1, 0.05}, [&](double h) { return bent_beam(h, false); });
}
