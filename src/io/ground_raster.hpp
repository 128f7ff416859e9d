/// A triangle surface as heights on a grid: what the report's map draws, and what shows where the terrain
/// ends.
#pragma once
#include <array>
#include <vector>

#include "core/types.hpp"

namespace talus::io {

struct Mesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;
};

/// Highest point of the surface at the nodes of a grid over [min, max] in plan; NaN where there is none.
struct Raster {
  int nx = 0, ny = 0;
  double x0 = 0, y0 = 0, dx = 1, dy = 1;
  std::vector<float> z;  // row-major, y slow
};
Raster rasterise(const Mesh& mesh, const Box3& region, int largest_side);

}  // namespace talus::io
