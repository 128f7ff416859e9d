/// What a step leaves to the next one: the memory of its contacts.
#pragma once
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// What each node of the structures gets, J^T p over its contacts.
void collect_node_impulses(const IslandContext& in, Step& step);

/// The step that ends at t_end is taken: works, rows of structures and audit sums to the report, memories
/// anew.
void commit_step(const IslandContext& in, Step& step, IslandReport& report, bool shed, double t_end,
                 double h);

}  // namespace talus::coupling
