// Solutions and first frequencies of structures that are too large to factor.
#include <gtest/gtest.h>

#include <cmath>

#include "fem/bearings/bearings.hpp"
#include "fem/kernels/element_operator.hpp"
#include "fem/linear/linear_system.hpp"
#include "fem/linear/lowest_eigenvalue.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;

namespace {

/// A deck on bents, springs of the bearings between: 13,392 degrees of freedom.
struct Viaduct {
  StructureSpec spec;
  Discretisation cells;
  DofMap dofs;
  std::unique_ptr<ElementOperator> elements;
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
    cells.reinit(make_mesh(spec));
    cells.hold(find_supports(spec, cells.mesh()).held);
    dofs = cells.free_dofs();
    elements = std::make_unique<ElementOperator>(cells.mesh(), 15e9, 20e9, false);
    springs = Bearings(spec, cells.mesh(), viaduct_plan(spec)).springs();
  }
  VecX weight() const {
    VecX b(dofs.size);
    b.setZero();
    for (const auto& number : dofs.number)
      if (number[2] >= 0) b[number[2]] = -1e3;
    return b;
  }
};

}  // namespace

TEST(Multigrid, SoftSpringsBetweenBodiesCostNoIterations) {
  for (const double stiffness : {1e7, 1e9}) {  // the default; as stiff as a cell
    const Viaduct v(stiffness);
    const VecX b = v.weight();
    VecX x(v.dofs.size), y(v.dofs.size);
    CholeskyFactor(assemble_stiffness(v.cells.mesh(), v.dofs, 15e9, 20e9, v.springs), 0, {})
        .solve(b.data(), x.data());
    const int iterations =
        make_multigrid(v.cells, v.dofs, *v.elements, v.springs)->solve(b.data(), y.data(), 1e-10);
    EXPECT_LT(iterations, 65) << stiffness;
    RecordProperty("iterations", iterations);
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
