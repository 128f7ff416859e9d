// Cost of one contact problem: small islands, a tower, walls, piles. Warm: v_hat of the next step differs by
// `change`, the impulses are those of the step before.
#include <benchmark/benchmark.h>

#include "unit/contact/solver_problems.hpp"

using namespace talus;
using namespace talus::contact;
using namespace talus::contact::testing;

namespace {

void run(benchmark::State& state, Builder b, double tolerance, bool warm, double change) {
  ContactSolver solver;
  SolveSettings settings;
  settings.tolerance = tolerance;
  const std::vector<double> v_hat = b.problem.v_hat;
  SolveReport report = solver.solve(b.problem, settings);
  const std::vector<ProblemContact> solved = b.problem.contacts;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  double newton = 0, runs = 0;
  bool converged = true;
  for (auto _ : state) {
    state.PauseTiming();
    for (std::size_t k = 0; k < v_hat.size(); ++k)
      b.problem.v_hat[k] = v_hat[k] + (warm ? change * unit(random) : 0.0);
    for (std::size_t k = 0; k < solved.size(); ++k)
      b.problem.contacts[k].impulse = warm ? solved[k].impulse : Vec3(Vec3::Zero());
    state.ResumeTiming();
    report = solver.solve(b.problem, settings);
    newton += report.newton;
    converged = converged && report.converged;
    ++runs;
  }
  state.counters["blocks"] = static_cast<double>(b.problem.bodies.size());
  state.counters["contacts"] = static_cast<double>(b.problem.contacts.size());
  state.counters["newton"] = newton / runs;
  state.counters["converged"] = converged;
}

Builder sliding() {
  Builder b;
  b.box(Vec3(0, 0, 0.5), Vec3::Ones(), 2500, 0.01 * Vec3(5.6, 0, -8.0));
  b.patch(-1, 0, Vec3::Zero(), 0.5 * X, 0.5 * Y, Z, 0.53);
  return b;
}

void tight(benchmark::State& s, Builder (*make)(), bool warm, double change) {
  run(s, make(), 1e-10, warm, change);
}
void loose(benchmark::State& s, Builder (*make)(), bool warm, double change) {
  run(s, make(), 1e-6, warm, change);
}

Builder tower() { return cubes(1, 1, 50, 0.53, 0.01); }
Builder wall() { return cubes(20, 1, 10, 0.53, 0.01, true); }
Builder pile_128() { return pile(8, 8, 2, 0.53, 0.005, 0.3, 1); }
Builder pile_432() { return pile(12, 12, 3, 0.53, 0.005, 0.3, 2); }
Builder pile_1728() { return pile(24, 24, 3, 0.53, 0.005, 0.3, 3); }

BENCHMARK_CAPTURE(tight, block_cold, sliding, false, 0.0);
BENCHMARK_CAPTURE(tight, block_warm, sliding, true, 1e-4);
BENCHMARK_CAPTURE(tight, tower_cold, tower, false, 0.0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(tight, tower_warm, tower, true, 1e-6)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(tight, wall_cold, wall, false, 0.0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(tight, wall_warm, wall, true, 1e-6)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(loose, pile_128_cold, pile_128, false, 0.0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(loose, pile_128_warm, pile_128, true, 1e-3)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(loose, pile_432_cold, pile_432, false, 0.0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(loose, pile_432_warm, pile_432, true, 1e-3)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(loose, pile_1728_cold, pile_1728, false, 0.0)->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(loose, pile_1728_warm, pile_1728, true, 1e-3)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace

BENCHMARK_MAIN();
