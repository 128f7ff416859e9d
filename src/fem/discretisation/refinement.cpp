// Local refinement: a mesh becomes the coarse mesh of deal.II's Triangulation, whose active cells and hanging nodes it then has.
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/grid/tria.h>
#include <deal.II/lac/affine_constraints.h>

#include <algorithm>
#include <set>
#include <utility>

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

std::array<Vec3, 8> corners_of(const Triangulation::active_cell_iterator& cell) {
  std::array<Vec3, 8> corners;
  for (unsigned a = 0; a < 8; ++a) corners[a] = vector(cell->vertex(vtk_order[a]));
  return corners;
}

void refine(Triangulation& grid, const std::vector<StructureSpec::Refinement>& zones) {
  constexpr int most_halvings = 8;
  for (int level = 0; level < most_halvings; ++level) {
    bool any = false;
    for (const auto& cell : grid.active_cell_iterators())
      for (const StructureSpec::Refinement& zone : zones)
        if (to_be_halved(corners_of(cell), zone)) {
          cell->set_refine_flag();
          any = true;
          break;
        }
    if (!any) return;
    grid.execute_coarsening_and_refinement();
  }
}

/// New nodes lie in the middle of the corners of an edge, a face or a cell, level by level.
void take_new_nodes(const Triangulation& grid, HexMesh& mesh) {
  std::vector<char> known(grid.n_vertices(), 0);
  std::fill_n(known.begin(), mesh.nodes.size(), 1);
  mesh.nodes.resize(grid.n_vertices());
  mesh.halved.clear();
  const auto halve = [&](unsigned middle, const auto& body, unsigned corners) {
    if (std::exchange(known[middle], 1) != 0) return;
    HalvedNode& node = mesh.halved.emplace_back();
    node.node = static_cast<int>(middle);
    for (unsigned v = 0; v < corners; ++v) node.corners.push_back(static_cast<int>(body->vertex_index(v)));
    std::sort(node.corners.begin(), node.corners.end());
    mesh.nodes[middle] = vector(grid.get_vertices()[middle]);
  };
  for (const auto& cell : grid.cell_iterators()) {
    if (!cell->has_children()) continue;
    for (unsigned l = 0; l < dealii::GeometryInfo<3>::lines_per_cell; ++l) halve(cell->line(l)->child(0)->vertex_index(1), cell->line(l), 2);
    for (unsigned f = 0; f < dealii::GeometryInfo<3>::faces_per_cell; ++f) halve(cell->face(f)->isotropic_child(0)->vertex_index(3), cell->face(f), 4);
    halve(cell->child(0)->vertex_index(7), cell, 8);
  }
  for (auto& [name, nodes] : mesh.node_groups) {   // a new node belongs to a group if all those corners do
    std::set<int> inside(nodes.begin(), nodes.end());
    for (const HalvedNode& h : mesh.halved)
      if (std::all_of(h.corners.begin(), h.corners.end(), [&](int n) { return inside.count(n) > 0; })) inside.insert(h.node);
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
  take_new_nodes(grid, mesh);
  for (std::size_t v = mesh.local.size(); v < mesh.nodes.size(); ++v) mesh.local.push_back(turn * mesh.nodes[v] + shift);
  take_cells(grid, mesh);
  take_hanging_nodes(grid, mesh);
}

}  // namespace talus::fem
