/// Springs per area at a structure's skin, elastic or crushing, as columns below the block
/// (contact/laws/bed.hpp): one touch for each part of a face of the skin.
///
/// The energy of such a bed is a function of where the block lies, so that faces may come and go and nothing
/// has to be carried from one to the next. What is remembered for each cell of a face of the skin is down to
/// where it was crushed for good (craters.hpp), also after the block has left it. A face found deep inside at
/// once, over more than the block can have covered in a step, starts unloaded.
///
/// Where asked to (`tilts`) a part that presses stands on four points about its centre of pressure, each with
/// a quarter of its columns, as far apart that tilting the part meets the stiffness of its columns: a step
/// that knew only of the force at the centre would feed what tilts, skin or block, unless it resolves that.
/// They are remembered as one.
#pragma once
#include "coupling/touch/touch.hpp"

namespace talus::coupling {

/// Whether contacts of this law at a deforming skin are such a bed.
bool is_bed(const ContactLaw& law);

/// True for the memory of a crater, which stays when the block has left it.
bool is_crater(const ContactMemory& memory);

/// Appends the touches of a pair; `memory` is block B's. Approach and dashpots are left to the caller.
void find_bed(const TriangleSurface& skin, const contact::SurfaceIndex& index, const CandidatePair& pair,
              const ContactLaw& law, const Polyhedron& shape, const Pose& pose, double margin,
              const std::vector<ContactMemory>& memory, const Tilts& tilts, std::vector<Touch>& out);

/// Adds what one of the points of a part remembers to what the others do.
void add_point(const ContactMemory& point, ContactMemory& part);

/// Takes the craters that a block's own among these touches found into its memory, in place of those that
/// their cells had.
void keep_craters(std::span<const Touch* const> touches, int block, std::vector<ContactMemory>& list);

}  // namespace talus::coupling
