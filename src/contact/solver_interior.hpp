/// Primal-dual interior-point method for contact with exact Coulomb friction (or associated flow).
///
///   A (v - v_hat) = J^T p
///   y P = tau / w,             P = p_n - floor > 0,  y = u_n - a mu gamma > 0           (normal)
///   g gamma + p_t . u_t = tau / w,  g u_t + gamma p_t = 0,  g = mu p_n + c > |p_t|, gamma > |u_t|   (friction cone)
///
/// symbol   meaning                                                                   unit
/// u        J v + b + R p                                                             m/s
/// gamma    slip rate; a = 0 exact Coulomb, a = 1 associated flow                     m/s, 1
/// tau      barrier parameter, the same for all contacts in velocity units            m^2/s^2
/// w        scale of the contact, turns impulse into velocity                         1/kg
///
/// Eliminating dP, dp_t, dgamma, dy per contact leaves (A + sum J^T D J) dv = f: the pattern of the Newton method. Predictor
/// and corrector share a factorisation [mehrotra1992]. No proximal term: D stays moderate along the path, so a cold start
/// costs 10 to 20 factorisations.
#pragma once
#include <vector>

#include "contact/solver_hessian.hpp"
#include "contact/solver_sweep.hpp"

namespace talus::contact::detail {

struct InteriorOptions {
  double tolerance = 1e-10;  // [m/s]
  int max_iterations = 60;
  int sweeps = 0;            // visits per contact of an attempt to settle from the path what lags behind; 0: none
  double start = 0;          // [m/s] expected distance from the warm start; sets the first barrier
};

struct InteriorOutcome {
  bool converged = false;
  int iterations = 0;
  double residual = 0;
};

class Interior {
 public:
  explicit Interior(Hessian& hessian) : hessian_(&hessian) {}
  /// p: in the warm start, out the best impulses; v their velocities.
  InteriorOutcome run(const System& system, std::vector<Vec3>& p, std::vector<double>& v, const InteriorOptions& options);

 private:
  struct Pair {  // the interior point of one contact and its step
    double P, y, gamma;
    Eigen::Vector2d pt, ut;
    double dP, dy, dgamma;
    Eigen::Vector2d dpt, dut;
    bool frictional;
  };
  Hessian* hessian_;
  std::vector<Pair> pairs_;
  std::vector<Mat3> D_;
  std::vector<Vec3> constant_, p_, best_;
  std::vector<double> un_, v_, step_, rhs_, force_, vp_, settled_v_;
  std::vector<Vec3> settled_;
  LocalSweeps local_;
};

}  // namespace talus::contact::detail
