/// Volume meshes in files: hexahedra and tetrahedra of first order with named groups of nodes.
///
///   formats   Gmsh .msh (read: 2.2 and 4.1, ASCII; written: 2.2), Abaqus/CalculiX .inp
///
/// A group is the set of nodes of a Gmsh physical group (of any dimension), or of an Abaqus NSET or ELSET:
/// what `support` and `load` of a structure name.
#pragma once
#include <array>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/types.hpp"

namespace talus {

struct SolidMesh {
  std::vector<Vec3> nodes;                // n x 3, in the order of the file [its unit of length]
  std::vector<std::array<int, 8>> hexes;  // VTK order, which Gmsh and Abaqus share
  std::vector<std::array<int, 4>> tets;
  std::map<std::string, std::set<int>> groups;  // name -> indices of nodes
  std::vector<long> hex_numbers, tet_numbers;   // of each cell in the file, for messages
  std::map<std::string, int> without_volume;  // type -> number of lines and surfaces, which only name groups
};

/// True for the endings .msh and .inp, in any case.
bool is_solid_mesh_file(const std::string& path);

/// Reads by the file's ending. Throws InputError with file and line for anything that is not understood:
/// entities of other types, nodes that are not defined, numbers that are none. Whether cells are valid is not
/// looked at.
SolidMesh read_solid_mesh(const std::string& path);

/// The text of a file of the ending of `path`; node k of the mesh is number k + 1. In .msh a group is one of
/// points at its nodes, since that is all a group of nodes is. Throws InputError naming a group whose name
/// the format cannot hold.
std::string solid_mesh_text(const std::string& path, const SolidMesh& mesh);

/// The outer faces as triangles, outward for cells of positive volume; vertices as in `nodes`.
std::vector<std::array<int, 3>> outer_triangles(const SolidMesh& mesh);

}  // namespace talus
