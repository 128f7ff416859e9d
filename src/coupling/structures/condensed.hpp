/// The condensed regime: structures that take long steps while blocks touch them.
///
/// A structure's step is then an affine map of the contact impulses on its touched nodes, v = v_hat + W p
/// (contact/structures/structure.hpp). In the contact problem it is one body of 3 m degrees of freedom with
/// the dense inverse mass W. Blocks at it move by the same rules as among themselves: velocities live at the
/// time of the positions, which follow the trapezoid.
#pragma once
#include <vector>

#include "coupling/search/contact_search.hpp"

namespace talus::coupling {

/// True if a block meets a structure within h faster than a condensed step may stop; the structure is
/// notified. It is the block that strikes: a skin that rings below one at rest, of light nodes and faster
/// than such a step resolves, is stilled by its first one (what is left of it: `meets_fast`).
bool strikes_structure(const IslandContext& in, const Step& step, double t, double h);

/// Nodes that the contacts at hand may press on, and their compliance.
void gather_condensed_surfaces(const IslandContext& in, Step& step);

/// Speed at which a hard contact may still approach at the end of a condensed step [m/s]; negative: it has to
/// leave. Positions follow the mean velocity: it may bring the gap to zero and no further, and an
/// overlap is corrected slowly. Never a rebound: whatever speed the mean asks for, the end of the step is at
/// most at rest, so that the normal impulse takes energy and gives none. Between blocks as well: what lies
/// inside there is projected, and a rebound is given back where its speed is more than a condensed step may
/// stop.
double approach_left(const IslandContext& in, const Step& step, const Touch& t, double h);

/// Largest error that the change of the contact forces since the last step leaves in positions, over the size
/// of the blocks: the midpoint rule's h^2/12 times the change of the acceleration, of blocks and of the
/// touched nodes.
double condensed_error(const IslandContext& in, const Step& step, double h);

/// Normal speeds at the skins as the condensed step at hand begins: what it does not resolve of their
/// velocities is gone.
void update_surface_approaches(const IslandContext& in, Step& step);

/// A block at rest on a structure at rest moves as the skin below it does.
double surface_speed(const IslandContext& in, const Step& step);

/// Hands the impulses to the structures; if one may not take them all are as they were, and it is notified
/// that it was struck.
bool correct_condensed(const IslandContext& in, const Step& step, double t, double h);

/// Impulses of the step on the nodes of a structure.
std::vector<NodeImpulse> shares_of(const Step& step, int structure);

/// Whether a macro step may begin condensed: no block strikes a structure in it, and every structure can.
bool may_condense(const IslandContext& in, Step& step, ContactSearch& search, double t, double duration);

/// Length of the next condensed step: a power of two of the macro step, so that few factors serve; 0: the
/// regime has to be left [s].
double condensed_length(const IslandContext& in, Step& step, ContactSearch& search, double t, double duration,
                        double remaining, double longest);

}  // namespace talus::coupling
