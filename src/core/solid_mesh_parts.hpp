/// Parts of a volume mesh: cells that hang together by nodes.
#pragma once
#include <cstddef>

#include "core/solid_mesh.hpp"

namespace talus {

struct UnmergedNodes {
  int parts = 0;          // of the mesh
  std::size_t count = 0;  // nodes that lie within 1e-6 of the mesh's size, or 5e-3 of its shortest edge, of
                          // a node of another part
  Vec3 first = Vec3::Zero();  // one of them, as in the file
};

/// Nodes that look as if they were meant to be one and are not: nothing ties the parts together there.
UnmergedNodes unmerged_nodes(const SolidMesh& mesh);

}  // namespace talus
