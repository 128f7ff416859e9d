/// A deformable structure as the coupled step sees it. Implemented by the finite-element module (src/fem),
/// which is loaded at run time; nothing here names deal.II. One explicit sub-step of length h (central
/// difference, lumped mass m):
///
///   predict:  v_hat = (v_{n-1/2} (1 - a) + h m^-1 (f_ext - f_int(x_n) - f_damp)) / (1 + a)     (no contact)
///   joint contact problem over blocks and touched nodes, node mass m
///   correct:  v_{n+1/2} = v_hat + m^-1 p,   x_{n+1} = x_n + h v_{n+1/2}
#pragma once
#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "contact/geometry/surface.hpp"
#include "core/types.hpp"

namespace talus {

/// Everything that describes one structure; plain data, validated by the scene.
struct StructureSpec {
  std::string name;
  std::string kind = "box";  // box, column, viaduct, mesh
  int material = 0;          // contact material (index into the scene's materials)

  // mechanical properties, SI
  double density = 2450, young = 0, poisson = 0.2;
  double f_cm = 0;  // mean compressive strength [Pa]; > 0: concrete, the rest derived (MC2010)
  double tensile_strength = 0, fracture_energy = 0;  // 0: derived from f_cm   [Pa], [N/m]
  std::string damage = "none";                       // none, concrete, concrete-cdpm2
  bool rate_effect = true;
  bool erosion = true;
  double aggregate = 0;  // largest grain of crack faces that interlock [m]; 0: they do not

  // geometry: the bounding parameters of each kind
  Vec3 position =
      Vec3::Zero();  // box: centroid; column: centre of the base; mesh: where its volume centroid goes, if
                     // parameters hold "centred" (1); else the file's coordinates are the world's
  Vec3 size = Vec3::Ones();  // box: full extents; column: (section x, section y, height)
  Mat3 rotation = Mat3::Identity();
  std::string section = "rectangular";  // column: rectangular, round, hollow
  double wall_thickness = 0;            // hollow
  std::string file;                     // mesh: absolute path
  std::vector<std::pair<std::string, double>>
      parameters;  // viaduct: named numbers (spans, span_length, pier_height...)
  std::function<double(double, double)>
      ground;            // viaduct: height of the terrain at x, y [m], NaN outside; empty: level ground
  double cell_size = 0;  // [m], 0 if cells are given
  std::array<int, 3> cells{0, 0, 0};
  struct Refinement {
    Box3 region;
    double cell_size;
  };  // finer cells there [m]
  std::vector<Refinement> refinements;

  // supports: "-x", "+z", ... faces of the bounding box, or explicit ones
  struct Support {
    std::string face;   // "-z" etc., or empty
    std::string group;  // mesh group name, or empty
    Box3 region;        // used if face and group are empty
    std::array<bool, 3> held{true, true, true};
  };
  std::vector<Support> supports;
  bool gravity_preload = true;
  double damping_ratio = 0;  // of the first mode
  std::string rebar_file;    // absolute path, or empty
  struct RebarRule {
    std::string kind, part = "pier";
    int bars = 0;
    double diameter = 0, cover = 0, spacing = 0, yield = 500e6, ultimate_strain = 0.05, prestress = 0;
  };
  std::vector<RebarRule> rebar_rules;
  std::string bond = "perfect";  // perfect, mc2010 (bond slip)

  struct Probe {
    std::string name;
    Vec3 at;
  };
  std::vector<Probe> probes;
  struct Load {  // prescribed traction on the surface patch inside region
    Box3 region;
    Vec3 traction;
    std::vector<std::pair<double, double>> history;
  };
  std::vector<Load> loads;
  Vec3 initial_velocity = Vec3::Zero();  // free bodies (a block as finite elements)
  std::string integrator = "auto";       // auto, explicit, implicit, modal
  double critical_step_fraction = 0.9;   // of the stable step
};

/// Energies and work since the start, J. Signs as in the ledger of interface.md: dissipation positive.
struct StructureEnergy {
  double kinetic = 0, elastic = 0, gravity_potential = 0;  // potential zero at z = 0 of the scene
  double damping_work = 0, damage_work = 0, plastic_work = 0, bulk_viscosity_work = 0, eroded_energy = 0;
  double external_work = 0;  // prescribed loads
  double contact_work = 0;   // work done on the structure by contact impulses
  double algorithmic =
      0;  // work of internal forces that is neither stored nor dissipated by a law: what the time
          // discretisation of a non-linear structure loses (> 0) or gains (< 0); zero when it is linear
  double step_dependence =
      0;  // by how much less the leapfrog's energy is for the steps that it was lengthened to; no loss
  Vec3 linear_momentum = Vec3::Zero(), angular_momentum = Vec3::Zero();  // about the scene origin
};

/// A piece that came off; becomes a block. Momenta exact by construction.
struct Fragment {
  std::vector<Vec3> vertices;                 // world [m]
  std::vector<std::array<int, 3>> triangles;  // outward
  double mass = 0;                            // [kg]
  double crushed = 0;  // of it, of cells that eroded beside it and whose nodes it has, and steel [kg]
  Vec3 centroid = Vec3::Zero();
  Vec3 linear_momentum = Vec3::Zero(), angular_momentum = Vec3::Zero();  // angular about its centroid
  double kinetic = 0;                                                    // what its nodes had [J]
  double elastic = 0;                                                    // strain energy it took with it [J]
};

/// A pier, column, box or span of a deck as a member: what does not change.
struct Member {
  std::string name;
  bool span = false;  // of a deck: from bearings to bearings, axis_x across and axis_y up; its drift is the
                      // deflection of its middle
  std::vector<int> carried_by;  // of a span: places of the piers below its ends, in the list of members
  Vec3 base = Vec3::Zero();     // centre of the lowest section [m]
  Vec3 axis_x = Vec3::UnitX(),
       axis_y = Vec3::UnitY();      // of the section; the member runs along axis_x x axis_y
  double length = 0, volume = 0;    // [m], of its cells [m^3]
  std::array<double, 2> section{};  // extents along axis_x and axis_y [m]
  std::vector<double> stations;     // distances of the sections from the base [m]
  double axial_preload = 0;         // N at the base under permanent load, compression positive [N]
  std::array<double, 2> shear_design{},
      shear_mean{};  // V_Rd (EN 1992-1-1 6.2, gamma_c 1.2, gamma_s 1, f_ck) and with mean
                     // strengths, for a force along axis_x and axis_y [N]; 0: no concrete
};

/// Its state now. Section forces are those of the part above on the part below.
struct MemberState {
  std::vector<double> axial;                  // per station, compression positive [N]
  std::vector<std::array<double, 2>> shear;   // along axis_x, axis_y [N]
  std::vector<std::array<double, 2>> moment;  // about axis_x, axis_y, at the centre of the section [N m]
  std::array<double, 2> drift{};  // top against base, of a span its middle against the mean of its ends,
                                  // along axis_x, axis_y; NaN once that has come off [m]
  double crack_width = 0;         // largest [m]
  double lost_volume = 0;         // eroded or come off [m^3]
  int bars_yielded = 0, bars_broken = 0;
  int ends_unseated = 0;  // of a span: ends of which no bearing holds
  double end_shift = 0;   // of a span: the larger displacement of its ends, in plan and down [m]
};

/// Greatest value so far, when, and for a member at which station [s], [m].
struct LoadPeak {
  double value = 0, time = 0, station = 0;
};

/// Greatest principal stress at the centre of a cell, in samples of a millisecond, where elastic concrete is
/// strained as if it could bear all; strength 0: not looked for.
struct StressPeak {
  double value = 0, time = 0, strength = 0;  // size [Pa], [s], f_t or f_cm [Pa]
  double share = 0;                          // greatest share of the volume beyond the strength
  Vec3 at = Vec3::Zero();                    // as built [m]
};

/// A member's greatest loads so far, each of means over `load_window`; drift and crack width as they were.
struct MemberPeaks {
  LoadPeak shear, moment;                     // sizes of V and M [N], [N m]
  LoadPeak use_design, use_mean;              // V_dyn / V_Rd, sqrt((V_x / V_Rd,x)^2 + (V_y / V_Rd,y)^2)
  double axial_least = 0, axial_largest = 0;  // compression positive [N]
  double drift = 0, crack_width = 0;          // [m]
  /// V_dyn / V_Rd and crack width [m] of the runs that this one goes on from.
  struct Before {
    double use_design = 0, use_mean = 0, crack_width = 0;
  } before;
};

/// What a structure had to carry so far, found in every step that it made and independent of how often
/// histories are written. Reactions are those beyond the ones under permanent load (of a structure that
/// starts from an earlier run's last state, which may still ring: that run's).
struct LoadPeaks {
  LoadPeak force, shear, moment;    // size of the base force, of its horizontal part [N]; the greatest moment
                                    // on one foot, about its own centroid [N m]
  Vec3 moment_at = Vec3::Zero();    // that foot's centroid; a foot: supported nodes joined by cells [m]
  int moment_member = -1;           // the pier that stands on it, as members(); -1: none does
  StressPeak tension, compression;  // of an elastic concrete
  std::vector<MemberPeaks> members;  // as members()
  std::vector<LoadPeak> probes;      // sizes of displacements, permanent load included [m]
};

/// A force of a single sub-step is set by that step where something hard meets a node that is held; what a
/// section or a foundation has to carry is the impulse over a window: a running mean, without overshoot, 3 dB
/// down at 0.443 / window = 295 Hz [s].
inline constexpr double load_window = 1.5e-3;

/// Push-down of one member: axial load against displacement of its top; of a push-over the lateral one.
struct PushDown {
  std::string member;
  int axis = -1;                             // -1: down; 0, 1: along axis_x, axis_y
  double capacity = 0;                       // greatest load on the top [N]
  double at = 0;                             // displacement there [m]
  std::vector<std::array<double, 2>> curve;  // displacement [m], load [N]
};

/// Resistances of a pier's section at its foot by EN 1992-1-1, static values: shear (6.2), and moment at the
/// axial force under permanent load (6.1), for a force along axis_x and axis_y.
struct SectionResistance {
  std::string member;
  double axial = 0;  // under permanent load, compression positive [N]
  struct Values {
    double compression = 0, tension = 0;
    std::array<double, 2> moment{}, shear{};
  };                    // N_Rd of pure compression and tension [N], M_Rd [N m], V_Rd [N]
  Values design, mean;  // f_ck, gamma_c 1.2, gamma_s 1 (accidental); f_cm, 1, 1
  std::array<std::vector<std::array<double, 2>>, 2> interaction;  // design: N, M_Rd
};

/// A reinforcing bar from end to end, as placed [m].
struct BarLine {
  Vec3 first, last;
  double diameter = 0;
};

/// A node's share of a contact impulse over a sub-step.
struct NodeImpulse {
  int node;
  Vec3 impulse;
};  // [N s]

/// The boundary surface of a structure, as contact sees it: nodes by the numbers of the whole mesh.
class StructureSkin {
 public:
  virtual ~StructureSkin() = default;
  virtual const TriangleSurface& surface() const = 0;  // vertices and velocities follow the state
  virtual double young() const = 0;                    // of the material, undamaged [Pa]
  virtual double node_mass(int node) const = 0;        // lumped [kg]; infinity when fully held
  virtual Vec3 node_position(int node) const = 0;
  virtual Vec3 node_built(int node) const = 0;          // before any load
  virtual Vec3 node_velocity(int node) const = 0;       // at the last half step
  virtual Vec3 predicted_velocity(int node) const = 0;  // v_hat [m/s]
  virtual std::array<bool, 3> node_held(int node) const = 0;
  virtual std::vector<Vec3> probe_displacements() const = 0;
};

/// Condensed steps: one step of the midpoint rule, an affine map of the contact impulses on touched nodes
/// (docs/theory/coupling.md),
///
///   v_np = v_hat + W p,     u_np = u_n + h (v_n + v_np) / 2
///   velocities at the time of the displacements
class CondensedSteps {
 public:
  virtual ~CondensedSteps() = default;
  /// Longest such step that resolves the motion to the relative `accuracy` and its displacements to `within`
  /// [m]; 0: none now (explicit by the structure's own settings, damage grows, or waves of a blow still run)
  /// [s].
  virtual double longest_step(double t, double accuracy, double within) = 0;
  virtual double lowest_frequency() const = 0;  ///< of the undamaged structure [rad/s]
  /// True if the structure is to be condensed whatever strikes it (integrator implicit or modal).
  virtual bool by_choice() const = 0;
  /// Whether condensed steps of h may begin at t: what they do not resolve of a ringing structure is damped,
  /// and is to be a small part of its motion. False: explicit ones until it has decayed so far.
  virtual bool may_begin(double t, double h, double accuracy) = 0;
  /// Computes v_hat of a condensed step; predicted_velocity() then gives it. The state stays, but that
  /// velocities are brought to the time of the displacements.
  virtual void predict(double t, double h) = 0;
  /// W of these nodes for the step that was predicted, 3m x 3m, zero where held [1/kg].
  virtual MatX compliance(std::span<const int> nodes) = 0;
  /// Finishes the step that predict() began. False if it may not be: damage would grow in it. Then undo() is
  /// due.
  virtual bool correct(double t, double h, std::span<const NodeImpulse> impulses) = 0;
  virtual void undo() = 0;
  /// The structure was struck at t, faster than a condensed step may take: until the waves have passed it
  /// asks for explicit sub-steps.
  virtual void struck(double t) = 0;
};

/// What members and feet of a structure carry.
class StructureLoads {
 public:
  virtual ~StructureLoads() = default;
  virtual const std::vector<Member>& members() const = 0;  // empty for a mesh and for free bodies
  virtual const std::vector<MemberState>& states() const = 0;
  virtual const LoadPeaks& peaks() const = 0;
  virtual Vec3 base_force() const = 0;   // acting on the support [N]
  virtual Vec3 base_moment() const = 0;  // about the first centroid of the supported nodes [N m]
  /// Force and moment on the supports under the permanent load, from which those of LoadPeaks count; kept by
  /// Structure::start_over() [N], [N m].
  virtual Vec6 permanent_reaction() const = 0;
};

/// Tests of members from the present state, which is kept.
class MemberCapacity {
 public:
  virtual ~MemberCapacity() = default;
  /// Presses every member but spans, which come last, between rigid plates, in displacement control; slow
  /// enough that inertia carries below 2 %. Throws InputError if there is no member.
  virtual std::vector<PushDown> push_down() = 0;
  /// The same sideways: the foot is held, the top is moved along axis_x, then in a second test along axis_y
  /// (two entries for each pier), free to sink and to turn under what the pier carries for good.
  virtual std::vector<PushDown> push_over() = 0;
  /// Of every pier; empty without concrete.
  virtual std::vector<SectionResistance> section_resistances() const = 0;
};

class Structure {
 public:
  virtual ~Structure() = default;

  virtual const StructureSkin& skin() const = 0;
  virtual const StructureLoads& loads() const = 0;
  virtual CondensedSteps& condensed() = 0;
  virtual MemberCapacity& capacity() = 0;

  /// Stable explicit sub-step now [s].
  virtual double critical_step() const = 0;
  /// Computes v_hat for a sub-step of length h from the present state at time t; does not change the state.
  virtual void predict(double t, double h) = 0;
  /// Finishes the sub-step that predict() began.
  virtual void correct(double t, double h, std::span<const NodeImpulse> impulses) = 0;
  /// Advances without any contact from t to t + duration by the cheapest suitable scheme (modal, implicit or
  /// explicit sub-steps); returns the name of the scheme used.
  virtual std::string advance_alone(double t, double duration) = 0;

  /// True if nothing would move it: no load, kinetic energy below 1e-8 of the reference, damage not growing.
  virtual bool quiet() const = 0;
  virtual bool free() const = 0;  // nothing supports it
  virtual StructureEnergy energy() const = 0;
  struct Damage {
    double largest = 0;  // 0 to 1
    double volume = 0;   // damaged beyond a half [m^3]
    double spalled = 0;  // eroded or come off as fragments [m^3]
  };
  virtual Damage damage() const = 0;
  virtual std::vector<BarLine> bars() const = 0;  // of files and rules
  virtual long dofs() const = 0;
  virtual long elements() const = 0;
  /// What stepping for `duration` [s] may hold beyond what stands now, at most [bytes]: factors, columns,
  /// modes, history of laws.
  virtual double memory_of_steps(double duration) const = 0;
  virtual std::string plan() const = 0;  // what is computed and what is left out, one line per fact

  /// Parts that lost their support since the last call; their mass has left the structure.
  virtual std::vector<Fragment> take_fragments() = 0;
  /// Mass of the parts that take_fragments() would give as blocks, all together, its share of the whole, and
  /// where their centroid was as built; they stay. 0 unless cracks or bearings have gone on since the last
  /// call.
  struct Unsupported {
    double mass = 0, share = 0;
    Vec3 centroid = Vec3::Zero();
  };  // [kg], 1, [m]
  virtual Unsupported unsupported() = 0;

  /// All history as plain doubles; restore() brings back the same bits. Of several ranks the first has it.
  void save(std::vector<double>& state) const { write(state, false); }
  void restore(std::span<const double> state) { read(state, false); }
  /// The same of what this process holds alone. All of several ranks call these together.
  void save_here(std::vector<double>& state) const { write(state, true); }
  void restore_here(std::span<const double> state) { read(state, true); }
  /// A new history at t = 0 from the present state: displacement, velocity and damage stay, works start from
  /// zero.
  virtual void start_over() = 0;

  /// Nodal and cell fields for output, or a part of them: hexahedra (8 nodes, VTK order), displacement,
  /// velocity, damage per cell.
  struct Snapshot {
    std::vector<Vec3> nodes;                   // reference positions
    std::vector<std::array<int, 8>> hexes;     // only live cells
    std::vector<Vec3> displacement, velocity;  // per node
    std::vector<double> damage_tension, damage_compression, stress_von_mises,
        crack_width;                       // per hex; crack_width [m]
    std::vector<std::array<int, 2>> bars;  // rebar segments, nodes of their own positions
    std::vector<Vec3> bar_points;
    std::vector<double> bar_strain, bar_stress;  // per segment, stress [Pa]
    std::vector<double> bar_state;               // 0 elastic, 1 has yielded, 2 broken
  };
  using TakePart = std::function<void(const Snapshot&)>;
  /// The same in parts, some thousand nodes, cells or bars each, in the order and with the numbers of the
  /// whole: nodes, hexes and bars; then all values. Of several ranks all call them together, and each is
  /// given every part.
  virtual void shape(const TakePart& take) const = 0;
  virtual void values(const TakePart& take) const = 0;
  Snapshot snapshot() const;
  std::vector<Vec3> built_nodes() const;  // reference positions of all
  /// Where fields come from: a structure, or a snapshot of one.
  struct Fields {
    std::function<void(const TakePart&)> shape, values;
  };
  Fields fields() const;
  static Fields fields(Snapshot snapshot);

 private:
  virtual void write(std::vector<double>& state, bool here) const = 0;
  virtual void read(std::span<const double> state, bool here) = 0;
};

/// Signature of the function that the finite-element module exports as "talus_make_structure".
/// gravity [m/s^2]; `report` receives lines for the log. Throws InputError (bad mesh, bars outside
/// concrete...).
using MakeStructure = Structure* (*)(const StructureSpec&, const Vec3& gravity,
                                     const std::function<void(const std::string&)>& report);

/// Loads the module beside the executable (or in TALUS_MODULE_DIR) and makes a structure; a scene without a
/// structure never calls it.
std::unique_ptr<Structure> load_structure(const StructureSpec&, const Vec3& gravity,
                                          const std::function<void(const std::string&)>& report);

}  // namespace talus
