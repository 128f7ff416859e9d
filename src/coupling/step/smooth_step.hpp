/// The smooth part of a step: rows about its end, solved, moved, and again.
#pragma once
#include "coupling/rows/assembly.hpp"
#include "coupling/solution/problem_solver.hpp"
#include "coupling/step/update.hpp"

namespace talus::coupling {

class SmoothStep {
 public:
  struct Outcome {
    bool ok = false;
    double error = 0;  // between the last two passes, relative to the block size
  };
  SmoothStep(IslandContext& in, Step& step, RowAssembly& assembly, ProblemSolver& solver, BodyUpdate& update);
  /// From the present state over h, in at least so many passes; works are accounted for. Where it is not ok
  /// the state is of no use.
  Outcome solve(double h, bool time_stepped, int passes, bool last_resort = false);

 private:
  IslandContext& in_;
  Step& step_;
  RowAssembly& assembly_;
  ProblemSolver& solver_;
  BodyUpdate& update_;
};

}  // namespace talus::coupling
