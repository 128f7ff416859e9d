/// Points of a block that the scene holds fixed.
#pragma once
#include "contact/polyhedron.hpp"

namespace talus::sim {

/// The point of a block's surface nearest to x, or x itself where it lies within the block; both in body axes.
Vec3 nearest_of(const Polyhedron& body, const Vec3& x);

}  // namespace talus::sim
