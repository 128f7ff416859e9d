#include "unit/fem/reference.hpp"

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/base/symmetric_tensor.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_system.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/grid/tria.h>
#include <deal.II/lac/affine_constraints.h>
#include <deal.II/lac/dynamic_sparsity_pattern.h>
#include <deal.II/lac/full_matrix.h>
#include <deal.II/lac/lapack_full_matrix.h>
#include <deal.II/lac/sparse_matrix.h>
#include <deal.II/lac/vector.h>

namespace talus::fem {
namespace {

using Strain = dealii::SymmetricTensor<2, 3>;
using Strains = std::vector<Strain>;  // at the eight points

constexpr unsigned functions[6] = {1, 2, 4, 3, 6, 5};  // bit d: the function holds reference coordinate d

/// +1 or -1: the function at a point of deal.II's QGauss(2), whose coordinates are the bits of its number.
double at_point(unsigned function, unsigned q) {
  double sign = 1;
  for (unsigned d = 0; d < 3; ++d)
    if ((function & (1u << d)) != 0) sign *= (q & (1u << d)) != 0 ? 1 : -1;
  return sign;
}

/// <eps> + sum_k phi_k eps_k.
Strains along_functions(const Strains& given, const dealii::FEValuesBase<3>& values) {
  Strain mean;
  double volume = 0;
  for (unsigned q = 0; q < 8; ++q) mean += values.JxW(q) * given[q], volume += values.JxW(q);
  Strains out(8, mean / volume);
  for (const unsigned function : functions) {
    Strain part;
    for (unsigned q = 0; q < 8; ++q) part += at_point(function, q) / 8 * given[q];
    for (unsigned q = 0; q < 8; ++q) out[q] += at_point(function, q) * part;
  }
  return out;
}

/// phi_k G_m of all functions.
std::vector<Strains> incompatible_modes(const dealii::Tensor<2, 3>& jacobian) {
  const dealii::Tensor<2, 3> normals = dealii::invert(jacobian);
  std::vector<Strains> modes;
  for (const unsigned function : functions)
    for (unsigned d = 0; d < 3; ++d)
      for (unsigned i = 0; (function & (1u << d)) != 0 && i < 3; ++i) {
        dealii::Tensor<1, 3> way;
        way[i] = 1;
        const Strain g = dealii::symmetrize(dealii::outer_product(way, normals[d] / normals[d].norm()));
        Strains& mode = modes.emplace_back(8);
        for (unsigned q = 0; q < 8; ++q) mode[q] = at_point(function, q) * g;
      }
  return modes;
}

double product(const Strains& a, const Strains& b, double shear, double lambda, double weight) {
  double sum = 0;
  for (unsigned q = 0; q < 8; ++q)
    sum += weight * (2 * shear * (a[q] * b[q]) + lambda * dealii::trace(a[q]) * dealii::trace(b[q]));
  return sum;
}

dealii::FullMatrix<double> cell_matrix(const dealii::FEValuesBase<3>& values,
                                       const dealii::Tensor<2, 3>& jacobian, double shear, double lambda) {
  const dealii::FEValuesExtractors::Vector displacement(0);
  double volume = 0;
  for (unsigned q = 0; q < 8; ++q) volume += values.JxW(q);
  std::vector<Strains> strain;
  for (unsigned i = 0; i < 24; ++i) {
    Strains given(8);
    for (unsigned q = 0; q < 8; ++q) given[q] = values[displacement].symmetric_gradient(i, q);
    strain.push_back(along_functions(given, values));
  }
  const std::vector<Strains> mode = incompatible_modes(jacobian);
  const auto count = static_cast<unsigned>(mode.size());
  const auto energy = [&](const Strains& a, const Strains& b) {
    return product(a, b, shear, lambda, volume / 8);
  };
  dealii::LAPACKFullMatrix<double> inverse(count, count);
  dealii::FullMatrix<double> stiff(24, 24), mixed(count, 24), condensed(count, 24), pseudo(count, count);
  for (unsigned i = 0; i < count; ++i) {
    for (unsigned j = 0; j < count; ++j) inverse(i, j) = energy(mode[i], mode[j]);
    for (unsigned j = 0; j < 24; ++j) mixed(i, j) = energy(mode[i], strain[j]);
  }
  for (unsigned i = 0; i < 24; ++i)
    for (unsigned j = 0; j < 24; ++j) stiff(i, j) = energy(strain[i], strain[j]);
  // sym(n_1 (x) n_2) opens two faces and is there twice: a pseudo-inverse.
  inverse.compute_inverse_svd(1e-8);
  for (unsigned i = 0; i < count; ++i) {
    dealii::Vector<double> unit(count), column(count);
    unit(i) = 1;
    inverse.vmult(column, unit);
    for (unsigned j = 0; j < count; ++j) pseudo(j, i) = column(j);
  }
  pseudo.mmult(condensed, mixed);
  dealii::FullMatrix<double> less(24, 24);
  mixed.Tmmult(less, condensed);
  stiff.add(-1, less);
  return stiff;
}

}  // namespace

std::vector<double> reference_internal_force(const Discretisation& cells, double shear, double bulk,
                                             const std::vector<double>& u) {
  const dealii::DoFHandler<3>& dofs = cells.dof_handler();
  const dealii::AffineConstraints<double>& constraints = cells.hanging_node_constraints();
  dealii::DynamicSparsityPattern entries(dofs.n_dofs());
  dealii::DoFTools::make_sparsity_pattern(dofs, entries, constraints, false);
  dealii::SparsityPattern pattern;
  pattern.copy_from(entries);
  dealii::SparseMatrix<double> matrix(pattern);
  const dealii::QGauss<3> points(2);
  const dealii::QMidpoint<3> middle;
  dealii::FEValues<3> values(dofs.get_fe(), points, dealii::update_gradients | dealii::update_JxW_values),
      centre(dofs.get_fe(), middle, dealii::update_jacobians);
  std::vector<dealii::types::global_dof_index> of_cell(24);
  for (const auto& cell : dofs.active_cell_iterators()) {
    values.reinit(cell);
    centre.reinit(cell);
    cell->get_dof_indices(of_cell);
    constraints.distribute_local_to_global(
        cell_matrix(values, dealii::Tensor<2, 3>(centre.jacobian(0)), shear, bulk - 2.0 / 3 * shear), of_cell,
        matrix);
  }
  dealii::Vector<double> displacement(u.begin(), u.end()), force(dofs.n_dofs());
  matrix.vmult(force, displacement);
  constraints.set_zero(force);
  return {force.begin(), force.end()};
}

std::vector<double> reference_masses(const Discretisation& cells, double density) {
  const dealii::DoFHandler<3>& dofs = cells.dof_handler();
  const dealii::QGauss<3> points(2);
  dealii::FEValues<3> values(dofs.get_fe(), points, dealii::update_values | dealii::update_JxW_values);
  dealii::Vector<double> mass(dofs.n_dofs()), of_nodes(24);
  std::vector<dealii::types::global_dof_index> of_cell(24);
  for (const auto& cell : dofs.active_cell_iterators()) {
    values.reinit(cell);
    of_nodes = 0;
    for (unsigned i = 0; i < 24; ++i)
      for (unsigned q = 0; q < 8; ++q) of_nodes(i) += density * values.shape_value(i, q) * values.JxW(q);
    cell->get_dof_indices(of_cell);
    cells.hanging_node_constraints().distribute_local_to_global(of_nodes, of_cell, mass);
  }
  std::vector<double> per_node;
  for (unsigned d = 0; d < mass.size(); d += 3) per_node.push_back(mass(d));
  return per_node;
}

}  // namespace talus::fem
