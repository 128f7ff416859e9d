/// Trilinear hexahedra, corners in VTK order.
///
///   N_a(xi) = (1 + s_a0 xi)(1 + s_a1 eta)(1 + s_a2 zeta) / 8,   s: corner_sign
///   x(xi) = x_0 + c_0 xi + c_1 eta + c_2 zeta + c_3 xi eta + c_4 xi zeta + c_5 eta zeta + c_6 xi eta zeta
///
/// symbol   meaning                                                     unit   shape
/// xi       reference coordinates in [-1, 1]^3                          -      3
/// c        coefficients of the map from the reference cube             m      7 x 3
///
/// Hughes, The Finite Element Method (2000), section 3.5.
#pragma once
#include <array>
#include <cmath>
#include <span>

#include "core/types.hpp"

namespace talus::fem {

inline constexpr int corner_sign[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                          {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};

/// The eight Gauss points, xi fastest.
inline Vec3 gauss_point(int q) {
  const double g = 1 / std::sqrt(3.0);
  return {q & 1 ? g : -g, q & 2 ? g : -g, q & 4 ? g : -g};
}

/// Values of the eight shape functions.
inline std::array<double, 8> shape_values(const Vec3& xi) {
  std::array<double, 8> n;
  for (int a = 0; a < 8; ++a)
    n[a] = 0.125 * (1 + corner_sign[a][0] * xi.x()) * (1 + corner_sign[a][1] * xi.y()) *
           (1 + corner_sign[a][2] * xi.z());
  return n;
}

/// Their gradients with respect to the reference coordinates.
inline std::array<Vec3, 8> shape_gradients(const Vec3& xi) {
  std::array<Vec3, 8> g;
  for (int a = 0; a < 8; ++a) {
    const double x = 1 + corner_sign[a][0] * xi.x(), y = 1 + corner_sign[a][1] * xi.y(),
                 z = 1 + corner_sign[a][2] * xi.z();
    g[a] = 0.125 * Vec3(corner_sign[a][0] * y * z, corner_sign[a][1] * x * z, corner_sign[a][2] * x * y);
  }
  return g;
}

/// The map of one hexahedron.
class TrilinearMap {
 public:
  TrilinearMap(std::span<const Vec3> nodes, const std::array<int, 8>& hex) {
    const Vec3& origin =
        nodes[static_cast<std::size_t>(hex[0])];  // edge vectors keep it exact for cells far from the origin
    c_.fill(Vec3::Zero());
    for (std::size_t a = 1; a < 8; ++a) {
      const Vec3 x = 0.125 * (nodes[static_cast<std::size_t>(hex[a])] - origin);
      const double i = corner_sign[a][0], j = corner_sign[a][1], k = corner_sign[a][2];
      const std::array<double, 7> factor{i, j, k, i * j, i * k, j * k, i * j * k};
      for (std::size_t n = 0; n < 7; ++n) c_[n] += factor[n] * x;
    }
  }

  /// dx/dxi; rows x, y, z, columns xi, eta, zeta.
  Mat3 jacobian(const Vec3& xi) const {
    Mat3 j;
    j.col(0) = c_[0] + xi.y() * c_[3] + xi.z() * (c_[4] + xi.y() * c_[6]);
    j.col(1) = c_[1] + xi.x() * c_[3] + xi.z() * (c_[5] + xi.x() * c_[6]);
    j.col(2) = c_[2] + xi.x() * c_[4] + xi.y() * (c_[5] + xi.x() * c_[6]);
    return j;
  }

 private:
  std::array<Vec3, 7> c_;
};

}  // namespace talus::fem
