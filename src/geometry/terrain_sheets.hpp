/// Which side of a terrain mesh is rock: by connectivity, so that overhanging faces keep their side.
///
/// A sheet is a set of faces connected across edges that exactly two faces share. Within a sheet neighbours
/// run along their common edge in opposite directions, whatever the winding in the file. With the area
/// vectors A_f of faces oriented so, a sheet is turned as one:
///
///   open sheet          sum of A_f,z > 0: most of its plan area faces up
///   upright open sheet  |sum of A_f,z| <= 1e-6 sum of |A_f|: the winding of most of its area, with a warning
///   closed sheet        outward: its volume is positive
///
/// Edges at which more than two faces meet connect nothing. Where faces cannot be oriented consistently (a
/// Moebius strip) one edge of each such ring is left out. Both are warned of with their place.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/types.hpp"

namespace talus::geometry {

/// Orients the triangles in place and drops repeated ones (the same three vertices) but for the first. Warns
/// of that, of loose pieces and of holes. `name` is the file for the warnings; `origin` is added to places in
/// them: map coordinates [m]. Nothing is said of what lies outside of `crop`.
std::vector<Problem> orient_sheets(const std::vector<Vec3>& vertices,
                                   std::vector<std::array<int, 3>>& triangles, const std::string& name,
                                   const Vec3& origin = Vec3::Zero(),
                                   const std::optional<Box3>& crop = std::nullopt);

}  // namespace talus::geometry
