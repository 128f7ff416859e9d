/// What of a surface lies near a box, what lies inside it.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "contact/detection/detect.hpp"
#include "contact/geometry/bvh_tree.hpp"

namespace talus::contact {

/// Vertices of the triangles whose boxes meet `box`, ascending, each once.
void near_vertices(const SurfaceIndex& index, const Box3& box, std::vector<int>& vertices);

/// Whether x lies inside a closed surface: how often a straight line from there leaves it rather than enters.
bool encloses(const SurfaceIndex& index, const Vec3& x);
/// The same by the tree of boxes about its triangles, each larger by `rounding` [m].
bool encloses(const BoxTree& tree, std::span<const Vec3> vertices,
              std::span<const std::array<int, 3>> triangles, const Vec3& x, double rounding);

}  // namespace talus::contact
