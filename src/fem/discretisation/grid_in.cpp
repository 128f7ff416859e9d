#include "fem/discretisation/grid_in.hpp"

#include <deal.II/base/exceptions.h>
#include <deal.II/grid/grid_in.h>
#include <deal.II/grid/tria.h>

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

#include "fem/spec_error.hpp"

namespace talus::fem {
namespace {

std::string ending(const std::string& path) {
  std::string text = std::filesystem::path(path).extension().string();
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

[[noreturn]] void refuse(const StructureSpec& spec, const std::string& value, const std::string& rule) {
  bad(spec, "file", value, rule, "write the mesh as Gmsh .msh or Abaqus .inp, whose messages name the line",
      spec.file);
}

/// The line of a deal.II exception that says what is wrong.
std::string reason(const dealii::ExceptionBase& e) {
  if (dynamic_cast<const dealii::ExcIO*>(&e) != nullptr)
    return "a section that is cut short, a line that is not as the format has it, or another element than "
           "hexahedra of eight nodes";
  std::ostringstream text;
  e.print_info(text);
  std::string line, all;
  for (std::istringstream in(text.str()); std::getline(in, line);)
    if (const auto from = line.find_first_not_of(" \t"); from != std::string::npos)
      all += (all.empty() ? "" : " ") + line.substr(from);
  return all.empty() ? e.get_exc_name() : all;
}

/// Numbers with the exponent of Fortran's double precision, 1.0D+00, as streams read them.
std::string with_exponents(std::string text) {
  for (std::size_t i = 1; i + 1 < text.size(); ++i)
    if (text[i] == 'D' && (std::isdigit(static_cast<unsigned char>(text[i - 1])) || text[i - 1] == '.') &&
        (text[i + 1] == '+' || text[i + 1] == '-'))
      text[i] = 'E';
  return text;
}

/// The numbers of a mesh's cells, of which GridIn follows any: past the end of its nodes, or to the first
/// one.
class CellNodes {
 public:
  CellNodes(const StructureSpec& spec, const std::string& text) : spec_(spec), text_(text), in_(text) {}

  void check_vtk() {
    long points = 0, cells = 0, size = 0, count = 0;
    for (std::string word; in_ >> word;) {
      if (word == "POINTS") in_ >> points;
      if (word != "CELLS") continue;
      in_ >> cells >> size;
      for (; cells > 0 && in_ >> count; --cells)
        for (; count > 0 && in_; --count) check([&](long n) { return n >= 0 && n < points; });
    }
  }

  void check_unv() {
    std::set<long> nodes;
    for (std::string line; std::getline(in_, line);) {
      const long dataset = std::strtol(line.c_str(), nullptr, 10);
      long number = 0, kind = 0, count = 0, unused = 0;
      if (dataset == 2411)
        while (in_ >> number && number >= 0)
          nodes.insert(number), in_.ignore(most, '\n'), in_.ignore(most, '\n');
      if (dataset == 2412)
        while (in_ >> number && number >= 0) {
          in_ >> kind >> unused >> unused >> unused >> count;
          if (kind == beam) in_ >> unused >> unused >> unused;
          for (; count > 0 && in_; --count) check([&](long n) { return nodes.count(n) > 0; });
        }
      in_.clear();
    }
  }

 private:
  template <class There>
  void check(const There& there) {
    long n = 0;
    if (!(in_ >> n) || there(n)) return;  // what is no number GridIn says itself
    in_.clear();
    bad(spec_, "file", fmt::format("node {}", n), "a cell has a node that is not in the file",
        "write the nodes with the cells",
        fmt::format("{}:{}", spec_.file, 1 + std::count(text_.begin(), text_.begin() + in_.tellg(), '\n')));
  }

  static constexpr std::streamsize most = std::numeric_limits<std::streamsize>::max();
  static constexpr long beam = 11;  // with a line of its own before the nodes
  const StructureSpec& spec_;
  const std::string& text_;
  std::istringstream in_;
};

void read(const StructureSpec& spec, dealii::Triangulation<3>& grid) {
  std::ifstream file(spec.file);
  if (!file) refuse(spec, "", "the file cannot be opened");
  std::ostringstream text;
  text << file.rdbuf();
  const std::string numbers = with_exponents(text.str());
  const bool vtk = ending(spec.file) == ".vtk";
  vtk ? CellNodes(spec, numbers).check_vtk() : CellNodes(spec, numbers).check_unv();
  std::istringstream in(numbers);
  dealii::GridIn<3> reader(grid);
  try {
    vtk ? reader.read_vtk(in) : reader.read_unv(in);
  } catch (const dealii::ExceptionBase& e) { refuse(spec, reason(e), "deal.II's GridIn does not read it"); }
  if (!grid.all_reference_cells_are_hyper_cube())
    refuse(spec, "tetrahedra, wedges or pyramids", "of this format hexahedra alone are read");
}

}  // namespace

bool is_grid_file(const std::string& path) { return ending(path) == ".vtk" || ending(path) == ".unv"; }

HexMesh read_grid(const StructureSpec& spec) {
  constexpr unsigned vtk_order[8] = {0, 1, 3, 2, 4, 5, 7, 6};
  dealii::Triangulation<3> grid;
  read(spec, grid);
  HexMesh mesh;
  for (const dealii::Point<3>& x : grid.get_vertices()) mesh.nodes.emplace_back(x[0], x[1], x[2]);
  std::map<std::string, std::set<int>> groups;
  for (const auto& cell : grid.active_cell_iterators()) {
    std::array<int, 8>& hex = mesh.hexes.emplace_back();
    for (unsigned a = 0; a < 8; ++a) hex[a] = static_cast<int>(cell->vertex_index(vtk_order[a]));
    groups["material " + std::to_string(cell->material_id())].insert(hex.begin(), hex.end());
    for (const unsigned f : cell->face_indices())
      if (cell->at_boundary(f))
        for (const unsigned v : cell->face(f)->vertex_indices())
          groups["boundary " + std::to_string(cell->face(f)->boundary_id())].insert(
              static_cast<int>(cell->face(f)->vertex_index(v)));
  }
  for (const auto& [name, nodes] : groups) mesh.node_groups[name].assign(nodes.begin(), nodes.end());
  place_file_mesh(mesh, spec);
  return mesh;
}

}  // namespace talus::fem
