#include "unit/fem/reference.hpp"

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/base/symmetric_tensor.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/grid/tria.h>
#include <deal.II/lac/full_matrix.h>
#include <deal.II/lac/vector.h>

#include <cmath>
#include <vector>

namespace talus::fem {

namespace {

using Strain = dealii::SymmetricTensor<2, 3>;
using Strains = std::vector<Strain>;   // at the eight points

using Tensor = dealii::Tensor<2, 3>;
using Vector = dealii::Tensor<1, 3>;

/// Directions of a cell: normals of the faces of each reference coordinate, and vectors along its edges.
struct Directions { Vector normal[3], edge[3]; };
Directions directions_of(const Tensor& jacobian) {
  Directions d;
  const Tensor inverse = dealii::invert(jacobian);
  for (unsigned k = 0; k < 3; ++k) {
    for (unsigned i = 0; i < 3; ++i) d.normal[k][i] = inverse[k][i], d.edge[k][i] = jacobian[i][k];
    d.normal[k] /= d.normal[k].norm();
    d.edge[k] /= d.edge[k].norm();
  }
  return d;
}

/// The strain that incompatible displacements, opening the faces of normals n, leave of the given one when the tractions on these faces vanish: by Gauss' algorithm.
Strain released(const Strain& given, const std::vector<Vector>& faces, double shear, double lambda) {
  const auto stress = [&](const Strain& e) { return 2 * shear * e + lambda * dealii::trace(e) * dealii::unit_symmetric_tensor<3>(); };
  std::vector<Strain> added;
  for (unsigned f = 0; f < faces.size(); ++f) {
    std::vector<Vector> ways;
    if (f == 0) {
      for (unsigned i = 0; i < 3; ++i) ways.emplace_back(), ways.back()[i] = 1;
    } else ways = {faces[1], dealii::cross_product_3d(faces[0], faces[1])};   // along the first face's normal the strain is there already
    for (const Vector& way : ways) added.push_back(dealii::symmetrize(dealii::outer_product(way, faces[f])));
  }
  const unsigned size = static_cast<unsigned>(added.size());
  dealii::FullMatrix<double> a(size, size);
  dealii::Vector<double> b(size), x(size);
  for (unsigned i = 0; i < size; ++i) {
    b(i) = -(added[i] * stress(given));
    for (unsigned j = 0; j < size; ++j) a(i, j) = added[i] * stress(added[j]);
  }
  a.gauss_jordan();
  a.vmult(x, b);
  Strain out = given;
  for (unsigned i = 0; i < size; ++i) out += x(i) * added[i];
  return out;
}

/// assumed_strain.hpp, tensor by tensor.
Strains assumed(const Strains& given, const std::vector<double>& weight, const Directions& cell, double shear, double lambda) {
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
    Strain part;
    for (unsigned q = 0; q < 8; ++q) part += sign(q) / 8 * given[q];
    std::vector<Vector> faces;
    for (unsigned d = 0; d < 3; ++d)
      if (function & (1u << d)) faces.push_back(cell.normal[d]);
    const Strain kept = released(part, faces, shear, lambda);
    for (unsigned q = 0; q < 8; ++q) out[q] += sign(q) * kept;
  }
  return out;
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
  const double lambda = bulk - 2.0 / 3 * shear;
  std::vector<double> f(u.size(), 0.0);
  for (const auto& cell : dofs.active_cell_iterators()) {
    values.reinit(cell);
    centre.reinit(cell);
    const Directions directions = directions_of(Tensor(centre.jacobian(0)));
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
        given[q] = dealii::symmetrize(h);
      }
      of[i] = assumed(given, weight, directions, shear, lambda);
      for (unsigned q = 0; q < 8; ++q) whole[q] += u[3 * cell->vertex_index(i / 3) + i % 3] * of[i][q];
    }
    for (unsigned i = 0; i < 24; ++i)
      for (unsigned q = 0; q < 8; ++q)
        f[3 * cell->vertex_index(i / 3) + i % 3] += volume / 8 * (2 * shear * (of[i][q] * whole[q]) + lambda * dealii::trace(of[i][q]) * dealii::trace(whole[q]));
  }
  return f;
}

}  // namespace talus::fem
