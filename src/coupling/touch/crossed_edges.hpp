/// Two edges that cross each other, carried along by their bodies: what meets is another point of either from
/// moment to moment, and the normal turns with both.
///
///   n = +- a x b / |a x b|,   gap = n . (x_b - x_a) for any points x_a, x_b of the two lines
///
/// symbol   meaning                                   unit   shape
/// a, b     directions of the edges                   1      3
/// n        normal out of A                           1      3
#pragma once
#include <optional>

#include "coupling/touch/touch.hpp"

namespace talus::coupling {

/// Directions of the two at the start of a step, world axes.
struct CrossedEdges {
  Vec3 a, b;
};

/// Where they are nearest to each other.
struct EdgeMeeting {
  Vec3 normal, on_a, on_b;
  Vec3 between() const { return 0.5 * (on_a + on_b); }
};

/// The edges of a touch whose normal is theirs; none: it is of other features, or they are nearly parallel.
/// `pose_a`: of a block A.
std::optional<CrossedEdges> crossed_edges(const Touch&, const dda::Model&, const Environment&,
                                          const Pose& pose_a, const Pose& pose_b);

/// For edges through x_a and x_b along a and b, with the normal on the side of `towards`.
EdgeMeeting meet(const Vec3& x_a, const Vec3& a, const Vec3& x_b, const Vec3& b, const Vec3& towards);

}  // namespace talus::coupling
