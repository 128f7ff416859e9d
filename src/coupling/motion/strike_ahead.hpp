/// Where blocks are about to strike a structure, before they do: of every block that flies or slides towards
/// it, the first contact on its path
///
///   x(t) = c + v t + g t^2 / 2,     turning with w,
///
/// by conservative advancement. What the block meets on its way (ground, other blocks) turns it aside, hence
/// paths are followed over short times only: see `look_again`.
#pragma once
#include <limits>
#include <vector>

#include "coupling/environment.hpp"
#include "dda/state.hpp"

namespace talus::coupling {

struct StrikeAhead {
  int block = 0;
  Box3 place;         // of the points in contact [m]
  double energy = 0;  // kinetic, of the block [J]
};

struct StrikesAhead {
  std::vector<StrikeAhead> strikes;                             // within look_again, by block
  double look_again = std::numeric_limits<double>::infinity();  // after which blocks that are near may have
                                                                // been turned towards the structure [s]
};

/// Blocks that may reach structure `q` within `horizon` [s] and do not touch it yet. Blows weaker than a fall
/// by a hundredth of the block's size are none.
StrikesAhead strikes_ahead(const dda::Model& model, const dda::State& state, const ContactHistory& contacts,
                           const StructurePart& part, int q, double horizon);

}  // namespace talus::coupling
