/// Parts of contact rows that several of a step's parts use.
#pragma once
#include <span>

#include "contact/tolerances.hpp"
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// Whether an impulse is at the bound of Coulomb's law, |p_t| = mu p_n + c.
inline bool at_coulomb_bound(const contact::ProblemContact& c, const Vec3& impulse) {
  const double bound = c.friction * impulse[0] + c.cohesion;
  return impulse.tail<2>().norm() >= bound * (1 - contact::tolerances().at_bound);
}

/// Whether two touches resist rolling about the same axes by the same law: their couples are one, bounded by
/// the sum of both normal impulses. Two of them would leave open which of the two bears what, and with that
/// how the normal impulses are shared, and the bounds. A couple below its bound still leaves open what it
/// bears of the moment that the points' own impulses could bear, which friction between them turns into
/// another motion: of such points a problem begins without impulses, so that a step and the accelerations at
/// its ends share them alike.
inline bool roll_as_one(const Touch& s, const Touch& t) {
  return s.a == t.a && s.b == t.b && s.law == t.law &&
         s.at.normal.cross(t.at.normal).norm() < contact::tolerances().same_normal &&
         s.at.normal.dot(t.at.normal) > 0;
}

/// Rolling and drilling resistance: after the rows of all touches, a contact for each of the two that touches
/// have that roll as one, in the order of the first of these. The tangential rows are R (w_b - w_a) . t, of
/// drilling R (w_b - w_a) . n; the impulse is couple / R, at most mu_r p_n (mu_d p_n) of these touches.
inline std::size_t couples(const Touch& t) {
  return t.row >= 0 && t.rolls && t.couple_of < 0
             ? std::size_t{t.law->rolling_resistance > 0} + std::size_t{t.law->drilling_resistance > 0}
             : 0;
}

/// Calls use(touch, resistance, contact) for these contacts of a problem and the first of their touches, none
/// if it was assembled without.
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
/// trapezoidal rule's drift is not corrected by speed, which would gain energy without bound where a short
/// step follows a long one, but by the projection.
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
