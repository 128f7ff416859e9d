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
  void begin_step(double h, bool frozen_strain);
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
  std::vector<int> met_by(int structure) const;
  // island_run.cpp
  IslandReport run(double t, double duration);
  double next_length(const Trial& trial, double duration, double longest);
  double step_limit(double remaining, bool lumped) const;
  double apart_for(const Body& body) const;
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
  double spring_energy_of_island() const;
  // island_try.cpp
  bool take(Trial& trial);
  bool refused(Trial& trial, const Outcome& outcome);
  bool shortened(Trial& trial);
  bool met_others(Trial& trial);
  bool cut_at_settling(Trial& trial);
  bool cut_at_stop(Trial& trial);
  int stopped_touch(const Trial& trial) const;
  Vec3 parting(const Touch& touch) const;
  bool breaks(const Touch& touch) const;
  bool cut_at_break(Trial& trial);
  bool may_shorten(const Trial& trial) const;
  // vegetation.cpp
  bool cut_at_layer(Trial& trial);
  bool changes_drag(const Body& body, const Vec3& at) const;
  double first_change_of_drag(const Body& body, double h) const;
  double drag_limit(const Body& body) const;
  bool gains_energy() const;
  Vec3 slip(const Touch& touch, const Vec3& at) const;
  // island_swing.cpp
  void begin_swing();
  bool swing(bool first_pass);
  Eigen::Vector2d slip_at_end(const Touch& touch) const;
  bool by_trapezoid(const Touch& touch) const;
  double swing_error(double h) const;
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
  double reach(int block, double h) const;
  double approach_reach(const CandidatePair& pair, double h) const;
  bool has_closed() const;
  double fastest_among() const;
  double relative_speed(const Touch& t) const;
  double slow_speed(const Touch& t) const;
  bool too_much_happens(double duration) const;
  bool costs_too_much(double duration, bool rebounds_alone) const;
  void go_time_stepped();

  // island_impact.cpp
  double impact_speed(const Touch& touch) const;
  bool meets_hard(const Touch& touch) const;
  struct Restitution {
    double normal = 0, along = 0;
  };                                            // along the normals and along the faces
  enum class Impact { unsolved, gains, done };  // gains: energy from restitution
  Restitution impact_rows(const Restitution& part);
  Impact strike(const Restitution& part, bool frozen_strain);
  Impact most_of(const Restitution& none, const Restitution& all, bool frozen_strain);
  double kinetic(Vec12 Body::*velocity) const;
  void note_impacts_on_skin(double time);
  bool impact_stage(double time);

  void release_springs(double h);
  void weigh_springs();
  double spring_limit(double h, bool lumped) const;
  void choose_springs(double h, bool lumped);
  bool share_end_rule(const Touch& touch, double h);
  // island_quasistatic.cpp
  void find_followers();
  void balance_springs(double h);
  bool cut_at_release(double& h) const;
  Outcome smooth(double h, bool lumped, int passes, bool last_resort = false);
  // island_leapfrog.cpp
  bool makes_energy(const Body& b) const;
  void linearise_resting(double h);
  bool strain_from_start();
  void find_pressed();
  void convert(Body& body, double time);
  std::vector<char> held_by_hard_contacts() const;
  void to_half_steps(double h);
  void to_full_steps(double h);
  void linearise_at(Body& body, const Quat& q_end);
  void assemble(double h, bool lumped, bool first_pass);
  void begin_rows();
  void place_row(Touch& touch);
  void take_row(Touch& touch, double h, bool first_pass);
  void fill_rows(double h, bool first_pass);
  void fill_row(Touch& touch, double h, bool first_pass);
  bool onsets_by_trapezoid(const Body* a, const Body& b) const;
  bool goes_by_its_row(const Touch& touch) const;
  double parts_at(const Touch& touch) const;
  void add_row(Touch& touch, double h, bool first_pass);
  double left_inside(double gap, double h) const;
  void add_surface_row(Touch& touch, double h, bool first_pass);
  Vec3 add_structure_terms(int row, int structure, const SurfaceWeights& weights, const Mat3& frame,
                           double sign, Vec3& u_ref, std::span<const Vec3> tilt = {});
  void remember(const Touch& touch, double h, std::vector<ContactMemory>& memory) const;
  void shear_row(Touch& touch, contact::ProblemContact& c, double h, const Vec3& moved, const Vec3& u_ref);
  void secant_row(Touch& touch, contact::ProblemContact& c, double h, bool first_pass);
  struct Tangent {
    double force = 0, slope = 0;
    bool follows_law = true;
  };  // [N], [N/m]
  Tangent tangent_at_structure(const Touch& touch, double h) const;
  double lasts_at_structure(const Touch& touch, double h) const;
  bool follows_law(const Touch& touch, double h, double allowed) const;
  bool conserving(const Touch& touch, const contact::ProblemContact& c, double h) const;
  bool part_resolved(const Touch& touch) const;
  double normal_compliance(const contact::ProblemContact& c) const;
  void finish_bodies();
  bool finite() const;
  /// repeated: rows anew about an end that was not solved; what they contradict each other by still is taken.
  /// last_resort: the convex problem's solution, tier E, rather than none.
  enum class Effort { provisional, full, repeated, last_resort };
  bool solve(double h, Effort effort);
  // island_rolling.cpp
  void add_rolling_rows();
  contact::ProblemContact couple(const Touch& touch, std::span<const Vec3> axes);
  void add_rocking_rows(double h, bool first_pass);
  double limit_rolling(const std::function<double(const Touch&)>& pressed);
  bool solve_rolling(double h, Effort effort);
  void list_terms();
  void apply(double h);
  bool mark_reached(const std::function<bool(const Touch&)>& bear,
                    const std::function<bool(const Touch&)>& begins, const std::function<void(Body&)>& mark);
  void move_body(Body& body, double h);
  void set_spin(int block, const Vec3& momentum, bool strains);
  void shrink_births(int block);
  void confine(const Touch& touch, const contact::ProblemContact& contact);
  double indentation_at_end(const Touch& touch, double h) const;
  /// Whether the springs of a bond give way by the solution: torn off, sheared off, or, where it has no
  /// tension, opened.
  bool gives_way(const Touch& touch) const;
  double normal_energy_at_end(const Touch& touch) const;
  double spring_energy_at_end(const Touch& touch, double h) const;
  bool laws_met(double h) const;
  Vec3 shear_at_end(const Touch& touch, double h) const;
  Vec3 shear_way(const Touch& touch, double h) const;
  double shear_energy_at_end(const Touch& touch, double h) const;
  double project(double h);
  // island_ahead.cpp
  double step_error(int block) const;
  double fall_time(int block) const;
  bool looks_ahead() const;
  std::optional<std::vector<Vec6>> allowed_accelerations();
  double error_by_ends(double h, std::span<const Vec6> at_start, std::span<const Vec6> at_end) const;
  double rolling_arm(const Touch& touch) const;
  // island_drift.cpp
  double sum_of_overlaps() const;
  void keep_for_drift();
  void take_back();
  double motion(const Body& body, const Pose& from, const Pose& to) const;
  bool drift_beyond_motion(double h) const;
  std::map<std::pair<std::uint64_t, int>, double> deepest_by_motion() const;
  std::vector<Vec3> moments_of_way();
  void book(double h);
  double crushed_ahead(const Touch& touch) const;
  double freed_shear(const Touch& touch) const;
  void collect_node_impulses();
  bool pressed_on_lost_face(const ContactMemory& m) const;
  double lost_with_faces(const std::vector<ContactMemory>& memory, std::span<const Touch* const> rows) const;
  void remember_all(double h);
  void commit(double t_end, double h);
  void report_crushing();
  void go_on_with_ways(double h);
  void tell_impacts(double t_end);
  void save();
  void restore();
  // island_condensed.cpp
  bool chosen_condensed() const;
  bool may_condense(double t, double duration);
  bool none_strikes(double duration);
  double own_approach(const Touch& touch) const;
  bool blow(double t, double h) const;
  bool meets_fast(const Touch& touch, double h) const;
  void approach_skins();
  std::size_t touched_faces() const;
  double condensed_length(double t, double duration, double remaining, double longest);
  void gather_skins();
  Vec3 add_skin_terms(int row, int structure, const SurfaceWeights& weights, const Mat3& frame, double sign,
                      Vec3& u_ref);
  double condensed_error(double h) const;
  double approach_left(const Touch& touch, double h) const;
  bool correct_skins(double t, double h);
  double skin_speed() const;
  double skin_spring_limit(double ahead) const;
  double rise_limit(double ahead) const;
  bool locate_event(double& h, int passes);
  contact::Motion motion_of(int block, bool lumped) const;
  contact::Motion lumped_motion(int block) const;
  double time_of_impact(const CandidatePair& pair, double tolerance, bool lumped) const;
  double first_impact() const;  // fraction of the step, above 1: none
  bool rebounds(const Touch& t) const;
  bool rebound_waits() const;
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
