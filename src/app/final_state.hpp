/// The structures at the end of a run, kept beside the results: what `talus capacity` starts from.
#pragma once
#include <filesystem>
#include <span>
#include <string>

#include "io/checkpoint.hpp"
#include "scene/scene.hpp"
#include "sim/simulation.hpp"

namespace talus::app {

/// What a checkpoint must share with the scene it goes on with. The number of threads changes no bit of the
/// result, so it may differ; simulation.min_step as well, so that a run goes on for which no step was short
/// enough.
std::string scene_hash(const std::string& resolved);

struct FinalState {
  scene::Scene scene;
  double time = 0;  // [s]
  io::Checkpoint arrays;
  std::span<const double> of(int structure) const;
  /// For Simulation::halve_cells_struck().
  std::vector<double> struck_places() const;
};

/// Writes DIR/final_state.h5 if the state holds a structure. Throws WriteError.
void save_final_state(const std::filesystem::path& directory, sim::Checkpoint state, double time,
                      const std::string& hash);

/// Throws InputError if the directory holds no finished run of this version with a structure.
FinalState load_final_state(const std::filesystem::path& directory);

}  // namespace talus::app
