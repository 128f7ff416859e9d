// Halves of solutions: entries of the inverse and sums of columns are those of the whole solution, and do not
// depend on what else is asked.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "core/error.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

struct Column {
  DofMap dofs;
  SymmetricMatrix stiffness;
  explicit Column(int across, int along) {
    const HexMesh mesh = make_mesh(cantilever(across, along));
    dofs.number.assign(mesh.nodes.size(), {-1, -1, -1});
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
      if (mesh.nodes[n].z() > 1e-9)
        for (std::size_t c = 0; c < 3; ++c)
          dofs.number[n][c] = dofs.size++, dofs.place.push_back(static_cast<int>(4 * n + c));
    stiffness = assemble_stiffness(mesh, dofs, 14e9, 18e9);
  }
};

}  // namespace

TEST(HalfColumns, GiveTheInverse) {
  const Column pier(4, 24);
  const CholeskyFactor factor(pier.stiffness, 0.0, {});
  const int n = pier.dofs.size;
  const std::vector<int> asked{0, 1, n / 3, n / 2 + 1, n - 1};
  std::vector<HalfColumn> half;
  for (const int d : asked) half.push_back(factor.half_column(d));
  for (std::size_t j = 0; j < asked.size(); ++j) {
    VecX unit = VecX::Zero(n), whole(n), back(n), z = VecX::Zero(n);
    unit[asked[j]] = 1;
    factor.solve(unit.data(), whole.data());
    for (std::size_t i = 0; i < asked.size(); ++i)
      EXPECT_NEAR(factor.product(half[i], half[j]), whole[asked[i]], 1e-12 * whole.cwiseAbs().maxCoeff())
          << i << ", " << j;
    factor.add(half[j], 1, z.data());
    factor.back(z.data(), back.data());
    EXPECT_LT((back - whole).cwiseAbs().maxCoeff(), 1e-12 * whole.cwiseAbs().maxCoeff());
  }
}

TEST(HalfColumns, ArePartOfTheWhole) {
  const Column pier(4, 48);
  const CholeskyFactor factor(pier.stiffness, 0.0, {});
  EXPECT_LT(factor.half_column(pier.dofs.size / 2).value.size(),
            static_cast<std::size_t>(pier.dofs.size) / 3);
}

TEST(HalfColumns, OfUnconnectedPartsHaveNothingInCommon) {
  SymmetricMatrix a;  // two chains of two
  a.n = 4;
  a.column = {0, 2, 3, 5, 6};
  a.row = {0, 1, 1, 2, 3, 3};
  a.value = {2, -1, 2, 2, -1, 2};
  const CholeskyFactor factor(a, 0.0, {});
  const HalfColumn first = factor.half_column(0), second = factor.half_column(3);
  EXPECT_EQ(factor.product(first, second), 0);
  EXPECT_NEAR(factor.product(first, first), 2.0 / 3, 1e-15);
  EXPECT_EQ(factor.product(first, HalfColumn{}), 0);  // of a direction that is held
}

/// A factor made again in its place has the digits of a new one: of another matrix of the same pattern, of
/// one of another pattern, and after one that is not positive definite was refused.
TEST(CholeskyAgain, HasTheDigitsOfANewFactor) {
  const Column pier(4, 24), other(3, 30);
  CholeskyFactor factor(pier.stiffness, 0.0, {});
  factor.half_column(0);
  const auto same_as_new = [&](const SymmetricMatrix& a, double shift) {
    const std::vector<double> d(static_cast<std::size_t>(a.n), 2.5);
    factor.again(a, shift, d);
    const CholeskyFactor fresh(a, shift, d);
    VecX b(a.n), x(a.n), y(a.n);
    for (int i = 0; i < a.n; ++i) b[i] = std::sin(i);
    factor.solve(b.data(), x.data());
    fresh.solve(b.data(), y.data());
    EXPECT_TRUE(x == y);
    const HalfColumn now = factor.half_column(a.n / 2), then = fresh.half_column(a.n / 2);
    EXPECT_TRUE(now.supernode == then.supernode && now.value == then.value);
  };
  same_as_new(pier.stiffness, 1e9);
  SymmetricMatrix softer = pier.stiffness;
  for (std::size_t k = 0; k < softer.value.size(); ++k) softer.value[k] *= 0.5;
  same_as_new(softer, 3e8);
  same_as_new(other.stiffness, 0);
  same_as_new(pier.stiffness, 0);
  EXPECT_THROW(
      factor.again(pier.stiffness, -1e15, std::vector<double>(static_cast<std::size_t>(pier.dofs.size), 1.0)),
      NumericalFailure);
}

/// Structures of an ensemble's runs are factored in several threads at a time.
TEST(CholeskyAgain, ThreadsDoNotDisturbEachOther) {
  const Column pier(4, 24);
  const auto solution = [&] {
    const CholeskyFactor factor(pier.stiffness, 0.0, {});
    VecX b(pier.dofs.size), x(pier.dofs.size);
    for (int i = 0; i < pier.dofs.size; ++i) b[i] = std::sin(i);
    factor.solve(b.data(), x.data());
    return x;
  };
  const VecX alone = solution();
  std::atomic<int> wrong = 0;
  const auto work = [&] {
    for (int k = 0; k < 100; ++k) try {
        if (solution() != alone) ++wrong;
      } catch (const NumericalFailure&) { ++wrong; }
  };
  std::thread other(work);
  work();
  other.join();
  EXPECT_EQ(wrong, 0);
}

/// Which other nodes are asked for, in which order, and what was asked before changes no digit.
TEST(HalfColumns, ComplianceIsTheSameWhateverElseIsAsked) {
  const auto begun = [](FemStructure& s) {
    s.condensed().predict(0, 20 * s.critical_step());
    return s.condensed().compliance(std::vector<int>{40, 70});
  };
  StructureSpec spec = cantilever(2, 8);
  FemStructure one(spec, Vec3::Zero(), silent), other(spec, Vec3::Zero(), silent);
  const MatX first = begun(one);
  other.condensed().predict(0, 20 * other.critical_step());
  const MatX more = other.condensed().compliance(std::vector<int>{70, 55, 40});
  EXPECT_EQ((first.block<3, 3>(0, 0) - more.block<3, 3>(6, 6)).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ((first.block<3, 3>(0, 3) - more.block<3, 3>(6, 0)).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ((more - more.transpose()).cwiseAbs().maxCoeff(), 0);
  // An impulse moves what the compliance says.
  std::vector<NodeImpulse> push{{70, Vec3(3, -1, 2)}};
  ASSERT_TRUE(one.condensed().correct(0, 20 * one.critical_step(), push));
  EXPECT_LT((one.skin().node_velocity(40) - first.block<3, 3>(0, 3) * push[0].impulse).norm(),
            1e-12 * one.skin().node_velocity(70).norm());
}
