/// Meshes by deal.II's GridIn, beside those whose lines are named in messages (read_mesh()).
#pragma once
#include <string>

#include "fem/discretisation/hex_mesh.hpp"

namespace talus::fem {

/// Hexahedra of .vtk or .unv. Nodes of material k and of boundary k are the groups "material k" and "boundary
/// k". Throws InputError with what GridIn says.
bool is_grid_file(const std::string& path);
HexMesh read_grid(const StructureSpec& spec);

/// Moves nodes from the file's coordinates to where the specification puts them.
void place_file_mesh(HexMesh& mesh, const StructureSpec& spec);

}  // namespace talus::fem
