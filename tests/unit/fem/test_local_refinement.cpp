// Meshes that are refined in part, by deal.II's Triangulation: nodes that hang between cells of two sizes
// follow the larger ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>

#include "fem/discretisation/discretisation.hpp"
#include "fem/discretisation/hanging.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using talus::fem::test::cantilever;
using talus::fem::test::silent;

namespace {

/// A skew box of 4 x 3 x 5 cells, one corner of which is refined twice.
HexMesh refined_box() {
  StructureSpec s = cantilever(4, 5);
  s.kind = "box", s.cells = {4, 3, 5}, s.size = Vec3(1.2, 0.9, 2.0),
  s.rotation = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  HexMesh mesh = make_mesh(s);
  for (Vec3& x : mesh.nodes)
    x += 0.02 * Vec3(std::sin(3 * x.y()), std::cos(2 * x.z()), std::sin(x.x() + x.y()));
  Box3 corner;
  corner.extend(mesh.nodes[0]);
  corner.min().array() -= 0.45, corner.max().array() += 0.45;
  const std::vector<StructureSpec::Refinement> zones{{corner, 0.11}};
  return Discretisation(std::move(mesh), zones).mesh();
}

StructureSpec locally(StructureSpec s, const Box3& region, double cell_size) {
  s.refinements = {{region, cell_size}};
  s.parameters.emplace_back("local_refinement", 1);
  return s;
}

/// Half of the pier, from its foot up, in cells half as large.
StructureSpec pier_with_a_fine_foot() {
  return locally(cantilever(3, 24), Box3(Vec3(-1, -1, 0), Vec3(1, 1, 5.9)), 0.3);
}

}  // namespace

TEST(LocalRefinement, HalvesCellsInTheZoneAndNoneAfar) {
  const HexMesh mesh = refined_box();
  EXPECT_GT(mesh.hanging.size(), 20u);
  EXPECT_LT(mesh.hexes.size(), 60u * 64);
  double volume = 0, whole = 0;
  for (const double v : cell_volumes(mesh)) volume += v;
  StructureSpec s = cantilever(4, 5);
  s.kind = "box", s.cells = {4, 3, 5}, s.size = Vec3(1.2, 0.9, 2.0),
  s.rotation = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  HexMesh coarse = make_mesh(s);
  for (Vec3& x : coarse.nodes)
    x += 0.02 * Vec3(std::sin(3 * x.y()), std::cos(2 * x.z()), std::sin(x.x() + x.y()));
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

/// A linear field strains every cell alike: no node within feels a force, and the energy is that of the
/// strain in the volume, whatever hangs.
TEST(LocalRefinement, PassesThePatchTest) {
  const HexMesh mesh = refined_box();
  const double shear = 12e9, bulk = 17e9;
  DofMap dofs;
  dofs.number.assign(mesh.nodes.size(), {-1, -1, -1});
  std::vector<char> hangs(mesh.nodes.size(), 0), outside(mesh.nodes.size(), 0);
  for (const HangingNode& h : mesh.hanging) hangs[static_cast<std::size_t>(h.node)] = 1;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
    if (!hangs[n])
      for (std::size_t c = 0; c < 3; ++c)
        dofs.number[n][c] = dofs.size++, dofs.place.push_back(static_cast<int>(4 * n + c));
  for (const SkinQuad& q : skin(mesh, {}))
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
      if (const int d = dofs.number[n][static_cast<std::size_t>(c)]; d >= 0)
        u[d] = (gradient * mesh.nodes[n])[c];
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
  const Mat3 strain = 0.5 * (gradient + gradient.transpose()),
             stress = 2 * shear * strain + (bulk - 2.0 / 3 * shear) * strain.trace() * Mat3::Identity();
  EXPECT_NEAR(u.dot(f) / (volume * (stress.cwiseProduct(strain)).sum()), 1, 1e-10);
}

/// Kernels with spread and collected hanging nodes give the force of the assembled stiffness: the static
/// answer stays at rest in explicit steps.
TEST(LocalRefinement, KernelsAndStiffnessAgree) {
  StructureSpec s = pier_with_a_fine_foot();
  s.gravity_preload = true;
  FemStructure pier(s, Vec3(3, 0, -9.81), silent);
  EXPECT_GT(pier.mesh().hanging.size(), 10u);
  double volume = 0;
  for (const double v : cell_volumes(pier.mesh())) volume += v;
  const Vec3 weight = 2450 * volume * Vec3(3, 0, -9.81);
  EXPECT_LT((pier.loads().base_force() - weight).norm(), 1e-8 * weight.norm());
  const Vec3 before = pier.skin().probe_displacements()[0];
  const double h = pier.critical_step();
  for (int i = 0; i < 200; ++i) pier.predict(i * h, h), pier.correct(i * h, h, {});
  EXPECT_LT((pier.skin().probe_displacements()[0] - before).norm(), 1e-9 * before.norm());
}

/// Refined where it bends most, the pier answers as the uniformly fine one does, with fewer cells.
TEST(LocalRefinement, AnswersAsUniformRefinementDoes) {
  StructureSpec uniform = cantilever(6, 48), coarse = cantilever(3, 24), fine_foot = pier_with_a_fine_foot();
  std::vector<double> tip, omega;
  std::vector<long> cells;
  for (StructureSpec* s : {&uniform, &fine_foot, &coarse}) {
    s->gravity_preload = true;
    FemStructure pier(*s, Vec3(9.81, 0, 0), silent);
    tip.push_back(pier.skin().probe_displacements()[0].x());
    omega.push_back(pier.frequencies(1)[0]);
    cells.push_back(pier.elements());
  }
  EXPECT_LT(cells[1], 0.65 * static_cast<double>(cells[0]));
  EXPECT_NEAR(tip[1] / tip[0], 1, 0.005);
  EXPECT_NEAR(omega[1] / omega[0], 1, 0.005);
  EXPECT_LT(std::abs(tip[1] / tip[0] - 1), std::abs(tip[2] / tip[0] - 1));
}

/// Free, struck at hanging nodes and others: linear and angular momentum are what the impulses brought, the
/// books close.
TEST(LocalRefinement, KeepsMomentaAndEnergy) {
  for (const double speed : {0.0, 20.0}) {
    StructureSpec s = cantilever(3, 6);
    s.kind = "box", s.size = Vec3(1.5, 1.5, 3), s.supports.clear(), s.probes.clear(),
    s.initial_velocity = Vec3(speed, 0, 0);
    s = locally(s, Box3(Vec3(0.1, 0.1, 0.1), Vec3(2, 2, 2)), 0.2);
    FemStructure body(s, Vec3::Zero(), silent);
    ASSERT_GT(body.mesh().hanging.size(), 10u);
    const double h = body.critical_step();
    std::vector<NodeImpulse> blow{{body.mesh().hanging[3].node, Vec3(-900, 300, 500)},
                                  {0, Vec3(0, 400, -100)}};
    Vec3 linear = body.energy().linear_momentum, angular = body.energy().angular_momentum;
    for (const NodeImpulse& p : blow)
      linear += p.impulse, angular += body.skin().node_position(p.node).cross(p.impulse);
    for (int i = 0; i < 300; ++i)
      body.predict(i * h, h),
          body.correct(i * h, h,
                       i == 0 ? std::span<const NodeImpulse>(blow) : std::span<const NodeImpulse>{});
    const StructureEnergy e = body.energy();
    EXPECT_LT((e.linear_momentum - linear).norm(), 1e-11 * (linear.norm() + 900));
    EXPECT_LT((e.angular_momentum - angular).norm(), 2e-4 * (angular.norm() + 900))
        << "what the blow moves the body by within its first step is of the order h";
    const double mass = 2450 * 1.5 * 1.5 * 3, start = 0.5 * mass * speed * speed;
    EXPECT_GT(e.elastic, 0.01 * e.contact_work);
    EXPECT_LT(std::abs(e.kinetic + e.elastic + e.algorithmic + e.step_dependence - start - e.contact_work),
              1e-9 * (start + std::abs(e.contact_work)));
  }
}

/// A ringing pier whose cells are halved twice, in two places: the field of its motion, its linear momentum
/// and the sum of its books stay.
TEST(LocalRefinement, MotionGoesOnWhereCellsAreHalved) {
  StructureSpec s = cantilever(3, 12);
  s.gravity_preload = true;
  s.parameters.emplace_back(ImpactRefinement::size_key, 0.3);
  auto pier = std::make_unique<FemStructure>(s, Vec3(1, 0, -9.81), silent);
  std::vector<StructureSpec::Refinement> zones;
  double t = 0, permanent = pier->permanent_energy();
  const auto sum = [&] {
    const StructureEnergy e = pier->energy();
    return e.kinetic + e.elastic + e.gravity_potential + e.algorithmic + e.step_dependence - e.contact_work -
           pier->permanent_energy();
  };
  const double start = sum();
  for (const double height : {4.0, 9.0}) {
    std::vector<NodeImpulse> blow{{40, Vec3(900, -300, 100)}};
    for (int i = 0; i < 50; ++i) {
      const double h = pier->critical_step();
      pier->predict(t, h),
          pier->correct(t, h, i == 0 ? std::span<const NodeImpulse>(blow) : std::span<const NodeImpulse>{});
      t += h;
    }
    zones.push_back({Box3(Vec3(0.2, -1, height), Vec3(1, 1, height + 1)), 0.3});
    const Vec3 probe = pier->skin().probe_displacements()[0];
    std::unique_ptr<FemStructure> finer(static_cast<FemStructure*>(pier->refined(zones).release()));
    ASSERT_TRUE(finer);
    const StructureEnergy before = pier->energy(),
                          after = finer->energy();  // both at the time of the displacements
    EXPECT_GT(before.linear_momentum.norm(), 10);
    EXPECT_LT((after.linear_momentum - before.linear_momentum).norm(), 1e-11 * before.linear_momentum.norm());
    EXPECT_LT((finer->skin().probe_displacements()[0] - probe).norm(), 0.05 * probe.norm());
    EXPECT_LE(after.kinetic, before.kinetic);  // squares of means
    EXPECT_GT(after.kinetic, 0.85 * before.kinetic);
    EXPECT_GT(finer->elements(), pier->elements());
    EXPECT_FALSE(finer->refined(zones));  // it has them
    pier = std::move(finer);
    EXPECT_NEAR(sum(), start, 1e-9 * pier->energy().contact_work);
    // What it would be without motion is another: its own state at rest, at the same nodes a field of the
    // finer mesh.
    EXPECT_NE(pier->permanent_energy(), permanent);
    permanent = pier->permanent_energy();
  }
  const std::vector<Vec3> u = pier->snapshot().displacement;
  for (const HangingNode& h : pier->mesh().hanging)
    for (Eigen::Index c = 0; c < 3; ++c) {
      double mean = 0;
      for (const auto& [master, weight] : h.masters) mean += weight * u[static_cast<std::size_t>(master)][c];
      EXPECT_NEAR(u[static_cast<std::size_t>(h.node)][c], mean, 1e-15);
    }
}

/// Whatever cells are gone, what is left is bounded: the vectors of area of its faces add up to zero and
/// their moments to its volume, and cut at the middles of their edges any two faces meet in whole edges.
/// Whichever cell goes, the middle of every face that is bared is that of its corners, or of two across from
/// each other where all four follow more nodes than a surface holds, as of faces within the zone that end at
/// the middle of a larger cell.
TEST(LocalRefinement, BaredFacesFollowNodesThatDoNotHang) {
  const HexMesh mesh = refined_box();
  int by_diagonal = 0;
  for (std::size_t gone = 0; gone < mesh.hexes.size(); ++gone) {
    std::vector<char> live(mesh.hexes.size(), 1);
    live[gone] = 0;
    for (const SkinQuad& quad : skin(mesh, live)) {
      const TriangleSurface::NodeWeights w = followed_by_face(mesh, quad.node);
      std::set<int> all;
      std::array<Vec3, 4> x;
      for (std::size_t k = 0; k < 4; ++k) {
        x[k] = mesh.nodes[static_cast<std::size_t>(quad.node[k])];
        const TriangleSurface::NodeWeights of_corner = followed_by_node(mesh, quad.node[k]);
        all.insert(of_corner.node.begin(), of_corner.node.begin() + of_corner.count);
      }
      Vec3 followed = Vec3::Zero();
      double sum = 0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(w.count); ++k) {
        EXPECT_EQ(hanging_node(mesh, w.node[k]), nullptr);
        EXPECT_TRUE(all.contains(w.node[k]));
        followed += w.weight[k] * mesh.nodes[static_cast<std::size_t>(w.node[k])];
        sum += w.weight[k];
      }
      EXPECT_NEAR(sum, 1, 1e-14);
      const double one = (followed - 0.5 * (x[0] + x[2])).norm(),
                   other = (followed - 0.5 * (x[1] + x[3])).norm(),
                   four = (followed - 0.25 * (x[0] + x[1] + x[2] + x[3])).norm();
      if (all.size() <= 4) {
        EXPECT_LT(four, 1e-12);
      } else {
        ++by_diagonal;
        EXPECT_LT(std::min(one, other), 1e-12);
      }
    }
  }
  EXPECT_GT(by_diagonal, 0);
}

TEST(LocalRefinement, WhatIsLeftHasAClosedSurface) {
  const HexMesh mesh = refined_box();
  const std::vector<double> volumes = cell_volumes(mesh);
  std::uint64_t seed = 12345;
  for (int run = 0; run < 20; ++run) {
    std::vector<char> live(mesh.hexes.size());
    double volume = 0;
    for (std::size_t c = 0; c < live.size(); ++c) {
      seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
      live[c] = run == 0 || seed % 4 != 0;
      volume += live[c] ? volumes[c] : 0;
    }
    const std::vector<SkinQuad> quads = cut_at_middles(mesh, skin(mesh, live));
    const ClosedSurface surface = close_surface(quads);
    std::map<std::pair<int, int>, int> edges;
    double enclosed = 0, area = 0;
    Vec3 sum = Vec3::Zero();
    for (std::size_t q = 0; q < quads.size(); ++q) {
      EXPECT_TRUE(live[static_cast<std::size_t>(quads[q].cell)]);
      const auto& v = surface.quad[q];
      for (const auto& [i, j, k] : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
        const std::array<int, 3> t{v[static_cast<std::size_t>(i)], v[static_cast<std::size_t>(j)],
                                   v[static_cast<std::size_t>(k)]};
        if (t[1] == t[2]) continue;
        const auto at = [&](std::size_t c) -> const Vec3& {
          return mesh.nodes[static_cast<std::size_t>(surface.node[static_cast<std::size_t>(t[c])])];
        };
        const Vec3 normal = (at(1) - at(0)).cross(at(2) - at(0)) / 2;
        EXPECT_GT(normal.norm(), 1e-6);
        sum += normal, area += normal.norm();
        enclosed += at(0).dot(at(1).cross(at(2))) / 6;
        for (std::size_t c = 0; c < 3; ++c) {
          const int a = t[c], b = t[(c + 1) % 3];
          edges[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
        }
      }
    }
    EXPECT_LT(sum.norm(), 1e-12 * area);
    EXPECT_NEAR(enclosed, volume, 0.01 * volume);  // cells are not quite bounded by triangles
    for (const auto& [edge, balance] : edges) EXPECT_EQ(balance, 0) << edge.first << ' ' << edge.second;
  }
}

namespace {

/// A bar of concrete, finer up to `finer_to` [m], torn apart by what lies beyond `pulled_from` [m]: what
/// comes off has a closed surface, its mass and its momenta.
void tear_bar(double finer_to, double pulled_from, const Vec3& velocity) {
  StructureSpec s;
  s.name = "bar", s.kind = "box", s.f_cm = 38e6, s.density = 2450, s.size = Vec3(1.0, 0.2, 0.2),
  s.cells = {10, 2, 2}, s.damage = "concrete", s.rate_effect = false, s.integrator = "explicit";
  s.supports.push_back({"-x", "", {}, {true, true, true}});
  s = locally(s, Box3(Vec3(-0.12, -0.1, -0.1), Vec3(finer_to, 0.1, 0.1)), 0.05);
  FemStructure bar(s, Vec3::Zero(), silent);
  ASSERT_GT(bar.mesh().hanging.size(), 10u);
  const int nodes = static_cast<int>(bar.mesh().nodes.size());
  const auto whole = [&] {
    double mass = 0;
    for (int n = 0; n < nodes; ++n)
      if (std::isfinite(bar.skin().node_mass(n))) mass += bar.skin().node_mass(n);
    return mass;
  };
  const double h = bar.critical_step();
  double t = 0, mass = 0, fastest = 0;  // [m/s]
  std::vector<Fragment> fragments;
  StructureEnergy before;
  for (int i = 0; i < 8000 && fragments.empty(); ++i) {
    bar.predict(t, h);
    std::vector<NodeImpulse> pull;
    for (int n = 0; n < nodes; ++n)
      if (bar.mesh().nodes[static_cast<std::size_t>(n)].x() > pulled_from && bar.skin().node_mass(n) > 0)
        pull.push_back({n, bar.skin().node_mass(n) * (velocity - bar.skin().predicted_velocity(n))});
    bar.correct(t, h, pull);
    t += h;
    before = bar.energy();
    mass = whole();
    fastest = 0;
    for (int n = 0; n < nodes; ++n)
      if (bar.skin().node_mass(n) > 0) fastest = std::max(fastest, bar.skin().predicted_velocity(n).norm());
    fragments = bar.take_fragments();
  }
  ASSERT_FALSE(fragments.empty()) << bar.elements() << " cells, damage " << bar.damage().largest << " at "
                                  << t << " s";
  const StructureEnergy after = bar.energy();
  Vec3 momentum = after.linear_momentum, spin = after.angular_momentum;
  double rest = whole(), kinetic = after.kinetic;
  for (const Fragment& f : fragments) {
    momentum += f.linear_momentum, spin += f.angular_momentum + f.centroid.cross(f.linear_momentum);
    rest += f.mass, kinetic += f.kinetic;
    double volume = 0;
    std::map<std::pair<int, int>, int> edges;
    for (const auto& tri : f.triangles) {
      const auto at = [&](std::size_t c) -> const Vec3& {
        return f.vertices[static_cast<std::size_t>(tri[c])];
      };
      volume += at(0).dot(at(1).cross(at(2))) / 6;
      for (std::size_t c = 0; c < 3; ++c)
        edges[{std::min(tri[c], tri[(c + 1) % 3]), std::max(tri[c], tri[(c + 1) % 3])}] +=
            tri[c] < tri[(c + 1) % 3] ? 1 : -1;
    }
    EXPECT_GT(volume, 0);
    for (const auto& [edge, balance] : edges) EXPECT_EQ(balance, 0);
  }
  // Cells that hung by nodes of the piece alone are dust now: their nodes' mass and motion left.
  const double dust = mass - rest;
  EXPECT_GE(dust, -1e-12 * mass);
  EXPECT_LE(dust, 0.01 * mass);
  EXPECT_NEAR((momentum - before.linear_momentum).norm(), 0, 1e-12 * before.linear_momentum.norm());
  EXPECT_NEAR((spin - before.angular_momentum).norm(), 0, 1e-11 * before.angular_momentum.norm());
  EXPECT_NEAR(kinetic, before.kinetic, 1e-11 * before.kinetic + std::max(0.0, dust) * fastest * fastest / 2);
}

}  // namespace

TEST(LocalRefinement, PiecesComeOffWithTheirMassAndMomenta) { tear_bar(0.12, 0.25, Vec3(5, 1, 0)); }

/// Torn where smaller cells end: of the faces of larger cells there only some quarters are bared.
TEST(LocalRefinement, PiecesComeOffWhereSmallerCellsEnd) {
  for (const double from : {0.15, 0.19, 0.25})
    for (const Vec3& velocity : {Vec3(5, 1, 0), Vec3(3, 4, 2), Vec3(1, 6, 3), Vec3(8, 2, 5)}) {
      SCOPED_TRACE(from);
      tear_bar(0.15, from, velocity);
      tear_bar(0.22, from, velocity);
    }
}
