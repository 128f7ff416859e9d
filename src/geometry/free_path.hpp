/// How far a body can fly straight before it touches a surface.
#pragma once
#include "contact/geometry/polyhedron.hpp"
#include "contact/geometry/surface.hpp"

namespace talus::geometry {

/// Length of the way along `direction` (unit) from `pose` to the first touch of the surface [m]: exact, by
/// vertices before triangles of either side and edges across edges in the plane across the direction. What
/// lies behind the body does not count; infinite if it passes by.
double free_path(const Polyhedron& body, const Pose& pose, const TriangleSurface& surface,
                 const Vec3& direction);

/// Whether one of the two closed surfaces lies wholly inside the other, where no faces meet: one corner of
/// each is asked [vanoosterom1983].
bool one_inside_other(const Polyhedron& body, const Pose& pose, const TriangleSurface& surface);

/// Whether any corner of the body lies inside the closed surface, or one of the surface's inside the body: at
/// the cost of corners times triangles.
bool corner_inside(const Polyhedron& body, const Pose& pose, const TriangleSurface& surface);

}  // namespace talus::geometry
