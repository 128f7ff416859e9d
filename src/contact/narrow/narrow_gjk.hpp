/// Distance of two convex hulls by the Gilbert-Johnson-Keerthi iteration on the vertices of B - A
/// [gilbert1988], with the features that carry the closest points.
///
///   v = argmin { |x| : x in B - A },   stops when |v|^2 - v . w(v) <= eps |v|^2
///   w: support of B - A along -v
///
/// symbol   meaning                                      unit   shape
/// v        shortest vector from A to B                  m      3
/// w        vertex of B - A                              m      3
#pragma once
#include "contact/narrow/narrow_math.hpp"

namespace talus::contact::narrow {

struct Separation {
  bool overlap = false;        // the interiors meet (or the distance is below round-off)
  bool beyond = false;         // proved farther apart than the limit; the rest is a lower bound only
  double distance = 0;         // [m]
  Vec3 normal = Vec3::Zero();  // unit, from A to B
  Vec3 a, b;                   // closest points
  int count = 0;               // simplex size
  int ia[4], ib[4];            // its vertices
};

Separation gjk(const Hull& A, const Hull& B, const Vec3& start, double limit);

}  // namespace talus::contact::narrow
