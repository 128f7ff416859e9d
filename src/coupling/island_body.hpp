/// Private parts of IslandStepper.
#pragma once
#include "coupling/island.hpp"

namespace talus::coupling {

/// One block of the island during a step.
struct IslandStepper::Body {
  int block = 0;
  int ndof = 6;
  bool end_rule = false;               // position and strain by the velocity at the end: a force at the end of the step acts on it
  // start of the step
  Pose start;
  Quat q0 = Quat::Identity();
  Mat3 rotation0 = Mat3::Identity();
  Vec12 v0 = Vec12::Zero();
  Vec6 eps0 = Vec6::Zero();
  Vec3 momentum0 = Vec3::Zero();      // angular, about the centroid
  double internal0 = 0;                // energy of turning and straining [J]
  dda::FreeFlow free;
  // where the contacts are linearised: free flow first, then the result of the last pass
  Pose ref;                            // at the end
  Vec12 v_ref = Vec12::Zero();
  Vec3 turn = Vec3::Zero();            // rotation vector start -> end
  Mat3 half_turn = Mat3::Identity(), full_turn = Mat3::Identity();
  Vec3 mid_c = Vec3::Zero();
  Mat3 carry = Mat3::Identity();       // ref.F start.F^-1
  // result
  Vec12 impulse = Vec12::Zero();       // sum J^T p
  Vec12 shift = Vec12::Zero();         // sum theta A^-1 J^T p
  Mat3 along = Mat3::Identity();       // projector on the directions that no spring at the end of the step holds
  Vec12 v_solved = Vec12::Zero();      // v_hat + A^-1 sum J^T p

  Vec3 at_mid(const Vec3& x) const { return mid_c + half_turn * (x - start.c); }
  Vec3 at_end(const Vec3& x) const { return ref.c + carry * (x - start.c); }
  Vec3 velocity_at_end(const Vec3& x_end) const {
    Vec3 v = v_ref.head<3>() + v_ref.segment<3>(3).cross(x_end - ref.c);
    if (ndof == 12)
      v += (full_turn * rotation0) *
           (dda::strain_tensor(v_ref.tail<6>()) * (ref.F.inverse() * (x_end - ref.c)));
    return v;
  }
};

struct IslandStepper::Saved {
  Vec3 c, v, w;
  Quat q;
  Vec6 eps, eps_rate;
};

struct IslandStepper::Outcome {
  bool ok = false;
  double error = 0;   // between the last two passes, relative to block size
};

/// A step while it is tried: what is asked of it, and what the tries so far have taught.
struct IslandStepper::Trial {
  double start = 0;                  // [s]
  double remaining = 0;              // of the stretch [s]
  double h = 0;                      // [s]
  bool lumped = false;               // onsets are rows, not events
  bool closed = false;               // something touches at its start
  bool adaptive = false;             // event driven, its length by error control
  int passes = 1;
  int releases = 0, cuts = 0, halved = 0, refined = 0;
  std::vector<Vec3> slip_before;     // per touch at the start [m/s]
  int stopping = -1;                 // touch whose sliding stops within the step
  bool stop_located = false;
};

/// Rolling resistance: after the rows of all touches, one contact per touch that has it, in the touches' order. Its tangential rows are
/// the rolling velocities R (w_b - w_a) . t, its impulse p_t = couple / R, at most mu_r p_n of the touch in the pass before.
inline bool resists_rolling(const Touch& t) { return t.row >= 0 && t.rolls; }

/// Calls use(touch, contact) for the rolling rows of a problem, none if it was assembled without.
template <class Use>
void each_rolling(std::span<Touch> touches, contact::ContactProblem& problem, Use&& use) {
  std::size_t next = 0;
  for (const Touch& t : touches) next += t.row >= 0 ? 1 : 0;
  for (Touch& t : touches)
    if (resists_rolling(t) && next < problem.contacts.size()) use(t, problem.contacts[next++]);
}

/// Which body carries the normal: the one whose face it is, or neither (crossing edges).
enum class NormalOwner { a, b, edges };
NormalOwner normal_owner(const Touch& touch, const dda::Model& model, const Environment& environment, const Pose* pose_a);

}  // namespace talus::coupling
