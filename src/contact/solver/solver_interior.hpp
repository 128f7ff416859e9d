/// Primal-dual interior-point method for contact with exact Coulomb friction (or associated flow).
///
///   v = v_hat + J^T p          (velocities in which every mass is one, solver_system.hpp)
///   P y = tau,                 P = p_n - floor > 0,   y = u_n - a mu gamma > 0
///   x o z = tau e,             x = (mu p_n + c, p_t), z = (gamma, u_t), both in the cone x_0 > |x_t|
///
/// symbol   meaning                                                                   unit
/// u        J v + b + R p                                                             m/s
/// gamma    slip rate; a = 0 exact Coulomb, a = 1 associated flow                     m/s, 1
/// tau      work of a contact at the point; 0 at a solution                           J
/// o        product of vectors of the cone, x o z = (x . z, x_0 z_t + z_0 x_t), unit e = (1, 0, 0)
/// M        scaling of x and z [nesterov1997]: symmetric, M z = x
///
/// In the direction of Newton's method dx + M dz = tau z^-1 - x the scaling M stands for both points, so that
/// it depends neither on units nor on which contacts are between light bodies: work is what all contacts have
/// alike, whatever the ratio of their masses. The iterations are 20 to 40 from nothing known.
///
/// Eliminating dP, dx, dz, dy per contact leaves (1 + sum J^T D J) dv = f: the pattern of the Newton method.
/// Predictor and corrector share a factorisation [mehrotra1992].
#pragma once
#include <cmath>
#include <vector>

#include "contact/linear/solver_hessian.hpp"
#include "contact/solver/solver_sweep.hpp"

namespace talus::contact::detail {

struct InteriorOptions {
  double tolerance = 1e-10;  // [m/s]
  int max_iterations = 60;
  int sweeps = 0;      // visits per contact of an attempt to settle from the path what lags behind; 0: none
  int correctors = 0;  // more of them in an iteration, at most, while they lengthen its step [gondzio1996]
  double start = 0;    // [m/s] expected distance from the warm start; sets the first barrier
};

struct InteriorOutcome {
  int iterations = 0;
  double residual = 0;
};

class Interior {
 public:
  explicit Interior(Hessian& hessian) : hessian_(&hessian) {}
  /// p, v: in the warm start, out the best found.
  InteriorOutcome run(const System& system, std::vector<Vec3>& p, std::vector<double>& v,
                      const InteriorOptions& options);
  /// Where the last path ended, which may be nearer in all but a few contacts than the best.
  const std::vector<Vec3>& last_impulses() const { return p_; }
  double work_left() const { return work_left_; }  // there, of that at its start

 private:
  struct Pair {  // the interior point of one contact and its step
    double P, y;
    Vec3 x, z;
    double dP, dy;
    Vec3 dx, dz;
    Vec3 axis;  // of the root of M, size (2 axis axis^T - diag(1, -1, -1))
    double size;
    Mat3 M;
    Eigen::Matrix4d inverse;  // of the contact's equations for (dP, dz_0, dx_t)
    Eigen::Vector4d right;    // their right-hand side
    double lag;               // weight of the flow rule's own coupling in the direction: 0 is Newton on exact
                 // Coulomb, fast but now and then blocked; 1 takes the direction of the convex problem with
                 // the De Saxce shift held, which is monotone, and moves the shift at each iteration
    double own;  // longest step that this contact admits
    bool frictional;
  };
  enum class Phase { predictor, corrector };
  /// What a path has reached: the least residual, of which the best is kept, and what tells that it is stuck.
  struct Progress {
    double work = INFINITY;   // when it was last halved
    double least = INFINITY;  // residual, with what sweeps made of it
    int stalls = 0;
    int next_settling = 0;  // iteration of the next attempt
  };
  void begin(double delta);
  double measure();
  double residual(double tolerance);
  bool settle(const InteriorOptions& options, Progress& progress);
  void scale(const Touch& t, Pair& q) const;
  Eigen::Vector4d right_hand_side_of(const Touch& t, const Pair& q, std::size_t i, Phase phase,
                                     double tau) const;
  void right_hand_side(Phase phase, double tau);
  void contact_equations(const Touch& t, Pair& q, std::size_t i, Phase phase, double tau);
  double steps();
  void contact_step(const Touch& t, Pair& q, std::size_t i) const;
  double work_after(double alpha);
  bool direction(double work, int correctors, double& alpha);
  void advance(double alpha);

  Hessian* hessian_;
  const System* system_ = nullptr;
  int count_ = 0;  // complementary products
  double work_left_ = 1;
  bool own_ = false;  // the residual at hand is that of the path's own velocities
  std::vector<Pair> pairs_, last_pairs_;
  std::vector<Mat3> D_;
  std::vector<Vec3> constant_, p_, best_;
  std::vector<double> un_, products_, v_, best_v_, step_, rhs_, force_, vp_, settled_v_,
      last_step_;  // products_: the two complementary ones of every contact; force_: v - v(p)
  std::vector<Vec3> settled_;
  LocalSweeps local_;
};

}  // namespace talus::contact::detail
