/// One step of an island: its bodies, its contacts, and the contact problem that they make (theory:
/// docs/theory/contact.md, 1).
#pragma once
#include <limits>
#include <vector>

#include "contact/parallel.hpp"
#include "contact/solver/problem.hpp"
#include "coupling/step/context.hpp"

namespace talus::coupling {

/// What a range of a loop that threads share holds at least. Sums over touches and bodies are made by such
/// ranges, the same whatever the threads.
constexpr int touches_at_once = 512, bodies_at_once = 64;

/// One block of the island during a step.
struct Body {
  int block = 0;
  int ndof = 6;
  bool end_rule =
      false;  // position and strain by the velocity at the end: a force at the end of the step acts on it
  double spring_rate_sq = 0;  // sum of k J M^-1 J^T over its closed springs [1/s^2]
  bool follows = false;  // end_rule, and connected by springs to a block of the trapezoid: it follows that
                         // one quasi-statically
  Vec6 strain_lag = Vec6::Zero();  // impulse of its stress at the end less that which it follows with [J s]
  bool from_start = false;      // an onset reaches it through what presses: all its impulses of the step act
                                // from its start, x + h v^+
  bool strains_at_end = false;  // strain alone so: an onset's impulse acts on it from the start of the step,
                                // or the trapezoid would make energy
  bool guarded = false;       // in a step that is not shortened for energy made: its free flow may make none
  bool leapfrog = false;      // beside a structure in explicit steps: strain rates are those of half steps
  bool pressed = false;       // there: a hard contact holds it, so that it goes by x + h v^+ (find_pressed)
  bool at_half_step = false;  // there: its velocity at the start is that of the half step before
  double converted = 0;       // kinetic energy by conversions between full and half steps [J]
  double drag = 0;            // of the vegetation that it is in at the start of the step, eta/m [1/s]
  // start of the step
  Pose start;
  Quat q0 = Quat::Identity();
  Mat3 rotation0 = Mat3::Identity();
  Vec12 v0 = Vec12::Zero();
  Vec6 eps0 = Vec6::Zero();
  Vec3 momentum0 = Vec3::Zero();  // angular, about the centroid
  double internal0 = 0;           // energy of turning and straining [J]
  dda::FreeFlow free;
  // where the contacts are linearised: free flow first, then the result of the last pass
  Pose ref;  // at the end
  Vec12 v_ref = Vec12::Zero();
  Vec3 turn = Vec3::Zero();  // rotation vector start -> end
  Mat3 half_turn = Mat3::Identity(), full_turn = Mat3::Identity();
  Vec3 mid_c = Vec3::Zero();
  Vec3 about = Vec3::Zero();  // what rows take moments about: the point of the centroid's way that keeps the
                              // angular momentum, c_n + (1 - theta) (c_np - c_n)
  Mat3 carry = Mat3::Identity();  // ref.F start.F^-1
  // result
  Vec12 impulse = Vec12::Zero();   // sum J^T p
  Vec12 shift = Vec12::Zero();     // sum theta A^-1 J^T p
  Mat3 along = Mat3::Identity();   // projector on the directions that no spring at the end of the step holds
  Vec12 v_solved = Vec12::Zero();  // v_hat + A^-1 sum J^T p

  bool strains() const { return ndof == 12; }
  /// Mean acceleration of the translation without contacts [m/s^2].
  Vec3 free_acceleration(const Vec3& gravity) const {
    return drag > 0 ? Vec3(gravity - drag * ((1 - free.theta) * v0 + free.theta * free.velocity).head<3>())
                    : gravity;
  }
  Vec3 at_mid(const Vec3& x) const { return mid_c + half_turn * (x - start.c); }
  Vec3 at_end(const Vec3& x) const { return ref.c + carry * (x - start.c); }
  Vec3 velocity_at_end(const Vec3& x_end) const {
    Vec3 v = v_ref.head<3>() + v_ref.segment<3>(3).cross(x_end - ref.c);
    if (strains())
      v += (full_turn * rotation0) *
           (dda::strain_tensor(v_ref.tail<6>()) * (ref.F.inverse() * (x_end - ref.c)));
    return v;
  }
};

/// A structure's node that contacts press on in an explicit step: a body of the contact problem.
struct NodeBody {
  int structure, node;
  Vec3 v_hat, v_before;
  double mass;
};

/// The touched nodes of a structure in a condensed step, ascending, with their inverse mass W: one body.
struct CondensedSurface {
  int structure;
  std::vector<int> node;
  MatX inverse;
  VecX v_hat, v_before;
};

/// Weight of a row on a node that is held: the support takes its impulse.
struct HeldShare {
  int structure, node, contact;
  double weight;
  Vec3 tilt = Vec3::Zero();
};

/// What a node of a structure gets by all contacts of the step.
struct NodeShare {
  int structure, node;
  Vec3 impulse, position;
};

/// What the last contact problem's solution is good for.
struct Solution {
  bool certified = true;      // as close as a proof of rest asks
  bool stagnated = false;     // the search for it got no farther than what is taken
  double unsolved_speed = 0;  // what it leaves [m/s]
  double residual = 0;        // relative to the problem's velocity scale
};

struct Step {
  double length = 0;       // of the step being computed [s]
  double suggested = 0;    // that error control would take next [s]
  double last_length = 0;  // of the explicit one before it in this macro step, 0: none [s]
  double fastest = 0;      // of the points of its blocks at the start of the step [m/s]
  std::vector<Body> bodies;
  std::vector<dda::BlockState> saved;  // of the bodies, at its start
  std::vector<Touch> touches;          // in the order of the island's pairs
  double found_for = -1;               // step whose reach the touches cover at the present state; -1: none
  // The contact problem: bodies, then nodes or skins of structures.
  contact::ContactProblem problem;
  std::vector<NodeBody> nodes;
  std::vector<CondensedSurface>
      condensed_surfaces;  // of the condensed regime, one body each in place of nodes
  std::vector<HeldShare> held;
  std::size_t rocking_rows = 0;  // last of the problem's contacts (add_rocking_rows)
  Solution solution;
  std::vector<NodeShare> node_impulses;
  Ledger pending;             // works of the step
  bool sprung = false;        // springs act in the step, between blocks alone
  bool from_start = false;    // an onset reaches some body of the step (Body::from_start)
  bool settling = false;      // a step in which what parted slowly comes back: held where it is
  std::vector<double> ahead;  // per pair: it was met by a solution of this step, whose bodies moved so far:
                              // its touches are rows [m]; 0: not
  std::vector<char> meets_to_rebound;  // per pair: apart, and what closes within this time-stepped step is
                                       // thrown back; empty: none

  /// Calls use(body) for every body of the island, in any order, on several threads where it pays: it may
  /// write to what is that body's alone.
  template <class Use>
  void each_body(Use&& use) {
    contact::in_ranges(static_cast<int>(bodies.size()), bodies_at_once, [&](int from, int to) {
      for (int i = from; i < to; ++i) use(bodies[static_cast<std::size_t>(i)]);
    });
  }
  /// The same for every touch.
  template <class Use>
  void each_touch(Use&& use) {
    contact::in_ranges(static_cast<int>(touches.size()), touches_at_once, [&](int from, int to) {
      for (int i = from; i < to; ++i) use(touches[static_cast<std::size_t>(i)]);
    });
  }

  /// Step before this one of length h at a touch; as long where none is known [s].
  double length_before(const Touch& t, double h) const {
    return t.lasted > 0 ? t.lasted : last_length > 0 ? last_length : h;
  }
  /// From half step to half step about the start of the step, what an impulse of a leapfrog's stands for [s].
  double between_half_steps(const Touch& t, double h) const { return 0.5 * (length_before(t, h) + h); }
};

}  // namespace talus::coupling
