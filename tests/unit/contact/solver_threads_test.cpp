// The solver gives the same bits on one thread and on several, in problems large enough that they share its
// loops.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <random>

#include "contact/linear/solver_linear.hpp"
#include "contact/linear/solver_order.hpp"
#include "contact/solver/solver_system.hpp"
#include "solver_problems.hpp"

namespace talus::contact::testing {
namespace {

struct Solved {
  SolveReport report;
  std::vector<double> v;
};

Solved solve_on(int threads, const Builder& scene, const SolveSettings& settings) {
  ContactProblem problem = scene.problem;
  ContactSolver solver;
  Solved out;
  tbb::task_arena(threads).execute([&] { out.report = solver.solve(problem, settings); });
  out.v = problem.v;
  return out;
}

TEST(SolverThreads, GiveTheSameBits) {
  const Builder b = pile(18, 18, 3, 0.5, 0.005, 0.3, 5);
  ASSERT_GE(b.problem.contacts.size(), static_cast<std::size_t>(2 * detail::VisitingOrder::contacts_of_part));
  SolveSettings settings;
  settings.tolerance = 2e-3;
  const Solved one = solve_on(1, b, settings), two = solve_on(2, b, settings),
               three = solve_on(3, b, settings);
  EXPECT_TRUE(one.report.converged);
  EXPECT_GT(one.report.newton, 0);
  EXPECT_EQ(one.report.newton, two.report.newton);
  EXPECT_EQ(one.v, two.v);
  EXPECT_EQ(one.v, three.v);
}

TEST(BlockLU, FrontsThatWaitForOthersGiveTheSameBitsAndTheSolution) {
  constexpr int nx = 12, ny = 12, nz = 5, m = 6;  // bodies of a grid, each coupled to its neighbours
  const std::vector<int> sizes(nx * ny * nz, m);
  std::vector<std::pair<int, int>> pairs;
  for (int i = 0; i < nx * ny * nz; ++i)
    for (const auto& [step, last] : {std::pair(1, (i + 1) % nx == 0), std::pair(nx, (i / nx + 1) % ny == 0),
                                     std::pair(nx * ny, i / (nx * ny) + 1 == nz)})
      if (!last) pairs.emplace_back(i, i + step);
  std::sort(pairs.begin(), pairs.end());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> entry(-1, 1);
  std::vector<double> off(2 * pairs.size() * m * m), b(sizes.size() * m);
  for (double& x : off) x = entry(random);
  for (double& x : b) x = entry(random);

  const auto solution_on = [&](int threads) {
    std::vector<double> x = b;
    tbb::task_arena(threads).execute([&] {
      detail::BlockLU lu;
      lu.analyse(sizes, pairs);
      EXPECT_GT(lu.levels(), 2);
      for (int again = 0; again < 2; ++again) {  // the factor serves again
        lu.set_zero();
        for (std::size_t a = 0; a < sizes.size(); ++a)
          for (int k = 0; k < m; ++k) lu.diagonal(static_cast<int>(a))[k * (m + 1)] = 20;
        for (std::size_t p = 0; p < pairs.size(); ++p) {
          std::copy_n(off.data() + 2 * p * m * m, m * m, lu.upper(static_cast<int>(p)));
          std::copy_n(off.data() + (2 * p + 1) * m * m, m * m, lu.lower(static_cast<int>(p)));
        }
        EXPECT_TRUE(lu.factor());
      }
      lu.solve(x.data());
    });
    return x;
  };
  const std::vector<double> x = solution_on(1);
  std::vector<double> rest = b;  // b - H x
  for (std::size_t i = 0; i < rest.size(); ++i) rest[i] -= 20 * x[i];
  for (std::size_t p = 0; p < pairs.size(); ++p)
    for (int c = 0; c < m; ++c)
      for (int r = 0; r < m; ++r) {
        const int a = m * pairs[p].first, d = m * pairs[p].second;
        rest[static_cast<std::size_t>(a + r)] -=
            off[2 * p * m * m + static_cast<std::size_t>(c * m + r)] * x[static_cast<std::size_t>(d + c)];
        rest[static_cast<std::size_t>(d + r)] -=
            off[(2 * p + 1) * m * m + static_cast<std::size_t>(c * m + r)] *
            x[static_cast<std::size_t>(a + c)];
      }
  for (const double r : rest) ASSERT_NEAR(r, 0, 1e-12);
  EXPECT_EQ(x, solution_on(2));
  EXPECT_EQ(x, solution_on(3));
}

TEST(VisitingOrder, GroupsThatAreVisitedTogetherShareNoBody) {
  const Builder b = pile(24, 24, 3, 0.5, 0.005, 0.3, 5);
  detail::System system;
  system.assemble(b.problem, true);
  ASSERT_GT(system.order.levels(), 2);
  for (int level = 0; level < system.order.levels(); ++level) {
    std::vector<int> group_of_body(system.body.size(), -1);
    for (int g = 0; g < system.order.groups(level); ++g) {
      EXPECT_TRUE(std::ranges::is_sorted(system.order.group(level, g)));
      for (const int i : system.order.group(level, g)) {
        const detail::Touch& t = system.touch[static_cast<std::size_t>(i)];
        for (int k = t.first; k < t.first + t.count; ++k) {
          int& group =
              group_of_body[static_cast<std::size_t>(system.terms[static_cast<std::size_t>(k)].body)];
          EXPECT_TRUE(group < 0 || group == g) << "level " << level << ", contact " << i;
          group = g;
        }
      }
    }
  }
  for (const bool forward : {true, false}) {
    std::vector<int> times(system.touch.size(), 0);
    system.order.each(forward, false, [&](int i) { return ++times[static_cast<std::size_t>(i)] > 0; });
    EXPECT_TRUE(std::ranges::all_of(times, [](int n) { return n == 1; }));
  }
}

/// What lies between the parts is little, else loads would be carried on part by part alone.
TEST(VisitingOrder, MostContactsLieWithinAPart) {
  const Builder b = cubes(20, 10, 8, 0.5, 0.01, true);
  detail::System system;
  system.assemble(b.problem, true);
  ASSERT_GT(system.order.levels(), 2);
  std::size_t within = 0;
  for (int g = 0; g < system.order.groups(0); ++g) within += system.order.group(0, g).size();
  EXPECT_GT(within, 0.75 * static_cast<double>(system.touch.size()));
}

/// The touched skin of a structure is one body of many degrees of freedom: eliminated by panels.
TEST(BlockLU, BodiesOfManyDegreesOfFreedom) {
  for (const int many : {95, 96, 97, 150, 433}) {
    const std::vector<int> sizes{6, many, 6};
    const std::vector<std::pair<int, int>> pairs{{0, 1}, {1, 2}};
    std::mt19937 random(static_cast<unsigned>(many));
    std::uniform_real_distribution<double> entry(-1, 1);
    const int n = many + 12;
    MatX H = MatX::Zero(n, n);
    const auto fill = [&](int row, int column, int rows, int columns) {
      for (int c = 0; c < columns; ++c)
        for (int r = 0; r < rows; ++r) H(row + r, column + c) = entry(random);
    };
    fill(0, 0, 6 + many, 6 + many);  // no diagonal stands out: rows are exchanged
    fill(6, 6 + many, many, 6);
    fill(6 + many, 6, 6, many);
    fill(6 + many, 6 + many, 6, 6);
    H.topLeftCorner(6, 6) += 20 * MatX::Identity(6, 6);
    H.bottomRightCorner(6, 6) += 20 * MatX::Identity(6, 6);
    detail::BlockLU lu;
    lu.analyse(sizes, pairs);
    lu.set_zero();
    const std::vector<int> at{0, 6, 6 + many};
    for (int b = 0; b < 3; ++b)
      Eigen::Map<MatX>(lu.diagonal(b), sizes[b], sizes[b]) = H.block(at[b], at[b], sizes[b], sizes[b]);
    for (int p = 0; p < 2; ++p) {
      const auto [a, b] = pairs[static_cast<std::size_t>(p)];
      Eigen::Map<MatX>(lu.upper(p), sizes[a], sizes[b]) = H.block(at[a], at[b], sizes[a], sizes[b]);
      Eigen::Map<MatX>(lu.lower(p), sizes[b], sizes[a]) = H.block(at[b], at[a], sizes[b], sizes[a]);
    }
    ASSERT_TRUE(lu.factor());
    VecX x = VecX::Ones(n);
    lu.solve(x.data());
    EXPECT_LT((H * x - VecX::Ones(n)).cwiseAbs().maxCoeff(), 1e-9 * (1 + x.cwiseAbs().maxCoeff())) << many;
  }
}

}  // namespace
}  // namespace talus::contact::testing
