/// Contacts as one run hands them on to the next: between bodies that are known again by what they are, not
/// by their place in a scene.
#pragma once
#include "coupling/system/system.hpp"
#include "sim/final_state.hpp"
#include "sim/world.hpp"

namespace talus::sim {

/// Adds the bodies of the world and what they remember of each other.
void keep_contacts(const World&, FinalState&);

/// Puts the contacts of `state` in place of the world's own and returns the pairs of bodies that were there
/// in that run: whether these are bonded, and where they stand to each other, is theirs from then. A block
/// that is not among `state.blocks` is another one.
coupling::KnownPairs restore_contacts(World&, const FinalState& state);

}  // namespace talus::sim
