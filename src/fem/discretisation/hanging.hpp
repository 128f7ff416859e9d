/// Cells beside larger ones: what their hanging nodes mean for masses and for the surface of a piece.
#pragma once
#include <algorithm>
#include <array>
#include <vector>

#include "contact/geometry/surface.hpp"
#include "fem/discretisation/hex_mesh.hpp"

namespace talus::fem {

constexpr int most_halvings = 8;  // of a cell that zones of refine ask for smaller ones of

/// The hanging node of this number, or null.
inline const HangingNode* hanging_node(const HexMesh& mesh, int n) {
  const auto at = std::lower_bound(mesh.hanging.begin(), mesh.hanging.end(), n,
                                   [](const HangingNode& h, int node) { return h.node < node; });
  return at == mesh.hanging.end() || at->node != n ? nullptr : &*at;
}

/// Nodes with which a node moves, and their shares: itself, unless it hangs between larger cells.
class Followed {
 public:
  explicit Followed(const HexMesh& mesh)
      : mesh_(mesh), place_(mesh.hanging.empty() ? 0 : mesh.nodes.size(), -1) {
    for (std::size_t k = 0; k < mesh.hanging.size(); ++k)
      place_[static_cast<std::size_t>(mesh.hanging[k].node)] = static_cast<int>(k);
  }
  template <class Use>
  void each(int node, Use&& use) const {
    if (place_.empty() || place_[static_cast<std::size_t>(node)] < 0) return use(node, 1.0);
    for (const auto& [master, weight] :
         mesh_.hanging[static_cast<std::size_t>(place_[static_cast<std::size_t>(node)])].masters)
      use(master, weight);
  }

 private:
  const HexMesh& mesh_;
  std::vector<int> place_;
};

/// Nodes that a cell moves with, ascending: its corners, and those that its hanging corners follow. None of
/// them may go while the cell is there.
std::vector<int> carriers(const HexMesh& mesh, int cell);

/// A node of the skin in terms of the nodes that it follows; itself if it does not hang.
TriangleSurface::NodeWeights followed_by_node(const HexMesh& mesh, int node);

/// The middle of a face of the skin in terms of the nodes that its corners follow: the mean of the corners,
/// or of two across from each other where all four follow more nodes than TriangleSurface::NodeWeights holds.
/// Of a parallelogram both are the same. A face within a zone of smaller cells that ends at the middle of a
/// larger one, bared when the cells before it are gone, follows six or seven; of the corners across from each
/// other one is its own and the other in the middle of an edge: three. Throws NumericalFailure where neither
/// pair is few enough.
TriangleSurface::NodeWeights followed_by_face(const HexMesh& mesh, const std::array<int, 4>& corner);

/// Faces that end where smaller ones begin, cut along the lines to the nodes in the middle of their edges:
/// any two that meet share whole edges then. A triangle is a quadrilateral whose last corner is there twice.
std::vector<SkinQuad> cut_at_middles(const HexMesh& mesh, const std::vector<SkinQuad>& quads);

}  // namespace talus::fem
