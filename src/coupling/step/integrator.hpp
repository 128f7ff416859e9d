/// Advances one island of touching (or nearly touching) blocks, with the structures that it touches, over a
/// macro step.
///
/// A step of length h:
///   1. free flow of every block, exact without contact (dda/kinematics.hpp);
///      v_hat of the structures (contact/structures/structure.hpp)
///   2. one contact problem over blocks and touched structure nodes (contact/solver/problem.hpp)
///   3. positions:  x_np = x_free + h sum_i theta_i A^-1 J_i^T p_i,
///      momenta exact:  P_np = P_free + sum_i J_i^T p_i
///   4. drift of closed hard contacts projected back to gap >= 0, its energy accounted for
/// Islands are event driven: the step ends at the next onset, which is an impulse of no duration. Where that
/// costs more than time steps, and at structures, onsets are rows on the gap at the end of the step (order
/// 1). Structures take explicit sub-steps while damage may grow or waves of a blow run, else condensed steps
/// (condensed.hpp).
#pragma once
#include <atomic>
#include <limits>
#include <span>

#include "coupling/drift/drift_correction.hpp"
#include "coupling/drift/drift_guard.hpp"
#include "coupling/events/event_locator.hpp"
#include "coupling/events/impact_stage.hpp"
#include "coupling/step/control.hpp"
#include "coupling/step/motion_record.hpp"

namespace talus::coupling {

class IslandIntegrator {
 public:
  /// `history` is per block, `surface_history` per structure.
  IslandIntegrator(const dda::Model& model, dda::State& state, Environment& environment,
                   ContactHistory& history, ContactHistory& surface_history, const StepSettings& settings);
  IslandIntegrator(const IslandIntegrator&) = delete;
  IslandIntegrator& operator=(const IslandIntegrator&) = delete;
  /// Advances over a stretch; `first_step` is a hint (0: none). Ends early, soon after `stop` becomes
  /// non-zero. `rows`: ascending times that the report's motion is wanted at; no step depends on them.
  IslandReport advance(const Island& island, const Stretch& stretch, double first_step,
                       const std::atomic<int>* stop = nullptr, std::span<const double> rows = {});

 private:
  /// What the steps so far have taught.
  struct Progress {
    double done = 0;                                           // of the macro step [s]
    double longest = std::numeric_limits<double>::infinity();  // of the next step, where the last try found
                                                               // no solution [s]
    int grazes = 0;                                            // steps cut short by an onset that was none
    int impacts_when_cut = -1;  // impacts as the last step was cut short; negative: it was not
    bool small = false;         // event driven as it began
    bool restless = false;      // no long steps of what stands
  };
  bool with_structure() const { return !in_.island->structures.empty(); }
  void begin(const Island& island, std::span<const double> rows);
  /// Time at which so much of the macro step is done; its end, to the bit, where all is [s].
  double clock(double done) const;
  void run();
  Progress begin_steps();
  /// A step by its length, not yet tried.
  Trial next_trial(const Progress& progress);
  /// Springs that vanished and impacts, which have no duration, before it.
  void resolve_onsets(Trial& trial);
  void limit_length(Trial& trial);
  /// Takes the step. False: the correction of its drift is none, and all is as at its start.
  bool finish(const Trial& trial, double done, double taken);
  /// For the rest of the macro step: its steps are others, and so is what they reach. Time steps lose energy
  /// of first order in their length: they are as short as the work that events have taken in vain would have
  /// paid for over the macro step, so that neither costs more than the other.
  void start_time_stepping();
  /// Length of the next step by what moves and what it stands at; the touches within its reach are found on
  /// the way.
  double next_length(const Trial& trial, double longest);
  /// Once before a step is committed.
  void release(double h);
  /// The leapfrog's own correction (the condensed one has had its), and where the skins are then.
  void correct_structures(double t, double h);
  void rest_check(double h);

  IslandContext in_;
  Step step_;
  IslandReport report_;
  SurfaceFocus focus_;
  ContactSearch search_;
  RowAssembly assembly_;
  ProblemSolver solver_;
  BodyUpdate update_;
  SmoothStep smooth_;
  StructureImpacts impacts_on_structures_;
  ImpactStage impacts_;
  StepControl control_;
  EventLocator locator_;
  DriftGuard guard_;
  DriftCorrection correction_;
  MotionRecord record_;
  double start_ = 0, duration_ = 0, end_ = 0;  // of the macro step [s]
  bool released_ = false;  // the energy of the springs that vanished loaded was given back
  bool sheds_ = false,
       shed_ = false;  // a skin lost faces at the end of this step, of the one before it in this macro step
};

}  // namespace talus::coupling
