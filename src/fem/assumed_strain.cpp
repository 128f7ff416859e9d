#include "fem/assumed_strain.hpp"

#include <algorithm>

namespace talus::fem {
namespace {

using Points = double[8];

/// One stage of the two transforms below: pairs of numbers that differ in one bit.
template <int stride, class Use>
inline void each_two(double* v, Use use) {
#pragma GCC unroll 8
  for (int i = 0; i < 8; ++i)
    if ((i & stride) == 0) use(v[i], v[i + stride]);
}

template <class Use>
inline void all_stages(double* v, Use use) {
  each_two<1>(v, use);
  each_two<2>(v, use);
  each_two<4>(v, use);
}

/// Sums over the points with the signs of the functions 0 to 7 (bits: xi, eta, zeta), in place.
inline void walsh(double* v) {
  all_stages(v, [](double& a, double& b) {
    const double low = a, high = b;
    a = low + high;
    b = high - low;
  });
}

/// From the functions' numbers to their sums at the points, in place.
inline void at_points(double* v) {
  all_stages(v, [](double& a, double& b) {
    const double even = a, odd = b;
    a = even - odd;
    b = even + odd;
  });
}

/// The tensor R^T e R (or R e R^T: back) at each point; `half` of a shear's number is its component.
void turn(const double* axes, bool back, double half, Points* e) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> r(axes);
  for (int q = 0; q < 8; ++q) {
    Mat3 t;
    t << e[0][q], half * e[5][q], half * e[4][q], half * e[5][q], e[1][q], half * e[3][q], half * e[4][q], half * e[3][q], e[2][q];
    t = back ? Mat3(r * t * r.transpose()) : Mat3(r.transpose() * t * r);
    e[0][q] = t(0, 0), e[1][q] = t(1, 1), e[2][q] = t(2, 2);
    e[3][q] = t(1, 2) / half, e[4][q] = t(2, 0) / half, e[5][q] = t(0, 1) / half;
  }
}

}  // namespace

AssumedStrain::AssumedStrain(const HexMesh& mesh, int cell, double nu) : poisson(nu), turned(false) {
  double volume = 0;
  for (int q = 0; q < 8; ++q) volume += weight[q] = point_jacobian(mesh, cell, q).determinant();
  for (double& w : weight) w /= volume;
  const Mat3 r = cell_axes(mesh, cell);
  turned = !r.isIdentity(1e-14);
  for (int i = 0; i < 9; ++i) axes[i] = r(i / 3, i % 3);
}

void AssumedStrain::assume(double (&e)[6][8]) const {
  if (turned) turn(axes, false, 0.5, e);
  const double closed = poisson / (1 - poisson);
  Points mode[6], out[6] = {};
  for (int k = 0; k < 6; ++k) {
    double mean = 0;
    for (int q = 0; q < 8; ++q) mean += weight[q] * e[k][q], mode[k][q] = 0.125 * e[k][q];
    walsh(mode[k]);
    out[k][0] = mean;
  }
  for (int d = 0; d < 3; ++d) {
    const int a = (d + 1) % 3, b = (d + 2) % 3, linear = 1 << d, product = 7 - linear;
    out[a][linear] += mode[a][linear], out[b][linear] += mode[b][linear];
    out[d][linear] -= closed * (mode[a][linear] + mode[b][linear]);
    out[3 + d][linear] = mode[3 + d][linear];
    out[d][product] += mode[d][product];
    out[a][product] -= poisson * mode[d][product], out[b][product] -= poisson * mode[d][product];
  }
  for (int k = 0; k < 6; ++k) {
    at_points(out[k]);
    std::copy(out[k], out[k] + 8, e[k]);
  }
  if (turned) turn(axes, true, 0.5, e);
}

void AssumedStrain::transpose(const double (*stress)[8], double (&out)[6][8]) const {
  for (int k = 0; k < 6; ++k) std::copy(stress[k], stress[k] + 8, out[k]);
  if (turned) turn(axes, false, 1, out);
  const double closed = poisson / (1 - poisson);
  Points mode[6], sum[6] = {};
  for (int k = 0; k < 6; ++k) {
    for (int q = 0; q < 8; ++q) mode[k][q] = 0.125 * out[k][q];
    walsh(mode[k]);
  }
  for (int d = 0; d < 3; ++d) {
    const int a = (d + 1) % 3, b = (d + 2) % 3, linear = 1 << d, product = 7 - linear;
    sum[a][linear] = mode[a][linear] - closed * mode[d][linear];
    sum[b][linear] = mode[b][linear] - closed * mode[d][linear];
    sum[3 + d][linear] = mode[3 + d][linear];
    sum[d][product] = mode[d][product] - poisson * (mode[a][product] + mode[b][product]);
  }
  for (int k = 0; k < 6; ++k) {
    at_points(sum[k]);
    for (int q = 0; q < 8; ++q) out[k][q] = weight[q] * mode[k][0] + 0.125 * sum[k][q];
  }
  if (turned) turn(axes, true, 1, out);
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
