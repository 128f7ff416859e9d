/// Springs of points at a structure's skin that vanish while they are loaded.
///
/// A face that comes to lie on a skin has the skin's nodes for contacts, and its own vertices and edges are
/// none any more; a block that tilts, or slides over an edge, loses them one by one. What such a spring held
/// the others of the pair go on holding, which press much the same way (their normals within 60 degrees of
/// its own): each is sunk deeper by one factor s, up to 4, so that by the leapfrog's energies of half steps
///
///   sum [W(s d_n + h_- u_-) + W(s d_n)] / 2 = sum [W(d_n + h_- u_-) + W(d_n)] / 2 + what was held
///
/// with W the work of the law, d_n the indentation at the start of the step, h_- u_- what the step before
/// left of it. Likewise the shear springs by their elongations. What no other can take is lost, and accounted
/// for where the memory of it ends.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "coupling/touch/touch.hpp"

namespace talus::coupling {

/// Deepens the pressed springs of a pair (`touches`, block B's with `partner`) at the start of an explicit
/// step by what the features of B's `memory` that none of them goes on from held. Gap, offset, shear and
/// stored energies are set. `before`: length of a touch's step before [s].
void leave_to_others(std::uint64_t partner, std::span<Touch> touches,
                     const std::vector<ContactMemory>& memory,
                     const std::function<double(const Touch&)>& before);

}  // namespace talus::coupling
