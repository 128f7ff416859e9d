/// Roughness that a terrain mesh leaves out: a random surface on faces of some materials.
///
///   z += a n(x, y),   n = 231/181 sum of w_i g_i over the four lattice points about (x, y)
///
/// with g_i standard normal numbers of the lattice point (spacing l, map coordinates) and the seed, and w_i
/// products of the quintic 6 t^5 - 15 t^4 + 10 t^3 along both axes: twice differentiable, of mean 0 and mean
/// square 1. Faces are divided at their edges until none is longer than l / 3; vertices that a smooth face
/// shares stay where they are.
///
/// symbol  meaning                                unit
/// a       standard deviation of the heights      m
/// l       lattice spacing                        m
#pragma once
#include <cstdint>
#include <span>

#include "contact/geometry/surface.hpp"

namespace talus::geometry {

struct Roughness {
  int material = 0;
  double amplitude = 0, length = 1;  // [m]
  std::uint32_t seed = 1;
};

/// Standard normal field at a place of the map, in lattice spacings.
double rough_height(std::uint32_t seed, double x, double y);

/// `origin`: map coordinates of the scene's origin. Throws InputError if the divided surface would have more
/// than 2e7 triangles.
void roughen(TriangleSurface& surface, std::span<const Roughness> materials, const Vec3& origin);

}  // namespace talus::geometry
