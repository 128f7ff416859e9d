#include "coupling/solution/over_constrained.hpp"

namespace talus::coupling {

bool ask_for_no_motion(std::span<const Touch> touches, contact::ContactProblem& problem, double h) {
  bool any = false;
  for (const Touch& t : touches) {
    if (t.row < 0) continue;
    contact::ProblemContact& c = problem.contacts[static_cast<std::size_t>(t.row)];
    c.impulse = h * (t.frame.transpose() * t.warm);
    if (t.stiffness > 0 || !(c.bias[0] < 0)) continue;
    c.bias[0] = 0;
    any = true;
  }
  return any;
}

}  // namespace talus::coupling
