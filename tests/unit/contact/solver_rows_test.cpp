// Products with the three rows of a Jacobian beside those of Eigen, for every number of columns that bodies
// have and for others.
#include <gtest/gtest.h>

#include "contact/solver/solver_rows.hpp"

namespace talus::contact::detail {
namespace {

using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

class SolverRows : public ::testing::TestWithParam<int> {
 protected:
  const int n = GetParam();
  const Rows J = Rows::Random(3, n);
  const Eigen::VectorXd x = Eigen::VectorXd::Random(n);
};

TEST_P(SolverRows, VelocitiesOfTwoBodiesAddUp) {
  const Rows K = Rows::Random(3, n);
  const Eigen::VectorXd y = Eigen::VectorXd::Random(n);
  RowSums<3> all;
  RowSums<1> normal;
  for (const auto& [rows, v] : {std::pair(&J, &x), std::pair(&K, &y)}) {
    all.add(rows->data(), n, v->data());
    normal.add(rows->data(), n, v->data());
  }
  const Vec3 u = J * x + K * y;
  for (int r = 0; r < 3; ++r) EXPECT_NEAR(all[r], u[r], 1e-14);
  EXPECT_EQ(normal[0], all[0]);
}

TEST_P(SolverRows, AnImpulseReachesEveryColumnAndNoneBeyond) {
  const Vec3 p(0.3, -1.7, 2.9);
  Eigen::VectorXd moved(n + 4);
  moved.head(n) = x;
  moved.tail<4>().setConstant(7);
  add_transposed(J.data(), n, p, moved.data());
  EXPECT_LT((moved.head(n) - x - J.transpose() * p).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_EQ(moved.tail<4>(), Eigen::Vector4d::Constant(7));
}

INSTANTIATE_TEST_SUITE_P(Columns, SolverRows, ::testing::Values(1, 3, 6, 7, 12, 30));

}  // namespace
}  // namespace talus::contact::detail
