/// The finite-element structure behind talus::Structure.
///
///   m a = f_ext(t) - f_int(u) - f_visc - alpha m v + r,      M lumped by rows, r reactions of the supports
///   predict:  v_hat = (v_{n-1/2} (1 - a) + k m^-1 f_n) / (1 + a),  a = alpha k / 2,  k = (h_{n-1} + h_n) / 2
///   correct:  v_{n+1/2} = v_hat + m^-1 p,   u_{n+1} = u_n + h_n v_{n+1/2}
///
/// k equals h while the step does not change; after a change, and at the start (h_{-1} = 0), it keeps the
/// scheme of second order, since velocities live at half steps [belytschko2014, 6.2]. alpha = 2 zeta omega_1.
///
/// Energies are those of the half step n + 1/2, for which the central difference closes its books exactly
/// when the structure is linear: kinetic 1/2 m v_{n+1/2}^2, stored U(u_n) + h/2 f_int(u_n) . v_{n+1/2} = 1/2
/// u_n K u_{n+1}. Every work is the impulse times the mean of the velocities before and after.
///
/// These energies depend on h: where it changes from h1 to h2 at t_n, the motion as it was, they change by
/// -(h2^2 - h1^2)/8 a . f, a the acceleration and f what the structure does by itself, gravity and internal
/// forces. What that is on the average over the phases of whatever rings is accounted for apart, as
/// step_dependence:
///
///   (h2^2 - h1^2)/8 Q,   Q = 1/2 v . (df_int/dt) + 1/2 a . f,
///                        v . (df_int/dt) = v_{n-1/2} . (f_int,n - f_int,n-1) / h1
///
/// The two halves differ by the rate of v . f, which is nothing on the average of what stays in bounds,
/// whatever the laws of the cells. Of a mode of amplitude A, Q is omega^4 A^2 / 2 on the average, for any h
/// below the stable step. The phase's part stays among the scheme's, algorithmic: a step that changes in time
/// with what rings feeds it.
///
/// symbol   meaning                                   unit   shape
/// u        displacement from the unstressed shape    m      nodes x 4 (padded)
/// v        velocity at the last half step            m/s    nodes x 4
/// m        lumped mass                               kg     nodes
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "contact/structures/divided.hpp"
#include "contact/structures/refinable.hpp"
#include "contact/structures/structure.hpp"
#include "core/disjoint_sets.hpp"
#include "fem/bearings/bearings.hpp"
#include "fem/discretisation/discretisation.hpp"
#include "fem/discretisation/partition.hpp"
#include "fem/kernels/aligned.hpp"
#include "fem/kernels/element_operator.hpp"
#include "fem/linear/elastic_system.hpp"
#include "fem/materials/damage_field.hpp"
#include "fem/members/load_track.hpp"
#include "fem/members/members.hpp"
#include "fem/rebar/bars.hpp"
#include "fem/setup.hpp"

namespace talus::fem {

/// Modes, factors and modal motion; made when the structure first rings on alone.
struct LinearDynamics;
struct LinearDynamicsDeleter {
  void operator()(LinearDynamics* p) const;
};

/// Factors, columns of the compliance and the step at hand of the condensed regime; made with its first step.
struct Condensed;
struct CondensedDeleter {
  void operator()(Condensed* p) const;
};

/// Explicit steps that a condensed one has to save, unless it is asked for.
constexpr double least_condensed_gain = 6;

using Report = std::function<void(const std::string&)>;

struct SeatedNode;  // bearing_pads.hpp

class FemStructure : public Structure, public RefinableStructure, public DividedStructure {
 public:
  using Zones = std::vector<StructureSpec::Refinement>;
  /// `before`: the same structure with larger cells, whose first frequency it takes. `struck`: where its
  /// cells are halved beyond what the specification asks for.
  FemStructure(const StructureSpec& spec, const Vec3& gravity, const Report& report, Zones struck = {},
               const FemStructure* before = nullptr);
  ~FemStructure() override;

  const TriangleSurface& surface() const override;
  double node_mass(int node) const override;
  Vec3 node_position(int node) const override;
  Vec3 node_built(int node) const override;
  Vec3 node_velocity(int node) const override;
  std::array<bool, 3> node_held(int node) const override;

  double young() const override { return spec_.young; }
  double critical_step() const override { return critical_step_; }
  void predict(double t, double h) override;
  Vec3 predicted_velocity(int node) const override;
  void correct(double t, double h, std::span<const NodeImpulse> impulses) override;
  std::string advance_alone(double t, double duration) override;

  double condensed_step(double t, double accuracy) override;
  bool condensed_by_choice() const override {
    return spec_.integrator == "implicit" || spec_.integrator == "modal";
  }
  void predict_condensed(double t, double h) override;
  MatX compliance(std::span<const int> nodes) override;
  bool correct_condensed(double t, double h, std::span<const NodeImpulse> impulses) override;
  void undo_condensed() override;
  bool may_begin(double t, double h, double accuracy) override;
  void struck(double t) override { blow_time_ = t; }

  bool quiet() const override;
  StructureEnergy energy() const override;
  Vec3 base_force() const override;
  Vec3 base_moment() const override;
  std::vector<Vec3> probe_displacements() const override;
  double damage_max() const override;
  double damaged_volume() const override;
  double spalled_volume() const override { return eroded_volume_ + detached_volume_; }
  const std::vector<Member>& members() const override { return members_; }
  std::vector<MemberState> member_states() const override;
  LoadPeaks load_peaks() const override { return load_track_.peaks(); }
  std::vector<PushDown> push_down() const override;
  std::vector<PushDown> push_over() const override;
  std::vector<SectionResistance> section_resistances() const override;
  std::vector<BarLine> bars() const override;
  long dofs() const override { return free_dofs_; }
  long elements() const override;
  double memory_of_steps(double duration) override;
  std::string plan() const override;
  std::vector<Fragment> take_fragments() override;
  Unsupported unsupported() override;
  void save(std::vector<double>& state) const override { save(state, false); }
  void restore(std::span<const double> state) override { restore(state, false); }
  void save_here(std::vector<double>& state) const override { save(state, true); }
  void restore_here(std::span<const double> state) override { restore(state, true); }
  void start_over() override;
  Vec6 permanent_reaction() const override { return load_track_.permanent(); }
  void shape(const TakePart& take) const override;
  void values(const TakePart& take) const override;
  bool refinable() const override;
  std::unique_ptr<Structure> refined(std::span<const StructureSpec::Refinement> zones) override;
  double permanent_energy() const override { return rest_.energy; }

  /// For tests and verification: the mesh, the fundamental circular frequencies [rad/s], and the internal
  /// force.
  const HexMesh& mesh() const { return mesh_; }
  const AlignedVector& displacement() const { return u_; }
  std::vector<double> frequencies(int count);
  /// What its tables and fields take on this process [bytes], by name.
  std::vector<std::pair<std::string, std::size_t>> memory_consumption() const;

 private:
  // structure_setup.cpp
  void set_loads(const Box3& extent);
  void set_masses();
  void find_critical_step();
  void set_material(bool first);
  material::CellSize largest_cell() const;
  void progress(const std::string& what) const;
  void check_supports(const HexMesh& mesh);
  void warn_of_cracks() const;
  std::string place_of_most(double most, int cell) const;
  void watch_stress(double t);            // of elastic concrete
  Mat3 strain_at_centre(int cell) const;  // Green's where rotations may be large
  // structure_rest.cpp
  void preload();
  VecX at_free(const AlignedVector& field) const;
  void move_by(const VecX& way);
  double square_of(const VecX& values) const;
  bool find_elastic_rest(VecX left, double pressed);
  long cracked_cells() const;
  bool find_cracked_rest(bool balanced, double pressed);
  void warn_of_no_rest() const;
  // structure_step.cpp
  void forces(double t);          // f_int_, external_ at the present state; cached until the state changes
  void external_force(double t);  // writes f_ext_
  struct StepWorks;
  std::vector<NodeImpulse> impulses_here(std::span<const NodeImpulse> given) const;
  void take_impulses(double h, std::span<const NodeImpulse> impulses);
  void move_nodes(double h, double kick, StepWorks& works);
  void account(double h, double kick, const StepWorks& works);
  void explicit_steps(double t, double duration);
  bool undisturbed(double t, double duration) const;  // at rest, and no load changes until t + duration
  double settling_time() const;  // for which kinetic energy has to stay small to mean rest [s]
  void moved();                  // the state changed: caches are stale
  // structure_hanging.cpp: of a mesh that is refined in part; else they do nothing
  Box3 make_cells();  // the extent of the whole mesh
  void take_over(FemStructure& before);
  void keep_rest();             // if cells may be halved later
  void settle_hanging_nodes();  // their masses, supports and loads go to the nodes that they follow
  double mechanical_energy();   // kinetic, stored and gravity, at the time of the velocities [J]
  Vec3 position(int n) const { return mesh_.nodes[n] + Vec3(u_[4 * n], u_[4 * n + 1], u_[4 * n + 2]); }
  Vec3 velocity(int n) const { return {v_[4 * n], v_[4 * n + 1], v_[4 * n + 2]}; }
  // structure_ranks.cpp: with several ranks, all of them call these together; with one they do nothing. Cells
  // and nodes have the numbers of this rank's part of the mesh, but for the skin, probes, lists of cells that
  // leave, and what is asked for from outside, which have those of the whole
  bool divides_memory(const HexMesh& whole) const;
  void make_partition(const HexMesh& whole, bool everywhere);
  void take_part(HexMesh&& whole);
  void make_links(const HexMesh& whole);  // bars and bearings
  bool divided() const { return partition_ && !partition_->holds_all(); }
  void divide();
  void watch();  // finds the nodes that others ask for
  bool first_rank() const { return !partition_ || partition_->first_rank(); }
  bool own_node(int n) const { return !partition_ || partition_->owns_node(n); }
  bool own_cell(int cell) const { return !partition_ || partition_->owns_cell(cell); }
  int node_here(int whole) const { return partition_ ? partition_->node_here(whole) : whole; }
  int cell_here(int whole) const { return partition_ ? partition_->cell_here(whole) : whole; }
  void sum(std::span<double> values) const;
  long count_of(long count) const;
  double largest(double value) const;
  void motion_changed();               // u_, v_ and histories are those of own nodes and cells
  const double* seen(int node) const;  // u, v of the skin and of probes
  std::size_t seen_place(int node) const;
  void share_prediction() const;                                 // v_hat there
  void share_motion();                                           // u_, v_ everywhere
  std::vector<int> joined(const std::vector<int>& cells) const;  // lists of all ranks, ascending
  // structure_linear.cpp
  void synchronise(double t);
  double ringing_step(double t);
  bool ring_on(double t, double duration);
  // structure_modal.cpp
  LinearDynamics& linear_dynamics();
  bool more_modes();
  void put_off_modes();
  bool project(double t);
  std::string plan_of_steps() const;
  bool rings_in_modes() const;  // linear, and allowed to
  int modes_at_most() const;
  int modes_within(double duration) const;
  bool enter_modal(double t, bool forced);
  void leave_modal();
  void materialise();
  void modal_motion(double t, double duration);
  void save_linear(std::vector<double>& state) const;
  std::size_t restore_linear(std::span<const double> state);
  // structure_condensed.cpp
  bool condensable() const;  // by what it is and what was asked for
  double lowest_frequency()
      const;                   // of the undamaged structure [rad/s]; negative: it has none, or moves freely
  double dissipation() const;  // of the last evaluation of the laws, not yet accepted [J]
  double condensed_step(
      double t, double accuracy,
      double laws_share);  // the laws may take that part of the stored energy in a period of the first mode
  double taken_at_ease(double h) const;
  double condensed_budget(double accuracy) const;
  bool at_ease(double h)
      const;  // the laws' last evaluation, of a step of length h, takes next to nothing and lets no cell go
  bool viscosity_at_ease(double h, double taken, double damped, double kinetic) const;
  void begin_condensed(double t, double h,
                       bool smoothed);  // `smoothed`: for contacts that may hold nodes, after explicit steps
                                        // by backward Euler from smoothed velocities
  VecX unresolved_velocities(double h);
  void smooth_velocities(double h);
  bool loads_hold(double from, double to) const;
  void accept_laws();  // books the last evaluation of the laws, and makes it the accepted one
  Condensed& condensed(double h);
  double stiffest(int cell) const;
  Mat3 frame_of(int cell) const;
  void follow_frames();  // K of condensed steps follows where cells have turned or cracked
  void set_frames(std::vector<Mat3> frames);
  void forget_stiffness();  // of condensed steps: cells or masses have changed
  void find_columns(std::span<const int> nodes);
  void push_condensed(std::span<const NodeImpulse> impulses);
  void drop_condensed_levels();        // they are made again when asked for
  double memory_of_condensed_steps();  // [bytes]
  // structure_break.cpp
  /// `width` numbers of each of these cells of the whole mesh, from its owner.
  std::vector<double> of_cells(const std::vector<int>& cells, std::size_t width,
                               const std::function<void(int, double*)>& write) const;
  struct Excerpt {
    HexMesh mesh;           // these cells alone, with numbers of their own
    std::vector<int> node;  // numbers in the whole mesh, ascending
    std::vector<Vec3> position, velocity;
    std::vector<double> mass, cell_mass;
    std::vector<int> cells_at_node;  // in the structure
    int place(int whole) const;      // -1: not in it
  };
  Excerpt excerpt(const std::vector<int>& cells) const;
  double cell_energy(int cell) const;
  double link_energy(
      const std::vector<int>& cells) const;  // of the bars in them and the bearings at them [J]
  void switch_off(const std::vector<int>& cells);
  void drop_orphans(const std::vector<int>& cells);
  void remove_node(int n);
  std::vector<int> spent_cells() const;  // own cells to erode
  void begin_leapfrog(double h);
  void find_jump(double h);  // into jump_
  void keep_momenta();       // of jump_, of a free structure
  double excess_of_gravity(double kick, double h) const;
  double power_of_own_forces(
      double kick) const;  // a . (m g - f_int), a the step's acceleration: this rank's part [W/s]
  void book_step_dependence(double h, double own, double strained);
  void erode(const std::vector<int>& cells);
  struct Leaving {
    double mass = 0;
    int cells = 0;      // of the piece
    bool goes = false;  // keeps no cell
    Vec3 position, velocity;
  };
  std::map<int, Leaving> leaving_nodes(const HexMesh& mesh, const std::vector<int>& cells,
                                       const Excerpt* apart) const;
  void shape_of_piece(const HexMesh& mesh, const std::vector<int>& cells, double smallest,
                      const std::map<int, Leaving>& nodes, const std::vector<SeatedNode>& seated,
                      Fragment& f) const;
  Fragment detach(const std::vector<int>& cells, const std::vector<SeatedNode>& seats);
  std::vector<SeatedNode> seated_nodes() const;  // of all decks, as long as cells of both sides are there
  // structure_pieces.cpp
  long count_cuts();
  Mat3 gradient_at_centre(int cell) const;
  double face_opening(int a, int b, int face) const;
  bool parted(int cell) const;
  std::vector<int> parted_beside(const std::vector<std::vector<int>>& pieces) const;
  std::vector<int> piece_labels() const;
  std::set<int> held_pieces(const std::vector<int>& label) const;
  std::vector<std::vector<int>> loose_pieces() const;
  bool is_rubble(const std::vector<int>& piece) const;
  // structure_output.cpp
  // Rows of all nodes or cells of the whole, in its order: each rank writes its own, and all take all.
  void each_node(int width, const WriteRow& write, const TakeRows& take) const;
  void each_cell(int width, const WriteRow& write, const TakeRows& take) const;
  std::vector<SkinQuad> whole_skin() const;
  void rebuild_skin();
  void save(std::vector<double>& state, bool here) const;
  void restore(std::span<const double> state, bool here);
  std::vector<double> foot_reactions(
      double step) const;  // support_reaction(), then for each foot the moment on it about its centroid
  Vec6 support_reaction(double step) const;  // force and moment on the supports by forces() as they stand,
                                             // contact impulses over `step` among them; 0: without
  // structure_members.cpp
  void find_places(const HexMesh& whole);  // of members and feet
  void find_feet(const HexMesh& whole);
  void set_members();
  void find_segments();  // of members and their cuts
  void begin_loads();
  void watch_loads(double t, double h);  // of the step that has come to t, its impulses in place
  std::vector<MemberState> find_member_states(bool widths) const;
  MemberState member_state(std::size_t member, AlignedVector& force, bool widths) const;
  std::vector<double> sums_over(const std::vector<const std::vector<int>*>& lists) const;
  // structure_capacity.cpp
  std::unique_ptr<FemStructure> cut_out(const PierPlace& place, bool top_held) const;
  std::size_t pier_count() const;  // of members_: they come first
  void needs_piers() const;
  PushDown push_over(std::size_t member, int axis) const;
  void compute_only(const std::vector<char>& cells);
  PushDown push_down(std::size_t member) const;
  bool unharmed(const PierPlace& place) const;  // no cell of it is gone or has a history

  StructureSpec spec_;
  Zones struck_zones_;
  Vec3 gravity_;
  Report report_;
  Discretisation discretisation_;
  const HexMesh& mesh_ = discretisation_.mesh();
  Supports supports_;
  std::vector<PatchLoad> loads_;
  std::vector<ProbePoint> probes_;
  double shear_ = 0, bulk_ = 0;
  bool finite_ = false;  // total Lagrangian
  DofMap dofs_;
  int free_dofs_ = 0;         // of the whole, as dofs_.size on one process
  double mass_of_cells_ = 0;  // of the whole, as built [kg]
  std::unique_ptr<ElementOperator> operator_;
  std::unique_ptr<ElasticSystem> elastic_;
  std::vector<double> cell_mass_;
  std::vector<double> built_mass_;  // of the nodes, as built
  std::vector<int> cells_at_node_;
  double wave_speed_ = 0;
  std::optional<material::Concrete> concrete_;
  std::vector<int> candidates_;
  std::vector<Member> members_;
  struct MemberPlace {
    Pier pier;
    PierPlace place;
    std::vector<int> segments;
    std::vector<std::vector<int>> cut_segments;
    std::vector<ElementPack> cut_packs;
    int deck = -1;
  };
  mutable std::vector<std::optional<PushDown>>
      unharmed_push_downs_;                         // by member: what it carried while it was unharmed
  mutable std::vector<MemberPlace> member_places_;  // which lanes of their packs count is set for every use
  std::unique_ptr<LinearDynamics, LinearDynamicsDeleter> linear_;
  std::unique_ptr<Condensed, CondensedDeleter> condensed_;
  mutable double lowest_frequency_ = 0;  // 0: not asked for yet
  double steps_taken_ = 0;               // explicit ones
  bool factored_ = false;                // from the start, for its weight or its damping
  int modes_ = 24;                       // asked for; more where the energy needs them
  AlignedVector
      jump_;  // what the velocities lose in the step that was predicted, whose length jumps; empty: nothing
  double modal_try_ = 100;       // lone steps after which modal motion is tried next
  double modal_excess_ = 1e300;  // what was left out at the last try, over what may be

  // several ranks
  std::unique_ptr<Partition> partition_;  // null: all on this process
  std::vector<NodeRange> own_, touched_;  // nodes of this rank; those that forces are added to
  WatchedNodes watched_;                  // of skin and probes
  struct Seen {
    std::vector<double> built, motion, prediction;
  };  // of each watched node: place as built, mass, directions held, 0; u, v; v_hat
  mutable Seen seen_;
  mutable bool skin_shared_ = true, prediction_shared_ = true;

  // state
  std::vector<char> live_;  // cells
  std::vector<double> mass_;
  AlignedVector u_, v_;
  std::unique_ptr<DamageField> damage_;  // null: no damage law, no history at all
  std::unique_ptr<Bars> bars_;           // null: no reinforcement
  std::unique_ptr<Bearings> bearings_;   // null: no viaduct
  long breaks_ = 0, cuts_seen_ = 0;      // what the search for fragments last saw
  double dust_mass_ = 0, dust_potential_ = 0, eroded_volume_ = 0, detached_volume_ = 0;
  Vec3 dust_momentum_ = Vec3::Zero(),
       dust_spin_ = Vec3::Zero();  // what it left with, linear and about the origin
  double h_last_ = 0;              // 0: v_ is at the same time as u_
  double power_ = 0;               // f_int . v of the last step, with the forces that it began from [W]
  bool power_valid_ = false;       // they have not jumped since, as cells went
  bool starting_ = false;  // condensed steps have been begun from explicit ones, the first is not taken yet
  double laws_share_ = 0;  // of the last condensed_step()
  double time_ = 0;
  AlignedVector contact_impulse_;  // on held nodes during the last step [N s]
  double contact_step_ = 0;
  StructureEnergy books_;  // the cumulative works
  LoadTrack load_track_;
  std::vector<int> foot_of_;  // of each supported node, as supports_.nodes
  std::vector<Vec3> foot_centroid_;
  std::vector<double> shortest_edge_;  // thickness of each cell, once it was asked for [m]
  struct Rest {
    AlignedVector u;
    double energy = 0;
    std::vector<double> reaction;
    std::vector<std::array<double, 2>> drift;
  };
  Rest rest_;                 // under the permanent load alone; empty unless cells may be halved later
  std::vector<Mat3> frames_;  // T of each cell in K of the condensed steps, T K_e T^T; empty: 1 (frame_of())
  double stored_half_ = 0;    // elastic energy at the half step
  double reference_kinetic_ = 0;
  double taken_by_condensed_ =
      0;                    // of the energy of motions, by starts and viscosity of condensed steps so far [J]
  double still_since_ = 0;  // kinetic energy has been below the limit since then
  bool still_ = false;
  double blow_time_ = -1e300;  // when a blow was last taken that a condensed step may not take [s]; later,
                               // where ringing has to decay first

  // derived
  double alpha_ = 0, omega_1_ = 0, critical_step_ = 0;
  double drag_ = 1;  // between predict() and correct() 1 + alpha h/2, by which damping adds to the mass that
                     // an impulse meets
  AlignedVector inverse_mass_;                    // nodes x 4, 0 where held
  AlignedVector f_int_, f_visc_, f_ext_, v_hat_;  // f_visc_ empty without damage
  bool forces_valid_ = false, weights_valid_ = false,
       laws_taken_ =
           false;  // laws_taken_: what they evaluated at the present state is accepted and accounted for
  double forces_time_ = 0;
  double stored_part_ = 0;   // elastic energy now, this rank's part
  std::vector<int> struck_;  // nodes with an entry in contact_impulse_
  std::vector<SkinQuad> skin_;
  std::vector<int> skin_node_;  // surface vertex -> node, the first ones
  mutable TriangleSurface surface_;
  mutable bool surface_stale_ = true;
  mutable std::vector<MemberState> member_states_;  // of the present state; empty: to be found
};

}  // namespace talus::fem
