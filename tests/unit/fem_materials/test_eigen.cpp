#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <random>

#include "core/types.hpp"
#include "drive.hpp"
#include "fem/materials/material_eigen.hpp"

namespace talus::material {
namespace {

Mat3 matrix(const Sym& s) {
  Mat3 m;
  m << s[0], s[5], s[4], s[5], s[1], s[3], s[4], s[3], s[2];
  return m;
}

void compare(const Sym& s, double tolerance) {
  const Eigen::SelfAdjointEigenSolver<Mat3> reference(matrix(s));
  const double size = std::max(1e-300, reference.eigenvalues().cwiseAbs().maxCoeff());
  const double raw[6] = {s[0], s[1], s[2], s[3], s[4], s[5]};
  const auto v = principal_values(raw);
  EXPECT_NEAR(v.first, reference.eigenvalues()[2], tolerance * size);
  EXPECT_NEAR(v.second, reference.eigenvalues()[1], tolerance * size);
  EXPECT_NEAR(v.third, reference.eigenvalues()[0], tolerance * size);
  double plus[6];
  positive_part(raw, v, plus);
  const Mat3 expected = reference.eigenvectors() * reference.eigenvalues().cwiseMax(0.0).asDiagonal() *
                        reference.eigenvectors().transpose();
  const Mat3 got = matrix({plus[0], plus[1], plus[2], plus[3], plus[4], plus[5]});
  EXPECT_LE((got - expected).cwiseAbs().maxCoeff(), 4 * tolerance * size) << matrix(s);
}

TEST(Eigen, RandomTensorsAgainstQr) {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    const double scale = std::pow(10.0, 12 * u(generator));
    Sym s;
    for (double& x : s) x = scale * u(generator);
    const double raw[6] = {s[0], s[1], s[2], s[3], s[4], s[5]};
    const auto v = principal_values(raw);
    const double spread =
        std::min(v.first - v.second, v.second - v.third) / std::max(std::abs(v.first), std::abs(v.third));
    compare(s, spread > 1e-3 ? 1e-12 : 5e-8);
  }
}

TEST(Eigen, RepeatedAndNearlyRepeatedValues) {
  for (const double shift : {0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-9, 1e-6})
    for (const Sym& diagonal : {Sym{1, 0, 0, 0, 0, 0}, Sym{-1, 0, 0, 0, 0, 0}, Sym{1, 1, 0, 0, 0, 0},
                                Sym{1, 1, 1, 0, 0, 0}, Sym{-1, -1, -1, 0, 0, 0}, Sym{1, 0, -1, 0, 0, 0},
                                Sym{2, -1, -1, 0, 0, 0}, Sym{-2, 1, 1, 0, 0, 0}, Sym{0, 0, 0, 0, 0, 0}}) {
      Sym s = diagonal;
      s[1] += shift;
      compare(s, 5e-8);
      compare(test::rotated(s, 0.3, 1.1, -0.7), 5e-8);
      compare(test::scaled(test::rotated(s, 0.3, 1.1, -0.7), 3e7), 5e-8);
    }
}

TEST(Eigen, VectorLanesGiveWhatTheScalarGives) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> u(-1e6, 1e6);
  for (int i = 0; i < 200; ++i) {
    double lanes[6][4];
    V4 packed[6];
    for (int k = 0; k < 6; ++k) {
      for (double& x : lanes[k]) x = u(generator);
      packed[k] = load4(lanes[k]);
    }
    const auto v = principal_values(packed);
    for (int lane = 0; lane < 4; ++lane) {
      const double one[6] = {lanes[0][lane], lanes[1][lane], lanes[2][lane],
                             lanes[3][lane], lanes[4][lane], lanes[5][lane]};
      const auto s = principal_values(one);
      EXPECT_NEAR(v.first[lane], s.first, 1e-7);
      EXPECT_NEAR(v.second[lane], s.second, 1e-7);
      EXPECT_NEAR(v.third[lane], s.third, 1e-7);
    }
  }
}

TEST(Eigen, DirectionIsAnEigenvectorAlsoForRepeatedValues) {
  for (const Sym& s : {Sym{3, 1, -2, 0.5, -0.3, 0.8}, Sym{1, 1, 1, 0, 0, 0}, Sym{2, 0, 0, 0, 0, 0},
                       Sym{0, 0, 2, 0, 0, 0}, Sym{1, 1, 3, 0, 0, 0}, Sym{0, 0, 0, 0, 0, 1}}) {
    const double raw[6] = {s[0], s[1], s[2], s[3], s[4], s[5]};
    const auto v = principal_values(raw);
    for (const double value : {v.first, v.third}) {
      const auto n = principal_direction(s, value);
      const Vec3 e(n[0], n[1], n[2]);
      EXPECT_NEAR(e.norm(), 1, 1e-14);
      EXPECT_LE((matrix(s) * e - value * e).norm(), 1e-7);
    }
  }
}

TEST(Exponential, AgreesWithTheLibrary) {
  for (double x = -700; x <= 0; x += 0.0737) {
    EXPECT_NEAR(exponential(x) / std::exp(x), 1, 5e-16);
    EXPECT_EQ(exponential(spread(x, V4{}))[2], exponential(x));
  }
  EXPECT_EQ(exponential(0.0), 1.0);
  EXPECT_GE(exponential(-1e9), 0.0);
}

}  // namespace
}  // namespace talus::material
