// The matrices of one block against independent evaluations.
#include <gtest/gtest.h>

#include <random>

#include "core/error.hpp"
#include "dda/shi1988_matrices.hpp"
#include "dda/shi1988_system.hpp"
#include "scene1988.hpp"

using namespace talus;
using namespace talus::dda;

TEST(Matrices1988, TransformationIsGradientOfAffineMotion) {
  // T D equals u_c + (skew(r) + strain tensor) x^ for any D: Eq. (3), shear columns included.
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int k = 0; k < 20; ++k) {
    const Vec12 D = Vec12::NullaryExpr([&] { return any(random); });
    const Vec3 x = Vec3::NullaryExpr([&] { return any(random); });
    Mat3 gradient;
    gradient << D[6], 0.5 * D[11], 0.5 * D[10], 0.5 * D[11], D[7], 0.5 * D[9], 0.5 * D[10], 0.5 * D[9], D[8];
    const Vec3 expected = D.head<3>() + Vec3(D.segment<3>(3)).cross(x) + gradient * x;
    EXPECT_LT((shi1988::transformation(x) * D - expected).norm(), 1e-15);
  }
}

TEST(Matrices1988, MassMatrixIsTheIntegralOfTtT) {
  // Two-point Gauss quadrature per direction is exact for the quadratic integrand on a box.
  const Vec3 size(1, 2, 3);
  const double density = 7, mass = density * size.prod();
  const Mat3 S = Vec3(mass / 12 * size.cwiseProduct(size)).asDiagonal();
  const Quat q = Quat(0.7, 0.1, -0.5, 0.3).normalized();
  Mat12 expected = Mat12::Zero();
  for (int k = 0; k < 8; ++k) {
    const Vec3 s(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    const auto T = shi1988::transformation(q * Vec3(0.5 / std::sqrt(3.0) * s.cwiseProduct(size)));
    expected += mass / 8 * T.transpose() * T;
  }
  const Mat12 M = shi1988::mass_matrix(mass, q.toRotationMatrix() * S * q.toRotationMatrix().transpose());
  EXPECT_LT((M - expected).norm(), 1e-13 * expected.norm());
  // 1 x 2 x 3 of unit density: rotation against shear rows -1.25, 2, -0.75, rotation 6.5, 5, 2.5.
  const Mat12 unit = shi1988::mass_matrix(6, Vec3(0.5, 2.0, 4.5).asDiagonal());
  EXPECT_NEAR(unit(3, 3), 6.5, 1e-14);
  EXPECT_NEAR(unit(4, 4), 5.0, 1e-14);
  EXPECT_NEAR(unit(5, 5), 2.5, 1e-14);
  EXPECT_NEAR(unit(3, 9), -1.25, 1e-14);
  EXPECT_NEAR(unit(4, 10), 2.0, 1e-14);
  EXPECT_NEAR(unit(5, 11), -0.75, 1e-14);
}

TEST(Matrices1988, PostCorrectionAgreesWithRotationToFirstOrderOnly) {
  const Vec3 r(1e-4, -2e-4, 3e-4);
  const Mat3 exact = Eigen::AngleAxisd(r.norm(), r.normalized()).toRotationMatrix();
  const double error = (shi1988::step_map(r, Vec6::Zero(), true) - exact).norm();
  EXPECT_LT(error, r.squaredNorm());
  EXPECT_GT(error, 0.1 * r.squaredNorm());  // Eq. (4) is not a rotation
  // About one coordinate axis it is one.
  const Mat3 about_z = Eigen::AngleAxisd(0.3, Vec3::UnitZ()).toRotationMatrix();
  EXPECT_LT((shi1988::step_map(Vec3(0, 0, 0.3), Vec6::Zero(), true) - about_z).norm(), 1e-15);
}

TEST(Matrices1988, PolarRotationAndStrainTurning) {
  const Quat q = Quat(0.4, 0.5, -0.3, 0.7).normalized();
  Mat3 U;
  U << 1.1, 0.05, -0.02, 0.05, 0.9, 0.03, -0.02, 0.03, 1.2;
  EXPECT_LT((shi1988::polar_rotation(q.toRotationMatrix() * U) - q.toRotationMatrix()).norm(), 1e-14);
  Vec6 e;
  e << 1, -2, 3, 0.4, 0.5, -0.6;
  const Vec6 there = shi1988::rotate_strain(e, q.toRotationMatrix());
  EXPECT_LT((shi1988::rotate_strain(there, q.toRotationMatrix().transpose()) - e).norm(), 1e-14);
  const Mat6 C = elastic_matrix(3e9, 0.3);
  EXPECT_NEAR(shi1988::energy_density(C * e, 3e9, 0.3), 0.5 * e.dot(C * e), 1e-4);
}

TEST(Matrices1988, SystemSolversAgree) {
  // A chain of blocks: dense, sparse and iterative solution of the same equations.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto solve = [&](int n, int direct_limit, double stiffness) {
    random.seed(3);
    shi1988::BlockSystem system;
    std::vector<std::pair<int, int>> pairs;
    for (int i = 0; i + 1 < n; ++i) pairs.emplace_back(i, i + 1);
    system.set_pattern(n, pairs, direct_limit);
    EXPECT_EQ(system.islands(), 1);
    for (int i = 0; i < n; ++i) {
      system.diagonal[static_cast<std::size_t>(i)] = Mat12::Identity();
      system.rhs[static_cast<std::size_t>(i)] = Vec12::NullaryExpr([&] { return any(random); });
    }
    for (int i = 0; i + 1 < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Eigen::Matrix<double, 12, 3> a =
          Eigen::Matrix<double, 12, 3>::NullaryExpr([&] { return any(random); });
      const Eigen::Matrix<double, 12, 3> b =
          Eigen::Matrix<double, 12, 3>::NullaryExpr([&] { return any(random); });
      system.diagonal[k] += stiffness * a * a.transpose();
      system.diagonal[k + 1] += stiffness * b * b.transpose();
      system.coupling[k] = -stiffness * a * b.transpose();
    }
    system.solve(0);
    double residual = 0, scale = 0;
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      Vec12 r = system.rhs[k] - system.diagonal[k] * system.solution[k];
      if (i > 0) r -= system.coupling[k - 1].transpose() * system.solution[k - 1];
      if (i + 1 < n) r -= system.coupling[k] * system.solution[k + 1];
      residual = std::max(residual, r.norm());
      scale = std::max(scale, system.diagonal[k].norm() * system.solution[k].norm());
    }
    EXPECT_LT(residual, 1e-12 * scale) << n << " blocks, direct up to " << direct_limit;
    return system.solution;
  };
  solve(5, 40, 10);
  for (const double stiffness : {0.1, 1e4}) {
    const auto sparse = solve(30, 40, stiffness), iterative = solve(30, 0, stiffness);
    for (std::size_t i = 0; i < sparse.size(); ++i) EXPECT_LT((sparse[i] - iterative[i]).norm(), 1e-9);
  }
}

TEST(Matrices1988, IndefiniteSystemIsNamed) {
  shi1988::BlockSystem system;
  system.set_pattern(1, {}, 40);
  system.diagonal[0] = -Mat12::Identity();
  system.rhs[0].setOnes();
  EXPECT_THROW(system.solve(0), NumericalFailure);
}
