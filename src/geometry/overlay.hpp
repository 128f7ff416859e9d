/// What lies between two surfaces, as a cell of exact points (private to take_out).
///
///   depth at a place in plan:  d(x, y) = z_upper(x, y) - z_lower(x, y),   body: where d > 0
///
/// Both surfaces are functions of the place in plan. Their triangulations are laid over each other in plan;
/// each part of a triangle of the one within a triangle of the other is divided where d = 0, so that the body
/// ends there in an edge, and where the surfaces coincide there is none. Where the lower surface ends, the
/// body ends in a vertical wall. All of it is decided and computed exactly, from the coordinates as they are
/// given.
#pragma once
#include <vector>

#include "contact/geometry/surface.hpp"
#include "geometry/exact_complex.hpp"

namespace talus::geometry {

/// What a face of the complex is, as its mark: k >= 0 a part of triangle k of the upper surface, or
constexpr int of_bed = -1;     // of the lower surface, of a wall, of a division
constexpr int of_border = -2;  // of a wall where the upper surface ends: nothing lies beyond

struct Between {
  ExactComplex complex;
  std::vector<int> bodies;  // connected each
  int rest = -1;            // a cell that holds nothing but faces: the ground that stays
};

/// `upper_triangles`: those to look at; what is not covered by the body becomes faces of the rest. All
/// triangles of both must face up. `sliver`: of the complex [m].
Between between(const TriangleSurface& upper, const std::vector<int>& upper_triangles,
                const TriangleSurface& lower, const std::vector<int>& lower_triangles, double sliver);

}  // namespace talus::geometry
