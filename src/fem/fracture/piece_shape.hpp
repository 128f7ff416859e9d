/// Shape of a piece that comes off, with as few faces as say the same.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "core/types.hpp"

namespace talus::fem {

/// Points of a body that is rigid from now on: where `tolerance` [m] allows it, those of the undeformed body,
/// moved as a whole. Faces that were planar are so again, and what was bent or crushed by more stays as it
/// is. The motion is the weighted least-squares one (Kabsch 1976) of what lies within the tolerance; where
/// that is less than half of the weight, nothing is moved. `reference`, `present`: n points [m]; `weight`: n,
/// not negative. Returns n points.
std::vector<Vec3> straightened(std::span<const Vec3> reference, std::span<const Vec3> present,
                               std::span<const double> weight, double tolerance);

/// Where a part touches itself along an edge and its sheets are one again at both ends of it, no vertices of
/// its own can part them: the edge would have four triangles. It gets a vertex in its middle for each sheet,
/// the two triangles there of one cell. `cell`: of each triangle.
void part_touching_edges(std::vector<Vec3>& vertices, std::vector<std::array<int, 3>>& triangles,
                         std::vector<int> cell);

/// Takes out vertices within planar parts and on straight edges of a closed triangulation, so that the same
/// surface has as few triangles as reasonable. Edges keep two triangles each, normals their directions;
/// vertices are numbered anew.
void merge_planar(std::vector<Vec3>& vertices, std::vector<std::array<int, 3>>& triangles);

}  // namespace talus::fem
