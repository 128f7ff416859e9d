// A structure's mesh from a file of volume cells: hexahedra as they are, tetrahedra cut into four hexahedra
// each (at the midpoints of edges, faces and the cell). The two may not meet: what a tetrahedron is cut at, a
// hexahedron does not have.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "core/error.hpp"
#include "core/solid_mesh.hpp"
#include "fem/discretisation/grid_in.hpp"
#include "fem/spec_error.hpp"

namespace talus::fem {
namespace {

/// Four hexahedra per tetrahedron; midpoints are shared, so the result is conforming.
void subdivide_tets(SolidMesh& mesh) {
  std::map<std::vector<int>, int> middle;
  const auto mid = [&](std::vector<int> of) {
    std::sort(of.begin(), of.end());
    const auto [at, fresh] = middle.try_emplace(of, static_cast<int>(mesh.nodes.size()));
    if (fresh) {
      Vec3 x = Vec3::Zero();
      for (int n : of) x += mesh.nodes[n] / static_cast<double>(of.size());
      mesh.nodes.push_back(x);
      for (auto& [name, nodes] : mesh.groups) {
        bool all = true;
        for (int n : of) all = all && nodes.count(n);
        if (all) nodes.insert(at->second);
      }
    }
    return at->second;
  };
  for (std::size_t k = 0; k < mesh.tets.size(); ++k) {
    const auto& t = mesh.tets[k];
    const int c = mid({t[0], t[1], t[2], t[3]});
    for (int i = 0; i < 4; ++i) {
      // The corner's three neighbours, counter-clockwise seen from outside for a positive tetrahedron.
      static const int around[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
      const int v = t[i], a = t[around[i][0]], b = t[around[i][1]], d = t[around[i][2]];
      mesh.hexes.push_back(
          {v, mid({v, a}), mid({v, a, b}), mid({v, b}), mid({v, d}), mid({v, a, d}), c, mid({v, b, d})});
      mesh.hex_numbers.push_back(-mesh.tet_numbers[k]);
    }
  }
  mesh.tets.clear();
}

/// A tetrahedron and a hexahedron that meet, and how many tetrahedra do so.
struct Meeting {
  std::size_t tet = 0, hex = 0;
  int nodes = 0, count = 0;
};

/// The widest meeting, if any: in a face or an edge. One common node is a joint, and stays one.
std::optional<Meeting> meeting(const SolidMesh& mesh) {
  std::vector<std::vector<std::size_t>> hexes_at(mesh.nodes.size());
  for (std::size_t h = 0; h < mesh.hexes.size(); ++h)
    for (int n : mesh.hexes[h]) hexes_at[static_cast<std::size_t>(n)].push_back(h);
  Meeting found;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    std::map<std::size_t, int> common;
    for (int n : mesh.tets[t])
      for (std::size_t h : hexes_at[static_cast<std::size_t>(n)]) ++common[h];
    bool meets = false;
    for (const auto& [hex, nodes] : common) {
      meets = meets || nodes > 1;
      if (nodes > std::max(found.nodes, 1)) found.tet = t, found.hex = hex, found.nodes = nodes;
    }
    found.count += meets ? 1 : 0;
  }
  if (found.count == 0) return {};
  return found;
}

/// Throws InputError where nodes would hang between the corners of a hexahedron: the structure would be too
/// soft, and nothing would tell.
void check_meetings(const SolidMesh& mesh, const StructureSpec& spec) {
  const auto found = meeting(mesh);
  if (!found) return;
  bad(spec, "file",
      fmt::format("cell {} (tetrahedron) and cell {} (hexahedron) meet in {} nodes",
                  mesh.tet_numbers[found->tet], mesh.hex_numbers[found->hex], found->nodes),
      fmt::format(
          "tetrahedra may not meet hexahedra in a face or an edge ({} tetrahedra do): they are computed with "
          "nodes at the midpoints of edges and faces, which a hexahedron does not hold",
          found->count),
      "mesh each connected part with hexahedra alone or tetrahedra alone", spec.file);
}

}  // namespace

void place_file_mesh(HexMesh& mesh, const StructureSpec& spec) {
  mesh.local = mesh.nodes;
  // With "centred" the volume centroid goes to the position; without, the coordinates are the world's, moved
  // by it.
  bool centred = false;
  for (const auto& [key, value] : spec.parameters) centred = centred || (key == "centred" && value != 0);
  Vec3 pivot = Vec3::Zero();
  if (centred) {
    double volume = 0;
    for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell) {
      const std::array<double, 8> share = corner_volumes(mesh, cell);
      for (int a = 0; a < 8; ++a) pivot += share[a] * mesh.nodes[mesh.hexes[cell][a]], volume += share[a];
    }
    if (volume != 0) pivot /= volume;
  }
  for (Vec3& x : mesh.nodes) x = spec.rotation * (x - pivot) + spec.position;
}

HexMesh read_mesh(const StructureSpec& spec) {
  if (!is_solid_mesh_file(spec.file))
    bad(spec, "file", spec.file,
        "Gmsh .msh and Abaqus/CalculiX .inp are read, of hexahedra .vtk and .unv too",
        "export the mesh in one of these formats");
  SolidMesh raw = read_solid_mesh(spec.file);
  check_meetings(raw, spec);
  subdivide_tets(raw);
  if (raw.hexes.empty())
    bad(spec, "file", "", "the mesh has no hexahedra and no tetrahedra",
        "mesh the volume, and save all elements", spec.file);
  // Only nodes that belong to a cell, in the order of the file.
  std::vector<int> number(raw.nodes.size(), -1);
  for (const auto& hex : raw.hexes)
    for (int n : hex) number[n] = 0;
  HexMesh mesh;
  for (std::size_t n = 0; n < raw.nodes.size(); ++n)
    if (number[n] == 0) number[n] = static_cast<int>(mesh.nodes.size()), mesh.nodes.push_back(raw.nodes[n]);
  for (auto hex : raw.hexes) {
    for (int& n : hex) n = number[n];
    mesh.hexes.push_back(hex);
  }
  mesh.number = raw.hex_numbers;
  for (const auto& [type, count] : raw.without_volume)
    mesh.remark += fmt::format("{}{} {}", mesh.remark.empty() ? "" : ", ", count, type);
  for (const auto& [name, nodes] : raw.groups) {
    auto& list = mesh.node_groups[name];
    for (int n : nodes)
      if (number[n] >= 0) list.push_back(number[n]);
  }
  place_file_mesh(mesh, spec);
  return mesh;
}

}  // namespace talus::fem
