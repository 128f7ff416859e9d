/// How long a step may be for the contact springs, and where it ends as one lets go.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// True if the step that is searched for resolves the oscillation of a part of an elastic foundation, h^2 k W
/// < 1, k its stiffness and W the inverse mass of block and skin along its normal. Along the normal its row
/// holds it at the end of the step; what tilts it moves it at the start alone, and feeds the tilting where
/// the step does not resolve it.
bool part_resolved(const IslandContext& in, const Step& step, const Touch& t);

/// A block at a structure: its force rises within a quarter of the period of the block on all its springs, in
/// series with the touched cells, which a stiffer spring does not outrun [s]. Hard contacts have the cells
/// alone; they count for the blocks that bring energy: what they would give in stopping where they approach,
/// and what their force holds already, so that a piece that lies on the structure or moves along with it does
/// not count. What a step loses goes with its square: blocks with a part of the largest energy take as many
/// exchanges as the root of that part. On Hertz's law, which is never hard contact, the touched nodes are
/// resolved, too. `ahead`: a step within which an open contact would have to close to count [s].
double rise_limit(const IslandContext& in, const Step& step, double ahead);

/// Longest step of at most h by the oscillations on springs that the accuracy asks to be resolved; those at
/// structures in explicit steps follow rise_limit() [s].
double spring_limit(const IslandContext& in, const Step& step, double h, bool time_stepped);

/// Energy of a spring up to which its opening or closing within a step is no event: a part of that of its
/// approach, or of `speed` [m/s] where it is slower [J].
double energy_of_no_event(const IslandContext& in, const Touch& t, double speed);

/// Shortens the step just computed to where a spring lets go, so that it gives back what it stored; false:
/// none does within it.
bool cut_at_release(const IslandContext& in, const Step& step, double& h);

}  // namespace talus::coupling
