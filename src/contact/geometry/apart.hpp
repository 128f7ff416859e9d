/// Whether a plane proves two bodies farther apart than a gap: what boxes along the world's axes say of
/// oblique slabs is far too wide.
#pragma once
#include "contact/detection/detect.hpp"

namespace talus::contact {

/// True if along some direction all of one lies more than `gap` [m] before all of the other: if the distance
/// of their convex hulls is larger. False proves nothing.
bool apart(const Polyhedron& A, const Pose& pose_a, const Polyhedron& B, const Pose& pose_b, double gap);

/// True if each triangle of the surface lies beyond B's box grown by `gap` [m] or more than `gap` before the
/// planes of one of B's faces.
bool apart(const SurfaceIndex& index, const Polyhedron& B, const Pose& pose_b, double gap);

}  // namespace talus::contact
