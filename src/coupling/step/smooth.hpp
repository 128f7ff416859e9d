/// The smooth part of a step: rows about its end, solved, moved, and again.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Whether the force that each spring gave is its law's at the indentation reached: rows hold its tangent.
bool laws_met(const IslandContext& in, const Step& step, double h);

}  // namespace talus::coupling
