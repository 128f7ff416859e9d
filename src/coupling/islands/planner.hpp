/// Who may meet whom within a stretch, and the islands that follow from it (theory: docs/theory/contact.md,
/// (2)).
#pragma once
#include <span>
#include <utility>
#include <vector>

#include "core/disjoint_sets.hpp"
#include "coupling/system/system_state.hpp"

namespace talus::coupling {

using BlockPairs = std::vector<std::pair<int, int>>;

struct IslandPlan {
  std::vector<Island> islands;
  std::vector<double> reach;            // per block [m]
  std::vector<char> structure_used;     // per structure
  std::vector<double> structure_reach;  // per structure [m]
  std::vector<SurfacePair> surfaces;    // structures that may meet
  BlockPairs
      beside;  // blocks of different islands that come near each other, but do not meet as they move now
  long skipped = 0;
};

/// What may come farther than its speeds say, and how far [m]: a block or the skin of a structure.
struct Farther {
  Partner::Kind kind = Partner::Kind::block;
  int index = 0;
  double way = 0;
};

class IslandPlanner {
 public:
  IslandPlanner(const dda::Model& model, const SystemState& state, const Environment& env,
                const SystemSettings& settings);
  /// For a stretch of that duration from the present state; `met`: what the tries so far have shown to meet.
  IslandPlan plan(double duration, std::span<const Farther> farther = {}, const BlockPairs& met = {}) const;
  /// Blocks of different islands that met on the ways that they took from `begun`.
  BlockPairs meetings(const IslandPlan& p, std::span<const IslandReport> reports, const dda::State& begun,
                      double duration) const;

 private:
  void pair_structures(double duration, std::span<const Farther> farther, IslandPlan& p) const;
  void join_clusters(double duration, const BlockPairs& pairs, const BlockPairs& met,
                     DisjointSets& sets) const;
  double touching(int block) const;
  bool touched(int i, int j) const;
  bool will_meet(int i, int j, double duration) const;
  bool may_meet(int i, int j, double duration) const;
  void group(const BlockPairs& pairs, std::span<const CandidatePair> fixed, DisjointSets& sets,
             IslandPlan& p) const;

  const dda::Model& model_;
  const SystemState& state_;
  const Environment& env_;
  const SystemSettings& settings_;
};

}  // namespace talus::coupling
