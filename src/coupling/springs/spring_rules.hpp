/// Contact springs: which rule a step uses for each (spring_rules.cpp).
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// h sqrt(rate_sq) up to which the trapezoid is used. rate_sq is a trace, about four times the square of the
/// main frequency of a face.
constexpr double resolved_phase = 1.0;

/// Frequencies, speeds and quiet speeds of the oscillations on contact springs, per touch and body
/// (Touch::rate_sq, swing_rate, swing_speed, quiet_speed, energetic).
void estimate_spring_frequencies(const IslandContext& in, Step& step);

/// The rule of each spring in a step of length h, and of each body the rule of its positions.
void choose_spring_rules(const IslandContext& in, Step& step, double h, bool time_stepped);

}  // namespace talus::coupling
