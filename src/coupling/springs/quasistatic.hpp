/// Light blocks between heavy ones: springs whose oscillation a step does not resolve (quasistatic.cpp).
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Blocks of the end rule that springs connect to a block of the trapezoid, at once or through others.
void find_followers(const IslandContext& in, Step& step);

/// By the solution just applied: force of each spring on blocks that follow, and the stress that these strain
/// against.
void balance_springs(const IslandContext& in, Step& step, double h);

}  // namespace talus::coupling
