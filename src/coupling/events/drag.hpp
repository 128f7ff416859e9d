/// Where a step meets the surface of vegetation, or ground where another grows.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Longest step whose way with drag is a parabola to what the accuracy asks, which the search for onsets
/// takes it for: with the same start, velocity there and end they differ by h^3 |x'''| / 40 at most, x''' =
/// -c a [s].
double drag_limit(const IslandContext& in, const Body& b);

/// Time within the step just computed after which a block is in another drag, h if in none other [s].
double first_change_of_drag(const IslandContext& in, const Body& b, double h);

}  // namespace talus::coupling
