/// The contact problem in the form the algorithms share: only touched bodies, contiguous Jacobians, local
/// Delassus blocks, and velocities in which every mass is one. With A^-1 = M M^T per body and the true
/// velocities M v,
///
///   u_i = J_i v + b_i,     v(p) = v_hat + J^T p,     W_i = J_i J_i^T + R_i
///
/// so that one Jacobian both reads velocities and takes impulses. What no impulse changes (a held direction:
/// its row and column of A^-1 are zero) has no column in J; its velocity belongs to the bias.
///
/// symbol   meaning                                                     unit             shape
/// v        M^-1 of the velocities; v_hat: without impulses             m/s kg^1/2       ndof per body
/// J        Jacobian of a term times M, row major                       kg^-1/2          3 x ndof
/// b_i      bias, and what held directions move                         m/s              3
/// W_i      local Delassus block with the compliance                    1/kg             3 x 3
/// w_i      its scale, trace / 3; turns impulses into velocities        1/kg             1
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/linear/solver_order.hpp"
#include "contact/solver/problem.hpp"
#include "contact/solver/solver_law.hpp"
#include "contact/solver/solver_rows.hpp"

namespace talus::contact::detail {

/// W_i without its normal impulse, which keeps u_n = 0: what a contact that slips or sticks solves in its
/// plane.
///
///   n = -k q_n - c . p_t,   u_t = S p_t + q_t - c q_n
///   k = 1 / W_nn,  c = W_nt / W_nn,  S = W_tt - W_tn W_nt / W_nn
struct Eliminated {
  double k = 0;
  double c1 = 0, c2 = 0;
  double s11 = 0, s12 = 0, s22 = 0;
  double i11 = 0, i12 = 0, i22 = 0;  // S^-1
};
Eliminated eliminate_normal(const Mat3& W);

struct Touch {
  int id = 0;                // contact of the problem
  int first = 0, count = 0;  // into terms
  bool opens = false;  // parting it bears nothing, and no sliding makes it bear: without an impulse, u_n >= 0
                       // is its one solution
  Law law;
  double w = 0, wt = 0;  // velocity change per impulse: that along the face is another one only where the two
                         // are far apart
  /// Of impulses to each other, where light bodies bear what heavy ones press: (least w of all / w)^(1/2). A
  /// contact of w may bear as much as that of the least or next to nothing.
  double load = 1;
  Scale scale() const { return {w, wt}; }
  double shift = 0;  // added to the normal velocity: De Saxce, when it is held fixed
  Vec3 bias, compliance;
  Mat3 W;
  Eliminated slip;  // the same with the normal part eliminated
};

/// What a range of a parallel loop holds at least.
constexpr int bodies_at_once = 64, contacts_at_once = 512;

struct TouchTerm {
  int body = 0;        // active body
  int n = 0;           // its ndof
  int v = 0;           // its offset in the active velocities
  std::size_t at = 0;  // of J in the pool
};

/// One contact of a body: its term's place in J.
struct TouchOfBody {
  int contact;
  std::uint32_t at;
};

struct System {
  // active bodies
  std::vector<int> body, ndof, offset;
  std::vector<std::size_t> matrix;  // offset of M in `root`
  std::vector<double> root;         // M, lower triangular, column major
  std::vector<double> v_hat;
  std::vector<double> held;  // what M v leaves of the velocities: those of held directions
  int n = 0;                 // active degrees of freedom
  double most_excused = 0;   // of the round-off of velocities that follow from impulses: the tolerance [m/s]
  /// What the bodies' momenta can press at most, an estimate [N s]: sum over the bodies of |v_hat| / |J| +
  /// |b| / |J|^2, b the rows' fastest approach. Impulses far beyond it do not bear a load: they grow between
  /// rows that contradict each other, and their last digits are no excuse.
  double most_pressed = 0;
  /// Of the velocities that the bodies have or are asked for, in which every mass is one: |v_hat| + |b| (sum
  /// 1 / |J|^2)^(1/2).
  double most_moving = 0;
  // contacts
  std::vector<Touch> touch;
  std::vector<TouchTerm> terms;
  std::vector<double> J;
  std::vector<int> first_of_body;    // into of_body, one more than bodies
  std::vector<TouchOfBody> of_body;  // ascending contacts of every body
  VisitingOrder order;

  void assemble(const ContactProblem& problem, bool exact_coulomb);
  /// Lists of what bodies touch, the order of visits and the loads; again after `touch` was changed.
  void list();
  int contacts() const { return static_cast<int>(touch.size()); }

  /// J_i x for the stacked velocities x.
  Vec3 relative(const Touch& t, const double* x) const {
    const RowSums<3> u = rows<3>(t, x);
    return {u[0], u[1], u[2]};
  }
  /// Its normal component alone.
  double relative_normal(const Touch& t, const double* x) const { return rows<1>(t, x)[0]; }
  /// True if it has no impulse and opens, as most contacts listed in a large island do: solved as it is,
  /// which follows from its normal equation alone.
  bool open_still(const Touch& t, const Vec3& p, const double* v) const {
    return t.opens && p == Vec3::Zero() && relative_normal(t, v) + t.bias.x() >= 0;
  }
  /// x += J_i^T p: the velocity change an impulse makes.
  void push(const Touch& t, const Vec3& p, double* x) const {
    for (const TouchTerm *term = terms.data() + t.first, *end = term + t.count; term != end; ++term)
      add_transposed(J.data() + term->at, term->n, p, x + term->v);
  }
  /// v = v_hat + J^T p.
  void velocities(const std::vector<Vec3>& p, std::vector<double>& v) const;
  /// The velocities of the bodies that are touched, into problem.v: those of problem.v_hat to the last bit
  /// where no impulse acts, whatever open contacts are listed.
  void write(const std::vector<double>& v, ContactProblem& problem) const;
  /// Largest velocity w |p| that a contact's impulse makes, up to what the bodies can press, per body: its
  /// last digits are round-off. Into `reach`.
  void impulse_reach(const std::vector<Vec3>& p, std::vector<double>& reach) const;
  /// Round-off of the contact velocity that follows from impulses, 16 machine epsilons of the reach of the
  /// bodies it touches [m/s].
  double round_off(const Touch& t, const std::vector<double>& reach) const {
    double largest = 0;
    for (int k = t.first; k < t.first + t.count; ++k) largest = std::max(largest, reach[terms[k].body]);
    return 16 * 2.220446049250313e-16 * largest;
  }
  /// The part of it that a residual takes off.
  double excuse(const Touch& t, const std::vector<double>& reach) const {
    return std::min(most_excused, round_off(t, reach));
  }
  /// Largest natural-map residual over the contacts, exact Coulomb where the law says so [m/s].
  double residual(const std::vector<double>& v, const std::vector<Vec3>& p) const;
  /// The same by what counts of a contact's: r (m / m_mean)^(1/2), m the lighter body's mass where that is
  /// below the mean of all, at least `least` r. Where no contact leaves more than x, the root mean square of
  /// what the bodies are off by, weighed by mass, is at most x.
  double residual_by_mass(const std::vector<double>& v, const std::vector<Vec3>& p, double least) const;
  /// Root mean square of the velocities at contacts of two bodies, weighed by 1/w [m/s]. A motion common to
  /// all is none.
  double speed(const std::vector<double>& v) const;
  /// How many contacts were off by more at the last of them.
  int count_off(double residual) const {
    return static_cast<int>(
        std::count_if(of_contact_.begin(), of_contact_.end(), [=](double r) { return r > residual; }));
  }
  /// The same of velocities that do not follow from the impulses, v - v(p) = `off`: without bound where an
  /// off beyond round-off is momentum.
  double residual_apart(const std::vector<double>& v, const std::vector<double>& off,
                        const std::vector<Vec3>& p) const;

 private:
  template <int Rows>
  RowSums<Rows> rows(const Touch& t, const double* x) const {
    RowSums<Rows> u;
    for (const TouchTerm *term = terms.data() + t.first, *end = term + t.count; term != end; ++term)
      u.add(J.data() + term->at, term->n, x + term->v);
    return u;
  }
  void number(const ContactProblem& problem, bool exact_coulomb);
  void find_bounds();
  void take_body(const ContactProblem& problem, int active);
  void fill(const ContactProblem& problem, int contact);

  mutable std::vector<double> reach_, of_contact_;
  std::vector<int> active_;  // problem body -> active body or -1
};

}  // namespace talus::contact::detail
