/// The contact problem of a step, solved as closely as the step asks (solve_settings.hpp).
#pragma once
#include "contact/solver/problem.hpp"
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// repeated: rows anew about an end that was not solved; what they contradict each other by still is taken.
/// last_resort: the convex problem's solution rather than none.
enum class Effort { provisional, full, repeated, last_resort };

class ProblemSolver {
 public:
  ProblemSolver(const IslandContext& in, Step& step, IslandReport& report);
  /// Of a macro step.
  void begin() { work_ = in_vain_ = 0; }
  /// With h = 0: an impulse of no duration. False: no solution.
  /// Solves again while the normal impulses found ask for other bounds than those it was solved with. The
  /// bounds x are a fixed point of x -> g(x), which is found by relaxation [irons1969]:  x' = x + w r,   r =
  /// g(x) - x,   w' = -w r . (r' - r) / |r' - r|^2
  bool solve_rolling(double h, Effort effort);
  /// Spent on the problems of the macro step: contacts times factorisations.
  double work() const { return work_; }
  /// The part of it whose problems had no solution.
  double in_vain() const { return in_vain_; }
  /// Whether that is what a time step may cost.
  bool not_worth_more() const;
  contact::ContactSolver& solver() { return solver_; }

 private:
  bool solve(double h, Effort effort);
  double weight() const;  // of the bodies [N]
  /// Looks for impulses under which all blocks stand still, where what moves is too slow to matter. True if
  /// it has them, as the step's solution; otherwise the problem is as it was.
  bool balanced(double h);

  const IslandContext& in_;
  Step& step_;
  IslandReport& report_;
  contact::ContactSolver solver_;
  double work_ = 0, in_vain_ = 0;
};

}  // namespace talus::coupling
