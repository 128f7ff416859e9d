#include "fem/reference.hpp"

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_system.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/grid/tria.h>
#include <deal.II/lac/dynamic_sparsity_pattern.h>
#include <deal.II/lac/full_matrix.h>
#include <deal.II/lac/sparse_matrix.h>
#include <deal.II/lac/vector.h>

namespace talus::fem {

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
  const dealii::FESystem<3> fe(dealii::FE_Q<3>(1), 3);
  dealii::DoFHandler<3> dofs(grid);
  dofs.distribute_dofs(fe);
  dealii::DynamicSparsityPattern graph(dofs.n_dofs());
  dealii::DoFTools::make_sparsity_pattern(dofs, graph);
  dealii::SparsityPattern pattern;
  pattern.copy_from(graph);
  dealii::SparseMatrix<double> stiffness(pattern);
  const dealii::QGauss<3> points(2);
  dealii::FEValues<3> values(fe, points, dealii::update_gradients | dealii::update_JxW_values);
  const unsigned n = fe.n_dofs_per_cell();
  dealii::Vector<double> x(dofs.n_dofs()), y(dofs.n_dofs());
  std::vector<dealii::types::global_dof_index> index(n);
  const dealii::FEValuesExtractors::Vector field(0);
  for (const auto& cell : dofs.active_cell_iterators()) {
    values.reinit(cell);
    dealii::FullMatrix<double> local(n, n);
    std::vector<double> divergence(n, 0.0);
    double volume = 0;
    for (unsigned q = 0; q < points.size(); ++q) {
      volume += values.JxW(q);
      for (unsigned i = 0; i < n; ++i) divergence[i] += values[field].divergence(i, q) * values.JxW(q);
    }
    for (unsigned q = 0; q < points.size(); ++q)
      for (unsigned i = 0; i < n; ++i)
        for (unsigned j = 0; j < n; ++j)
          local(i, j) += 2 * shear * (dealii::deviator(values[field].symmetric_gradient(i, q)) * dealii::deviator(values[field].symmetric_gradient(j, q))) * values.JxW(q);
    for (unsigned i = 0; i < n; ++i)
      for (unsigned j = 0; j < n; ++j) local(i, j) += bulk * divergence[i] * divergence[j] / volume;
    cell->get_dof_indices(index);
    stiffness.add(index, local);
    for (unsigned v = 0; v < 8; ++v)
      for (unsigned c = 0; c < 3; ++c) x(cell->vertex_dof_index(v, c)) = u[3 * cell->vertex_index(v) + c];
  }
  stiffness.vmult(y, x);
  std::vector<double> f(u.size(), 0.0);
  for (const auto& cell : dofs.active_cell_iterators())
    for (unsigned v = 0; v < 8; ++v)
      for (unsigned c = 0; c < 3; ++c) f[3 * cell->vertex_index(v) + c] = y(cell->vertex_dof_index(v, c));
  return f;
}

}  // namespace talus::fem
