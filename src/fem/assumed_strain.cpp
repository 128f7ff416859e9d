#include "fem/assumed_strain.hpp"

#include <algorithm>
#include <cmath>

namespace talus::fem {
AssumedStrain::AssumedStrain(const HexMesh& mesh, int cell, double nu) : poisson(nu) {
  double volume = 0;
  for (int q = 0; q < 8; ++q) volume += weight[q] = point_jacobian(mesh, cell, q).determinant();
  for (double& w : weight) w /= volume;
  even = std::all_of(weight, weight + 8, [](double w) { return std::abs(w - 0.125) < 1e-14; });
  const Mat3 r = cell_axes(mesh, cell);
  turned = !r.isIdentity(1e-14);
  for (int i = 0; i < 9; ++i) axes[i] = r(i / 3, i % 3);
}

ElementMatrix element_stiffness(const HexMesh& mesh, int cell, double shear, double bulk) {
  const double young = 9 * bulk * shear / (3 * bulk + shear), poisson = young / (2 * shear) - 1, plane = young / (1 - poisson * poisson);
  using Row = Eigen::Matrix<double, 1, 24>;
  const Mat3 axes = cell_axes(mesh, cell);
  std::array<std::array<Row, 8>, 6> b;   // strains of the displacements, in the cell's axes
  double volume = 0;
  std::array<double, 8> weight{};
  for (std::size_t q = 0; q < 8; ++q) {
    const Mat3 j = point_jacobian(mesh, cell, static_cast<int>(q));
    const Mat3 to_axes = axes.transpose() * j.inverse().transpose();
    weight[q] = j.determinant();
    volume += weight[q];
    for (auto& row : b) row[q].setZero();
    const std::array<Vec3, 8> reference = shape_gradients(gauss_point(static_cast<int>(q)));
    for (int n = 0; n < 8; ++n) {
      const Vec3 g = to_axes * reference[static_cast<std::size_t>(n)];
      for (int d = 0; d < 3; ++d) {
        const int a = (d + 1) % 3, c = (d + 2) % 3;
        b[static_cast<std::size_t>(d)][q].segment<3>(3 * n) += g[d] * axes.col(d).transpose();
        b[static_cast<std::size_t>(3 + d)][q].segment<3>(3 * n) += g[a] * axes.col(c).transpose() + g[c] * axes.col(a).transpose();
      }
    }
  }
  const auto mode = [&](int component, int function) {
    Row sum = Row::Zero();
    for (int q = 0; q < 8; ++q) {
      const bool minus = (__builtin_popcount(static_cast<unsigned>(function & ~q)) & 1) != 0;
      sum += (minus ? -0.125 : 0.125) * b[static_cast<std::size_t>(component)][static_cast<std::size_t>(q)];
    }
    return sum;
  };
  ElementMatrix k = ElementMatrix::Zero();
  const auto add = [&](const Row& s, const Row& e, double stiffness) { k += volume * stiffness * (s.transpose() * e); };
  std::array<Row, 6> mean;
  for (std::size_t i = 0; i < 6; ++i) {
    mean[i].setZero();
    for (std::size_t q = 0; q < 8; ++q) mean[i] += weight[q] / volume * b[i][q];
  }
  const Row dilatation = mean[0] + mean[1] + mean[2];
  add(dilatation, dilatation, bulk - 2.0 / 3 * shear);
  for (int d = 0; d < 3; ++d) {
    add(mean[static_cast<std::size_t>(d)], mean[static_cast<std::size_t>(d)], 2 * shear);
    add(mean[static_cast<std::size_t>(3 + d)], mean[static_cast<std::size_t>(3 + d)], shear);
    const int linear = 1 << d;
    const Row first = mode((d + 1) % 3, linear), second = mode((d + 2) % 3, linear), twist = mode(3 + d, linear), product = mode(d, 7 - linear);
    add(first, first + poisson * second, plane);
    add(second, second + poisson * first, plane);
    add(twist, twist, shear);
    add(product, product, young);
  }
  return k;
}

}  // namespace talus::fem
