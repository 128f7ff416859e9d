#include "fem/discretisation/discretisation.hpp"

#include <deal.II/dofs/dof_handler.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_system.h>
#include <deal.II/grid/tria.h>
#include <deal.II/lac/affine_constraints.h>
#include <deal.II/lac/vector.h>
#include <deal.II/numerics/vector_tools_interpolate.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <utility>

#include "core/error.hpp"
#include "fem/discretisation/hanging.hpp"

namespace talus::fem {
namespace {

using Triangulation = dealii::Triangulation<3>;
using Cell = Triangulation::active_cell_iterator;
using Vector = dealii::Vector<double>;

constexpr unsigned vtk_order[8] = {0, 1, 3, 2, 4, 5, 7, 6};  // deal.II numbers vertices lexicographically

Vec3 position(const dealii::Point<3>& x) { return {x[0], x[1], x[2]}; }

/// Place of a degree of freedom in fields of four numbers per node.
std::size_t padded(dealii::types::global_dof_index dof) { return 4 * (dof / 3) + dof % 3; }

void create_coarse_cells(const HexMesh& mesh, Triangulation& grid) {
  std::vector<dealii::Point<3>> vertices;
  vertices.reserve(mesh.nodes.size());
  for (const Vec3& x : mesh.nodes) vertices.emplace_back(x.x(), x.y(), x.z());
  std::vector<dealii::CellData<3>> cells(mesh.hexes.size());
  for (std::size_t c = 0; c < cells.size(); ++c) {
    for (unsigned a = 0; a < 8; ++a)
      cells[c].vertices[vtk_order[a]] = static_cast<unsigned>(mesh.hexes[c][a]);
    if (!mesh.component.empty()) cells[c].material_id = static_cast<unsigned>(mesh.component[c]);
  }
  grid.create_triangulation(vertices, cells, dealii::SubCellData());
}

std::array<Vec3, 8> corners_of(const Cell& cell) {
  std::array<Vec3, 8> corners;
  for (unsigned a = 0; a < 8; ++a) corners[a] = position(cell->vertex(vtk_order[a]));
  return corners;
}

using Zone = StructureSpec::Refinement;

/// Takes flags back until none is on a cell of these, nor on one whose halves would ask for its own.
void spare(Triangulation& grid, std::vector<char> kept) {
  std::vector<int> largest(grid.n_vertices());  // level of the largest of them that is flagged at a vertex
  for (bool grown = true; grown;) {
    grid.prepare_coarsening_and_refinement();  // sets those that differences of size ask for
    grown = false;
    std::fill(largest.begin(), largest.end(), std::numeric_limits<int>::max());
    for (const Cell& cell : grid.active_cell_iterators()) {
      if (kept[cell->active_cell_index()] == 0 || !cell->refine_flag_set()) continue;
      cell->clear_refine_flag();
      for (const unsigned v : cell->vertex_indices()) {
        int& of = largest[cell->vertex_index(v)];
        of = std::min(of, cell->level());
      }
    }
    for (const Cell& cell : grid.active_cell_iterators()) {
      bool beside = false;
      for (const unsigned v : cell->vertex_indices())
        beside = beside || cell->level() > largest[cell->vertex_index(v)];
      if (!beside || !cell->refine_flag_set()) continue;
      cell->clear_refine_flag();
      kept[cell->active_cell_index()] = 1;
      grown = true;
    }
  }
}

void halve(Triangulation& grid, std::span<const Zone> zones, const std::set<CellBox>& kept, double most) {
  for (int level = 0; level < most_halvings; ++level) {
    double halved = 0;
    std::vector<char> stays(grid.n_active_cells(), 0);
    for (const Cell& cell : grid.active_cell_iterators()) {
      const std::array<Vec3, 8> corners = corners_of(cell);
      char& stay = stays[cell->active_cell_index()] = kept.count(box_about(corners)) > 0;
      if (stay != 0 || std::none_of(zones.begin(), zones.end(),
                                    [&](const Zone& zone) { return to_be_halved(corners, zone); }))
        continue;
      cell->set_refine_flag();
      ++halved;
    }
    if (halved == 0) return;
    if (const double count = grid.n_active_cells() + 7 * halved; count > most)
      throw NumericalFailure(fmt::format(
          "finer cells (refine) come to more than {:.3g} million, and {:.3g} million are what this "
          "machine holds: take larger ones, or a smaller region or reach",
          count / 1e6, most / 1e6));
    if (!kept.empty()) spare(grid, std::move(stays));
    grid.execute_coarsening_and_refinement();
  }
}

/// Zones in their order, so that a list that goes on where another ended makes cells that are its cells or
/// parts of them: those before the first cell that stays together, each later one by itself.
void refine(Triangulation& grid, std::span<const Zone> zones, double most) {
  std::set<CellBox> kept;
  const auto first = std::find_if(zones.begin(), zones.end(), [](const Zone& z) { return z.cell_size == 0; });
  const auto together = static_cast<std::size_t>(first - zones.begin());
  if (together > 0) halve(grid, zones.first(together), kept, most);
  for (std::size_t k = together; k < zones.size(); ++k)
    if (zones[k].cell_size == 0)
      kept.insert(numbers_of(zones[k].region));
    else
      halve(grid, zones.subspan(k, 1), kept, most);
}

/// The cell across a face, of four smaller ones the first; -1: none.
int neighbour(const Cell& cell, unsigned face) {
  if (cell->at_boundary(face)) return -1;
  if (cell->face(face)->has_children())
    return static_cast<int>(cell->neighbor_child_on_subface(face, 0)->active_cell_index());
  return static_cast<int>(cell->neighbor(face)->active_cell_index());
}

}  // namespace

Discretisation::Discretisation() = default;
Discretisation::~Discretisation() = default;

Discretisation::Discretisation(HexMesh coarse, std::span<const StructureSpec::Refinement> zones) {
  reinit(std::move(coarse), zones);
}

void Discretisation::reinit(HexMesh coarse, std::span<const StructureSpec::Refinement> zones, double most) {
  forget_cells();
  mesh_ = std::move(coarse);
  triangulation_ = std::make_unique<Triangulation>(Triangulation::limit_level_difference_at_vertices);
  dof_handler_ = std::make_unique<dealii::DoFHandler<3>>(*triangulation_);
  hanging_ = std::make_unique<dealii::AffineConstraints<double>>();
  constraints_ = std::make_unique<dealii::AffineConstraints<double>>();
  create_coarse_cells(mesh_, *triangulation_);
  refine(*triangulation_, zones, most);
  const dealii::FESystem<3> element(dealii::FE_Q<3>(1), 3);
  dof_handler_->distribute_dofs(element);
  std::vector<dealii::types::global_dof_index> number(dof_handler_->n_dofs());
  for (const auto& cell : dof_handler_->active_cell_iterators())
    for (unsigned v = 0; v < 8; ++v)
      for (unsigned c = 0; c < 3; ++c) number[cell->vertex_dof_index(v, c)] = 3 * cell->vertex_index(v) + c;
  dof_handler_->renumber_dofs(number);
  dealii::DoFTools::make_hanging_node_constraints(*dof_handler_, *hanging_);
  hanging_->close();
  constraints_->copy_from(*hanging_);
  take_new_nodes();
  take_cells();
  take_hanging_nodes();
}

/// A new node, in the middle of an edge, a face or a cell, belongs to a group if the corners of those do.
void Discretisation::take_new_nodes() {
  const std::size_t coarse = mesh_.nodes.size();
  if (triangulation_->n_vertices() == coarse) return;
  std::vector<char> known(triangulation_->n_vertices(), 0);
  std::fill_n(known.begin(), coarse, 1);
  mesh_.local.resize(known.size());
  std::vector<std::set<int>> inside;
  for (const auto& [name, nodes] : mesh_.node_groups) inside.emplace_back(nodes.begin(), nodes.end());
  const auto halve = [&](unsigned middle, const auto& body, unsigned corners) {
    if (std::exchange(known[middle], 1) != 0) return;
    Vec3 local = Vec3::Zero();  // the axes of a part are straight: the mean, there as in the world
    for (unsigned v = 0; v < corners; ++v) local += mesh_.local[body->vertex_index(v)] / corners;
    mesh_.local[middle] = local;
    for (std::set<int>& group : inside) {
      bool all = true;
      for (unsigned v = 0; v < corners; ++v)
        all = all && group.count(static_cast<int>(body->vertex_index(v))) > 0;
      if (all) group.insert(static_cast<int>(middle));
    }
  };
  for (const auto& cell :
       triangulation_->cell_iterators()) {  // level by level: corners come before what lies between them
    if (!cell->has_children()) continue;
    for (const unsigned l : cell->line_indices())
      halve(cell->line(l)->child(0)->vertex_index(1), cell->line(l), 2);
    for (const unsigned f : cell->face_indices())
      halve(cell->face(f)->isotropic_child(0)->vertex_index(3), cell->face(f), 4);
    halve(cell->child(0)->vertex_index(7), cell, 8);
  }
  auto members = inside.begin();
  for (auto& [name, nodes] : mesh_.node_groups) nodes.assign(members->begin(), members->end()), ++members;
  for (std::size_t v = coarse; v < known.size(); ++v)
    mesh_.nodes.push_back(position(triangulation_->get_vertices()[v]));
}

/// Tables of the kernels, in VTK's order of vertices and faces: -x, +x, -y, +y, -z, +z, as deal.II's.
void Discretisation::take_cells() {
  const std::vector<long> number = std::move(mesh_.number);
  const std::size_t cells = triangulation_->n_active_cells();
  mesh_.number.clear();
  mesh_.hexes.resize(cells);
  mesh_.across.resize(cells);
  if (!mesh_.component.empty()) mesh_.component.resize(cells);
  std::vector<dealii::types::global_dof_index> dofs(24);
  const dealii::FiniteElement<3>& element = dof_handler_->get_fe();
  for (const auto& cell : dof_handler_->active_cell_iterators()) {
    const std::size_t i = cell->active_cell_index();
    cell->get_dof_indices(dofs);
    for (unsigned a = 0; a < 8; ++a)
      mesh_.hexes[i][a] = static_cast<int>(dofs[element.component_to_system_index(0, vtk_order[a])] / 3);
    for (const unsigned f : cell->face_indices()) mesh_.across[i][f] = neighbour(cell, f);
    if (!mesh_.component.empty()) mesh_.component[i] = static_cast<int>(cell->material_id());
    if (!number.empty()) mesh_.number.push_back(number[cell->id().get_coarse_cell_id()]);
    for (const unsigned l : cell->line_indices()) {  // edges of a larger cell that smaller ones halve
      const auto line = cell->line(l);
      if (!line->has_children()) continue;
      const int a = static_cast<int>(line->vertex_index(0)), b = static_cast<int>(line->vertex_index(1));
      mesh_.middle[{std::min(a, b), std::max(a, b)}] = static_cast<int>(line->child(0)->vertex_index(1));
    }
  }
}

/// Constraints of one component: the three move alike.
void Discretisation::take_hanging_nodes() {
  for (const auto& line : hanging_->get_lines()) {
    if (line.index % 3 != 0) continue;
    HangingNode& hanging = mesh_.hanging.emplace_back();
    hanging.node = static_cast<int>(line.index / 3);
    for (const auto& [master, weight] : line.entries)
      hanging.masters.emplace_back(static_cast<int>(master / 3), weight);
    std::sort(hanging.masters.begin(), hanging.masters.end());
  }
  std::sort(mesh_.hanging.begin(), mesh_.hanging.end(),
            [](const HangingNode& a, const HangingNode& b) { return a.node < b.node; });
}

void Discretisation::hold(const std::vector<std::array<bool, 3>>& held) {
  constraints_->clear();
  for (std::size_t n = 0; n < held.size(); ++n)
    for (std::size_t c = 0; c < 3; ++c)
      if (held[n][c] && !hanging_->is_constrained(3 * n + c)) constraints_->add_line(3 * n + c);
  constraints_->merge(*hanging_);
  constraints_->close();
}

DofMap Discretisation::free_dofs() const {
  DofMap dofs;
  dofs.number.assign(mesh_.nodes.size(), {-1, -1, -1});
  for (std::size_t n = 0; n < dofs.number.size(); ++n)
    for (std::size_t c = 0; c < 3; ++c)
      if (!constraints_->is_constrained(3 * n + c)) {
        dofs.number[n][c] = dofs.size++;
        dofs.place.push_back(static_cast<int>(4 * n + c));
      }
  return dofs;
}

void Discretisation::distribute(AlignedVector& u) const {
  for (const auto& line : hanging_->get_lines()) {
    double sum = 0;
    for (const auto& [master, weight] : line.entries) sum += weight * u[padded(master)];
    u[padded(line.index)] = sum;
  }
}

void Discretisation::condense(AlignedVector& f) const {
  for (const auto& line : hanging_->get_lines()) {
    const double force = std::exchange(f[padded(line.index)], 0.0);
    for (const auto& [master, weight] : line.entries) f[padded(master)] += weight * force;
  }
}

std::vector<NodeImpulse> Discretisation::condense(std::span<const NodeImpulse> impulses) const {
  std::vector<NodeImpulse> out;
  for (const NodeImpulse& p : impulses) {
    const HangingNode* h = hanging_node(mesh_, p.node);
    if (h == nullptr)
      out.push_back(p);
    else
      for (const auto& [master, weight] : h->masters) out.push_back({master, weight * p.impulse});
  }
  return out;
}

void Discretisation::interpolate(const Discretisation& before, const AlignedVector& from,
                                 AlignedVector& to) const {
  Vector coarse(before.dof_handler_->n_dofs()), fine(dof_handler_->n_dofs());
  for (unsigned d = 0; d < coarse.size(); ++d) coarse[d] = from[padded(d)];
  dealii::VectorTools::interpolate_to_different_mesh(*before.dof_handler_, coarse, *dof_handler_, *hanging_,
                                                     fine);
  for (unsigned d = 0; d < fine.size(); ++d) to[padded(d)] = fine[d];
}

void Discretisation::forget_cells() {
  dof_handler_.reset();
  triangulation_.reset();
}

}  // namespace talus::fem
