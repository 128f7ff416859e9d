/// Triangles so thin that rounding decides where they face (private to the cutting).
///
///   height of a triangle:  h = 2 A / (longest side)
///
/// A sliver whose shortest side is as short as its height goes with that side, whose ends become one; of
/// another the longest side is turned: its corner comes to lie on the neighbour's side, which it lay on but
/// for h.
#pragma once
#include <array>
#include <vector>

#include "core/types.hpp"

namespace talus::geometry {

/// Takes out slivers of less than `least` height [m]; no vertex moves by more. `source`: of each triangle
/// that is left, the one of before that it is part of. Those at the border of the surface, and those whose
/// removal would make the surface touch itself, stay.
std::vector<int> remove_slivers(const std::vector<Vec3>& x, std::vector<std::array<int, 3>>& triangles,
                                double least);

}  // namespace talus::geometry
