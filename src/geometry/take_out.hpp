/// A body that is taken out of the ground: the ground keeps a hollow of its shape.
///
///   mass = body and ground,   ground' = ground without body
///
/// Both are bounded by the same triangles where they touch, corner for corner (CGAL's corefinement with exact
/// points), so that blocks cut from the mass lie in the hollow without a gap and without an overlap.
#pragma once
#include "contact/geometry/surface.hpp"
#include "geometry/mesh.hpp"

namespace talus::geometry {

struct TakenOut {
  Mesh mass;               // closed
  TriangleSurface ground;  // what is left, its hollow of material `bed`
};

/// `ground`: solid below; it must face up where the body is. The body is what lies above the slip surface,
/// within the region; of the two one may be null. Where the slip surface is the ground itself, or lies above
/// it, it takes nothing out. `region`: closed, outward. Throws InputError where the ground or the slip
/// surface overhangs, or nothing of the body lies in the ground.
TakenOut take_out(const TriangleSurface& ground, const TriangleSurface* slip, const Mesh* region, int bed);

}  // namespace talus::geometry
