/// From hits to damage: coupled runs of a few of an ensemble's hits, weighted to all of them.
///
/// A member of the ensemble that hits the structure is an event; its strongest hit stands for it. Events are
/// clustered by the member of the structure that is struck; then the cluster whose events differ most, times
/// their number, is divided in what they differ most in (ln energy, height on the member, direction in plan),
/// so that the sum of squares about the means of both parts is least and each keeps three events, as long as
/// there are three runs a cluster. The runs are spread over the clusters in proportion to the root of their
/// sizes, so that rare strong hits are seen.
///
///   P(class >= k) = P(hit) C_k
///
/// with P(hit) of the ensemble's members that came to an end, and C_k of hits over the clusters as strata
/// (strata.hpp). Means over hits (peak force, capacity) weigh the clusters alike, with the variance within
/// clusters pooled. The run that narrows most is one more in the cluster whose term of the variance falls
/// most.
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "ensemble/progress.hpp"

namespace talus::ensemble {

struct FragilityRequest {
  std::filesystem::path directory;  // of the ensemble
  std::string structure;
  int runs = 60;
  double window = 0.5;  // of the strike and what follows [s]
  int threads = 1;
  bool capacity = false;  // each run ends with the push-down of the structure's members
  std::function<void(const Progress&)> progress;  // from any thread, one at a time
  std::function<void(const std::string&)> tell;   // what is about to be computed, and warnings
  const std::atomic<int>* stop = nullptr;
};

/// What is printed at the end, a line each.
struct FragilityResult {
  std::vector<std::string> lines;
  int asked = 0, done = 0, failed = 0;  // coupled runs
};

/// Writes fragility.json and fragility/RUN/. Goes on with the runs that are there already; stopped, the
/// figures are those of the runs that are done. Throws InputError.
FragilityResult write_fragility(const FragilityRequest& request);

}  // namespace talus::ensemble
