/// The world of a run: which parts exist, and their present state.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "coupling/system/system.hpp"
#include "dda/shi1988.hpp"
#include "scene/scene.hpp"
#include "sim/frame.hpp"

namespace talus::sim {

using Report = std::function<void(const std::string&)>;

/// Method "dda-1988": the paper's scheme beside the same model and environment.
struct PaperScheme {
  dda::Shi1988 scheme;
  dda::Shi1988State history;
  std::vector<const contact::SurfaceIndex*> surfaces;  // terrain, then the structures
  int first_structure = 0;                             // in `surfaces`
  double time = 0;
  long steps = 0, iterations = 0, cuts = 0, unsettled = 0, contacts = 0;
  double friction_work = 0, algorithmic = 0, worst_penetration = 0, contact_energy = 0, strain_energy = 0,
         kinetic = 0;
};

/// What rows are taken of: blocks, works and, of method "dda-1988", its own energies and maps of the
/// vertices.
struct Moment : coupling::Moment {
  double strain_energy = 0, kinetic = 0;  // [J], dda-1988
  std::vector<Mat3> map;                  // per block, dda-1988
};

class World {
 public:
  scene::Scene scene;
  std::unique_ptr<coupling::CoupledSystem> system;  // blocks, environment, state; steps by method "talus"
  std::optional<PaperScheme> paper;                 // steps instead, if method is "dda-1988"
  RunHeader header;
  std::vector<std::vector<double>> displaced;  // per structure, how far each of its nodes is at the start
                                               // from where the scene has it [m]; empty: not at all
  bool told_crushed_through = false;           // a layer that crushes has come to its end
  std::vector<char> told_unsupported;          // per structure; empty: none
  std::vector<std::string> notes;              // what was left out and why
  Report report;
  /// Gets every step of method dda-1988 with the time and the blocks before it; empty: nobody.
  std::function<void(double from, const dda::State& before)> watch_paper;
  double energy_start = 0;  // [J]
  double energy_peak = 0;   // largest kinetic energy so far, of blocks over all steps, with structures at
                            // rows: the residual's scale [J]
  bool built_energy = false;
  bool restored = false;  // goes on from a checkpoint: what is due at its time has been recorded

  double time() const { return paper ? paper->time : system->state().time; }
  /// Advances by one macro step of the system or some steps of dda-1988, to `end` at the latest and then
  /// exactly; false if `stop` became non-zero before. `rows`: ascending times that rows are wanted at; the
  /// motion does not depend on them, unless a structure takes steps (rows_end_steps).
  bool advance(double end, std::span<const double> rows, const std::atomic<int>* stop = nullptr);
  /// Longest time that advance() goes on for [s].
  double longest_advance() const;
  /// True if rows can be taken at the ends of macro steps alone: a structure takes steps, whose histories are
  /// those of its own state.
  bool rows_end_steps() const;
  /// Now, or at one of the rows of the last advance().
  Moment at(double t) const;
  Moment now() const { return at(time()); }
  /// Turns the structures' loose parts into blocks; returns what was added.
  std::vector<RunHeader::BlockInfo> take_fragments();
  /// Structures that have lost the support of a part which stays where it is (coupling.fragments = false): a
  /// sentence each, once in a run.
  std::vector<std::string> take_warnings();
  HistoryRow row(const Moment&) const;
  LedgerRow ledger(const Moment&) const;
  /// Energy now is that of the start, from which the ledger's residual counts, unless there is one already.
  void begin_ledger();
  RunCounters counters() const;
  /// A place where cells were halved before a block struck; 0 and more places of a structure, in the order of
  /// their finding.
  struct StruckPlace {
    int structure = 0;
    StructureSpec::Refinement zone;
    double energy = 0;  // of the block [J]
  };
  std::vector<StruckPlace> struck, left_coarse;  // the latter: where they could not be halved any more
  std::vector<std::string> due_warnings;         // for take_warnings()
  /// Gives structure `q` the finer cells of its struck places, with all that it is the surface of.
  bool refine_structure(int q);

  // Results list blocks as the scene does, then fragments; the system has those of the scene in the order of
  // their names.
  std::vector<int> place;  // in the system, of each block of the scene
  std::vector<int> order;  // in the scene, of each such block of the system
  int placed(int listed) const {
    return listed < static_cast<int>(place.size()) ? place[static_cast<std::size_t>(listed)] : listed;
  }
  int listed(int placed) const {
    return placed < static_cast<int>(order.size()) ? order[static_cast<std::size_t>(placed)] : placed;
  }
  Pose pose(int listed) const;
  Pose pose(int listed, const Moment&) const;

 private:
  double foresee_strikes(double end);
  bool advance_paper(double end, std::span<const double> rows, const std::atomic<int>* stop);
  double blocks_kinetic() const;
  void add_paper_peaks();
  Moment paper_now() const;
  Moment paper_before_;  // start of the last step that a row falls into
};

/// Blocks that overlap something at the present state, one problem each. What overlaps a structure by no more
/// than its surface has moved from where the scene has it touches it (method talus). `known`: pairs that
/// stand to each other as a run has left them.
std::vector<Problem> initial_overlaps(World&, const coupling::KnownPairs& known = {});
/// Structures that as built overlap each other, or, held by nothing, the ground: one problem for each pair.
std::vector<Problem> structure_overlaps(const World&);
/// How far up a block at this pose has to be moved until it overlaps no plane, terrain or fixed block that
/// would bear it [m].
double raise_above_ground(const World&, int block, const Pose& pose);

class Shared;  // shared.hpp

/// Decides what exists. Throws InputError with every problem found. `shared`: what this world has in common
/// with others; its header then holds neither terrain nor sections.
std::unique_ptr<World> build(scene::Scene scene, Report report, Shared* shared = nullptr);

}  // namespace talus::sim
