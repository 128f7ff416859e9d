/// What rows ask of a body that is jammed. A hard contact may ask for more than that nothing comes nearer: restitution asks for a rebound, a place inside a
/// structure's skin to be led out. A body between two sides that ask so cannot leave both: no impulse is large enough, however short the step.
#pragma once
#include <span>

#include "contact/problem.hpp"
#include "coupling/touch.hpp"

namespace talus::coupling {

/// Before a step at a structure is solved: a row asks for no motion towards a closed row (gap up to `closed` [m]) that faces it on the same block;
/// a rebound between two blocks, for none towards a row of theirs. Impulses of such
/// rows start from nothing.
void spare_jammed(std::span<const Touch> touches, double closed, contact::ContactProblem& problem);

/// After a step of length h could not be solved: no hard row asks for motion any more, which can always be met, by rest. Impulses start from those of
/// the step before, since those of the search that failed are out of all measure. False if nothing was asked.
bool ask_for_no_motion(std::span<const Touch> touches, contact::ContactProblem& problem, double h);

}  // namespace talus::coupling
