/// Blocks and structures as one system: islands, sleep, structures that nothing touches, and the synchronised
/// stretch.
///
/// A stretch (macro step) ends at the next multiple of the longest stretch on the run's own clock, sooner
/// where the motion asks for it, and at the end of the run; what is recorded is read off the steps within it
/// (motion.hpp). Within a stretch every island of blocks that may meet (swept boxes overlap) advances on its
/// own steps; a block that leaves the box it was given makes the stretch be repeated, halved. Resting islands
/// sleep on a static certificate: the contact problem started from v = 0 answers v = 0, so nothing would
/// change. They wake when an awake block's swept box reaches them.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "coupling/counters.hpp"
#include "coupling/islands/planner.hpp"
#include "coupling/motion/recorded_motion.hpp"

namespace talus::coupling {

class IslandIntegrator;

/// Is told of every stretch that was made, with the state before it; the present state is the system's.
using Watch = std::function<void(const SystemState& before)>;

/// Pairs whose contacts so far are in the state; empty: none.
using KnownPairs = std::function<bool(const CandidatePair&)>;

class CoupledSystem {
 public:
  CoupledSystem(dda::Model model, SystemState state, Environment environment, const SystemSettings& settings);
  ~CoupledSystem();

  /// Advances by one stretch, which ends at `end` at the latest, and exactly there if it reaches it. Throws
  /// NumericalFailure naming the island if its smallest step cannot be solved; the state is then the last
  /// committed one. False if `stop` became non-zero: the state is that of the last stretch, to go on from.
  /// `rows`: ascending times at which at() will be asked for; no step depends on them.
  bool advance(double end, const std::atomic<int>* stop = nullptr, std::span<const double> rows = {});
  /// Advances to time t exactly, stretch by stretch.
  bool advance_to(double t, const std::atomic<int>* stop = nullptr);
  /// Longest stretch [s].
  double longest_stretch() const;
  /// Blocks and works now, or at one of the rows of the last advance().
  Moment at(double t) const;

  const dda::Model& model() const { return model_; }
  dda::Model& model() { return model_; }
  SystemState& state() { return state_; }
  const SystemState& state() const { return state_; }
  Environment& environment() { return env_; }
  const Environment& environment() const { return env_; }

  const Counters& counters() const { return sums_.counters; }
  int islands() const { return islands_; }
  /// What is summed from the start of the run; a restart goes on with them. No step depends on them.
  RunSums& sums() { return sums_; }
  const RunSums& sums() const { return sums_; }
  /// Advances the structures of scheme "one-way" alone, from the state's time over `duration`, which becomes
  /// its time, under contact forces that were found elsewhere and are returned with those of
  /// take_structure_contacts(). Blocks stay where they are.
  void advance_structures(double duration, std::span<const StructureContact> rows);
  void watch(Watch watch) { watch_ = std::move(watch); }
  /// The blocks at ascending times of a stretch that began at `from`, by steps made anew: the present state,
  /// its sums and its contacts stay as they are. Only for systems that step no structure.
  std::vector<dda::State> again(const SystemState& from, std::span<const double> times);
  /// Contacts on structures since the last call of take_structure_contacts().
  std::span<const StructureContact> structure_contacts() const { return rows_; }
  /// Contacts on structures since the last call.
  std::vector<StructureContact> take_structure_contacts();
  /// Appends a block (a fragment); returns its index.
  int add_block(const dda::Model::Block& block, const Vec3& c, const Vec3& v, const Vec3& w);
  /// Marks what touches now as bonded, where a law or a rock bridge holds in tension. The bonds of `known`
  /// pairs are those in the state: none is made anew.
  void glue(const KnownPairs& known = {});

 private:
  bool meets_others(double stretch, const IslandPlan& p, SystemState& before);
  bool go_on(double end, const std::atomic<int>* stop, std::span<const double> rows);
  double stretch_end(double end) const;
  /// Why a stretch cannot be had; `shorter`: one that is shorter may do.
  struct Failure {
    std::string text;
    bool shorter = false;
  };
  bool stretch(double duration, const std::atomic<int>* stop, std::span<const double> rows, Failure& failure);
  void widen();
  struct MacroStep;
  void join_met(const BlockPairs& met, double stretch, MacroStep& m);
  std::vector<char> events_located(const MacroStep& m) const;
  void reach_on(const MacroStep& m, const BlockPairs& pairs, int hops, BlockPairs& met) const;
  struct IslandRun;
  struct Began;
  IslandReport advance_island(const Island& island, const Stretch& stretch, const IslandRun& run);
  IslandReport advance_in_turn(const Island& island, const Stretch& stretch, const IslandRun& run);
  Began began_of(int block) const;
  void put_back(const Island& island, const std::vector<Began>& began);
  void start_structure(MacroStep& m, std::size_t q);
  double hint_of(const Island& island) const;
  void step_islands(MacroStep& m, double duration, const std::atomic<int>* stop,
                    std::span<const double> rows);
  bool note_ends(const MacroStep& m, Failure& failure);
  void take_reports(const MacroStep& m);
  void step_other_structures(const MacroStep& m, double duration);

  std::vector<Farther> escapes_, wider_;  // what went farther than foreseen in the last try, and how far [m];
                                          // what the next tries foresee
  dda::Model model_;
  SystemState state_;
  Environment env_;
  SystemSettings settings_;
  IslandPlanner planner_;
  RunSums sums_;
  std::vector<StructureContact> rows_;
  RecordedMotion recorded_;
  Watch watch_;         // empty: none
  SystemState before_;  // of the last stretch, if there is a watch
  int islands_ = 0;
  struct Threads;  // whose number the loops of steps keep to: outside of them a loop takes all cores
  std::unique_ptr<Threads> threads_;
};

int sleeping_blocks(const CoupledSystem& system);
/// True if every block with DOFs sleeps or has left, and every structure is quiet.
bool at_rest(const CoupledSystem& system);
/// Blocks that have left the model: below all that is held, terrain and structures among it, so that
/// nothing can stop their fall. None where there is no gravity, a plane, or nothing held.
std::vector<int> departed(const CoupledSystem& system);
/// What of the pair overlaps now is where it starts: it touches, is not pushed apart, and no spring of it
/// is loaded.
void start_touching(CoupledSystem& system, const CandidatePair& pair, std::span<const Touch> touches);
/// Blocks from `first` on have just come off a structure: what they overlap is no contact that pushes.
void settle_newborn(CoupledSystem& system, int first);

}  // namespace talus::coupling
