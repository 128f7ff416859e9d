/// What a step leaves to the next one: the memory of its contacts.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// What each node of the structures gets, J^T p over its contacts.
void collect_node_impulses(const IslandContext& in, Step& step);

}  // namespace talus::coupling
