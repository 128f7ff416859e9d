/// Semismooth Newton on the impulses of a small problem, for the last digits where contacts are redundant.
///
///   F_i(p) = p_i - P_i(p_i - u_i / w_i) = 0,   u = W p + q,   W = J J^T + R,   q = J v_hat + b [alart1991]
///   ((I - G) + G w^-1 W) dp = -F,   G_i = dP_i / dz_i,   in the least squares sense of least length
///
/// No proximal term: round-off of the velocities is not magnified. Sticking contacts may contradict each
/// other by a little (conditions of two points of one pair on the line that joins them); their equations then
/// have no solution, and a self-stress grows until a contact slips or opens. The left null vector of the
/// equations is that self-stress: straight to the first that gives way.
///
/// symbol   meaning                                       unit        shape
/// W        Delassus matrix with the compliance           1/kg        3 n x 3 n, n contacts
/// w_i      scale of contact i (solver_system.hpp)        1/kg        1
#pragma once
#include <vector>

#include "contact/solver/solver_system.hpp"

namespace talus::contact::detail {

struct DualOutcome {
  int iterations = 0;
  double residual = 0;  // [m/s], natural map of the best impulses
};

class DualNewton {
 public:
  static constexpr int most_contacts = 40;
  /// p: in the start, out the best impulses; v their velocities. Below `sufficient` it ends once three
  /// iterations have not halved the residual.
  DualOutcome run(const System& system, std::vector<Vec3>& p, std::vector<double>& v, double tolerance,
                  double sufficient, int max_iterations);

 private:
  void assemble(const System& system);
  double evaluate(const System& system, const std::vector<Vec3>& p);
  double give_way(const System& system, const std::vector<Vec3>& p, const VecX& direction) const;

  MatX W_, M_;  // scaled: w^-1/2 W w^-1/2, and the Newton matrix
  VecX q_, F_, u_;
  std::vector<double> root_, v_;  // sqrt(w)
  std::vector<unsigned char> state_;
  std::vector<Vec3> best_, trial_;
};

}  // namespace talus::contact::detail
