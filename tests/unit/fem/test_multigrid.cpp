// Solutions and first frequencies of structures that are too large to factor.
#include <gtest/gtest.h>

#include <cmath>

#include "fem/bearings/bearings.hpp"
#include "fem/linear/linear_system.hpp"
#include "fem/linear/lowest_eigenvalue.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;

namespace {

/// A deck on bents, springs of the bearings between: 13,392 degrees of freedom.
struct Viaduct {
  StructureSpec spec;
  HexMesh mesh;
  DofMap dofs;
  std::vector<Vec3> position;
  std::vector<int> direction, body;
  std::vector<Spring> springs;

  explicit Viaduct(double bearing_stiffness) {
    spec.name = "V";
    spec.kind = "viaduct";
    spec.young = 36e9;
    spec.cell_size = 0.5;
    spec.parameters = {{"spans", 1},         {"span_length", 20},
                       {"pier_height", 9.7}, {"pier_width", 1.5},
                       {"pier_depth", 3},    {"cap_length", 8},
                       {"deck_width", 8},    {"bearing_stiffness", bearing_stiffness}};
    spec.supports.push_back({"-z", "", {}, {true, true, true}});
    mesh = make_mesh(spec);
    const Supports supports = find_supports(spec, mesh);
    std::vector<int> part(mesh.nodes.size());
    for (std::size_t cell = 0; cell < mesh.hexes.size(); ++cell)
      for (const int n : mesh.hexes[cell]) part[static_cast<std::size_t>(n)] = mesh.component[cell];
    dofs.number.assign(mesh.nodes.size(), {-1, -1, -1});
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
      for (int c = 0; c < 3; ++c)
        if (!supports.held[n][static_cast<std::size_t>(c)])
          dofs.number[n][static_cast<std::size_t>(c)] = dofs.size++, position.push_back(mesh.nodes[n]),
          direction.push_back(c), body.push_back(part[n]);
    springs = Bearings(spec, mesh, viaduct_plan(spec)).springs();
  }
  SymmetricMatrix stiffness() const { return assemble_stiffness(mesh, dofs, 15e9, 20e9, springs); }
  VecX weight() const {
    VecX b(dofs.size);
    for (int d = 0; d < dofs.size; ++d) b[d] = direction[static_cast<std::size_t>(d)] == 2 ? -1e3 : 0;
    return b;
  }
};

}  // namespace

TEST(Multigrid, SoftSpringsBetweenBodiesCostNoIterations) {
  for (const double stiffness : {1e7, 1e9}) {  // the default; as stiff as a cell
    const Viaduct v(stiffness);
    const VecX b = v.weight();
    VecX x(v.dofs.size), y(v.dofs.size);
    CholeskyFactor(v.stiffness(), 0, {}).solve(b.data(), x.data());
    EXPECT_LT(
        make_multigrid(v.stiffness(), v.position, v.direction, v.body)->solve(b.data(), y.data(), 1e-10), 65)
        << stiffness;  // as one body 89 at 1e7; as two 79 at 1e9
    EXPECT_LT((x - y).norm() / x.norm(), 1e-7) << stiffness;
  }
}

TEST(LowestEigenvalue, OfAChainByRoughSolutions) {
  // Unit masses between springs, held at both ends: 4 k sin^2(pi / (2 (n + 1))).
  const int n = 500;
  const double k = 1e4, expected = 4 * k * std::pow(std::sin(M_PI / (2 * (n + 1.0))), 2);
  SymmetricMatrix a;
  a.n = n;
  a.column.push_back(0);
  for (int j = 0; j < n; ++j) {
    a.row.push_back(j), a.value.push_back(2 * k);
    if (j + 1 < n) a.row.push_back(j + 1), a.value.push_back(-k);
    a.column.push_back(static_cast<std::int64_t>(a.row.size()));
  }
  const CholeskyFactor rough(a, 2 * expected, std::vector<double>(n, 1.0));
  int solutions = 0;
  const double found = lowest_eigenvalue(
      VecX::Ones(n), [&](const VecX& x, VecX& y) { a.multiply(x.data(), y.data()); },
      [&](const VecX& r, VecX& w) { rough.solve(r.data(), w.data()), ++solutions; },
      VecX::LinSpaced(n, 1, 1.5), 1e-8);
  EXPECT_NEAR(found / expected, 1, 1e-6);
  EXPECT_LT(solutions, 20);
}
