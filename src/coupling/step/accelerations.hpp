/// Error of a step by what the contacts allow at both of its ends (accelerations.cpp).
#pragma once
#include <span>

#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Error that a step may have in the position of a block [m].
double step_error(const IslandContext& in, int block);

/// Time of a fall by half the radius of the block [s].
double fall_time(const IslandContext& in, int block);

/// Of islands of rigid blocks in hard contact without bonds: what a bond bears depends on the time in which
/// it stops a motion.
bool looks_ahead(const IslandContext& in, const Step& step);

/// Error of the step just computed over the error that it may have, the largest of all bodies: from the
/// accelerations allowed at its start and end.
double error_by_ends(const IslandContext& in, const Step& step, double h, std::span<const Vec6> at_start,
                     std::span<const Vec6> at_end);

/// The same of places that go by a rule of order 1, by velocities at the end in the directions that springs
/// hold, and of strains: in half a period an oscillation of frequency w and speed v = w a loses pi/2 h w of
/// its amplitude a, hence pi/2 h v, however many springs share it. Of what springs hold in the time t_c as
/// well: h w v t_c/2, but no more than all of a = v/w. w by Rayleigh's quotient of the springs for these
/// velocities.
double error_by_end_rule(const IslandContext& in, const Step& step, double h);

/// The accelerations that the contacts of the present state allow, per body, less that by drag, whose share a
/// step integrates exactly; none if they have no solution.
std::optional<std::vector<Vec6>> allowed_accelerations(const IslandContext& in, const Step& step,
                                                       IslandReport& report, contact::ContactSolver& solver);

}  // namespace talus::coupling
