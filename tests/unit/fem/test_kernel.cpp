#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/error.hpp"
#include "fem/kernels/assumed_strain.hpp"
#include "fem/kernels/element_operator.hpp"
#include "unit/fem/fem_specs.hpp"
#include "unit/fem/reference.hpp"

using namespace talus;
using namespace talus::fem;

namespace {
/// A block of hexahedra; `skew` moves every node, so that no two cells are alike.
HexMesh block(int n, double skew, unsigned seed = 1) {
  StructureSpec s;
  s.kind = "box";
  s.size = Vec3(1.0, 1.2, 0.9);
  s.cells = {n, n, n};
  HexMesh mesh = make_mesh(s);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  for (Vec3& x : mesh.nodes) x += skew / n * Vec3(u(random), u(random), u(random));
  return mesh;
}

AlignedVector random_field(std::size_t nodes, double scale, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> d(-scale, scale);
  AlignedVector u(4 * nodes, 0.0);
  for (std::size_t i = 0; i < u.size(); ++i)
    if (i % 4 != 3) u[i] = d(random);
  return u;
}

/// Forces of the kernels, and of the assembled stiffness, at random displacements.
void compare(const HexMesh& given, CellShape expected_shape,
             std::span<const StructureSpec::Refinement> zones = {}) {
  EXPECT_EQ(shape_of(given, 0), expected_shape);
  const double shear = 14e9, bulk = 18e9;
  const Discretisation cells(given, zones);
  const HexMesh& mesh = cells.mesh();
  ElementOperator op(mesh, shear, bulk, false);
  AlignedVector u = random_field(mesh.nodes.size(), 1e-3, 7), f(u.size(), 0.0);
  cells.distribute(u);
  op.add_internal_force(u.data(), f.data(), false, false);
  cells.condense(f);
  const DofMap dofs = cells.free_dofs();
  VecX free(dofs.size), assembled(dofs.size);
  gather(dofs, u, free);
  assemble_stiffness(mesh, dofs, shear, bulk).multiply(free.data(), assembled.data());
  AlignedVector by_matrix(u.size(), 0.0);
  scatter(dofs, assembled, by_matrix);
  std::vector<double> flat;
  for (std::size_t i = 0; i < u.size(); ++i)
    if (i % 4 != 3) flat.push_back(u[i]);
  const std::vector<double> expected = reference_internal_force(cells, shear, bulk, flat);
  double scale = 0;
  for (double e : expected) scale = std::max(scale, std::abs(e));
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_NEAR(f[4 * (i / 3) + i % 3], expected[i], 1e-13 * scale);
    ASSERT_NEAR(by_matrix[4 * (i / 3) + i % 3], expected[i], 1e-13 * scale);
  }
}
}  // namespace

TEST(Kernel, EqualsDealiiOnBricks) { compare(block(3, 0.0), CellShape::brick); }
TEST(Kernel, EqualsDealiiOnSkewCells) { compare(block(3, 0.2), CellShape::general); }
TEST(Kernel, EqualsDealiiOnAffineCells) {
  HexMesh mesh = block(3, 0.0);
  Mat3 shear;
  shear << 1, 0.2, 0.1, -0.3, 1, 0.4, 0.1, -0.2, 1;
  for (Vec3& x : mesh.nodes) x = shear * x;
  compare(mesh, CellShape::affine);
}
TEST(Kernel, EqualsDealiiAtHangingNodes) {
  const std::vector<StructureSpec::Refinement> zones{{Box3(Vec3(0, 0, 0), Vec3(1, 1, 1)), 0.1}};
  const HexMesh mesh = block(3, 0.2);
  ASSERT_GT(Discretisation(mesh, zones).mesh().hanging.size(), 20u);
  compare(mesh, CellShape::general, zones);
}

/// Nodal masses are the row sums of deal.II's consistent mass, in cells that lean and where nodes hang; they
/// are the mass of the body.
TEST(Kernel, MassesAreRowSumsOfDealiis) {
  StructureSpec s = talus::fem::test::cantilever(3, 6);
  s.section = "round", s.rotation = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix(),
  s.supports.clear(), s.probes.clear();
  s.refinements = {{Box3(Vec3(-9, -9, -9), Vec3(9, 9, 6)), 0.3}};
  s.parameters.emplace_back("local_refinement", 1);
  const FemStructure structure(s, Vec3::Zero(), talus::fem::test::silent);
  StructureSpec coarse = s;
  coarse.refinements.clear();
  const Discretisation cells(make_mesh(coarse), s.refinements);
  ASSERT_GT(cells.mesh().hanging.size(), 20u);
  const std::vector<double> expected = reference_masses(cells, s.density);
  double sum = 0, volume = 0;
  for (std::size_t n = 0; n < expected.size(); ++n) {
    ASSERT_NEAR(structure.skin().node_mass(static_cast<int>(n)), expected[n], 1e-12 * expected[n]);
    sum += expected[n];
  }
  for (const double v : cell_volumes(cells.mesh())) volume += v;
  EXPECT_NEAR(sum / (s.density * volume), 1, 1e-12);
}

TEST(Kernel, BulkViscosityTurnsWithItsElement) {
  const HexMesh mesh = block(3, 0.2);
  ElementOperator op(mesh, 14e9, 18e9, true);
  const Mat3 turned = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const Vec3 spin(3, -2, 5);
  AlignedVector u = random_field(mesh.nodes.size(), 1e-2, 3), v = random_field(mesh.nodes.size(), 1.0, 5),
                rigid = v;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    Eigen::Map<Vec3> moved(&u[4 * n]), turns(&rigid[4 * n]);
    moved += turned * mesh.nodes[n] - mesh.nodes[n];
    turns = spin.cross(mesh.nodes[n] + moved);
  }
  AlignedVector f(u.size(), 0.0), none(u.size(), 0.0);
  op.add_bulk_viscosity(u.data(), v.data(), f.data(), 2400, 3500);
  op.add_bulk_viscosity(u.data(), rigid.data(), none.data(), 2400, 3500);
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
  double scale = 0, left = 0;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Vec3 at = Eigen::Map<const Vec3>(&f[4 * n]);
    force += at;
    moment += (mesh.nodes[n] + Eigen::Map<const Vec3>(&u[4 * n])).cross(at);
    scale += at.norm();
    left = std::max(left, Eigen::Map<const Vec3>(&none[4 * n]).norm());
  }
  EXPECT_LT(force.norm(), 1e-13 * scale);
  EXPECT_LT(moment.norm(), 1e-13 * scale);
  EXPECT_LT(left, 1e-13 * scale);
}

TEST(Kernel, AllInstructionSetsAgree) {
  const HexMesh mesh = block(2, 0.2);
  std::vector<int> nodes;
  AlignedVector geometry, scale(8, 1.0);
  const AlignedVector u = random_field(mesh.nodes.size(), 1e-2, 3);
  std::vector<AlignedVector> results;
  std::vector<const Kernels*> sets{&kernels_generic()};
  if (__builtin_cpu_supports("avx2")) sets.push_back(&kernels_avx2());
  if (__builtin_cpu_supports("avx512f")) sets.push_back(&kernels_avx512());
  for (const Kernels* set : sets) {
    const int w = set->width;
    nodes.assign(8 * 8, 0);
    geometry.assign(8 * 98, 0.0);
    for (int cell = 0; cell < 8; ++cell) {
      for (int a = 0; a < 8; ++a) nodes[(cell / w * 8 + a) * w + cell % w] = 4 * mesh.hexes[cell][a];
      const CellDirections directions = cell_directions(mesh, cell);
      double* of = &geometry[cell / w * 98 * w + cell % w];
      for (int i = 0; i < 9; ++i)
        of[i * w] = directions.normal(i % 3, i / 3), of[(9 + i) * w] = directions.edge(i % 3, i / 3);
      for (int q = 0; q < 8; ++q) {
        double values[10];
        point_geometry(mesh, cell, gauss_point(q), values);
        for (int i = 0; i < 10; ++i) of[(18 + q * 10 + i) * w] = values[i];
      }
    }
    AlignedVector f(u.size(), 0.0), energy(8, 0.0), bound(8, 0.0);
    KernelArguments k;
    k.nodes = nodes.data(), k.geometry = geometry.data(), k.scale = scale.data(), k.u = u.data(),
    k.f = f.data();
    k.energy = energy.data(), k.bound = bound.data(), k.last = 8 / w, k.shear = 14e9, k.bulk = 18e9,
    k.finite = true;
    set->internal_force(k);
    results.push_back(f);
  }
  double size = 0;
  for (double x : results[0]) size = std::max(size, std::abs(x));
  for (const auto& r : results)
    for (std::size_t i = 0; i < r.size(); ++i) ASSERT_NEAR(r[i], results[0][i], 1e-13 * size);
}

TEST(Kernel, PatchTest) {
  // A linear displacement leaves no force on interior nodes, and its energy is that of the uniform strain.
  const HexMesh mesh = Discretisation(block(3, 0.25)).mesh();
  const double shear = 14e9, bulk = 18e9;
  ElementOperator op(mesh, shear, bulk, false);
  Mat3 h;
  h << 1e-3, 2e-4, -3e-4, 5e-4, -7e-4, 1e-4, 2e-4, -1e-4, 4e-4;
  AlignedVector u(4 * mesh.nodes.size(), 0.0), f(u.size(), 0.0);
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Vec3 d = h * mesh.nodes[n];
    for (int c = 0; c < 3; ++c) u[4 * n + c] = d[c];
  }
  op.add_internal_force(u.data(), f.data(), false, true);
  std::vector<char> outer(mesh.nodes.size(), 0);
  for (const SkinQuad& quad : skin(mesh, {}))
    for (int n : quad.node) outer[n] = 1;
  const Mat3 strain = 0.5 * (h + h.transpose());
  const Mat3 deviator = strain - strain.trace() / 3 * Mat3::Identity();
  double volume = 0, largest = 0;
  for (double v : cell_volumes(mesh)) volume += v;
  for (double x : f) largest = std::max(largest, std::abs(x));
  int interior = 0;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
    if (!outer[n]) {
      ++interior;
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(f[4 * n + c], 0, 1e-12 * largest);
    }
  EXPECT_EQ(interior, 8);
  const double density = shear * deviator.squaredNorm() + 0.5 * bulk * strain.trace() * strain.trace();
  EXPECT_NEAR(op.total_energy(), density * volume, 1e-12 * density * volume);
}

class FiniteKernel : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Skew, FiniteKernel, testing::Values(0.0, 0.2));

TEST_P(FiniteKernel, ForceIsTheDerivativeOfItsEnergyAndBlindToRotation) {
  const HexMesh mesh = block(2, GetParam());
  ElementOperator op(mesh, 14e9, 18e9, false);
  AlignedVector u = random_field(mesh.nodes.size(), 2e-2, 5), f(u.size(), 0.0), dump(u.size(), 0.0);
  op.add_internal_force(u.data(), f.data(), true, true);
  const AlignedVector direction = random_field(mesh.nodes.size(), 1, 11);
  double slope = 0;
  for (std::size_t i = 0; i < u.size(); ++i) slope += f[i] * direction[i];
  const double h = 2e-6;
  double energy[2];
  for (int side = 0; side < 2; ++side) {
    AlignedVector moved = u;
    for (std::size_t i = 0; i < u.size(); ++i) moved[i] += (side ? h : -h) * direction[i];
    op.add_internal_force(moved.data(), dump.data(), true, true);
    energy[side] = op.total_energy();
  }
  EXPECT_NEAR((energy[1] - energy[0]) / (2 * h), slope, 1e-6 * std::abs(slope));
  // Turned as a whole, the unstrained body stays without force.
  const Mat3 r = Eigen::AngleAxisd(1.2, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  AlignedVector turned(u.size(), 0.0), none(u.size(), 0.0);
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Vec3 d = r * mesh.nodes[n] - mesh.nodes[n];
    for (int c = 0; c < 3; ++c) turned[4 * n + c] = d[c];
  }
  op.add_internal_force(turned.data(), none.data(), true, true);
  for (double x : none) EXPECT_NEAR(x, 0, 1e-4);  // [N], against 1e7 N for a strain of 1e-3
}

TEST(Mesh, InvertedCellIsNamed) {
  HexMesh mesh = block(2, 0);
  std::swap(mesh.hexes[3][0], mesh.hexes[3][4]);
  std::swap(mesh.hexes[3][1], mesh.hexes[3][5]);
  std::swap(mesh.hexes[3][2], mesh.hexes[3][6]);
  std::swap(mesh.hexes[3][3], mesh.hexes[3][7]);
  try {
    check_cells(mesh, "structure.X", "file.msh");
    FAIL() << "an inverted cell passed";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("cell 4"), std::string::npos) << e.what();
  }
}
