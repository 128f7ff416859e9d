// The solver gives the same bits on one thread and on several, in problems large enough that they share its loops.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <set>

#include "contact/solver_order.hpp"
#include "contact/solver_system.hpp"
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

TEST(VisitingOrder, RunsThatAreVisitedTogetherShareNoBody) {
  // Every contact once; of a body, one run of contacts after the other, each in its order or the other way round.
  const Builder b = pile(18, 18, 3, 0.5, 0.005, 0.3, 5);
  detail::System system;
  system.assemble(b.problem, true);
  ASSERT_GT(system.order.colours(), 1);
  for (const bool forward : {true, false}) {
    std::vector<int> visited;
    system.order.each(forward, false, [&](int i) {
      visited.push_back(i);
      return true;
    });
    std::vector<int> times(system.touch.size(), 0);
    std::vector<std::vector<int>> of_body(system.body.size());
    for (const int i : visited) {
      ++times[static_cast<std::size_t>(i)];
      const detail::Touch& t = system.touch[static_cast<std::size_t>(i)];
      for (int k = t.first; k < t.first + t.count; ++k) of_body[static_cast<std::size_t>(system.terms[static_cast<std::size_t>(k)].body)].push_back(i);
    }
    EXPECT_TRUE(std::ranges::all_of(times, [](int n) { return n == 1; }));
    for (const std::vector<int>& contacts : of_body) {
      std::set<int> runs;
      for (std::size_t k = 0; k < contacts.size(); ++k) {
        const int run = contacts[k] / detail::VisitingOrder::run_length;
        if (k > 0 && run == contacts[k - 1] / detail::VisitingOrder::run_length) EXPECT_EQ(contacts[k] > contacts[k - 1], forward);
        else EXPECT_TRUE(runs.insert(run).second) << "run " << run << " is visited among others on a body of its own";
      }
    }
  }
}

}  // namespace
}  // namespace talus::contact::testing
