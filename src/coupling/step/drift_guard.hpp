/// The correction of positions after a step is a correction of drift, or the step is not taken.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Of the hard contacts at hand, the deepest of each pair [m].
double sum_of_overlaps(const Step& step);

}  // namespace talus::coupling
