/// How far a body can fly straight before it touches a surface.
#pragma once
#include "contact/polyhedron.hpp"
#include "contact/surface.hpp"

namespace talus::geometry {

/// Length of the way along `direction` (unit) from `pose` to the first touch of the surface [m]: exact, by
/// vertices before triangles of either side and edges across edges in the plane across the direction. What
/// lies behind the body does not count; infinite if it passes by.
double free_path(const Polyhedron& body, const Pose& pose, const TriangleSurface& surface,
                 const Vec3& direction);

/// Whether a corner of the body lies inside the closed surface, or one of the surface's inside the body: they
/// overlap, or one lies in the other, where no faces meet [vanoosterom1983].
bool corner_inside(const Polyhedron& body, const Pose& pose, const TriangleSurface& surface);

}  // namespace talus::geometry
