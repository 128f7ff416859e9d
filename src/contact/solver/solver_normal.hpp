/// Problems without friction: one normal impulse per contact, a convex quadratic program with bounds.
///
///   minimise over p >= floor:   1/2 p^T N p + (J v_hat + b)^T p,     N = J J^T + R,  J the normal rows alone
///
/// Symmetric Gauss-Seidel sweeps as the preconditioner of nonlinear conjugate gradients (Fletcher-Reeves,
/// restarted when the step grows) [silcowitz2010]: a pair of sweeps is one gradient step.
///
/// symbol   meaning                                           unit        shape
/// d_i      diagonal of N                                     1/kg        1
/// step     what a pair of sweeps changes                     N s         contacts
#pragma once
#include <utility>
#include <vector>

#include "contact/solver/solver_system.hpp"

namespace talus::contact::detail {

class NormalSweeps {
 public:
  /// From the normal impulses of p; v is their velocity field, and is kept up. Ends when the residual is
  /// below the tolerance [m/s], after `budget` sweeps, or once these seem not to get there.
  void run(const System& system, std::vector<Vec3>& p, std::vector<double>& v, double tolerance, int budget);

 private:
  /// Terms; as of a Touch. Rigid blocks, whose velocities `v` are found without their terms: one or two of
  /// them, none if there are others.
  struct Row {
    int first, count, rigid;
    int v[2];
    std::size_t at;  // of J_
    double bias, diagonal, inverse, scale, compliance, floor;
  };
  void gather(const System& system, const std::vector<Vec3>& p);
  double velocity(const Row& row, const double* v) const;
  void push(const Row& row, double change, double* v) const;
  void sweep(bool forward, double* v);
  void carry_on(double momentum, double* v);
  std::pair<double, double> gain();
  double residual(const double* v);

  std::vector<Row> rows_;
  std::vector<double> J_;  // normal rows, of a term at a third of its place in the system's
  const System* system_ = nullptr;
  std::vector<std::pair<double, double>> gains_;  // of every range
  std::vector<double> p_, before_, direction_,
      change_;  // change_: of the last sweep, later the residuals [m/s]
};

}  // namespace talus::contact::detail
