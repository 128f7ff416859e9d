#include "fem/reference.hpp"

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/base/symmetric_tensor.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/grid/tria.h>

#include <cmath>
#include <vector>

namespace talus::fem {

namespace {

using Strain = dealii::SymmetricTensor<2, 3>;
using Strains = std::vector<Strain>;   // at the eight points

/// assumed_strain.hpp, tensor by tensor, in the axes of the cell.
Strains assumed(const Strains& given, const std::vector<double>& weight, double poisson) {
  Strains out(8);
  Strain mean;
  double volume = 0;
  for (unsigned q = 0; q < 8; ++q) mean += weight[q] * given[q], volume += weight[q];
  for (Strain& e : out) e = mean / volume;
  for (unsigned function = 1; function < 7; ++function) {
    const auto sign = [&](unsigned q) {
      double s = 1;
      for (unsigned d = 0; d < 3; ++d)
        if (function & (1u << d)) s *= q & (1u << d) ? 1 : -1;
      return s;
    };
    Strain part, kept;
    for (unsigned q = 0; q < 8; ++q) part += sign(q) / 8 * given[q];
    for (unsigned d = 0; d < 3; ++d) {
      const unsigned a = (d + 1) % 3, b = (d + 2) % 3;
      if (function == 1u << d) {
        kept[a][a] = part[a][a], kept[b][b] = part[b][b], kept[a][b] = part[a][b];
        kept[d][d] = -poisson / (1 - poisson) * (part[a][a] + part[b][b]);
      } else if (function == (1u << a) + (1u << b)) {
        kept[d][d] = part[d][d];
        kept[a][a] = kept[b][b] = -poisson * part[d][d];
      }
    }
    for (unsigned q = 0; q < 8; ++q) out[q] += sign(q) * kept;
  }
  return out;
}

/// Rotation nearest to the directions of the columns.
dealii::Tensor<2, 3> axes_of(dealii::Tensor<2, 3> j) {
  for (unsigned c = 0; c < 3; ++c) {
    const double length = std::sqrt(j[0][c] * j[0][c] + j[1][c] * j[1][c] + j[2][c] * j[2][c]);
    for (unsigned r = 0; r < 3; ++r) j[r][c] /= length;
  }
  for (int i = 0; i < 60; ++i) j = 0.5 * (j + dealii::transpose(dealii::invert(j)));
  return j;
}

}  // namespace

std::vector<double> reference_internal_force(const HexMesh& mesh, double shear, double bulk, const std::vector<double>& u) {
  static const int vtk[8] = {0, 1, 3, 2, 4, 5, 7, 6};
  std::vector<dealii::Point<3>> vertices;
  for (const Vec3& x : mesh.nodes) vertices.emplace_back(x.x(), x.y(), x.z());
  std::vector<dealii::CellData<3>> cells;
  for (const auto& hex : mesh.hexes) {
    dealii::CellData<3> cell;
    for (int a = 0; a < 8; ++a) cell.vertices[a] = hex[vtk[a]];
    cells.push_back(cell);
  }
  dealii::Triangulation<3> grid;
  grid.create_triangulation(vertices, cells, dealii::SubCellData());
  const dealii::FE_Q<3> fe(1);
  dealii::DoFHandler<3> dofs(grid);
  dofs.distribute_dofs(fe);
  const dealii::QGauss<3> points(2);
  const dealii::QMidpoint<3> middle;
  dealii::FEValues<3> values(fe, points, dealii::update_gradients | dealii::update_JxW_values), centre(fe, middle, dealii::update_jacobians);
  const double young = 9 * bulk * shear / (3 * bulk + shear), poisson = young / (2 * shear) - 1, lambda = bulk - 2.0 / 3 * shear;
  std::vector<double> f(u.size(), 0.0);
  for (const auto& cell : dofs.active_cell_iterators()) {
    values.reinit(cell);
    centre.reinit(cell);
    const dealii::Tensor<2, 3> axes = axes_of(dealii::Tensor<2, 3>(centre.jacobian(0)));
    std::vector<double> weight(8);
    double volume = 0;
    for (unsigned q = 0; q < 8; ++q) volume += weight[q] = values.JxW(q);
    std::vector<Strains> of(24);   // by degree of freedom
    Strains whole(8);
    for (unsigned i = 0; i < 24; ++i) {
      Strains given(8);
      for (unsigned q = 0; q < 8; ++q) {
        dealii::Tensor<2, 3> h;
        h[i % 3] = values.shape_grad(i / 3, q);
        given[q] = dealii::symmetrize(dealii::transpose(axes) * h * axes);
      }
      of[i] = assumed(given, weight, poisson);
      for (unsigned q = 0; q < 8; ++q) whole[q] += u[3 * cell->vertex_index(i / 3) + i % 3] * of[i][q];
    }
    for (unsigned i = 0; i < 24; ++i)
      for (unsigned q = 0; q < 8; ++q)
        f[3 * cell->vertex_index(i / 3) + i % 3] += volume / 8 * (2 * shear * (of[i][q] * whole[q]) + lambda * dealii::trace(of[i][q]) * dealii::trace(whole[q]));
  }
  return f;
}

}  // namespace talus::fem
