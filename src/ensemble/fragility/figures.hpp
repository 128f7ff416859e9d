/// What the coupled runs of a fragility say: probabilities of damage, curves over energy, expected closure,
/// the run that would narrow most (fragility.hpp).
#pragma once
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "ensemble/fragility/coupled_runs.hpp"
#include "ensemble/fragility/fragility.hpp"
#include "ensemble/fragility/hits.hpp"

namespace talus::ensemble {

/// What the figures are made of.
struct FragilityRuns {
  const FragilityRequest& request;
  double releases_per_year = 0;               // 0: not known
  long finished = 0;                          // members of the ensemble that came to an end
  long hits = 0;                              // of these, those that hit the structure
  const std::vector<talus::Member>& members;  // of the structure
  const std::vector<Cluster>& clusters;
  const std::vector<Task>& tasks;
  const std::vector<Outcome>& outcomes;  // of the tasks
  const std::vector<std::string>& faults;
  std::string mesh;  // that its cells are coarse for a damage class; empty: they are not
};

struct FragilityFigures {
  nlohmann::ordered_json root;  // of fragility.json
  FragilityResult result;
};

FragilityFigures figures_of(const FragilityRuns& runs);

}  // namespace talus::ensemble
