#include "fem/linear/lowest_eigenvalue.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/error.hpp"

namespace talus::fem {

double lowest_eigenvalue(const VecX& mass, const LinearMap& stiffness, const LinearMap& inverse, VecX x,
                         double tolerance, const std::function<void(std::span<double>)>& sum) {
  constexpr int most_steps = 100;
  const int n = static_cast<int>(mass.size());
  const auto of_all = [&](MatX values) {
    if (sum) sum({values.data(), static_cast<std::size_t>(values.size())});
    return values;
  };
  const auto dot = [&](const auto& a, const auto& b) { return of_all(MatX::Constant(1, 1, a.dot(b)))(0, 0); };
  const auto norm = [&](const auto& v) { return std::sqrt(dot(v, mass.cwiseProduct(v))); };
  // Columns x, w, p and K times them, each of length one in M. At the first step, and where p lies in the
  // span of the others, there is no p.
  MatX basis(n, 3), stiff(n, 3);
  VecX product(n), w(n);
  basis.col(0) = x / norm(x);
  x = basis.col(0);
  stiffness(x, product);
  stiff.col(0) = product;
  double lambda = dot(x, product);
  int columns = 2;
  for (int step = 0, settled = 0; step < most_steps; ++step) {
    inverse(stiff.col(0) - lambda * mass.cwiseProduct(basis.col(0)), w);
    w -= dot(w, mass.cwiseProduct(basis.col(0))) * basis.col(0);  // else both are nearly parallel
    const double length = norm(w);
    if (!(length > 0)) return lambda;
    w /= length;
    stiffness(w, product);
    basis.col(1) = w, stiff.col(1) = product;
    MatX a = of_all(basis.leftCols(columns).transpose() * stiff.leftCols(columns)),
         m = of_all(basis.leftCols(columns).transpose() * mass.asDiagonal() * basis.leftCols(columns));
    if (columns == 3 && !(m.determinant() > 1e-10))
      columns = 2, a = a.topLeftCorner(2, 2).eval(), m = m.topLeftCorner(2, 2).eval();
    a = (0.5 * (a + a.transpose())).eval();
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> ritz(a, m);
    const VecX c = ritz.eigenvectors().col(0);
    const double next = ritz.eigenvalues()[0];
    VecX move = basis.col(1) * c[1], stiff_move = stiff.col(1) * c[1];
    if (columns == 3) move += basis.col(2) * c[2], stiff_move += stiff.col(2) * c[2];
    basis.col(0) = c[0] * basis.col(0) + move, stiff.col(0) = c[0] * stiff.col(0) + stiff_move;
    const double size = norm(basis.col(0)), moved = norm(move);
    basis.col(0) /= size, stiff.col(0) /= size;
    settled = std::abs(next - lambda) <= tolerance * next ? settled + 1 : 0;
    lambda = next;
    if (settled == 2 || !(moved > 0)) return lambda;
    basis.col(2) = move / moved, stiff.col(2) = stiff_move / moved;
    columns = 3;
  }
  throw NumericalFailure("The first frequency of the structure was not found");
}

}  // namespace talus::fem
