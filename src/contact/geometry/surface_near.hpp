/// What of a surface lies near a box, what lies inside it.
#pragma once
#include <vector>

#include "contact/detection/detect.hpp"

namespace talus::contact {

/// Vertices of the triangles whose boxes meet `box`, ascending, each once.
void near_vertices(const SurfaceIndex& index, const Box3& box, std::vector<int>& vertices);

/// Whether x lies inside a closed surface: how often a straight line from there leaves it rather than enters.
bool encloses(const SurfaceIndex& index, const Vec3& x);

}  // namespace talus::contact
