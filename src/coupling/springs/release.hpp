/// Springs whose contact vanished while they were loaded, with no other to hand their energy to: it goes into
/// motion, along their normals (release.cpp).
#pragma once
#include <span>

#include "coupling/springs/spring_carry.hpp"
#include "coupling/step/context.hpp"

namespace talus::coupling {

/// True if any did; their energy is accounted for.
bool release_springs(const IslandContext& in, std::span<const LooseSpring> loose, Ledger& ledger);

}  // namespace talus::coupling
