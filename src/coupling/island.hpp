/// Advances one island of touching (or nearly touching) blocks, with the structures that it touches, over a
/// stretch of time.
///
/// A step of length h:
///   1. free flow of every block, exact without contact (dda/kinematics.hpp);
///      v_hat of the structures (contact/structure.hpp)
///   2. one contact problem over blocks and touched structure nodes (contact/problem.hpp)
///   3. positions:  x_np = x_free + h sum_i theta_i A^-1 J_i^T p_i,
///      momenta exact:  P_np = P_free + sum_i J_i^T p_i
///   4. drift of closed hard contacts projected back to gap >= 0, its energy booked
/// Small islands are event driven: the step ends at the next onset, which is an impulse of no duration. In
/// large islands and at structures onsets are rows on the gap at the end of the step (order 1). Structures
/// take explicit sub-steps while damage may grow or waves of a blow run, else condensed steps
/// (island_condensed.cpp).
#pragma once
#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "contact/problem.hpp"
#include "contact/tolerances.hpp"
#include "coupling/counters.hpp"
#include "coupling/motion.hpp"
#include "coupling/node_places.hpp"
#include "coupling/pair_watch.hpp"
#include "coupling/spring_carry.hpp"
#include "coupling/step/context.hpp"
#include "coupling/step/step.hpp"
#include "coupling/touch.hpp"
#include "dda/kinematics.hpp"

namespace talus::coupling {

class IslandStepper {
 public:
  // Of a problem, beyond which it is solved to what the accuracy asks; of an island's closed contacts, beyond
  // which it is time-stepped.
  static constexpr std::size_t many_contacts = 150;
  static constexpr std::size_t pairs_for_threads =
      500;  // of an island, whose search is worth a second thread
  /// `history` is per block, `surface_history` per structure.
  IslandStepper(const dda::Model& model, dda::State& state, Environment& environment, ContactHistory& history,
                ContactHistory& surface_history, const StepSettings& settings);
  ~IslandStepper();
  /// Advances from t to t + duration; `first_step` is a hint (0: none). Ends early, soon after `stop` becomes
  /// non-zero. `rows`: ascending times that the report's motion is wanted at; no step depends on them.
  IslandReport advance(const Island& island, double t, double duration, double first_step,
                       const std::atomic<int>* stop = nullptr, std::span<const double> rows = {});

 private:
  struct Outcome;
  struct Trial;
  struct Booking;

  void begin(const Island& island);
  /// What has seen the stop has done less than it would have: whatever it comes to from here on is void, and
  /// the report says so.
  bool stopped() {
    return report_.stopped =
               report_.stopped || (stop_ != nullptr && stop_->load(std::memory_order_relaxed) != 0);
  }
  // island_focus.cpp
  struct Followed {
    double blocks, skins;
  };
  void follow_skins(double h);
  Followed followed_need(double h, double fastest) const;
  bool follows(const Followed& need) const;
  void choose_followed();
  void go_on_following();
  void end_following();
  // island_run.cpp
  IslandReport run(double t, double duration);
  double next_length(const Trial& trial, double duration, double longest);
  double step_limit(double remaining, bool lumped) const;
  double structure_step(double duration, double longest);
  void correct_structures(double t, double h);
  void reject();
  IslandReport fail_at_smallest_step();
  IslandReport fail_at_drift();
  void look_for_gains();
  void rest_check(double h);
  void measure_way(double from, double to, std::span<contact::Motion> made);
  // island_motion.cpp
  bool begin_motion(double t0, double t1);
  void end_motion();
  // island_try.cpp
  bool take(Trial& trial);
  bool refused(Trial& trial, const Outcome& outcome);
  bool shortened(Trial& trial);
  bool met_others(Trial& trial);
  bool cut_at_settling(Trial& trial);
  bool cut_at_stop(Trial& trial);
  bool cut_at_break(Trial& trial);
  bool may_shorten(const Trial& trial) const;
  // vegetation.cpp
  bool cut_at_layer(Trial& trial);
  // island_swing.cpp
  /// The touches of the present state within the reach of h; `at_start`: it is the one that the memory
  /// belongs to.
  void find(double h, bool at_start = true);
  void find_moved(const std::vector<Pose>& last, std::vector<double>& carried);
  void carry_pair(std::size_t pair, const std::vector<Pose>& last);
  void take_carried();
  void keep_late_overlaps();
  void carry_at_structures(const std::vector<Pose>& before);
  void look(std::size_t pair);
  void leave_out(std::size_t pair);
  void each_pair(
      const std::function<void(std::size_t)>& use) const;  // in any order, on several threads where it pays
  void gather_touches();
  void carry();
  void carry_out_of_reach();
  bool too_much_happens(double duration) const;
  bool costs_too_much(double duration, bool rebounds_alone) const;
  void go_time_stepped();

  // island_impact.cpp
  struct Restitution {
    double normal = 0, along = 0;
  };                                            // along the normals and along the faces
  enum class Impact { unsolved, gains, done };  // gains: energy from restitution
  Restitution impact_rows(const Restitution& part);
  Impact strike(const Restitution& part, bool frozen_strain);
  Impact most_of(const Restitution& none, const Restitution& all, bool frozen_strain);
  void note_impacts_on_skin(double time);
  bool impact_stage(double time);

  void release_springs(double h);
  // island_quasistatic.cpp
  Outcome smooth(double h, bool lumped, int passes, bool last_resort = false);
  // island_leapfrog.cpp
  void assemble(double h, bool lumped, bool first_pass);
  void begin_rows();
  void place_row(Touch& touch);
  void take_row(Touch& touch, double h, bool first_pass);
  void fill_rows(double h, bool first_pass);
  void fill_row(Touch& touch, double h, bool first_pass);
  void add_row(Touch& touch, double h, bool first_pass);
  void add_surface_row(Touch& touch, double h, bool first_pass);
  Vec3 add_structure_terms(int row, int structure, const SurfaceWeights& weights, const Mat3& frame,
                           double sign, Vec3& u_ref, std::span<const Vec3> tilt = {});
  void finish_bodies();
  /// repeated: rows anew about an end that was not solved; what they contradict each other by still is taken.
  /// last_resort: the convex problem's solution, tier E, rather than none.
  enum class Effort { provisional, full, repeated, last_resort };
  bool solve(double h, Effort effort);
  // island_rolling.cpp
  bool solve_rolling(double h, Effort effort);
  void list_terms();
  void apply(double h);
  double project(double h);
  // island_ahead.cpp
  std::optional<std::vector<Vec6>> allowed_accelerations();
  // island_drift.cpp
  void keep_for_drift();
  void take_back();
  bool drift_beyond_motion(double h) const;
  std::map<std::pair<std::uint64_t, int>, double> deepest_by_motion() const;
  std::vector<Vec3> moments_of_way();
  void book(double h);
  void remember_all(double h);
  void commit(double t_end, double h);
  void report_crushing();
  void tell_impacts(double t_end);
  // island_condensed.cpp
  bool may_condense(double t, double duration);
  bool none_strikes(double duration);
  double condensed_length(double t, double duration, double remaining, double longest);
  Vec3 add_skin_terms(int row, int structure, const SurfaceWeights& weights, const Mat3& frame, double sign,
                      Vec3& u_ref);
  bool correct_skins(double t, double h);
  bool locate_event(double& h, int passes);
  contact::Motion motion_of(int block, bool lumped) const;
  contact::Motion lumped_motion(int block) const;
  double time_of_impact(const CandidatePair& pair, double tolerance, bool lumped) const;
  double first_impact() const;  // fraction of the step, above 1: none
  double first_rebound(double h);
  double path(const CandidatePair& pair) const;
  struct Crossing {
    double first = 2;     // fraction of the step that may stand; above 1: all of it
    bool listed = false;  // something met is no row yet: the step is to be solved again with more of them
    std::vector<std::vector<Touch>>
        features;  // per pair with rows: others that were met, at the start of the step
  };
  Crossing crossing();                                       // of what the rows of a lumped step left open
  struct Known {                                             // what the touches of a pair say
    std::size_t first = 0, count = 0;                        // their range
    double apart = std::numeric_limits<double>::infinity();  // least gap at the start [m]
    bool listed = false, any = false, open = false;
  };
  Vec3 carried_back(int block, const Vec3& x) const;
  Touch carried_back(Touch touch) const;
  std::vector<Touch> unforeseen(std::size_t pair, std::span<const Touch> known) const;
  std::pair<double, double> meeting(std::size_t pair, const Known& known) const;
  void look_ahead(const Crossing& met);

  IslandContext in_;
  Step step_;
  contact::ContactSolver solver_;
  std::span<const double> rows_;         // times that rows fall due at, ascending [s]
  std::vector<dda::BlockState> starts_;  // of the bodies in the step at hand, after impulses of no duration
  const std::atomic<int>* stop_ =
      nullptr;  // non-zero: end soon, what was computed since the start is thrown away
  struct Began {
    Vec3 c;
    Quat q;
    Vec6 eps;
  };
  std::vector<Began> began_;                    // where the bodies were as the stretch began
  std::vector<std::vector<Touch>> touches_of_;  // per pair, before internal edges were dropped
  std::vector<std::size_t> first_of_pair_;      // of touches_of_ one after the other, while they are gathered
  std::vector<Touch> touches_at_surfaces_;
  std::vector<double> margins_;   // per pair: no feature farther apart than this is among the touches [m]
  std::vector<double> left_out_;  // per pair: least gap of the features within its margin that are not among
                                  // the touches, since they cannot close [m]
  std::vector<LooseSpring> loose_;  // springs that vanished loaded since the last step
  bool released_ = false;           // their energy was given back
  std::vector<char> flush_pair_;    // per pair: it had touches, all of them internal edges
  std::vector<contact::Motion>
      motions_;  // of the bodies in the lumped step at hand, while its crossings are sought; else empty
  bool at_start_ = true;  // the touches are those of the state that the memory belongs to
  struct Seen {
    int block;
    Vec3 c;
    Quat q;
  };
  std::vector<Seen>
      seen_;  // blocks at structures, where they were when the followed part of the skins was chosen
  double followed_ =
      -1;  // how far from those blocks skins are followed, 0 without blocks [m]; negative: everywhere
  double followed_skins_ = 0;                      // how far from each other's faces [m]
  std::vector<std::uint64_t> followed_revisions_;  // of the island's skins as they were chosen
  double skin_path_ = 0;                           // bound on how far the skins have moved since then [m]
  double skin_travel_ = 0;                         // and since the stretch began [m]
  std::vector<PairWatch> watches_;                 // per pair, while skins are followed
  NodePlaces node_places_;
  std::vector<NodeImpulse> shares_;
  std::vector<StructureContact> impacts_on_skin_;  // impulses of no duration that are not told yet; `force`
                                                   // is the impulse [N s], `time` when it was
  double stretch_start_ = 0, stretch_ = 0;         // the stretch at hand, its length [s]
  std::optional<std::vector<Vec6>>
      allowed_;         // accelerations that the contacts allow at the start of the step, if known
  struct BeforeDrift {  // all that taking a step changes, until the correction of its drift is known to be
                        // one
    Ledger ledger;
    Counters counters;
    AuditSums audit;
    std::size_t rows = 0, works = 0, segments = 0;   // of the report
    std::vector<StructureContact> impacts;           // not reported yet
    std::vector<std::vector<ContactMemory>> memory;  // per body
    std::vector<Pose> poses;                         // per body, at the end of the step before the correction
    double overlaps = 0;                             // sum_of_overlaps() at the start of the step [m]
  } before_drift_;
  struct TermOfBody {
    int contact, term;
  };
  std::vector<std::size_t> first_term_of_;  // into terms_of_, per body and one more
  std::vector<TermOfBody> terms_of_;        // of the bodies, ascending contacts of each
  std::vector<double> theta_of_;            // per contact of the problem
  std::size_t jacobians_ = 0;               // entries of the Jacobians of the rows that have their place
  std::vector<double> pool_;                // masses and inverses of the problem's bodies
  std::vector<std::size_t> pool_offset_;
  IslandReport report_;
  double suggested_ = 0;  // step that error control would take next [s]
  bool sheds_ = false,
       shed_ = false;  // a skin lost faces at the end of this step, of the one before it in this stretch
  int impacts_ = 0;
  double work_ = 0;  // of the contact problems of the stretch: contacts times factorisations
};

}  // namespace talus::coupling
