/// Contact equations of over-constrained bodies. A hard contact may demand more than no approach: restitution
/// demands a rebound, an overlap with a structure's surface its correction. A body between two sides with
/// such demands cannot leave both: no impulse is large enough, however short the step.
#pragma once
#include <span>

#include "contact/solver/problem.hpp"
#include "coupling/touch/touch.hpp"

namespace talus::coupling {

/// Before a step at a structure is solved: a row asks for no motion towards a closed row (gap up to `closed`
/// [m]) that faces it on the same block; a rebound between two blocks, for none towards a row of theirs. Of
/// the impulses of such rows `kept` is left to start from: two sides may press on each other through the body
/// with any impulse, and what nothing but the start holds up is to fade.
void spare_jammed(std::span<const Touch> touches, double closed, double kept,
                  contact::ContactProblem& problem);

/// Gap that a hard contact at a structure, now `gap`, may keep at the end of a step of length h [m]. One that
/// is inside already (a face found late, a corner that came round) is corrected at a thousandth of the speed
/// `moving` that blocks really have there [m/s]: faster correction would inject energy, and where all is at
/// rest over-constrained pieces would be driven against friction for ever.
double left_inside(double gap, double moving, double h);

/// After a step of length h could not be solved: no hard row asks for motion any more, which can always be
/// met, by rest. Impulses start from those of the step before, since those of the search that failed are out
/// of all measure. False if nothing was asked.
bool ask_for_no_motion(std::span<const Touch> touches, contact::ContactProblem& problem, double h);

/// Hard rows of blocks that bind nothing sink by a part of what their impulse moves, along the face as well:
///
///   u >= -epsilon w p,   w = n . J A^-1 J^T n   [1/kg]
///
/// Among over-constrained bodies all impulses that balance each other solve the rows; handed on from step to
/// step as a start they grow without bound, and what a residual leaves times these is energy. So the least
/// ones are the solution, whatever the rows ask. In steps of h a row that bears N times a body's weight sinks
/// at epsilon N g h.
void give_a_little(std::span<const Touch> touches, double epsilon, contact::ContactProblem& problem);

}  // namespace talus::coupling
