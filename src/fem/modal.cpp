#include "fem/modal.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace talus::fem {

ModalBasis lowest_modes(const CholeskyFactor& factor, const std::vector<double>& mass, int count) {
  const int n = static_cast<int>(mass.size());
  count = std::min(count, n);
  const Eigen::Map<const VecX> m(mass.data(), n);
  const int most = std::min(n, 4 * count + 40);
  MatX basis(n, most + 1);
  std::uint64_t seed = 2463534242ull;
  for (int i = 0; i < n; ++i) {
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    basis(i, 0) = static_cast<double>(seed >> 11) * 0x1p-53 - 0.5;
  }
  basis.col(0) /= std::sqrt(basis.col(0).dot(m.cwiseProduct(basis.col(0))));
  VecX diagonal(most), off(most), right(n), next(n);
  int size = 0;
  Eigen::SelfAdjointEigenSolver<MatX> eigen;
  for (int k = 0; k < most; ++k) {
    right = m.cwiseProduct(basis.col(k));
    factor.solve(right.data(), next.data());
    diagonal[k] = right.dot(next);
    // Twice is enough: orthogonal to working precision.
    for (int pass = 0; pass < 2; ++pass) {
      const VecX overlap = basis.leftCols(k + 1).transpose() * m.cwiseProduct(next);
      next.noalias() -= basis.leftCols(k + 1) * overlap;
    }
    off[k] = std::sqrt(next.dot(m.cwiseProduct(next)));
    size = k + 1;
    const bool exhausted = !(off[k] > 1e-14 * diagonal[0]);
    if (!exhausted) basis.col(k + 1) = next / off[k];
    if (exhausted || size == most || (size >= count + 10 && size % 10 == 0)) {
      MatX t = MatX::Zero(size, size);
      t.diagonal() = diagonal.head(size);
      if (size > 1) t.diagonal(1) = off.head(size - 1), t.diagonal(-1) = off.head(size - 1);
      eigen.compute(t);
      // Largest of K^-1 M are the lowest frequencies; the residual of a Ritz pair is off * last component.
      bool good = true;
      for (int i = 0; i < count && i < size; ++i) {
        const int j = size - 1 - i;
        good = good && std::abs(off[k] * eigen.eigenvectors()(size - 1, j)) <= 1e-7 * eigen.eigenvalues()[j];
      }
      if (good || exhausted) break;
    }
  }
  count = std::min(count, size);
  ModalBasis modes;
  modes.omega.resize(count);
  MatX chosen(size, count);
  for (int i = 0; i < count; ++i) {
    modes.omega[i] = 1 / std::sqrt(eigen.eigenvalues()[size - 1 - i]);
    chosen.col(i) = eigen.eigenvectors().col(size - 1 - i);
  }
  modes.phi.noalias() = basis.leftCols(size) * chosen;
  return modes;
}

double advance_mode(double omega, double alpha, double p, double s, double h, double& q, double& rate) {
  const double omega_sq = omega * omega;
  const double slope = s / omega_sq, level = (p - alpha * slope) / omega_sq;
  const double x = q - level, v = rate - slope;
  const double damped = std::sqrt(std::max(omega_sq - 0.25 * alpha * alpha, 1e-12 * omega_sq));
  const double decay = std::exp(-0.5 * alpha * h), c = std::cos(damped * h), sn = std::sin(damped * h) / damped;
  const double x1 = decay * (x * c + (v + 0.5 * alpha * x) * sn);
  const double v1 = decay * (v * c - (omega_sq * x + 0.5 * alpha * v) * sn);
  const double q1 = x1 + level + slope * h, rate1 = v1 + slope;
  // The equation of motion integrated once gives the integral of q.
  const double area = (p * h + 0.5 * s * h * h - (rate1 - rate) - alpha * (q1 - q)) / omega_sq;
  q = q1;
  rate = rate1;
  return area;
}

}  // namespace talus::fem
