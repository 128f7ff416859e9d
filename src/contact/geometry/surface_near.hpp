/// The vertices of a surface near a box.
#pragma once
#include <vector>

#include "contact/detection/detect.hpp"

namespace talus::contact {

/// Vertices of the triangles whose boxes meet `box`, ascending, each once.
void near_vertices(const SurfaceIndex& index, const Box3& box, std::vector<int>& vertices);

}  // namespace talus::contact
