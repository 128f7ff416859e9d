/// Friction of what slides through a step while its direction turns: against the mean of the slips at both
/// ends of the step it is of second order, as the trapezoid of the positions; against that at the end of
/// first.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// The slips at the start of the step; friction is taken against those at its end.
void begin_friction_direction(const IslandContext& in, Step& step);

/// Whether each touch slides on, by the solution, as its row supposed. After the first pass all those that
/// turn by less than 60 degrees change to the mean; what that turns round, or stops, changes back. In
/// condensed steps: whether friction takes energy at each pair, sum p_t . (u_t + slip) <= 0. Where it drives,
/// the slip at the end is none that the step resolves, and what drives opposes the mean from the next pass
/// on. But for what a step may make of a block at rest: its slips come and go from step to step, and against
/// the mean of them friction takes nothing.
bool turn_friction(const IslandContext& in, Step& step, bool first_pass);

/// What the turning of the slip within the step adds to the error of the path until friction has stopped it,
/// relative to block size.
double friction_direction_error(const IslandContext& in, const Step& step, double h);

}  // namespace talus::coupling
