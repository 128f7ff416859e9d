/// How finely the coordinates of a file are given.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/types.hpp"

namespace talus::geometry {

/// Distance of single-precision numbers of the size of x.
double single_precision_step(double x);

/// An STL file, or a PLY file whose header says that its coordinates are of 32 bits.
bool holds_single_precision(const std::string& path);

/// Warns of a terrain mesh whose plan coordinates (as in the file) are rounded to steps that its faces feel:
/// single precision in map coordinates, or too few digits. Vertices on the lines of a grid are as meant.
/// `digits`: false for bodies of few vertices, where round numbers say nothing of how they were written.
std::vector<Problem> rounding_warning(const std::vector<Vec3>& vertices,
                                      const std::vector<std::array<int, 3>>& triangles,
                                      const std::string& path, bool digits = true);

}  // namespace talus::geometry
