/// The finite-element structure behind talus::Structure.
#pragma once
#include <memory>
#include <optional>

#include "contact/structures/divided.hpp"
#include "contact/structures/refinable.hpp"
#include "contact/structures/structure.hpp"
#include "fem/integrators/leapfrog.hpp"
#include "fem/members/capacity.hpp"

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

class FemStructure : public Structure, public RefinableStructure, public DividedStructure {
 public:
  using Zones = std::vector<StructureSpec::Refinement>;
  /// `before`: the same structure with larger cells, whose first frequency it takes. `struck`: where its
  /// cells are halved beyond what the specification asks for.
  FemStructure(const StructureSpec& spec, const Vec3& gravity, const Report& report, Zones struck = {},
               const FemStructure* before = nullptr);
  ~FemStructure() override;

  const TriangleSurface& surface() const override { return skin_.surface(); }
  double node_mass(int node) const override { return skin_.node_mass(node); }
  Vec3 node_position(int node) const override { return skin_.node_position(node); }
  Vec3 node_built(int node) const override { return skin_.node_built(node); }
  Vec3 node_velocity(int node) const override { return skin_.node_velocity(node); }
  std::array<bool, 3> node_held(int node) const override { return skin_.node_held(node); }

  double young() const override { return body_.spec.young; }
  double critical_step() const override { return body_.critical_step; }
  void predict(double t, double h) override {
    leave_modal();
    leapfrog_.predict(t, h);
  }
  Vec3 predicted_velocity(int node) const override { return skin_.predicted_velocity(node); }
  void correct(double t, double h, std::span<const NodeImpulse> impulses) override {
    leapfrog_.correct(t, h, impulses);
  }
  std::string advance_alone(double t, double duration) override;

  double condensed_step(double t, double accuracy) override;
  bool condensed_by_choice() const override {
    return body_.spec.integrator == "implicit" || body_.spec.integrator == "modal";
  }
  void predict_condensed(double t, double h) override;
  MatX compliance(std::span<const int> nodes) override;
  bool correct_condensed(double t, double h, std::span<const NodeImpulse> impulses) override;
  void undo_condensed() override;
  bool may_begin(double t, double h, double accuracy) override;
  void struck(double t) override { blow_time_ = t; }

  bool quiet() const override;
  StructureEnergy energy() const override { return energy_.total(); }
  Vec3 base_force() const override;
  Vec3 base_moment() const override;
  std::vector<Vec3> probe_displacements() const override { return skin_.probe_displacements(); }
  double damage_max() const override;
  double damaged_volume() const override;
  double spalled_volume() const override { return body_.lost.eroded_volume + body_.lost.detached_volume; }
  const std::vector<Member>& members() const override { return loads_.members(); }
  std::vector<MemberState> member_states() const override { return loads_.states(); }
  LoadPeaks load_peaks() const override { return loads_.track().peaks(); }
  std::vector<PushDown> push_down() const override { return capacity_.push_down(); }
  std::vector<PushDown> push_over() const override { return capacity_.push_over(); }
  std::vector<SectionResistance> section_resistances() const override {
    return capacity_.section_resistances();
  }
  std::vector<BarLine> bars() const override;
  long dofs() const override { return body_.free_dofs; }
  long elements() const override;
  double memory_of_steps(double duration) override;
  std::string plan() const override;
  std::vector<Fragment> take_fragments() override { return fracture_.take_fragments(); }
  Unsupported unsupported() override { return fracture_.unsupported(); }
  void save(std::vector<double>& state) const override { save(state, false); }
  void restore(std::span<const double> state) override { restore(state, false); }
  void save_here(std::vector<double>& state) const override { save(state, true); }
  void restore_here(std::span<const double> state) override { restore(state, true); }
  void start_over() override;
  Vec6 permanent_reaction() const override { return loads_.track().permanent(); }
  void shape(const TakePart& take) const override;
  void values(const TakePart& take) const override;
  bool refinable() const override;
  std::unique_ptr<Structure> refined(std::span<const StructureSpec::Refinement> zones) override;
  double permanent_energy() const override { return rest_.energy; }

  /// For tests and verification: the mesh, the fundamental circular frequencies [rad/s], and the internal
  /// force.
  const HexMesh& mesh() const { return body_.mesh; }
  const AlignedVector& displacement() const { return fields_.u; }
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
  // structure_rest.cpp
  void preload();
  VecX at_free(const AlignedVector& field) const;
  void move_by(const VecX& way);
  double square_of(const VecX& values) const;
  bool find_elastic_rest(VecX left, double pressed);
  long cracked_cells() const;
  bool find_cracked_rest(bool balanced, double pressed);
  void warn_of_no_rest() const;
  void explicit_steps(double t, double duration);
  bool undisturbed(double t, double duration) const;  // at rest, and no load changes until t + duration
  double settling_time() const;  // for which kinetic energy has to stay small to mean rest [s]
  // structure_hanging.cpp: of a mesh that is refined in part; else they do nothing
  Box3 make_cells();  // the extent of the whole mesh
  void take_over(FemStructure& before);
  void keep_rest();             // if cells may be halved later
  void settle_hanging_nodes();  // their masses, supports and loads go to the nodes that they follow
  // structure_ranks.cpp: with several ranks, all of them call these together; with one they do nothing. Cells
  // and nodes have the numbers of this rank's part of the mesh, but for the skin, probes, lists of cells that
  // leave, and what is asked for from outside, which have those of the whole
  bool divides_memory(const HexMesh& whole) const;
  void make_partition(const HexMesh& whole, bool everywhere);
  void take_part(HexMesh&& whole);
  void make_links(const HexMesh& whole);  // bars and bearings
  void divide();
  // structure_linear.cpp
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
      const;  // of the undamaged structure [rad/s]; negative: it has none, or moves freely
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
  Condensed& condensed(double h);
  double stiffest(int cell) const;
  Mat3 frame_of(int cell) const;
  void follow_frames();  // K of condensed steps follows where cells have turned or cracked
  void set_frames(std::vector<Mat3> frames);
  void find_columns(std::span<const int> nodes);
  void push_condensed(std::span<const NodeImpulse> impulses);
  void drop_condensed_levels();        // they are made again when asked for
  double memory_of_condensed_steps();  // [bytes]
  // structure_output.cpp
  // Rows of all nodes or cells of the whole, in its order: each rank writes its own, and all take all.
  void each_node(int width, const WriteRow& write, const TakeRows& take) const;
  void each_cell(int width, const WriteRow& write, const TakeRows& take) const;
  void save(std::vector<double>& state, bool here) const;
  void restore(std::span<const double> state, bool here);

  StructureBody body_;
  NodalFields fields_{body_.mesh};
  mutable Forces forces_{body_, fields_};  // found when they are asked for
  EnergyAccount energy_{body_, fields_, forces_};
  ContactSurface skin_{body_, fields_};
  MemberLoads loads_{body_, fields_, forces_};
  Fracture fracture_{body_, fields_, forces_, energy_, skin_, loads_.stresses()};
  Leapfrog leapfrog_{body_, fields_, forces_, energy_, loads_, fracture_};
  mutable CapacityTests capacity_{*this};  // keeps what it found
  friend CapacityTests;
  std::unique_ptr<LinearDynamics, LinearDynamicsDeleter> linear_;
  std::unique_ptr<Condensed, CondensedDeleter> condensed_;
  mutable double lowest_frequency_ = 0;  // 0: not asked for yet
  bool factored_ = false;                // from the start, for its weight or its damping
  int modes_ = 24;                       // asked for; more where the energy needs them
  double modal_try_ = 100;               // lone steps after which modal motion is tried next
  double modal_excess_ = 1e300;          // what was left out at the last try, over what may be

  bool starting_ = false;  // condensed steps have been begun from explicit ones, the first is not taken yet
  double laws_share_ = 0;  // of the last condensed_step()
  struct Rest {
    AlignedVector u;
    double energy = 0;
    std::vector<double> reaction;
    std::vector<std::array<double, 2>> drift;
  };
  Rest rest_;                 // under the permanent load alone; empty unless cells may be halved later
  std::vector<Mat3> frames_;  // T of each cell in K of the condensed steps, T K_e T^T; empty: 1 (frame_of())
  double taken_by_condensed_ =
      0;  // of the energy of motions, by starts and viscosity of condensed steps so far [J]
  double blow_time_ = -1e300;  // when a blow was last taken that a condensed step may not take [s]; later,
                               // where ringing has to decay first
};

}  // namespace talus::fem
