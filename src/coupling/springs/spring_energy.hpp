/// What contact springs hold at the end of a step.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Of the normal spring, of the shear spring, of both [J].
double normal_energy_at_end(const Step& step, const Touch& t);

double spring_energy_at_end(const Step& step, const Touch& t, double h);

double shear_energy_at_end(const Step& step, const Touch& t, double h);

/// Elongation of the shear spring at the end of the step, and that by which the step has stretched it, none
/// where it let go [m].
Vec3 shear_way(const Step& step, const Touch& t, double h);

Vec3 shear_at_end(const Step& step, const Touch& t, double h);

/// Columns of a bed that come out of contact lose the last of their pressure sheared: what they held slips
/// away. Those that join are not sheared, and a part shears as one: what evens out among them slips as well
/// [J].
double freed_shear(const IslandContext& in, const Touch& t);

/// A bed knows what was crushed once the block has come to where it lies. What its law tells for the step
/// ahead, of a leapfrog for the half of it, is put right a step later.
double crushed_ahead(const Touch& t);

}  // namespace talus::coupling
