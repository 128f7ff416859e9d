/// Work of a step's impulses, accounted for where it is done.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Adds to Step::pending the works of the step just computed, of length h; 0: of an impulse of no duration.
void account_works(const IslandContext& in, Step& step, double h);

}  // namespace talus::coupling
