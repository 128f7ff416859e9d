/// The map of one hexahedron from its reference cube, as a polynomial: for those who ask for its Jacobian at
/// many points.
///
///   x(xi) = x_0 + c_0 xi + c_1 eta + c_2 zeta + c_3 xi eta + c_4 xi zeta + c_5 eta zeta + c_6 xi eta zeta
///
/// Hughes, The Finite Element Method (2000), section 3.5.
#pragma once
#include <array>

#include "fem/discretisation/hex_mesh.hpp"

namespace talus::fem {

class TrilinearMap {
 public:
  TrilinearMap(const HexMesh& mesh, int cell) {
    constexpr int sign[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};  // VTK order
    const auto& hex = mesh.hexes[static_cast<std::size_t>(cell)];
    const Vec3& origin = mesh.nodes[static_cast<std::size_t>(
        hex[0])];  // edge vectors keep it exact for cells far from the origin
    c_.fill(Vec3::Zero());
    for (std::size_t a = 1; a < 8; ++a) {
      const Vec3 x = 0.125 * (mesh.nodes[static_cast<std::size_t>(hex[a])] - origin);
      const double i = sign[a][0], j = sign[a][1], k = sign[a][2];
      const std::array<double, 7> factor{i, j, k, i * j, i * k, j * k, i * j * k};
      for (std::size_t n = 0; n < 7; ++n) c_[n] += factor[n] * x;
    }
  }

  /// dx/dxi at a reference point in [-1, 1]^3; rows x, y, z, columns xi, eta, zeta.
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
