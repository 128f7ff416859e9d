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
  BlockPairs asleep;  // the same of blocks that both sleep
  long skipped = 0;
};

struct Meetings {
  BlockPairs pairs;
  double first = 0;  // no meeting is earlier [s]
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
  /// Joins the blocks of an island (by their places in it) that touch, or will meet as they move from the
  /// present state within that time.
  DisjointSets parts(const Island& island, double duration) const;
  /// An island for each of the sets of its blocks.
  IslandPlan divide(const Island& island, DisjointSets& sets) const;
  /// Blocks of different islands that met on the ways that they took, those of islands without a report on
  /// the motions foreseen; what is in no island is where it is.
  Meetings meetings(const IslandPlan& p, std::span<const IslandReport> reports, const dda::State& begun,
                    const Stretch& stretch) const;

 private:
  void pair_structures(double duration, std::span<const Farther> farther, IslandPlan& p) const;
  void join_clusters(double duration, const BlockPairs& pairs, const BlockPairs& met, DisjointSets& sets,
                     std::vector<Course>& course) const;
  double touching(int block) const;
  bool touched(int i, int j) const;
  bool both_move(const CandidatePair& pair) const;
  bool rebounds(int i, int j) const;
  contact::Motion foreseen(int block, double duration) const;
  bool will_meet(int i, int j, double duration) const;
  bool may_meet(int i, int j, double duration) const;
  void group(const BlockPairs& pairs, std::span<const CandidatePair> fixed, DisjointSets& sets,
             std::span<const Course> course, IslandPlan& p) const;

  const dda::Model& model_;
  const SystemState& state_;
  const Environment& env_;
  const SystemSettings& settings_;
};

}  // namespace talus::coupling
