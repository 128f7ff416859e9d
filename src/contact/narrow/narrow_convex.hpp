/// Convex against convex polyhedra. Internal to src/contact.
#pragma once
#include "contact/narrow/narrow_math.hpp"

namespace talus::contact::narrow {

/// See block_block. Both polyhedra convex.
int convex_convex(const Polyhedron& a, const Pose& pose_a, const Polyhedron& b, const Pose& pose_b,
                  double margin, std::vector<ContactPoint>& out);

}  // namespace talus::contact::narrow
