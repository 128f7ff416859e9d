/// Cells beside larger ones: what their hanging nodes mean for masses and for the surface of a piece.
#pragma once
#include <algorithm>
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"

namespace talus::fem {

/// The hanging node of this number, or null.
inline const HangingNode* hanging_node(const HexMesh& mesh, int n) {
  const auto at = std::lower_bound(mesh.hanging.begin(), mesh.hanging.end(), n,
                                   [](const HangingNode& h, int node) { return h.node < node; });
  return at == mesh.hanging.end() || at->node != n ? nullptr : &*at;
}

/// Nodes that a cell moves with, ascending: its corners, and those that its hanging corners follow. None of
/// them may go while the cell is there.
std::vector<int> carriers(const HexMesh& mesh, int cell);

/// Faces that end where smaller ones begin, cut along the lines to the nodes in the middle of their edges:
/// any two that meet share whole edges then. A triangle is a quadrilateral whose last corner is there twice.
std::vector<SkinQuad> cut_at_middles(const HexMesh& mesh, const std::vector<SkinQuad>& quads);

}  // namespace talus::fem
