/// One convex contact problem: bodies with generalised velocities and contacts between them.
///
///   minimise over v:   1/2 (v - v_hat)^T A (v - v_hat) + sum_i  psi_i(J_i v + b_i)                  (C)
///   optimality:        A (v - v_hat) = sum_i J_i^T p_i,
///   per contact i:     u_i = J_i v + b_i + R_i p_i (+ De Saxce shift mu |u_t| on the normal),
///                      p_i in C_i,   -u_i in the normal cone of C_i at p_i
///   C_i = { p_n >= -T_i, |p_t| <= mu_i p_n + c_i }: the Coulomb cone, its apex moved by cohesion,
///         cut off in tension
///
/// symbol   meaning                                                   unit         shape
/// v        generalised velocities at the end of the step             m/s, rad/s   sum of ndof
/// v_hat    the same without contact (free flow)                      m/s, rad/s
/// A        block-diagonal SPD generalised mass of the step           kg, kg m^2   ndof x ndof per body
/// J_i      relative velocity: normal (opening > 0), two tangents                  3 x ndof per touched body
/// b_i      bias: restitution, gap / h, spring terms                  m/s          3
/// R_i      diagonal compliance (0 = hard)                            m/s per N s  3
/// mu_i     friction coefficient; c_i, T_i cohesion and tension impulses   1, N s
/// p_i      impulse on the second body along the normal frame         N s          3
///
/// Friction regions: open (no impulse), stick, slip: the states of Table 1 of the rockfall paper. The convex
/// problem alone is associated flow; exact Coulomb follows from the De Saxce shift [desaxce1998], which is on
/// by default.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/types.hpp"

namespace talus::contact {

struct ProblemBody {
  int ndof = 6;                  // 3 (a structure node), 6, 12, or any size (condensed structure)
  int offset = 0;                // into the stacked v
  const double* mass = nullptr;  // A, ndof x ndof, column major, SPD; null for a condensed structure, of
                                 // which A^-1 is all that is known
  const double* mass_inverse = nullptr;  // A^-1, ndof x ndof, column major
};

/// The Jacobian of one contact with respect to one body: 3 x ndof, column major, at `jacobian` in the pool.
struct ContactTerm {
  int body;
  int jacobian;  // offset into ContactProblem::jacobians
};

struct ProblemContact {
  int first_term = 0;  // into terms
  int terms = 0;       // bodies touched (fixed partners have none)
  Vec3 bias = Vec3::Zero();
  Vec3 compliance = Vec3::Zero();
  double friction = 0;
  double cohesion = 0;          // impulse [N s]
  double tension = 0;           // impulse [N s]
  bool associated = false;      // true: leave the De Saxce shift out for this contact
  Vec3 impulse = Vec3::Zero();  // in: warm start; out: solution
};

struct ContactProblem {
  std::vector<ProblemBody> bodies;
  std::vector<ProblemContact> contacts;
  std::vector<ContactTerm> terms;
  std::vector<double> jacobians;  // pool
  std::vector<double> v_hat;      // in
  std::vector<double> v;          // out
  void clear();                   // keeps the capacity

  std::span<const ContactTerm> terms_of(const ProblemContact& c) const {
    return std::span(terms).subspan(static_cast<std::size_t>(c.first_term),
                                    static_cast<std::size_t>(c.terms));
  }
  const ProblemBody& body_of(const ContactTerm& t) const { return bodies[static_cast<std::size_t>(t.body)]; }
  Eigen::Map<const Eigen::Matrix3Xd> jacobian(const ContactTerm& t) const {
    return {jacobians.data() + t.jacobian, 3, body_of(t).ndof};
  }
  /// J_i x of the stacked velocities x, without the bias [m/s].
  Vec3 relative(const ProblemContact& c, const std::vector<double>& x) const {
    Vec3 u = Vec3::Zero();
    for (const ContactTerm& t : terms_of(c))
      u += jacobian(t) * Eigen::Map<const VecX>(x.data() + body_of(t).offset, body_of(t).ndof);
    return u;
  }
};

struct SolveSettings {
  double tolerance = 1e-10;  // on the exact-Coulomb residual, relative to `velocity_scale`
  double sufficient =
      0;  // what ends the search where an attempt at `tolerance` stops at round-off; 0: `tolerance`
  double velocity_scale = 1.0;  // [m/s]
  /// Suffices there, too: this part of the contacts' speed by the solution, up to `most` relative to
  /// `velocity_scale`; and up to `most` what of light bodies does not count (System::residual_by_mass).
  double of_motion = 0, most = 0;
  bool exact_coulomb = true;  // De Saxce correction
  bool unstressed = true;  // the solution next to half of the warm start: of impulses that hold each other no
                           // more than the load asks for
  bool goes_on = false;  // it differs by little from the problem that the impulses given solve: sweeps first
  bool at_hand = false;  // a few steps of Newton's method from the impulses given, and no more
  int max_outer = 60;
};

enum class Method { newton, interior_point };

struct SolveReport {
  bool converged = false;
  Method method = Method::newton;  // that was needed, with whatever followed it
  int newton = 0;                  // Newton iterations (factorisations)
  int sweeps = 0;                  // Gauss-Seidel sweeps, if used
  int outer = 0;                   // proximal or De Saxce outer iterations
  double residual = 0;             // exact-Coulomb residual, relative to velocity_scale
};

/// Workspace that keeps factorisations' symbolic parts and buffers between calls. Not shared between threads.
class ContactSolver {
 public:
  ContactSolver();
  ~ContactSolver();
  ContactSolver(ContactSolver&&) noexcept;
  ContactSolver& operator=(ContactSolver&&) noexcept;
  /// Fills problem.v and every contact's impulse. Deterministic: depends on the problem alone, never on
  /// earlier calls (cached symbolic factors and buffers do not change a bit of the result) or on the thread
  /// count.
  SolveReport solve(ContactProblem& problem, const SolveSettings& settings);
  /// Looks for impulses under which bodies stay where they are, as the limit of contacts that give about the
  /// last impulses found, at first about none: none are found that press for no load, and each round leaves a
  /// part of the velocity before. Contacts slower than `still` [m/s] count as closed, others that open bear
  /// nothing. Fills problem.v and the impulses. `fastest`: of the bodies by problem.v [m/s]. True if that
  /// comes to at most `still`; not what is beyond `moving` [m/s] after the first round, or falls no longer.
  bool balance(ContactProblem& problem, double still, double moving, const std::function<double()>& fastest,
               SolveReport* report = nullptr);
  /// `count` Gauss-Seidel sweeps from the impulses of the problem, whatever their residual becomes. Fills
  /// what `solve` does; returns the residual [m/s].
  double sweep(ContactProblem& problem, int count);

 private:
  struct Work;
  Work* work_;
};

/// Exact-Coulomb (natural map) residual of a candidate solution, max over contacts, in m/s. For tests and
/// reports.
///   w_i |p_i - P_C(p_i - (u_i + shift) / w_i)|,   w_i = trace(J_i A^-1 J_i^T + R_i) / 3,
/// and |J_i (v - v_hat - A^-1 J^T p)|; less the round-off, 16 machine epsilons of the largest w |p| at the
/// touched bodies.
double coulomb_residual(const ContactProblem& problem, bool exact_coulomb);

}  // namespace talus::contact
