/// Points of a block that the scene holds fixed.
#pragma once
#include <span>

#include "contact/geometry/polyhedron.hpp"

namespace talus::sim {

/// The point of a block's surface nearest to x, or x itself where it lies within the block; both in body
/// axes.
Vec3 nearest_of(const Polyhedron& body, const Vec3& x);

/// A rigid motion: velocity of the centroid and spin, world axes [m/s, rad/s].
struct RigidMotion {
  Vec3 v, w;
};

/// The motion that leaves points at rest (`arms`, from the centroid in world axes [m]), nearest to the given
/// one in kinetic energy:
///
///   V = V_0 - M^-1 J^T (J M^-1 J^T)^+ J V_0,   J V = v + w x arm at each point (1)
///
/// which is what impulses at the points make of V_0, as if they were caught at once. `inertia` about the
/// centroid, world axes [kg m^2].
RigidMotion held_motion(double mass, const Mat3& inertia, std::span<const Vec3> arms,
                        const RigidMotion& given);

}  // namespace talus::sim
