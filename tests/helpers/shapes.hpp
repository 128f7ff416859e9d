/// Polyhedra that tests of several folders use.
#pragma once
#include "contact/geometry/polyhedron.hpp"

namespace talus::test {

/// Cuboid of these sides about the origin; corner k has the sign of bit 0, 1, 2 of k along x, y, z.
inline Polyhedron cuboid(const Vec3& sides) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 8; ++k)
    corners.push_back(0.5 * sides.cwiseProduct(Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
  return make_polyhedron(corners, {{0, 2, 3},
                                   {0, 3, 1},
                                   {4, 5, 7},
                                   {4, 7, 6},
                                   {0, 1, 5},
                                   {0, 5, 4},
                                   {2, 6, 7},
                                   {2, 7, 3},
                                   {0, 4, 6},
                                   {0, 6, 2},
                                   {1, 3, 7},
                                   {1, 7, 5}});
}

inline Polyhedron unit_cube() { return cuboid(Vec3::Ones()); }

}  // namespace talus::test
