/// Structures that nothing holds meet moving blocks and other structures; planes, terrain and fixed blocks
/// they do not.
#pragma once
#include <vector>

#include "core/error.hpp"
#include "coupling/environment.hpp"
#include "dda/state.hpp"
#include "scene/scene.hpp"

namespace talus::sim {

/// One error for each such structure and fixed thing that may come together within the run: by free fall from
/// where it starts, and by what blocks and other structures can push it to (a body that is struck leaves at
/// most at twice the striker's speed).
std::vector<Problem> free_structure_problems(const scene::Scene& scene,
                                             const coupling::Environment& environment,
                                             const dda::Model& model, const dda::State& state);

}  // namespace talus::sim
