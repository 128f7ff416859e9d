// The solver gives the same bits on one thread and on several, in problems large enough that they share its loops.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "contact/solver_order.hpp"
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
  ASSERT_GE(b.problem.contacts.size(), static_cast<std::size_t>(detail::VisitingOrder::coloured_from));
  SolveSettings settings;
  settings.tolerance = 2e-3;
  const Solved one = solve_on(1, b, settings), two = solve_on(2, b, settings), three = solve_on(3, b, settings);
  EXPECT_TRUE(one.report.converged);
  EXPECT_GT(one.report.newton, 0);
  EXPECT_EQ(one.report.newton, two.report.newton);
  EXPECT_EQ(one.v, two.v);
  EXPECT_EQ(one.v, three.v);
}

}  // namespace
}  // namespace talus::contact::testing
