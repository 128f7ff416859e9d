/// Contact equations of over-constrained bodies. Restitution demands more than no approach: a body between
/// two sides that both demand a rebound cannot leave both, no impulse is large enough, however short the
/// step.
#pragma once
#include <span>

#include "contact/solver/problem.hpp"
#include "coupling/touch/touch.hpp"

namespace talus::coupling {

/// After a step of length h could not be solved: no hard row asks for motion any more, which can always be
/// met, by rest. Impulses start from those of the step before, since those of the search that failed are out
/// of all measure. False if nothing was asked.
bool ask_for_no_motion(std::span<const Touch> touches, contact::ContactProblem& problem, double h);

}  // namespace talus::coupling
