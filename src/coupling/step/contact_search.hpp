/// What the bodies of an island may touch within a step.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// How far a block may come within h [m].
double reach_of(const IslandContext& in, int block, double h);

}  // namespace talus::coupling
