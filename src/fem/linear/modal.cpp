#include "fem/linear/modal.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace talus::fem {

namespace {

/// Several vectors at a time: the factor is read once for all of them, and double frequencies come together.
constexpr int block_size = 6;

/// Makes the columns of x orthonormal in M against `basis` and each other; what is lost of x itself goes into
/// r (x_before = basis c + x_after r, c added to `overlap`). A column that lies in the span of the others
/// becomes zero, and so does its row of r.
void orthonormalise(const MatX& basis, int size, const VecX& m, MatX& x, MatX& overlap, MatX& r) {
  const int b = static_cast<int>(x.cols());
  overlap = MatX::Zero(size, b);
  r = MatX::Zero(b, b);
  VecX before(b);
  for (int j = 0; j < b; ++j) before[j] = std::sqrt(x.col(j).dot(m.cwiseProduct(x.col(j))));
  // Twice is enough: orthogonal to working precision.
  for (int pass = 0; pass < 2 && size > 0; ++pass) {
    const MatX weighted = m.asDiagonal() * x;
    const MatX c = basis.leftCols(size).transpose() * weighted;
    x.noalias() -= basis.leftCols(size) * c;
    overlap += c;
  }
  for (int j = 0; j < b; ++j) {
    for (int pass = 0; pass < 2; ++pass)
      for (int k = 0; k < j; ++k) {
        const double c = x.col(k).dot(m.cwiseProduct(x.col(j)));
        x.col(j) -= c * x.col(k);
        r(k, j) += c;
      }
    const double norm = std::sqrt(x.col(j).dot(m.cwiseProduct(x.col(j))));
    if (norm > 1e-12 * before[j])
      r(j, j) = norm, x.col(j) /= norm;
    else
      x.col(j).setZero();
  }
}

/// Puts the Ritz vectors of the `kept` largest values in place of the basis; the residual of the basis
/// remains the next block.
void keep_best(MatX& basis, int size, MatX& projected, const Eigen::SelfAdjointEigenSolver<MatX>& eigen,
               int kept) {
  const MatX chosen = eigen.eigenvectors().rightCols(kept);
  constexpr int rows_at_once = 256;
  for (int row = 0; row < basis.rows(); row += rows_at_once) {
    const int rows = std::min<int>(rows_at_once, static_cast<int>(basis.rows()) - row);
    basis.block(row, 0, rows, kept) = (basis.block(row, 0, rows, size) * chosen).eval();
  }
  projected.topLeftCorner(kept, kept) = eigen.eigenvalues().tail(kept).asDiagonal();
}

}  // namespace

int largest_basis(int n, int count) { return std::min(n, 5 * count / 2 + 60); }

double memory_of_search(int n, int count) {
  const double most = largest_basis(n, count) + block_size;
  return sizeof(double) *
         (n * (most + 4 * block_size) +
          3 * most * most);  // basis and blocks beside it; the projected matrix, its vectors and a copy
}

ModalBasis lowest_modes(const CholeskyFactor& factor, const VecX& m, int count, int largest) {
  const int n = static_cast<int>(m.size());
  count = std::min(count, n);
  const int b = std::min(block_size, n), most = largest > 0 ? std::min(n, largest) : largest_basis(n, count);
  MatX basis(n, most + b), block(n, b), next(n, b), overlap, r, projected = MatX::Zero(most + b, most + b);
  std::uint64_t seed = 2463534242ull;
  for (int j = 0; j < b; ++j)
    for (int i = 0; i < n; ++i) {
      seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
      block(i, j) = static_cast<double>(seed >> 11) * 0x1p-53 - 0.5;
    }
  orthonormalise(basis, 0, m, block, overlap, r);
  basis.leftCols(b) = block;
  Eigen::SelfAdjointEigenSolver<MatX> eigen;
  int size = b, first = 0;  // columns of the basis; where its last block starts
  int check = 2 * count;    // size at which the Ritz pairs are looked at next
  while (true) {
    const int width = size - first;
    const MatX right = m.asDiagonal() * basis.middleCols(first, width);
    next.resize(n, width);
    factor.solve(right.data(), next.data(), width);
    orthonormalise(basis, size, m, next, overlap, r);
    // M K^-1 M in the basis: the new block's columns, by symmetry its rows.
    projected.block(0, first, size, width) = overlap;
    projected.block(first, 0, width, size) = overlap.transpose();
    int fresh = 0;
    for (int j = 0; j < width && size + fresh < most; ++j)
      if (r(j, j) > 0) basis.col(size + fresh++) = next.col(j);
    const bool full = most < n && size + fresh >= most;
    if (fresh == 0 || size >= check || full) {
      check = size + 3 * b;
      eigen.compute(projected.topLeftCorner(size, size));
      // Largest of K^-1 M are the lowest frequencies; the residual of a Ritz pair is r times the last block
      // of its vector. The error of a frequency is of the order of its square.
      bool good = size >= count;
      for (int i = 0; i < count && good; ++i) {
        const int j = size - 1 - i;
        good = (r * eigen.eigenvectors().col(j).tail(width)).norm() <= 1e-5 * eigen.eigenvalues()[j];
      }
      if (good || fresh == 0) break;  // found, or the space is exhausted
    }
    if (full) {
      keep_best(basis, size, projected, eigen, count + 2 * b);
      size = count + 2 * b;
      fresh = 0;
      for (int j = 0; j < width; ++j)
        if (r(j, j) > 0) basis.col(size + fresh++) = next.col(j);
      check = size + 3 * b;
    }
    first = size;
    size += fresh;
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
  const double decay = std::exp(-0.5 * alpha * h), c = std::cos(damped * h),
               sn = std::sin(damped * h) / damped;
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
