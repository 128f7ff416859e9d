/// Tolerances of contact among blocks and of their steps that no law of the scene gives. All are relative, to
/// a size, a speed or `simulation.accuracy`. Not here: those of structures' surfaces (skin_*.cpp,
/// touch_*.cpp), of the solver (solver_*.cpp) and of how closely it solves
/// (coupling/solution/solve_settings.cpp), which stand there.
///
/// L  size of the smallest block of an island [m]     V  speed of an island, at least (g L)^(1/2) [m/s]
/// r  radius of a block [m]                           d  inradius of the thinner of two blocks [m]
///
/// `talus verify invariants/G13-tolerances` meets closed forms of blocks on planes to the accuracy with each
/// of them a tenth and ten times as large; piles, terrain and structures are not among these
/// (docs/theory/tolerances.md has this list as a table).
#pragma once
#include <span>
#include <string>
#include <string_view>

namespace talus::contact {

inline double square(double x) { return x * x; }

// X(name, value, what it is relative to, why)
#define TALUS_TOLERANCES(X)                                                                                 \
  /* Time */                                                                                                \
  X(same_instant, 1e-9, "macro step or step",                                                               \
    "times closer to each other are the same, so that no step of that length is taken")                     \
  X(time_round_off, 1e-12, "macro step", "a remaining interval this short is none")                         \
  /* Speeds */                                                                                              \
  X(still, 1e-9, "V", "slower is the round-off of a solution to 1e-12 of V with a thousand contacts")       \
  X(slips, 1e-6, "V",                                                                                       \
    "slower slip has no direction that friction could turn with, no approach to rebound from")              \
  X(pressed_still, 1e-4, "V", "what was pressed in the last step parts no faster by the error of a step")   \
  X(lowest_bounce, 0.03, "accuracy V", "an error u acts over L/V: a thirtieth of what the accuracy allows") \
  X(gentle_height, 0.1, "accuracy L", "a rebound to this height is beneath the accuracy")                   \
  X(gentle_speed, 0.1, "accuracy V", "the same without gravity")                                            \
  X(rest_fall, 1e-6, "g h", "what rests moves slower: a millionth of what it would fall by in the step")    \
  X(gives, 1e-2, "g h", "contacts that give by 1e-5 of what bodies fall by leave them less, if they rest")  \
  /* Gaps */                                                                                                \
  X(touch_gap, 1e-7, "L", "closed: far above round-off at a kilometre, far below any accuracy")             \
  X(near_gap, 1e-3, "accuracy L", "closed as well, if it moves slower than a bounce that shows")            \
  X(located_gap, 1e-10, "L", "how near to the surface an impact is located")                                \
  X(flush, 1e-8, "L", "lower steps between neighbouring faces are none")                                    \
  X(row_reach, 5e-3, "L", "nearer contact points enter the equations of a step that locates no events")     \
  X(listed_near, 2e-3, "L",                                                                                 \
    "contact points of hard ground as near are kept: twice what the drift looks for")                       \
  X(drift_near, 1e-3, "L", "nearer contact points enter the correction of drift")                           \
  X(overlap_none, 1e-9, "L", "overlap at the start of a step that the guard of corrections does not count") \
  X(late_overlap, 1e-3, "L", "overlap of hollow blocks beyond their motion that is left where it is")       \
  X(cluster_gap, 1e-5, "r", "what is as near belongs to one island")                                        \
  X(bonded_gap, 1e-6, "r", "faces as near at the start are bonded, and their springs damped together")      \
  X(unseen_way, 0.25, "d", "a pair with contacts moves no farther in a step unless its path is searched")   \
  X(through, 1e-3, "d", "depth at which a pair with hard contacts has gone into each other")                \
  X(through_springs, 2e-2, "d", "the same of a pair on springs")                                            \
  X(same_point, 1e-4, "L", "a contact point that has moved less is what it was")                            \
  X(carried_way, 3e-3, "r", "as far points of a pair that touches are carried along before it is searched") \
  X(skin_ahead, 0.15, "r", "nearer vertices of a structure's boundary surface are watched one by one")      \
  X(woken_by, 1e-3, "r", "displacement of a structure's boundary surface that wakes blocks at rest on it")  \
  X(on_skin, 1e-2, "r", "a point as near to a new piece lies on its surface")                               \
  X(structure_near, 2e-2, "L",                                                                              \
    "a contact point at a structure that comes nearer within the step enters its equations")                \
  X(same_place, 1e-9, "r, or sides of a face",                                                              \
    "points as near to each other are one; a shared side belongs to both")                                  \
  X(far_off, 1e-15, "largest coordinate", "round-off of places far from the origin")                        \
  /* Drift */                                                                                               \
  X(drift, 1e-9, "d", "overlap that is corrected")                                                          \
  X(drift_at_structures, 2e-2, "accuracy d",                                                                \
    "the same in explicit sub-steps, which drift by less than shows")                                       \
  X(recovery, 1e-3, "way of the fastest", "by which an overlap with a structure is taken off in a step")    \
  X(bound_aim, 0.25, "drift", "the correction aims beyond the surface by as much, so that it ends outside") \
  /* Impulses */                                                                                            \
  X(at_bound, 1e-9, "Coulomb bound", "an impulse as near to its bound slides, or is torn")                  \
  X(bond_yields, 1e-3, "bond's bound", "the same of a bond that may break: more than its solution leaves")  \
  X(follows_law, 1e-6, "impulse", "how well the force of a spring's row meets its law")                     \
  X(same_stiffness, 1e-9, "stiffness, energy", "springs as alike are the same, an energy as small is none") \
  X(level_law, 1e-6, "stiffness", "least slope of a contact equation where a law is level")                 \
  X(solved, 0.1, "accuracy", "part of it that the residual of a contact problem may take")                  \
  X(rolling_bound, 0.1, "accuracy", "how well the bound of a rolling couple meets the normal force found")  \
  /* Error and energy of a step */                                                                          \
  X(pass_error, 0.1, "accuracy", "between the last two passes of a step, over L")                           \
  X(gain, 0.04, "accuracy", "numerical energy gain of a step, over what it moves and stores")               \
  X(stop_located, 1e-2, "pass_error",                                                                       \
    "way by which sliding on would be wrong, from which on the stop is located")                            \
  X(rocking_arm, 0.1, "accuracy L", "shift of the force of a face that bounces on springs")                 \
  X(acceleration, 0.01, "accuracy^(3/2) g",                                                                 \
    "how closely the accelerations at the ends of a step are solved")                                       \
  X(opening_energy, 1e-3, "accuracy",                                                                       \
    "energy of a spring's release within a step, over that of its approach")                                \
  /* Angles */                                                                                              \
  X(crossed, 0.05, "sine", "edges nearer to parallel meet at a point that goes far with little motion")     \
  X(same_normal, 1e-6, "sine", "a normal is that of two edges, or of a face")                               \
  X(true_edge, 1e-9, "sine", "faces nearer to coplanar have no edge between them")                          \
  X(parallel, 0.02, "radian", "faces nearer to parallel press on an area (1.15 degrees)")                   \
  X(nearly_flat, 0.0872, "radian", "faces up to 5 degrees apart are completed to a manifold")               \
  X(lean, 0.02, "sine", "an edge or face leaning less has its corners as contacts")                         \
  X(steep, 0.17, "sine", "an edge that falls more from a vertex is none of contact (10 degrees)")

struct Tolerances {
#define TALUS_TOLERANCE(name, value, of, why) double name = value;
  TALUS_TOLERANCES(TALUS_TOLERANCE)
#undef TALUS_TOLERANCE
  /// Cosines of the angles, to the fourth power of these.
  double parallel_cosine() const { return 1 - 0.5 * parallel * parallel; }
  double nearly_flat_cosine() const { return 1 - 0.5 * nearly_flat * nearly_flat; }
};

namespace detail {
inline Tolerances tolerances_in_use;
}

/// Those in use. Nobody changes them but tests.
inline const Tolerances& tolerances() { return detail::tolerances_in_use; }

/// Others, until it is destroyed. Nothing else may run meanwhile.
class OtherTolerances {
 public:
  explicit OtherTolerances(const Tolerances& others) : before_(detail::tolerances_in_use) {
    detail::tolerances_in_use = others;
  }
  ~OtherTolerances() { detail::tolerances_in_use = before_; }
  OtherTolerances(const OtherTolerances&) = delete;
  OtherTolerances& operator=(const OtherTolerances&) = delete;

 private:
  Tolerances before_;
};

struct ToleranceInfo {
  std::string_view name;
  double Tolerances::*value;
  std::string_view relative_to, why;
};

/// The list above, in its order.
std::span<const ToleranceInfo> list_of_tolerances();

/// The same as a page, docs/theory/tolerances.md.
std::string tolerances_markdown();

}  // namespace talus::contact
