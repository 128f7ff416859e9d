// Local refinement: a mesh becomes the coarse mesh of deal.II's Triangulation, whose active cells and hanging nodes it then has.
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/grid/tria.h>
#include <deal.II/lac/affine_constraints.h>

#include <algorithm>
#include <set>

#include "fem/dealii/parts.hpp"

namespace talus::fem {
namespace {

using Triangulation = dealii::Triangulation<3>;

constexpr unsigned vtk_order[8] = {0, 1, 3, 2, 4, 5, 7, 6};   // deal.II numbers vertices lexicographically

dealii::Point<3> point(const Vec3& x) { return {x.x(), x.y(), x.z()}; }
Vec3 vector(const dealii::Point<3>& x) { return {x[0], x[1], x[2]}; }

void coarse_mesh(const HexMesh& mesh, Triangulation& grid) {
  std::vector<dealii::Point<3>> vertices;
  for (const Vec3& x : mesh.nodes) vertices.push_back(point(x));
  std::vector<dealii::CellData<3>> cells(mesh.hexes.size());
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (unsigned a = 0; a < 8; ++a) cells[c].vertices[vtk_order[a]] = static_cast<unsigned>(mesh.hexes[c][a]);
  grid.create_triangulation(vertices, cells, dealii::SubCellData());
}

/// The longest edge of a cell, and whether more than its border lies in a zone.
double longest_edge(const Triangulation::active_cell_iterator& cell) {
  double edge = 0;
  for (unsigned l = 0; l < dealii::GeometryInfo<3>::lines_per_cell; ++l) edge = std::max(edge, cell->line(l)->vertex(0).distance(cell->line(l)->vertex(1)));
  return edge;
}

bool cut_by(const Triangulation::active_cell_iterator& cell, const Box3& zone) {
  Box3 box;
  for (unsigned v = 0; v < 8; ++v) box.extend(vector(cell->vertex(v)));
  const Vec3 common = box.max().cwiseMin(zone.max()) - box.min().cwiseMax(zone.min());
  return (common.array() > 1e-9 * box.sizes().array()).all();
}

void refine(Triangulation& grid, const std::vector<StructureSpec::Refinement>& zones) {
  constexpr int most_halvings = 8;
  for (int level = 0; level < most_halvings; ++level) {
    bool any = false;
    for (const auto& cell : grid.active_cell_iterators())
      for (const StructureSpec::Refinement& zone : zones)
        if (longest_edge(cell) > zone.cell_size * (1 + 1e-6) && cut_by(cell, zone.region)) {
          cell->set_refine_flag();
          any = true;
          break;
        }
    if (!any) return;
    grid.execute_coarsening_and_refinement();
  }
}

/// A new node belongs to a group if all corners do of the edge, face or cell that it halves.
void extend_groups(const Triangulation& grid, HexMesh& mesh) {
  for (auto& [name, nodes] : mesh.node_groups) {
    std::set<unsigned> inside(nodes.begin(), nodes.end());
    const auto halve = [&](unsigned middle, std::initializer_list<unsigned> corners) {
      if (std::all_of(corners.begin(), corners.end(), [&](unsigned v) { return inside.count(v) > 0; })) inside.insert(middle);
    };
    for (const auto& cell : grid.cell_iterators()) {   // level by level
      if (!cell->has_children()) continue;
      for (unsigned l = 0; l < dealii::GeometryInfo<3>::lines_per_cell; ++l) {
        const auto line = cell->line(l);
        halve(line->child(0)->vertex_index(1), {line->vertex_index(0), line->vertex_index(1)});
      }
      for (unsigned f = 0; f < dealii::GeometryInfo<3>::faces_per_cell; ++f) {
        const auto face = cell->face(f);
        halve(face->isotropic_child(0)->vertex_index(3), {face->vertex_index(0), face->vertex_index(1), face->vertex_index(2), face->vertex_index(3)});
      }
      halve(cell->child(0)->vertex_index(7), {cell->vertex_index(0), cell->vertex_index(1), cell->vertex_index(2), cell->vertex_index(3), cell->vertex_index(4), cell->vertex_index(5), cell->vertex_index(6), cell->vertex_index(7)});
    }
    nodes.assign(inside.begin(), inside.end());
  }
}

void take_cells(const Triangulation& grid, HexMesh& mesh) {
  const std::vector<int> component = mesh.component;
  const std::vector<long> number = mesh.number;
  mesh.hexes.clear(), mesh.component.clear(), mesh.number.clear(), mesh.across.clear();
  for (const auto& cell : grid.active_cell_iterators()) {
    std::array<int, 8> hex;
    for (unsigned a = 0; a < 8; ++a) hex[a] = static_cast<int>(cell->vertex_index(vtk_order[a]));
    mesh.hexes.push_back(hex);
    const auto origin = static_cast<std::size_t>(cell->id().get_coarse_cell_id());
    if (!component.empty()) mesh.component.push_back(component[origin]);
    if (!number.empty()) mesh.number.push_back(number[origin]);
    std::array<int, 6> across;
    for (unsigned f = 0; f < 6; ++f) {   // our faces go in deal.II's order: -x, +x, -y, +y, -z, +z
      if (cell->at_boundary(f)) across[f] = -1;
      else if (cell->face(f)->has_children()) across[f] = static_cast<int>(cell->neighbor_child_on_subface(f, 0)->active_cell_index());
      else across[f] = static_cast<int>(cell->neighbor(f)->active_cell_index());
    }
    mesh.across.push_back(across);
  }
}

/// Constraints of one component: the three move alike.
void take_hanging_nodes(const Triangulation& grid, HexMesh& mesh) {
  const dealii::FE_Q<3> element(1);
  dealii::DoFHandler<3> dofs(grid);
  dofs.distribute_dofs(element);
  dealii::AffineConstraints<double> constraints;
  dealii::DoFTools::make_hanging_node_constraints(dofs, constraints);
  constraints.close();
  std::vector<int> node(dofs.n_dofs(), -1);
  for (const auto& cell : dofs.active_cell_iterators())
    for (unsigned v = 0; v < 8; ++v) node[cell->vertex_dof_index(v, 0)] = static_cast<int>(cell->vertex_index(v));
  mesh.hanging.clear();
  for (const auto& line : constraints.get_lines()) {
    HangingNode hanging{node[line.index], {}};
    for (const auto& [master, weight] : line.entries) hanging.masters.emplace_back(node[master], weight);
    std::sort(hanging.masters.begin(), hanging.masters.end());
    mesh.hanging.push_back(std::move(hanging));
  }
  std::sort(mesh.hanging.begin(), mesh.hanging.end(), [](const HangingNode& a, const HangingNode& b) { return a.node < b.node; });
}

}  // namespace

void refine_by_dealii(HexMesh& mesh, const std::vector<StructureSpec::Refinement>& zones) {
  Triangulation grid(Triangulation::limit_level_difference_at_vertices);
  coarse_mesh(mesh, grid);
  refine(grid, zones);
  if (grid.n_active_cells() == mesh.hexes.size()) return;
  // From world axes to the body's own: a rotation and a shift, which three edges of a cell give.
  const auto& hex = mesh.hexes[0];
  const auto edges = [&](const std::vector<Vec3>& x) {
    Mat3 e;
    e << x[static_cast<std::size_t>(hex[1])] - x[static_cast<std::size_t>(hex[0])], x[static_cast<std::size_t>(hex[3])] - x[static_cast<std::size_t>(hex[0])], x[static_cast<std::size_t>(hex[4])] - x[static_cast<std::size_t>(hex[0])];
    return e;
  };
  const Mat3 turn = edges(mesh.local) * edges(mesh.nodes).inverse();
  const Vec3 shift = mesh.local[static_cast<std::size_t>(hex[0])] - turn * mesh.nodes[static_cast<std::size_t>(hex[0])];
  for (std::size_t v = mesh.nodes.size(); v < grid.n_vertices(); ++v) {
    mesh.nodes.push_back(vector(grid.get_vertices()[v]));
    mesh.local.push_back(turn * mesh.nodes.back() + shift);
  }
  extend_groups(grid, mesh);
  take_cells(grid, mesh);
  take_hanging_nodes(grid, mesh);
}

}  // namespace talus::fem
