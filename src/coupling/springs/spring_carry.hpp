/// Contact springs between blocks, and of blocks with planes, terrain and rigid structures, from one step to
/// the next.
///
/// The geometry names a contact by its features, and these change while the contact lasts: a vertex passes to
/// the next face, the polygon shared by two faces loses a corner, an area becomes an edge; of edges almost
/// parallel even the same feature may jump. With the force taken from the gap alone each such change would
/// add or take the energy by which the springs differ. So the springs of a pair keep it:
///
///   a feature that stays, with the stiffness it had:  d as at the end of the last step                   (1)
///   those that appeared or changed their stiffness:   d = s max(0, -(gap + offset)),                     (2)
///                                                     sum W(d) = sum of what these and those that vanished
///                                                     held, s <= 4; what is left then is set free
///
///
/// What crushes is as deep as it is in (2): crushed for good to y, s from 0 (y = d, unloaded) to 1 (d - y = p
/// A/k) and on (deeper, up to that), so that nothing is crushed by a name.
///
/// with d the indentation, W its energy, and the offset the feature's own, or that of the nearest one alike.
/// What d differs from the geometry is the contact's offset from then on; it is corrected slowly
/// (step/commit.cpp). What appears where nothing was held starts unloaded, however deep it is. Shear
/// elongations go on in the new plane of contact and are shortened where they would hold more than there was.
#pragma once
#include <span>
#include <vector>

#include "coupling/touch/touch.hpp"

namespace talus::coupling {

/// A spring that has vanished loaded, and left its energy to no other.
struct LooseSpring {
  Partner a;
  int b = 0;
  Vec3 place, normal;  // out of A
  double energy;       // [J]
};

/// Sets gap, offset, shear and stored energy of the springs of one pair at the start of a step; `memory` is
/// block B's. What no spring can hold is appended to `loose`. `half_steps`: the energies remembered are the
/// leapfrog's, means of two ends of steps; what is handed on is that of the end.
void carry_springs(const CandidatePair& pair, std::span<Touch> touches,
                   const std::vector<ContactMemory>& memory, bool half_steps,
                   std::vector<LooseSpring>& loose);

}  // namespace talus::coupling
