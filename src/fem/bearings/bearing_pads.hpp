/// What keeps a deck that comes off apart from the cap beams that it still lies on.
///
/// Bearings are springs over a height that no cells fill. Without them a deck with one end off its seat would
/// drop by that height at the other, onto the cap, and strike it with the whole of its weight: it turns about
/// a pad instead, which belongs to the piece from now on.
#pragma once
#include <map>
#include <span>
#include <vector>

#include "fem/discretisation/hex_mesh.hpp"

namespace talus::fem {

/// A node of a deck over the point of a cap beam that its bearing stands on.
struct SeatedNode {
  int node;
  int cell;       // of the deck
  int end;        // one number for each end of each deck: its pads lie in one plane
  double height;  // of the bearing, as built [m]
  Vec3 foot;      // that point, displaced [m]
};

/// Draws the faces above the feet down to the nearest of them, by the height of the bearing at most: pads as
/// wide as the faces of their nodes, without mass.
///
/// `seated`: of this piece. `quads`: its skin; faces that are drawn down get sides. `at`, `points`: where
/// each node of the skin lies in the piece [m]; new nodes are numbered from the mesh's on. A gap below 1 mm
/// gets no pads.
void stand_on_pads(const HexMesh& mesh, std::span<const SeatedNode> seated, std::vector<SkinQuad>& quads,
                   std::map<int, std::size_t>& at, std::vector<Vec3>& points);

}  // namespace talus::fem
