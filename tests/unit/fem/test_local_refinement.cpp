// Meshes that are refined in part, by deal.II's Triangulation: nodes that hang between cells of two sizes follow the larger ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "fem/services.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using talus::fem::test::cantilever;
using talus::fem::test::silent;

namespace {

/// A skew box of 4 x 3 x 5 cells, one corner of which is refined twice.
HexMesh refined_box() {
  StructureSpec s = cantilever(4, 5);
  s.kind = "box", s.cells = {4, 3, 5}, s.size = Vec3(1.2, 0.9, 2.0), s.rotation = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  HexMesh mesh = make_mesh(s);
  for (Vec3& x : mesh.nodes) x += 0.02 * Vec3(std::sin(3 * x.y()), std::cos(2 * x.z()), std::sin(x.x() + x.y()));
  Box3 corner;
  corner.extend(mesh.nodes[0]);
  corner.min().array() -= 0.45, corner.max().array() += 0.45;
  refine_locally(mesh, {{corner, 0.11}});
  return mesh;
}

StructureSpec locally(StructureSpec s, const Box3& region, double cell_size) {
  s.refinements = {{region, cell_size}};
  s.parameters.emplace_back("local_refinement", 1);
  return s;
}

/// Half of the pier, from its foot up, in cells half as large.
StructureSpec pier_with_a_fine_foot() { return locally(cantilever(3, 24), Box3(Vec3(-1, -1, 0), Vec3(1, 1, 5.9)), 0.3); }

}  // namespace

TEST(LocalRefinement, HalvesCellsInTheZoneAndNoneAfar) {
  const HexMesh mesh = refined_box();
  EXPECT_GT(mesh.hanging.size(), 20u);
  EXPECT_LT(mesh.hexes.size(), 60u * 64);
  double volume = 0, whole = 0;
  for (const double v : cell_volumes(mesh)) volume += v;
  StructureSpec s = cantilever(4, 5);
  s.kind = "box", s.cells = {4, 3, 5}, s.size = Vec3(1.2, 0.9, 2.0), s.rotation = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  HexMesh coarse = make_mesh(s);
  for (Vec3& x : coarse.nodes) x += 0.02 * Vec3(std::sin(3 * x.y()), std::cos(2 * x.z()), std::sin(x.x() + x.y()));
  for (const double v : cell_volumes(coarse)) whole += v;
  EXPECT_NEAR(volume / whole, 1, 1e-12);
  for (const HangingNode& h : mesh.hanging) {
    Vec3 x = Vec3::Zero();
    for (const auto& [master, weight] : h.masters) x += weight * mesh.nodes[static_cast<std::size_t>(master)];
    EXPECT_LT((x - mesh.nodes[static_cast<std::size_t>(h.node)]).norm(), 1e-12);
  }
  // Faces seen from either side: a smaller cell sees the larger one, which sees one of the four.
  for (std::size_t cell = 0; cell < mesh.hexes.size(); ++cell)
    for (const int other : mesh.across[cell]) {
      if (other < 0) continue;
      const auto& seen = mesh.across[static_cast<std::size_t>(other)];
      EXPECT_TRUE(std::any_of(seen.begin(), seen.end(), [](int back) { return back >= 0; })) << cell;
    }
}

/// A linear field strains every cell alike: no node within feels a force, and the energy is that of the strain in the volume, whatever hangs.
TEST(LocalRefinement, PassesThePatchTest) {
  const HexMesh mesh = refined_box();
  const double shear = 12e9, bulk = 17e9;
  DofMap dofs;
  dofs.number.assign(mesh.nodes.size(), {-1, -1, -1});
  std::vector<char> hangs(mesh.nodes.size(), 0), outside(mesh.nodes.size(), 0);
  for (const HangingNode& h : mesh.hanging) hangs[static_cast<std::size_t>(h.node)] = 1;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
    if (!hangs[n])
      for (int& d : dofs.number[n]) d = dofs.size++;
  for (const SkinQuad& q : skin(mesh, neighbours(mesh), {}))
    for (const int n : q.node) outside[static_cast<std::size_t>(n)] = 1;
  for (const HangingNode& h : mesh.hanging)
    if (outside[static_cast<std::size_t>(h.node)])
      for (const auto& [master, weight] : h.masters) outside[static_cast<std::size_t>(master)] = 1;
  const SymmetricMatrix k = assemble_stiffness(mesh, dofs, shear, bulk);
  Mat3 gradient;
  gradient << 1e-3, 2e-4, -3e-4, 5e-4, -7e-4, 1e-4, 2e-4, 6e-4, 9e-4;
  VecX u(dofs.size), f(dofs.size);
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
    for (int c = 0; c < 3; ++c)
      if (const int d = dofs.number[n][static_cast<std::size_t>(c)]; d >= 0) u[d] = (gradient * mesh.nodes[n])[c];
  k.multiply(u.data(), f.data());
  int within = 0;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
    for (int c = 0; c < 3; ++c)
      if (const int d = dofs.number[n][static_cast<std::size_t>(c)]; d >= 0 && !outside[n]) {
        EXPECT_LT(std::abs(f[d]), 1e-10 * f.cwiseAbs().maxCoeff());
        ++within;
      }
  EXPECT_GT(within, 50);
  double volume = 0;
  for (const double v : cell_volumes(mesh)) volume += v;
  const Mat3 strain = 0.5 * (gradient + gradient.transpose()), stress = 2 * shear * strain + (bulk - 2.0 / 3 * shear) * strain.trace() * Mat3::Identity();
  EXPECT_NEAR(u.dot(f) / (volume * (stress.cwiseProduct(strain)).sum()), 1, 1e-10);
}

/// Kernels with spread and collected hanging nodes give the force of the assembled stiffness: the static answer stays at rest in explicit steps.
TEST(LocalRefinement, KernelsAndStiffnessAgree) {
  StructureSpec s = pier_with_a_fine_foot();
  s.gravity_preload = true;
  FemStructure pier(s, Vec3(3, 0, -9.81), silent);
  EXPECT_GT(pier.mesh().hanging.size(), 10u);
  double volume = 0;
  for (const double v : cell_volumes(pier.mesh())) volume += v;
  const Vec3 weight = 2450 * volume * Vec3(3, 0, -9.81);
  EXPECT_LT((pier.base_force() - weight).norm(), 1e-8 * weight.norm());
  const Vec3 before = pier.probe_displacements()[0];
  const double h = pier.critical_step();
  for (int i = 0; i < 200; ++i) pier.predict(i * h, h), pier.correct(i * h, h, {});
  EXPECT_LT((pier.probe_displacements()[0] - before).norm(), 1e-9 * before.norm());
}

/// Refined where it bends most, the pier answers as the uniformly fine one does, with fewer cells.
TEST(LocalRefinement, AnswersAsUniformRefinementDoes) {
  StructureSpec uniform = cantilever(6, 48), coarse = cantilever(3, 24), fine_foot = pier_with_a_fine_foot();
  std::vector<double> tip, omega;
  std::vector<long> cells;
  for (StructureSpec* s : {&uniform, &fine_foot, &coarse}) {
    s->gravity_preload = true;
    FemStructure pier(*s, Vec3(9.81, 0, 0), silent);
    tip.push_back(pier.probe_displacements()[0].x());
    omega.push_back(pier.frequencies(1)[0]);
    cells.push_back(pier.elements());
  }
  EXPECT_LT(cells[1], 0.65 * static_cast<double>(cells[0]));
  EXPECT_NEAR(tip[1] / tip[0], 1, 0.005);
  EXPECT_NEAR(omega[1] / omega[0], 1, 0.005);
  EXPECT_LT(std::abs(tip[1] / tip[0] - 1), std::abs(tip[2] / tip[0] - 1));
}

/// Free, struck at hanging nodes and others: linear and angular momentum are what the impulses brought, the books close.
TEST(LocalRefinement, KeepsMomentaAndEnergy) {
  for (const double speed : {0.0, 20.0}) {
    StructureSpec s = cantilever(3, 6);
    s.kind = "box", s.size = Vec3(1.5, 1.5, 3), s.supports.clear(), s.probes.clear(), s.initial_velocity = Vec3(speed, 0, 0);
    s = locally(s, Box3(Vec3(0.1, 0.1, 0.1), Vec3(2, 2, 2)), 0.2);
    FemStructure body(s, Vec3::Zero(), silent);
    ASSERT_GT(body.mesh().hanging.size(), 10u);
    const double h = body.critical_step();
    std::vector<NodeImpulse> blow{{body.mesh().hanging[3].node, Vec3(-900, 300, 500)}, {0, Vec3(0, 400, -100)}};
    Vec3 linear = body.energy().linear_momentum, angular = body.energy().angular_momentum;
    for (const NodeImpulse& p : blow) linear += p.impulse, angular += body.node_position(p.node).cross(p.impulse);
    for (int i = 0; i < 300; ++i) body.predict(i * h, h), body.correct(i * h, h, i == 0 ? std::span<const NodeImpulse>(blow) : std::span<const NodeImpulse>{});
    const StructureEnergy e = body.energy();
    EXPECT_LT((e.linear_momentum - linear).norm(), 1e-11 * (linear.norm() + 900));
    EXPECT_LT((e.angular_momentum - angular).norm(), 2e-4 * (angular.norm() + 900)) << "what the blow moves the body by within its first step is of the order h";
    const double mass = 2450 * 1.5 * 1.5 * 3, start = 0.5 * mass * speed * speed;
    EXPECT_GT(e.elastic, 0.01 * e.contact_work);
    EXPECT_LT(std::abs(e.kinetic + e.elastic + e.algorithmic + e.step_dependence - start - e.contact_work), 1e-9 * (start + std::abs(e.contact_work)));
  }
}
