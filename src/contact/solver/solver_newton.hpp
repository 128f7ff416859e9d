/// Proximal outer iteration with a semismooth Newton method inside.
///
///   inner, for fixed multipliers p^k and proximal compliance rho_i = max(0, eps l_i w_i - R_i):
///     F(v) = v - v_hat - sum J_i^T p_i(v) = 0,   p_i(v) = P_i((rho_i p^k_i - J_i v - b_i) / (R_i + rho_i))
///     (1 + sum J_i^T D_i J_i) dv = -F,   D_i = -dp_i/du_i
///   outer:  p^{k+1} = p(v),  which removes the proximal compliance as it converges   [rockafellar1976]
///
/// Velocities that follow from impulses, v(p), are off by the last digits of what presses a body from both
/// sides, eps w |p|, which may be more than it moves by: a pebble beneath a boulder. Those of the inner
/// problem are not: p(v) meets the law exactly at J v + b + R p + rho (p - p^k), so that where F is round-off
/// of the impulses (v, p) is a solution to within |rho (p - p^k)|.
///
/// For associated laws F is the gradient of a C1, strongly convex function and the exact line search on it
/// makes the inner iteration globally convergent. For exact Coulomb F is not a gradient; the line search is
/// on |F|^2, and a failure is reported to the caller.
#pragma once
#include <vector>

#include "contact/linear/solver_hessian.hpp"
#include "contact/solver/solver_system.hpp"

namespace talus::contact::detail {

struct NewtonOptions {
  double tolerance = 1e-10;  // [m/s], on the residual of (v(p), p) or (v, p)
  double sufficient = 0;  // [m/s] ends the search once three factorisations have not halved the residual; 0:
                          // `tolerance` alone
  double most = 0;        // [m/s] that would be taken: rows that contradict each other by more end the search
  int max_newton = 60;
  int max_outer = 60;
  double epsilon = 1e-4;  // proximal compliance over l w, l the contact's load (solver_system.hpp)
  bool held = false;  // epsilon stays: no more than it asks for is pressed by rows that contradict each other
  bool convex = false;  // use the associated law with Touch::shift everywhere
};

struct NewtonOutcome {
  int newton = 0, outer = 0;
  double residual = 0;
  double least = 0;  // no velocities that bodies would have leave less: the rows contradict each other [m/s]
};

class Newton {
 public:
  explicit Newton(Hessian& hessian) : hessian_(&hessian) {}
  /// p, v: in the first multipliers and the start, out the best found.
  NewtonOutcome run(const System& system, std::vector<Vec3>& p, std::vector<double>& v,
                    const NewtonOptions& options);

  /// Where it ended, which may be nearer in all but one contact than the best.
  const std::vector<Vec3>& last_impulses() const { return here_.p; }

 private:
  struct Point {                        // everything that is known at a trial v
    std::vector<double> v, difference;  // difference = v - v(p(v)) = F
    std::vector<Vec3> p, u;
    std::vector<unsigned char> state;
    double merit = 0;
  };
  void evaluate(const System& system, const std::vector<Vec3>& multiplier, double epsilon, bool convex,
                Point& point, bool derivatives);
  /// How far a contact is from the inner and the outer solution, the law from being met by v, and the
  /// residual of v(p) [m/s].
  struct OfContact {
    double inner = 0, outer = 0, law = 0, residual = 0;
  };
  OfContact measure(const System& system, double epsilon, bool convex);
  double exact_step(const System& system, const std::vector<Vec3>& multiplier, double epsilon,
                    const Point& from);
  /// Of hard rows u_n = J_n v + b_n >= 0 those that contradict each other press ever more, outer iteration
  /// after outer iteration. By how much they do, any d >= 0 tells, here the growth of p_n: at velocities v'
  /// of no more than V, what the bodies have or are asked for (System::most_moving),
  ///
  ///   sum d u_n(v') = sum d u_n(v) + (v' - v) . J_n^T d <= sum d u_n(v) + (|v| + V) |J_n^T d|,
  ///
  /// so that where this is negative some u_n is below it over sum d. [m/s], 0: nothing is known.
  double contradiction(const System& system);

  Hessian* hessian_;
  Point here_, there_;
  std::vector<Mat3> D_;
  std::vector<double> step_, candidate_, reach_, best_v_, balance_;
  std::vector<Vec3> multiplier_, slope_, best_p_;
  std::vector<OfContact> of_contact_;
  std::vector<unsigned char> factored_state_;
};

}  // namespace talus::contact::detail
