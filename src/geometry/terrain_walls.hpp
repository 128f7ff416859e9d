/// The ground as a solid: a one-sided surface ends in vertical walls.
///
/// Without them the solid below the surface would have no side: what rolls over the border, or over the rim
/// of a hole, would move in under the surface and be pushed out of it from below, a spurious energy gain.
#pragma once
#include <span>

#include "contact/geometry/surface.hpp"

namespace talus::geometry {

/// The surface with walls from its borders down to z = `bottom` [m], appended to its triangles and of the
/// material of the triangle above. None where other ground goes on beyond the border, level with it or
/// higher: another sheet of the surface, or a plane; and none at the upper and lateral edges of overhanging
/// and upright faces, behind which the rock goes on upwards. A wall above an overhang ends at the underside.
/// A two-sided surface stays as it is.
TriangleSurface with_border_walls(TriangleSurface surface, std::span<const Plane> planes, double bottom);

}  // namespace talus::geometry
