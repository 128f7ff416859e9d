/// Everything that a system of blocks and structures goes on from, and how it is stepped.
#pragma once
#include <vector>

#include "coupling/environment.hpp"
#include "coupling/step/island.hpp"
#include "dda/state.hpp"

namespace talus::coupling {

/// Everything with a history, apart from the structures' own (Structure::save). A copy is a checkpoint.
struct SystemState {
  double time = 0;
  long stretches = 0;
  dda::State blocks;
  ContactHistory contacts;             // per block
  ContactHistory surface_contacts;     // between structures, per second structure of the pair
  std::vector<char> asleep;            // per block
  std::vector<double> step;            // suggested step of the island the block was last in [s]
  std::vector<double> structure_step;  // the same per structure; 0: it was in none in the last stretch [s]
  double stretch =
      0;  // longest stretch that is tried next, after one had to be repeated; 0: the settings' [s]
  Ledger ledger;
  std::vector<MotionPeaks> peaks;  // per block, over the steps so far
  double kinetic_peak = 0;         // of all blocks: the islands' own within one stretch, added [J]
};

struct SystemSettings {
  StepSettings step;
  bool sleeping = true;
  int threads = 1;
  double longest_stretch =
      0.05;  // [s]; with a fixed step, the whole number of steps nearest below, at least one
};

/// Blocks and works at one time.
struct Moment {
  double time = 0;
  dda::State blocks;
  Ledger works;  // `contact`: stored in springs then
};

}  // namespace talus::coupling
