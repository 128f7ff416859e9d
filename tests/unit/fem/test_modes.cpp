// Natural modes of chains of equal masses and springs, in closed form.
#include <gtest/gtest.h>

#include <cmath>

#include "fem/linear/modal.hpp"

using namespace talus;
using namespace talus::fem;

namespace {

/// Chains side by side, each of `masses` unit masses between springs of stiffness k [N/m], held at both ends.
SymmetricMatrix chains(int count, int masses, double k) {
  SymmetricMatrix a;
  a.n = count * masses;
  a.column.push_back(0);
  for (int j = 0; j < a.n; ++j) {
    a.row.push_back(j), a.value.push_back(2 * k);
    if (j % masses != masses - 1) a.row.push_back(j + 1), a.value.push_back(-k);
    a.column.push_back(static_cast<std::int64_t>(a.row.size()));
  }
  return a;
}

/// omega_j = 2 sqrt(k/m) sin(j pi / (2 (n + 1)))
double frequency(int j, int masses, double k) {
  return 2 * std::sqrt(k) * std::sin(j * M_PI / (2 * (masses + 1.0)));
}

void expect_modes(int asked, int largest) {
  const int count = 3, masses = 300;
  const double k = 1e4;
  const SymmetricMatrix stiffness = chains(count, masses, k);
  const CholeskyFactor factor(stiffness, 0.0, {});
  const ModalBasis modes = lowest_modes(factor, VecX::Ones(stiffness.n), asked, largest);
  ASSERT_EQ(modes.omega.size(), asked);
  for (int i = 0; i < asked; ++i)
    EXPECT_NEAR(modes.omega[i] / frequency(i / count + 1, masses, k), 1, 1e-8) << "mode " << i;
  EXPECT_LT((modes.phi.transpose() * modes.phi - MatX::Identity(asked, asked)).cwiseAbs().maxCoeff(), 1e-10);
  MatX stressed(stiffness.n, asked);
  for (int i = 0; i < asked; ++i) stiffness.multiply(modes.phi.col(i).data(), stressed.col(i).data());
  const MatX left = stressed - modes.phi * modes.omega.cwiseAbs2().asDiagonal();
  for (int i = 0; i < asked; ++i)
    EXPECT_LT(left.col(i).norm(), 1e-2 * modes.omega[i] * modes.omega[i]) << "mode " << i;
}

}  // namespace

TEST(Modes, ThreeEqualChains) { expect_modes(60, 0); }

TEST(Modes, BasisThatStartsAgain) { expect_modes(60, 80); }
