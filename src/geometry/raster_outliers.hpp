/// Heights of a grid that no terrain has: spikes and pits of one to three cells, as faulty returns of a
/// scanner leave them.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "core/error.hpp"

namespace talus::geometry {

/// A grid of heights, row by row from the south; NaN where there is no data.
struct HeightGrid {
  std::span<const double> z;  // rows x columns [m]
  int columns = 0, rows = 0;
  double x0 = 0, y0 = 0, dx = 1, dy = 1;  // of the south-west node, spacing [m]
};

/// Nodes that stand above (or below) all but two of their eight neighbours by more than five cells and by
/// more than twenty times the grid's own roughness, which is the median of |z - median of the neighbours|. An
/// edge of a cliff or a ridge has more than two neighbours at its own height. Node numbers, the one that
/// stands out most first.
std::vector<std::size_t> height_outliers(const HeightGrid& grid);

/// The warning that names them, nothing if there is none.
std::vector<Problem> outlier_warning(const HeightGrid& grid, const std::string& file);

}  // namespace talus::geometry
