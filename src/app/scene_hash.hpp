#pragma once
#include <string>

namespace talus::app {

/// What a checkpoint must share with the scene it goes on with. The number of threads changes no bit of the
/// result, so it may differ; simulation.min_step as well, so that a run goes on for which no step was short
/// enough.
std::string scene_hash(const std::string& resolved);

}  // namespace talus::app
