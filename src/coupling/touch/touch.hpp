/// One point where block B touches a partner A (another block, a plane, the terrain, the skin of a
/// structure), found at the start of the step, and how the step treats it.
///
///   mode           law over the step of length h                                 position weight theta
///   closed         u_n^+ >= 0, tangential Coulomb on u_t^+                       1/2 (trapezoid)
///   end            g + h u_n^+ >= 0 (onset in the step, or held at its end)      1
///   spring_mean    p = h (mean force over the step) while h sqrt(k/m) < 0.5      1/2
///   spring_end     p = h (force at the end of the step), its loss algorithmic    1
///   spring_secant  p = h (U(d_np) - U(d_0)) / (d_np - d_0), no loss              1
///   bilateral      fixed point: u^+ = -drift                                     1/2
///
/// spring_end of a block that others press: less the part of the force that is the other side's motion, with
/// theta 1/2 for the blocks that the step resolves (springs/quasistatic.cpp). spring_secant: d = -g, at a
/// structure, whose velocities live at half steps; d_0 is of the step before.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "contact/laws/normal_law.hpp"
#include "coupling/environment.hpp"
#include "dda/state.hpp"

namespace talus::coupling {

enum class Mode : std::uint8_t { idle, closed, end, spring_mean, spring_end, spring_secant };

/// What a facet of a block crushed of a cell of a structure's face (craters.hpp).
struct Crater {
  std::uint64_t feature = 0;  // ContactMemory::feature
  Vec3 floor = Vec3::Zero();  // plane [m, 1, 1]
  double depth = 0;           // greatest of the cell [m]
};

/// Of a touch that goes on from none.
constexpr std::uint64_t no_feature = born_inside;

/// The springs of a contact point, as they are at the start of a step.
struct TouchSpring {
  double stiffness =
      0;  // k_n of this point [N/m], 0: hard; of a curved law its tangent where the contact will work
  contact::NormalLaw normal_law;      // if stiffness > 0
  Vec3 corner_normal = Vec3::Zero();  // of the cell of its corner, ContactMemory::corner_normal
  double shear_stiffness = 0;
  double dashpot = 0;  // its share of 2 zeta sqrt(K m), K of the pair's closed points, m in series [N s/m]
  double rate_sq = 0;  // bound on the square of the fastest frequency that the spring takes part in [1/s^2]
  double swing_rate = 0;  // of the fastest of its oscillations that the accuracy asks to be resolved, as the
                          // root of rate_sq [1/s]
  double swing_speed =
      0;  // amplitude of the speed of that oscillation, by its present speed and acceleration [m/s]
  double quiet_speed =
      0;  // normal speed below which an oscillation on the spring is beneath the accuracy asked for [m/s]
  bool energetic = false;         // it oscillates, or will, by more than that
  Mode spring = Mode::idle;       // rule of this step if it is sprung
  Vec3 shear = Vec3::Zero();      // shear spring at the start, world [m]
  Vec3 shear_way = Vec3::Zero();  // by which the step before stretched it, world [m]
  bool shears_by_half = false;    // its force is that between the half steps, without loss (shear_row())
  double stored = 0;              // energy of its springs at the start, as the ledger counts it [J],
  double sheared = 0;             // of which its shear spring's
  double lasted = 0;              // length of the leapfrog's step before, 0: none known [s]
  std::uint64_t goes_on_from = no_feature;  // ContactMemory::feature
  double offset = 0;            // gap less the geometric one: springs at a structure, pieces born inside [m]
  std::vector<Crater> craters;  // of the face it presses on, a crushing bed's
  double crushed = 0;           // of its columns in the step before [J],
  double crushed_ahead = 0;     // of which the ledger had so much [J]
  double of_part = 1;           // share of its part of a bed that one of several points carries
};

/// Its row in the contact problem, filled by the assembly, and the solution.
struct TouchRow {
  Mode mode = Mode::idle;
  Vec3 normal = Vec3::UnitZ();    // at mid-step
  Mat3 frame = Mat3::Identity();  // columns n, t1, t2 at mid-step
  Vec3 acts_at = Vec3::Zero();    // where the impulse acts on both sides at the start [m]
  double theta = 0.5;
  int row = -1;        // contact index in the problem
  int couple_of = -1;  // that of the step's touches whose rolling couple this one takes part in; -1: its own
  double gap_ref = 0, u_ref = 0;  // gap and normal velocity at the end of the linearisation [m], [m/s]
  double indentation = 0;     // at the end of the step by the last solution, where the law is linearised [m]
  double balanced_force = 0;  // by which a spring_end of a block that others press acts over the step, by the
                              // last solution (springs/quasistatic.cpp) [N]
  Vec3 impulse = Vec3::Zero();  // solution in the frame [N s]
  double ploughing = 0;         // part of the row's cohesion that the ground in the way gives [N s]
  Vec3 slip = Vec3::Zero();     // at the start of the step, of what presses by the trapezoid in a step of
                                // events, world [m/s]
  Eigen::Vector2d slip_row = Eigen::Vector2d::Zero();  // the same along the row's tangents [m/s]
  bool swings =
      false;  // it slides through the step: friction opposes the mean of the slips at its start and its end
};

struct Touch : TouchSpring, TouchRow {
  Partner a;
  int b = 0;  // block, -1: a node of structure `b_structure`
  int b_structure = -1, b_node = -1;
  contact::ContactPoint at;  // gap > 0 open, normal out of A
  const ContactLaw* law = nullptr;
  double approach = 0;  // normal relative velocity at the start, < 0 approaching [m/s]
  double sooner = 0;  // what it was more in the half step before, where a block at a structure strains [m/s]
  Vec3 warm = Vec3::Zero();  // last mean force, world [N]
  bool broken = false;
  bool glued = false;       // closed since the start, or one of a pair that is: it holds in tension too
  bool on_edge = false;     // face_a was looked up: the contact is with an edge or vertex of A
  bool persistent = false;  // carried force in the last step
  bool rolls = false;       // it resists rolling or drilling
  bool met = false;         // a solution of this step met it: it is a row
  BondedAt bonded{};
  double bond_cohesion = 0, bond_tension = 0;  // rock bridge [Pa]
  double width = 0;  // its part of the width of the pair's contact, where the law ploughs [m]
  /// Tension that the bond holds, cut off where the cone of friction and cohesion ends; 0: none, or broken
  /// [N].
  double bond() const;
  /// What it bears along the surface without friction, and across it; 0: none, or lost for good [N].
  double cohesion() const { return broken ? 0.0 : (law->cohesion + (glued ? bond_cohesion : 0.0)) * at.area; }
  double tension() const { return glued && !broken ? (law->tension + bond_tension) * at.area : 0.0; }
  /// A linear spring under a bond, between blocks or at what stands fast: it pulls as it presses. On a
  /// structure a bond is hard, whatever the law.
  bool pulls() const {
    return glued && stiffness > 0 && a.kind != Partner::Kind::structure &&
           law->kind == ContactLaw::Kind::linear && bond() > 0;
  }
  /// A hard bond at known points: both ways, it keeps the gap closed.
  bool holds() const { return stiffness == 0 && bonded.area > 0 && bond() > 0; }
};

/// What a crushing bed crushes is told by its craters.
inline bool booked_by_craters(const Touch& t) { return t.normal_law.bed && t.law->crushes(); }

/// Energy of a spring that pulls, stretched by -depth [J].
inline double pull_energy(const Touch& t, double depth) {
  return 0.5 * t.normal_law.stiffness * depth * depth;
}

/// Deterministic right-handed frame with n as first column.
Mat3 contact_frame(const Vec3& n);

/// Gap up to which a block counts as bonded to the skin of a structure from the start, and is held where it
/// is: gravity's preload has moved the skin [m].
inline double bond_gap(const Polyhedron& block) { return 1e-3 * block.radius; }

/// A candidate pair from the broad phase.
struct CandidatePair {
  Partner a;
  int b = 0;
};

/// A point that a search has found, before its law and history are asked.
struct FoundPoint {
  contact::ContactPoint at;
  bool on_edge = false;  // face_a was looked up: the contact is with an edge or vertex of A
};

/// True if the pair's law is a pressure of a cushion on faces (touch_bed.hpp), whose search is its own.
bool presses_on_bed(const dda::Model&, const Environment&, const CandidatePair&);

/// Appends what a pair without a bed has within the margin; and the touches of such points at the present
/// state.
void find_points(const dda::Model&, const dda::State&, const Environment&, const CandidatePair&,
                 double margin, std::vector<FoundPoint>& out);
void make_touches(const dda::Model&, const dda::State&, const Environment&, const CandidatePair&,
                  std::span<const FoundPoint> points, const ContactHistory&, std::vector<Touch>& out);

/// Where a closed face contact is bonded from now on; and that point as a search would find it. The one that
/// touches first is A.
BondedAt bonded_here(const dda::State&, const Touch&);
contact::ContactPoint bonded_point(const dda::State&, const CandidatePair&, const ContactMemory&);

/// Whether a part of a bed stands on four points (touch_bed.hpp), by the one that it would stand on.
using Tilts = std::function<bool(const Touch&)>;

/// Appends all touches of the pair with gap <= margin at the present state. `tilts`: none where empty.
void find_touches(const dda::Model&, const dda::State&, const Environment&, const CandidatePair&,
                  double margin, const ContactHistory&, std::vector<Touch>& out, const Tilts& tilts = {});

/// What the nodes of structure b's skin may touch: the faces of another structure's, or a ground.
struct SurfacePair {
  Partner a;
  int b = 0;
};

/// The same for such a pair, nodes with |gap| <= reach; `history` is per structure b.
void find_surface_touches(const Environment&, const SurfacePair&, double reach, const ContactHistory& history,
                          std::vector<Touch>& out);

/// Edge of the face that a triangle of a skin belongs to (four triangles to a face), and the longest of all
/// [m].
double face_edge(const TriangleSurface&, int triangle);
double face_edge(const TriangleSurface&);

/// Velocity of the material point of A or B at x (world) in the present state.
Vec3 point_velocity(const dda::State&, int block, const Vec3& x);
Vec3 partner_velocity(const dda::State&, const Environment&, const Touch&);

/// Barycentric weights of x on triangle t of the surface, mapped to structure nodes (up to 3 x 4 entries).
struct SurfaceWeights {
  int count = 0;
  std::array<int, 12> node{};
  std::array<double, 12> weight{};
};
SurfaceWeights surface_weights(const TriangleSurface&, int triangle, const Vec3& x);

/// Gradients of these weights along the triangle, one for each entry [1/m].
std::array<Vec3, 12> weight_gradients(const TriangleSurface&, int triangle, const SurfaceWeights&);

/// The same for a touch at a skin: by the face's mean plane where it is of a bed, whose columns stand on
/// that.
SurfaceWeights skin_weights(const Touch&, const TriangleSurface&, const Vec3& x);

}  // namespace talus::coupling
