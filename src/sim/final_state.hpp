/// What a run hands on to a later one (key simulation.initial_state): the last state of blocks and structures by name.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "core/types.hpp"

namespace talus::sim {

struct FinalState {
  struct Block { Vec3 c, v, w; Quat q; Vec6 eps, eps_rate; };   // as dda::State
  struct Structure {
    std::vector<Vec3> nodes;        // reference positions: the mesh this history belongs to [m]
    std::vector<double> history;    // Structure::save
  };
  std::map<std::string, Block> blocks;
  std::map<std::string, Structure> structures;
};

}  // namespace talus::sim
