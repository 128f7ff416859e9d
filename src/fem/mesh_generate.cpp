// Meshes by deal.II's generators.
#include <deal.II/base/table.h>
#include <deal.II/grid/grid_generator.h>
#include <deal.II/grid/grid_tools.h>
#include <deal.II/grid/manifold_lib.h>
#include <deal.II/grid/tria.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "fem/hex_mesh.hpp"
#include "fem/viaduct.hpp"

namespace talus::fem {
namespace {

// deal.II numbers a hexahedron's vertices lexicographically.
const int vtk_from_dealii[8] = {0, 1, 3, 2, 4, 5, 7, 6};

HexMesh from_triangulation(const dealii::Triangulation<3>& grid) {
  HexMesh mesh;
  mesh.nodes.reserve(grid.n_used_vertices());
  std::vector<int> number(grid.n_vertices(), -1);
  for (const auto& cell : grid.active_cell_iterators()) {
    std::array<int, 8> hex;
    for (int a = 0; a < 8; ++a) {
      const unsigned v = cell->vertex_index(vtk_from_dealii[a]);
      if (number[v] < 0) {
        number[v] = static_cast<int>(mesh.nodes.size());
        const auto& p = grid.get_vertices()[v];
        mesh.nodes.emplace_back(p[0], p[1], p[2]);
      }
      hex[a] = number[v];
    }
    mesh.hexes.push_back(hex);
  }
  return mesh;
}

[[noreturn]] void bad(const StructureSpec& spec, const std::string& key, const std::string& value, const std::string& rule, const std::string& remedy) {
  Problem p;
  p.key = fmt::format("structure.{}.{}", spec.name, key);
  p.value = value;
  p.rule = rule;
  p.remedy = remedy;
  throw InputError(p);
}

/// Cells along each axis: given, or as many as keep every edge at or below cell_size.
std::array<unsigned, 3> divisions(const StructureSpec& spec) {
  std::array<unsigned, 3> n{};
  for (int i = 0; i < 3; ++i) {
    if (spec.cells[i] > 0) n[i] = spec.cells[i];
    else if (spec.cell_size > 0) n[i] = std::max(1u, static_cast<unsigned>(std::ceil(spec.size[i] / spec.cell_size - 1e-9)));
    else bad(spec, "cell_size", "", "a cell size or the numbers of cells are needed", "give cell_size = \"0.25 m\" or cells = [nx, ny, nz]");
  }
  const double total = double(n[0]) * n[1] * n[2];
  if (total > 2e7) bad(spec, "cell_size", fmt::format("{:g} cells", total), "at most 20 million cells", "take a larger cell_size");
  return n;
}

HexMesh rectangular(const StructureSpec& spec, const Vec3& low) {
  const std::array<unsigned, 3> n = divisions(spec);
  dealii::Triangulation<3> grid;
  dealii::GridGenerator::subdivided_hyper_rectangle(grid, {n[0], n[1], n[2]}, dealii::Point<3>(low.x(), low.y(), low.z()),
                                                    dealii::Point<3>(low.x() + spec.size.x(), low.y() + spec.size.y(), low.z() + spec.size.z()));
  return from_triangulation(grid);
}

HexMesh round_column(const StructureSpec& spec) {
  // A disc of five blocks, refined until its cells are as small as asked, stretched to the ellipse and extruded.
  const double radius = 0.5;
  const double diameter = std::max(spec.size.x(), spec.size.y());
  int across = spec.cells[0] > 0 ? spec.cells[0] : static_cast<int>(std::ceil(diameter / spec.cell_size - 1e-9));
  int levels = 0;
  while ((3 << levels) < across && levels < 8) ++levels;
  dealii::Triangulation<2> disc;
  dealii::GridGenerator::hyper_ball(disc, dealii::Point<2>(), radius);
  disc.refine_global(levels);
  dealii::Triangulation<2> flat;
  dealii::GridGenerator::flatten_triangulation(disc, flat);
  const unsigned slices = spec.cells[2] > 0 ? spec.cells[2] : std::max(1u, static_cast<unsigned>(std::ceil(spec.size.z() / spec.cell_size - 1e-9)));
  dealii::Triangulation<3> grid;
  dealii::GridGenerator::extrude_triangulation(flat, slices + 1, spec.size.z(), grid);
  HexMesh mesh = from_triangulation(grid);
  for (Vec3& x : mesh.nodes) x.x() *= spec.size.x(), x.y() *= spec.size.y();
  return mesh;
}

HexMesh hollow_column(const StructureSpec& spec) {
  const double t = spec.wall_thickness;
  if (!(t > 0 && 2 * t < std::min(spec.size.x(), spec.size.y())))
    bad(spec, "wall_thickness", fmt::format("{:g} m", t), "between 0 and half of the section", "give the thickness of the wall");
  const auto count = [&](double length) { return std::max(1, static_cast<int>(std::ceil(length / spec.cell_size - 1e-9))); };
  const int wall = spec.cell_size > 0 ? count(t) : 1;
  std::vector<std::vector<double>> steps(3);
  std::array<int, 2> inner{};
  for (int i = 0; i < 2; ++i) {
    const double gap = spec.size[i] - 2 * t;
    inner[i] = spec.cells[i] > 0 ? std::max(1, spec.cells[i] - 2 * wall) : count(gap);
    for (int k = 0; k < wall; ++k) steps[i].push_back(t / wall);
    for (int k = 0; k < inner[i]; ++k) steps[i].push_back(gap / inner[i]);
    for (int k = 0; k < wall; ++k) steps[i].push_back(t / wall);
  }
  const int nz = spec.cells[2] > 0 ? spec.cells[2] : count(spec.size.z());
  steps[2].assign(nz, spec.size.z() / nz);
  dealii::Table<3, dealii::types::material_id> kind(steps[0].size(), steps[1].size(), steps[2].size());
  for (unsigned i = 0; i < steps[0].size(); ++i)
    for (unsigned j = 0; j < steps[1].size(); ++j)
      for (unsigned k = 0; k < steps[2].size(); ++k) {
        const bool hole = int(i) >= wall && int(i) < wall + inner[0] && int(j) >= wall && int(j) < wall + inner[1];
        kind(i, j, k) = hole ? dealii::numbers::invalid_material_id : dealii::types::material_id(0);
      }
  dealii::Triangulation<3> grid;
  dealii::GridGenerator::subdivided_hyper_rectangle(grid, steps, dealii::Point<3>(-spec.size.x() / 2, -spec.size.y() / 2, 0), kind);
  return from_triangulation(grid);
}

void place(HexMesh& mesh, const StructureSpec& spec) {
  mesh.local = mesh.nodes;
  for (Vec3& x : mesh.nodes) x = spec.rotation * x + spec.position;
}

}  // namespace

HexMesh bricks(const std::vector<Box3>& boxes, double cell_size) {
  // Grid lines: every plane of a box, and between them as many as the cell size asks for.
  std::vector<std::vector<double>> steps(3);
  std::array<std::vector<double>, 3> line;
  for (int i = 0; i < 3; ++i) {
    std::vector<double> planes;
    for (const Box3& b : boxes) planes.push_back(b.min()[i]), planes.push_back(b.max()[i]);
    std::sort(planes.begin(), planes.end());
    planes.erase(std::unique(planes.begin(), planes.end(), [](double a, double b) { return b - a < 1e-9; }), planes.end());
    line[i].push_back(planes[0]);
    for (std::size_t k = 0; k + 1 < planes.size(); ++k) {
      const double span = planes[k + 1] - planes[k];
      const int n = std::max(1, static_cast<int>(std::ceil(span / cell_size - 1e-9)));
      for (int m = 1; m <= n; ++m) {
        line[i].push_back(planes[k] + span * m / n);
        steps[i].push_back(span / n);
      }
    }
  }
  dealii::Table<3, dealii::types::material_id> kind(steps[0].size(), steps[1].size(), steps[2].size());
  for (std::size_t i = 0; i < steps[0].size(); ++i)
    for (std::size_t j = 0; j < steps[1].size(); ++j)
      for (std::size_t k = 0; k < steps[2].size(); ++k) {
        const Vec3 centre(line[0][i] + steps[0][i] / 2, line[1][j] + steps[1][j] / 2, line[2][k] + steps[2][k] / 2);
        bool solid = false;
        for (const Box3& b : boxes) solid = solid || b.contains(centre);
        kind(i, j, k) = solid ? dealii::types::material_id(0) : dealii::numbers::invalid_material_id;
      }
  dealii::Triangulation<3> grid;
  dealii::GridGenerator::subdivided_hyper_rectangle(grid, steps, dealii::Point<3>(line[0][0], line[1][0], line[2][0]), kind);
  HexMesh mesh = from_triangulation(grid);
  // The generator adds up its steps: put the nodes back onto the lines, so that planes of parts agree.
  for (Vec3& x : mesh.nodes)
    for (int i = 0; i < 3; ++i) {
      const auto at = std::lower_bound(line[i].begin(), line[i].end(), x[i] - 1e-7);
      x[i] = *at;
    }
  return mesh;
}

HexMesh make_mesh(const StructureSpec& spec) {
  if (spec.kind == "mesh") return read_mesh(spec);
  if (spec.kind == "viaduct") return viaduct_mesh(spec);
  for (int i = 0; i < 3; ++i)
    if (!(spec.size[i] > 0)) bad(spec, "size", fmt::format("[{:g}, {:g}, {:g}]", spec.size.x(), spec.size.y(), spec.size.z()), "every extent must be positive", "give three lengths");
  HexMesh mesh;
  if (spec.kind == "box") {
    mesh = rectangular(spec, -0.5 * spec.size);
  } else if (spec.kind == "column") {
    if (spec.section == "rectangular") mesh = rectangular(spec, Vec3(-spec.size.x() / 2, -spec.size.y() / 2, 0));
    else if (!(spec.cell_size > 0) && spec.cells[0] == 0) bad(spec, "cell_size", "", "a cell size is needed", "give cell_size = \"0.25 m\"");
    else if (spec.section == "round") mesh = round_column(spec);
    else if (spec.section == "hollow") mesh = hollow_column(spec);
    else bad(spec, "section", spec.section, "one of rectangular, round, hollow", "choose one");
  } else {
    bad(spec, "kind", spec.kind, "one of box, column, viaduct, mesh", "choose one");
  }
  place(mesh, spec);
  return mesh;
}

}  // namespace talus::fem
