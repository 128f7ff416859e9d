/// Private parts of IslandStepper.
#pragma once
#include <algorithm>
#include <span>

#include "contact/parallel.hpp"
#include "contact/tolerances.hpp"
#include "coupling/island.hpp"
#include "coupling/step/accelerations.hpp"
#include "coupling/step/approach.hpp"
#include "coupling/step/bodies.hpp"
#include "coupling/step/bonds.hpp"
#include "coupling/step/condensed.hpp"
#include "coupling/step/contact_search.hpp"
#include "coupling/step/drag.hpp"
#include "coupling/step/drift_guard.hpp"
#include "coupling/step/leapfrog.hpp"
#include "coupling/step/memory.hpp"
#include "coupling/step/quasistatic.hpp"
#include "coupling/step/rolling.hpp"
#include "coupling/step/slip_direction.hpp"
#include "coupling/step/smooth.hpp"
#include "coupling/step/spring_energy.hpp"
#include "coupling/step/spring_limits.hpp"
#include "coupling/step/spring_rows.hpp"
#include "coupling/step/spring_rules.hpp"
#include "coupling/step/update.hpp"

namespace talus::coupling {

/// Whether an impulse is at the bound of Coulomb's law, |p_t| = mu p_n + c.
inline bool at_coulomb_bound(const contact::ProblemContact& c, const Vec3& impulse) {
  const double bound = c.friction * impulse[0] + c.cohesion;
  return impulse.tail<2>().norm() >= bound * (1 - contact::tolerances().at_bound);
}

struct IslandStepper::Outcome {
  bool ok = false;
  double error = 0;  // between the last two passes, relative to block size
};

/// A step while it is tried: what is asked of it, and what the tries so far have taught.
struct IslandStepper::Trial {
  double start = 0;      // [s]
  double remaining = 0;  // of the stretch [s]
  double h = 0;          // [s]
  double usual = 0;  // length by what may move, where all stand still and the step is the rest of the stretch
                     // [s]; else 0
  bool lumped = false;    // onsets are rows, not events
  bool closed = false;    // something touches at its start
  bool adaptive = false;  // event driven, its length by error control
  int passes = 1;
  int releases = 0, cuts = 0, halved = 0, refined = 0;
  int stopping = -1;  // touch whose sliding stops within the step
  bool stop_located = false;
  bool at_layer = false;  // ends where a block goes into vegetation or comes out of it
  double asked = 0;       // first length tried [s]
  double holds = 0,
         breaks = 0;  // lengths over which all bonds hold, over which one breaks; 0: none tried [s]
};

/// Speed below which a block counts as at rest, in a step of length h [m/s].
inline double still_speed(const dda::Model& model, double h) {
  return contact::tolerances().rest_fall * model.gravity.norm() * h;
}

/// True if no point of the blocks moves faster than `still` [m/s].
inline bool stand(const dda::Model& model, const dda::State& state, std::span<const int> blocks,
                  double still) {
  return std::all_of(blocks.begin(), blocks.end(), [&](int b) {
    const auto k = static_cast<std::size_t>(b);
    return state.v[k].norm() +
               model.blocks[k].shape->radius * (state.w[k].norm() + state.eps_rate[k].norm()) <=
           still;
  });
}

/// Rolling and drilling resistance: after the rows of all touches, a contact for each of the two that a touch
/// has, in the touches' order. The tangential rows are R (w_b - w_a) . t, of drilling R (w_b - w_a) . n; the
/// impulse is couple / R, at most mu_r p_n (mu_d p_n) of the touch.
inline std::size_t couples(const Touch& t) {
  return t.row >= 0 && t.rolls
             ? std::size_t{t.law->rolling_resistance > 0} + std::size_t{t.law->drilling_resistance > 0}
             : 0;
}

/// Calls use(touch, resistance, contact) for these contacts of a problem, none if it was assembled without.
template <class Use>
void each_rolling(std::span<Touch> touches, contact::ContactProblem& problem, Use&& use) {
  std::size_t next = 0;
  for (const Touch& t : touches) next += t.row >= 0 ? 1 : 0;
  for (Touch& t : touches) {
    if (couples(t) == 0) continue;
    for (const double resistance : {t.law->rolling_resistance, t.law->drilling_resistance})
      if (resistance > 0 && next < problem.contacts.size()) use(t, resistance, problem.contacts[next++]);
  }
}

/// Calls use(contact) for the rows of fixed points, which follow all others; none if the problem was
/// assembled without.
template <class Use>
void each_held(std::span<const Touch> touches, contact::ContactProblem& problem, Use&& use) {
  std::size_t first = 0;
  for (const Touch& t : touches) first += (t.row >= 0 ? 1u : 0u) + couples(t);
  for (std::size_t i = first; i < problem.contacts.size(); ++i) use(problem.contacts[i]);
}

/// 3 x ndof block of a contact row: sign * frame^T T(x), column major. Arm x - c in world axes, `strain_map`
/// its way back to body axes.
void write_jacobian(double* to, const Mat3& frame, const Vec3& arm, const Mat3& strain_map,
                    const Mat3& rotation, int ndof, double sign);

/// Points of blocks that stay where they are: a row each after all others, of a contact that pulls and shears
/// as much as it must (`bound` [N s]). At rest at the end of the step (h = 0: of the impulse). The
/// trapezoid's drift is not led back by speed, whose energy a short step after a long one would make without
/// bound, but by the projection.
template <class Bodies>
void add_held_rows(contact::ContactProblem& problem, const dda::Model& model, const Bodies& bodies, double h,
                   double bound) {
  for (std::size_t l = 0; l < bodies.size(); ++l) {
    const auto& b = bodies[l];
    const dda::Model::Block& block = model.blocks[static_cast<std::size_t>(b.block)];
    for (std::size_t i = 0; i < block.fixed_points.size(); ++i) {
      const Vec3 x = b.start.c + b.start.F * block.fixed_points[i], mid = b.at_mid(x);
      contact::ProblemContact c;
      c.first_term = static_cast<int>(problem.terms.size());
      c.terms = 1;
      const int offset = static_cast<int>(problem.jacobians.size());
      problem.jacobians.resize(problem.jacobians.size() + 3 * static_cast<std::size_t>(b.ndof));
      write_jacobian(problem.jacobians.data() + offset, Mat3::Identity(), mid - b.mid_c,
                     b.start.F.inverse() * b.half_turn.transpose(), b.half_turn * b.rotation0, b.ndof, 1);
      problem.terms.push_back({static_cast<int>(l), offset});
      const Vec3 u_ref = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>>(
                             problem.jacobians.data() + offset, 3, b.ndof) *
                         b.v_ref.head(b.ndof);
      if (h > 0) c.bias = b.velocity_at_end(b.at_end(x)) - u_ref;
      c.cohesion = c.tension = bound;
      problem.contacts.push_back(c);
    }
  }
}

/// How far each fixed point of the blocks is from its place, in the order of their rows: use(x - place) [m].
template <class Bodies, class Use>
void each_drift(const dda::Model& model, const dda::State& state, const Bodies& bodies, Use&& use) {
  for (const auto& b : bodies) {
    const dda::Model::Block& block = model.blocks[static_cast<std::size_t>(b.block)];
    if (block.fixed_points.empty()) continue;
    const Pose now = dda::pose(state, b.block);
    for (std::size_t i = 0; i < block.fixed_points.size(); ++i)
      use(Vec3(now.c + now.F * block.fixed_points[i] - block.fixed_points_world[i]));
  }
}

/// Row n . T(x) of a block's generalised velocity: that of its point x (world) along n. Arm r = x - c;
/// `strain_map` is F^-1.
Vec12 point_row(const dda::Model::Block& block, const Mat3& rotation, const Mat3& strain_map, const Vec3& r,
                const Vec3& n);

/// Which body carries the normal: the one whose face it is, or neither (crossing edges).
enum class NormalOwner { a, b, edges };
NormalOwner normal_owner(const Touch& touch, const dda::Model& model, const Environment& environment,
                         const Pose* pose_a);

/// Where the impulse between two points acts: at that of the side that does not own the normal, or in the
/// middle.
inline Vec3 acts_between(NormalOwner owner, const Vec3& a, const Vec3& b) {
  return owner == NormalOwner::a ? b : owner == NormalOwner::b ? a : Vec3(0.5 * (a + b));
}

}  // namespace talus::coupling
