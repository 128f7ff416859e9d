/// Primal-dual interior-point method for contact with exact Coulomb friction (or associated flow).
///
///   v = v_hat + J^T p          (velocities in which every mass is one, solver_system.hpp)
///   y P = tau / w,             P = p_n - floor > 0,  y = u_n - a mu gamma > 0           (normal)
///   g gamma + p_t . u_t = tau / w,  g u_t + gamma p_t = 0,  g = mu p_n + c > |p_t|, gamma > |u_t| (friction
///   cone)
///
/// symbol   meaning                                                                   unit
/// u        J v + b + R p                                                             m/s
/// gamma    slip rate; a = 0 exact Coulomb, a = 1 associated flow                     m/s, 1
/// tau      barrier parameter, the same for all contacts in velocity units            m^2/s^2
/// w        scale of the contact, turns impulse into velocity                         1/kg
///
/// Eliminating dP, dp_t, dgamma, dy per contact leaves (1 + sum J^T D J) dv = f: the pattern of the Newton
/// method. Predictor and corrector share a factorisation [mehrotra1992]. No proximal term: D stays moderate
/// along the path, so a cold start costs 10 to 20 factorisations. In large problems a contact that holds up a
/// short step is put back inside its cone before the next.
#pragma once
#include <cmath>
#include <vector>

#include "contact/solver_hessian.hpp"
#include "contact/solver_sweep.hpp"

namespace talus::contact::detail {

struct InteriorOptions {
  double tolerance = 1e-10;  // [m/s]
  int max_iterations = 60;
  int sweeps = 0;      // visits per contact of an attempt to settle from the path what lags behind; 0: none
  int correctors = 0;  // more of them in an iteration, at most, while they lengthen its step [gondzio1996]
  bool recentre = false;  // put the contacts that hold up a short step back inside their cones
  double start = 0;       // [m/s] expected distance from the warm start; sets the first barrier
};

struct InteriorOutcome {
  int iterations = 0;
  double residual = 0;
};

class Interior {
 public:
  explicit Interior(Hessian& hessian) : hessian_(&hessian) {}
  /// p: in the warm start, out the best impulses; v their velocities.
  InteriorOutcome run(const System& system, std::vector<Vec3>& p, std::vector<double>& v,
                      const InteriorOptions& options);

 private:
  struct Pair {  // the interior point of one contact and its step
    double P, y, gamma;
    Eigen::Vector2d pt, ut;
    double dP, dy, dgamma;
    Eigen::Vector2d dpt, dut;
    double own;  // longest step that this contact admits
    bool frictional;
  };
  enum class Phase { predictor, corrector };
  /// What a path has reached: the least residual, of which the best impulses are kept, and what tells that it
  /// is stuck.
  struct Progress {
    double residual = INFINITY;  // least on the path itself
    double least = INFINITY;     // with what sweeps made of it
    int stalls = 0, blocked = 0;
    int next_settling = 0;  // iteration of the next attempt
  };
  void begin(double delta);
  void place_impulse(const Touch& t, Pair& q, Vec3& p, double delta) const;
  double measure();
  bool settle(const InteriorOptions& options, Progress& progress);
  bool stuck(double residual, Progress& progress);
  void right_hand_side(Phase phase, double tau);
  void contact_equations(const Touch& t, Pair& q, std::size_t i, Phase phase, double tau);
  double steps(Phase phase, double tau);
  void contact_step(const Touch& t, Pair& q, std::size_t i, Phase phase, double tau) const;
  double complementarity_after(double alpha);
  bool direction(double complementarity, int correctors, double& alpha);
  void advance(double alpha, double complementarity, bool recentre);

  Hessian* hessian_;
  const System* system_ = nullptr;
  int count_ = 0;  // complementary products
  // Weight of the flow rule's own coupling in the direction: 0 is Newton on exact Coulomb, fast but now and
  // then blocked; 1 takes the direction of the convex problem with the De Saxce shift held, which is
  // monotone, and moves the shift at each iteration.
  double lag_ = 0;
  std::vector<Pair> pairs_, last_pairs_;
  std::vector<Mat3> D_;
  std::vector<Vec3> constant_, p_, best_;
  std::vector<double> un_, products_, v_, step_, rhs_, force_, vp_, settled_v_,
      last_step_;  // products_: the two complementary ones of every contact; force_: v - v(p)
  std::vector<Vec3> settled_;
  LocalSweeps local_;
};

}  // namespace talus::contact::detail
