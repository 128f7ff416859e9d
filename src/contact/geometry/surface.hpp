/// A triangulated surface that blocks can touch and that is not itself a block: terrain (fixed) or the skin
/// of a structure (its vertices move). Solid lies on the inner side of the outward normals.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/types.hpp"

namespace talus {

struct TriangleSurface {
  std::vector<Vec3> vertices;                 // V x 3 [m]
  std::vector<Vec3> velocities;               // V x 3 [m/s]; empty if fixed
  std::vector<std::array<int, 3>> triangles;  // T, outward
  std::vector<int> material;  // T, index into the scene's materials; empty: all `default_material`
  int default_material = 0;
  bool two_sided = false;
  /// For the skin of a structure: the map from a vertex to structure nodes. A vertex is a node (one entry,
  /// weight 1) or the centroid of a quadrilateral (four entries, weight 1/4).
  struct NodeWeights {
    int count = 0;
    std::array<int, 4> node{};
    std::array<double, 4> weight{};
  };
  std::vector<NodeWeights> nodes;  // V; empty for terrain
  std::vector<int> parent_face;    // T, quadrilateral each triangle came from; empty for terrain
  std::uint64_t revision = 0;      // grows whenever the topology changes (erosion, fragments)
};

/// Unbounded fixed plane; solid below.
struct Plane {
  Vec3 point = Vec3::Zero();    // [m]
  Vec3 normal = Vec3::UnitZ();  // outward unit
  int material = 0;
};

}  // namespace talus
