/// Constrained Delaunay triangulation in plan, with exact predicates.
#pragma once
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "core/types.hpp"

namespace talus::geometry {

/// Triangles (counter-clockwise, x and y only) of the convex hull of the points that hold every edge. Points
/// of the same x and y become the one that comes first; `same` gives the point that stands for each. If two
/// edges cross, no triangles, and `crossing` names the edges.
struct PlanTriangulation {
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> same;
  std::optional<std::pair<int, int>>
      crossing;  // indices into the edges; the second is -1 where it is not known
};
PlanTriangulation constrained_delaunay(const std::vector<Vec3>& points,
                                       const std::vector<std::pair<int, int>>& edges);

}  // namespace talus::geometry
