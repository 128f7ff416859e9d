/// The coupled runs of a fragility, each a window of a strike and what follows, in fragility/STRUCTURE-K/ of
/// the ensemble's directory.
#pragma once
#include <atomic>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "contact/structures/structure.hpp"
#include "ensemble/ensemble.hpp"
#include "ensemble/fragility/fragility.hpp"
#include "ensemble/fragility/hits.hpp"

namespace talus::ensemble {

struct Outcome {
  bool made = false;               // the run came to an end
  bool good = false;               // and can be judged
  std::string message;             // why not
  std::vector<std::string> names;  // of the structure's members
  std::vector<int> grade;          // -1: not judged
  std::vector<std::string> basis;  // why the members have their grades
  std::vector<std::string> warnings;
  double peak_force = 0;  // greatest contact force, mean over 1.5 ms [N]
  double capacity =
      -1;  // least over the members of that now over that as built, 0: lost; negative: not asked for
  int worst() const;
  /// Whether the worst member's class rests on its shear force alone, with no crack, bar or volume beside it.
  bool rests_on_shear() const;
};

class CoupledRuns {
 public:
  /// `structure`: its place among the scene's.
  CoupledRuns(const FragilityRequest& request, Ensemble& ensemble, int structure,
              const std::vector<Cluster>& clusters, const std::vector<Task>& tasks);
  /// Runs what the directory does not hold yet, until all are done or `request.stop` is set.
  void run();
  const std::vector<Outcome>& outcomes() const { return outcomes_; }  // of the tasks
  const std::vector<std::string>& faults() const { return faults_; }  // runs that could not be made, why

 private:
  scene::Scene scene_of(const Task& t, double back);
  std::filesystem::path folder(std::size_t k) const;
  std::optional<Outcome> outcome_of(const std::filesystem::path& directory) const;
  /// False if it was stopped before its end.
  bool run_one(std::size_t k);
  void write_capacity(sim::Simulation& simulation, const std::filesystem::path& directory);
  const std::vector<PushDown>& as_built(const Task& task);
  void plan_file();

  const FragilityRequest& request_;
  Ensemble& ensemble_;
  int structure_;
  const std::vector<Cluster>& clusters_;
  const std::vector<Task>& tasks_;
  std::vector<Outcome> outcomes_;
  std::vector<std::string> faults_;
  std::optional<std::vector<PushDown>> built_;
  std::mutex built_mutex_;
};

}  // namespace talus::ensemble
