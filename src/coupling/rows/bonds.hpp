/// What the solution of the contact problem says of a contact: its velocity, and whether its bond holds.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Velocity of a touch's row by the solution, bias included, in its frame [m/s].
Vec3 row_velocity(const Step& step, const Touch& t);

/// True if this touch was bonded and its bond does not hold by the solution. A hard one: it bears the most
/// that it can, and the two move on each other by more than the solution leaves unsolved. Many that share a
/// load may have the most that they can bear and still hold.
bool bond_breaks(const IslandContext& in, const Step& step, const Touch& t);

/// Whether the springs of a bond give way by the solution: torn off, sheared off, or, where it has no
/// tension, opened.
bool spring_bond_gives_way(const Step& step, const Touch& t);

}  // namespace talus::coupling
