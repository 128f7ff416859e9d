/// What the recorder is handed: plain arrays in the order of interface.md. Produced by sim, written by io.
#pragma once
#include <string>
#include <vector>

#include "contact/geometry/polyhedron.hpp"
#include "contact/geometry/surface.hpp"
#include "contact/structures/structure.hpp"
#include "core/types.hpp"
#include "coupling/counters.hpp"
#include "coupling/motion/motion.hpp"

namespace talus::sim {

/// Fixed once at the start (and again when fragments are born: `blocks` grows at the end).
struct RunHeader {
  std::string title;
  double duration = 0;
  std::string crs;  // coordinate reference system of the terrain, "EPSG:31254" or WKT; empty: not known
  Vec3 map_origin = Vec3::Zero();  // map coordinates of the scene's origin [m]
  struct BlockInfo {
    std::string name;
    double mass = 0;
    double volume = 0;
    bool fixed = false;
    bool fragment = false;
    Polyhedron shape;               // body axes
    double young = 0, poisson = 0;  // of its material [Pa], 1; 0: rigid
    int from = -1;                  // fragment: the structure it came off
    double crushed = 0;             // fragment: as Fragment::crushed [kg]
  };
  std::vector<BlockInfo> blocks;
  TriangleSurface terrain;  // empty if none (decimated for the report by io)
  double terrain_cell = 0;  // of the grid that it is read from; 0: not known, or none [m]
  std::vector<Plane> planes;
  struct StructureInfo {
    std::string name;
    std::vector<std::string> probes;
    std::vector<Vec3> probe_at;
    std::string plan;
    std::vector<Member> members;
    double young = 0, poisson = 0, f_cm = 0;  // of its material [Pa], 1, [Pa]; 0: not given
    bool loaded = false;                      // by a prescribed traction
    // For the design formulas: along each axis of a section (world unit vectors), for a blow along it; empty
    // or 0: not known.
    std::vector<Vec3> axes;
    Vec3 effective_depth = Vec3::Zero(), reinforcement_ratio = Vec3::Zero();  // [m], 1
    std::string form;               // column, beam, slab, viaduct, mesh: what words fit
    bool cushion = false;           // a block meets it through a law that crushes or is tabulated
    std::vector<int> meets;         // structures that it can touch: their materials have a law
    Vec6 permanent = Vec6::Zero();  // force and moment on its supports under permanent load [N], [N m]
    bool told_permanent = false;    // not in what earlier versions wrote
    double load_until = 0;          // when its prescribed tractions end; beyond the run: they do not [s]
  };
  std::vector<StructureInfo> structures;
  std::vector<std::string> materials;
  std::vector<std::string> plan;      // what is computed and what is left out, one line per fact
  std::vector<std::string> warnings;  // of the scene and of what was built from it, a sentence each
  bool prescribed_impact = false;     // talus impact: a block that is there to strike
};

/// Energies in J, cumulative work since the start; dissipation positive (interface.md).
struct LedgerRow {
  double kinetic = 0, potential = 0, strain = 0, contact = 0;
  double friction_work = 0, damping_work = 0, damage_work = 0, algorithmic = 0, external_work = 0,
         residual = 0;
  double yield_work = 0, ploughing_work = 0, vegetation_work = 0;  // of ground laws
  double dissipated() const {
    return friction_work + damping_work + damage_work + yield_work + ploughing_work + vegetation_work +
           algorithmic;
  }
  double step_dependence = 0;  // part of `algorithmic` that is no loss: what energies of structures in
                               // explicit steps read lower by for the length of their steps
  /// Numerical dissipation (> 0) or numerical energy gain (< 0) of the time integration and of contact [J].
  double numerical_dissipation() const { return algorithmic - step_dependence; }
  Vec3 linear_momentum = Vec3::Zero(), angular_momentum = Vec3::Zero();
};

/// One instant of the histories. Arrays are per block in the header's order; NaN before birth.
struct HistoryRow {
  double time = 0;
  std::vector<Vec3> position, velocity, spin;
  std::vector<Eigen::Vector4d> orientation;  // w, x, y, z
  std::vector<Vec6> strain;
  std::vector<double> kinetic_translational, kinetic_rotational;
  std::vector<coupling::MotionPeaks> peaks;  // over the steps up to this row; empty: not kept
  double kinetic_peak = 0;                   // of the whole model, likewise [J]
  struct StructureRow {
    Vec3 base_force, base_moment;
    std::vector<Vec3> probe_displacement;
    double damage_max = 0, damaged_volume = 0, spalled_volume = 0;
    std::vector<MemberState> members;
    LoadPeaks peaks;
  };
  std::vector<StructureRow> structures;
  LedgerRow ledger;
};

/// One contact on a structure in one coupled step; force acts on the structure, mean over (time - dt, time].
struct ContactRow {
  double time = 0, dt = 0;
  int block = 0, structure = 0;
  Vec3 point = Vec3::Zero(), force = Vec3::Zero(), normal = Vec3::Zero();
  double area = 0;
  coupling::Arrival arrival;  // of the block
};

/// Step statistics for the progress line, log and summary.
struct RunCounters {
  long steps = 0, rejected = 0, contacts = 0, newton = 0, sweeps = 0, outer = 0, impacts = 0;
  long newton_method = 0, interior_point = 0, above_tolerance = 0, halved = 0, convex = 0;
  long asleep_skipped = 0, flight_closed_form = 0, structure_steps = 0, condensed_steps = 0,
       structure_asleep = 0;
  double worst_residual = 0;                // exact-Coulomb, relative
  double worst_penetration = 0;             // [m]
  double crush_depth = 0, crush_share = 0;  // greatest depth crushed [m], and over the thickness of its layer
  double gained = 0, worst_gain = 0,
         undone = 0;            // energy made by steps, by the worst of them, dissipation undone [J]
  long reduced = 0;             // impacts whose restitution was lowered so that they make no energy
  double restitution_lost = 0;  // what hard contacts did not give back in steps that locate no events [J]
  double dt = 0;                // last step [s]
  int islands = 0, sleeping_blocks = 0;
  double wall_seconds = 0, cpu_seconds = 0;
};

/// Audit of the interface between blocks and structures over the run.
struct InterfaceAudit {
  double worst_force_imbalance = 0;  // |F_blocks + F_structure| / max |F|
  double worst_moment_imbalance = 0;
  double impulse_defect =
      0;  // |impulse on blocks + impulse on structures| / |the latter|, each summed over the run
  double work_on_blocks = 0, work_on_structure = 0;  // [J]
  Vec3 impulse_on_structure = Vec3::Zero();          // [N s]
  std::vector<coupling::Met> met;  // what each structure got from others; empty: none touched another
};

}  // namespace talus::sim
