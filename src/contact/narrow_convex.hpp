/// Convex against convex polyhedra. Internal to src/contact.
#pragma once
#include "contact/narrow_math.hpp"

namespace talus::contact::narrow {

/// See block_block. Both polyhedra convex.
int convex_convex(const Polyhedron& a, const Pose& pose_a, const Polyhedron& b, const Pose& pose_b, double margin,
                  std::vector<ContactPoint>& out);

/// The best of all face and edge axes: largest gap (negative: least overlap). Owner 0: a face of A, 1: a face of B, 2: edges.
struct SignedAxis {
  double gap;
  Vec3 normal;  // out of A
  int owner;
};
SignedAxis signed_axis(Hull& a, Hull& b);

}  // namespace talus::contact::narrow
