/// The search for a solution of a contact problem: which method, from where, in which order.
#pragma once
#include <vector>

#include "contact/solver/problem.hpp"
#include "contact/solver/solver_dual.hpp"
#include "contact/solver/solver_interior.hpp"
#include "contact/solver/solver_newton.hpp"
#include "contact/solver/solver_sweep.hpp"
#include "contact/solver/solver_system.hpp"

namespace talus::contact::detail {

class Search {
 public:
  /// Part of the velocity scale: large problems whose warm start is off by more change too many regions for
  /// Newton's method.
  /// Proximal compliance over that of the contact: where the regions are known but for a few; farther off.
  static constexpr double soft = 1e-4, firm = 1e-3, strong = 1e-2, loose = 0.1;
  static constexpr double near = 1e-4;
  static constexpr int few_contacts = 60;  // up to which Newton's method costs little from wherever it starts
  static constexpr int few_unknowns = 48;  // up to which factorisations cost less than sweeps
  /// Compliance over the least w of the contacts which the interior point lends to all. Contacts that hold
  /// each other in balance, a row of blocks that fills the space between two walls, can press as hard as they
  /// like, and the middle of all solutions is one in which they jam. Of bodies that give, however little, no
  /// more is pressed than the load asks for.
  static constexpr double give = 1e-5;
  System system;
  std::vector<Vec3> p, best_p;    // the point at hand and the best so far
  std::vector<double> v, best_v;  // their velocities
  double best = 0;                // residual of the best [m/s]

  /// What is asked for from here on.
  void aim(const SolveSettings& settings);
  /// True if the best suffices, by itself or beside the motion that it leaves.
  bool enough() const;
  /// The point at hand is the best so far, of no residual that counts where it is not finite.
  void start();
  void start_from_nothing();
  void from_best();
  /// Keeps the candidate if it is better than the best.
  bool consider(const std::vector<Vec3>& candidate, const std::vector<double>& velocities, double residual);
  bool unstressed_first() const { return system.contacts() <= few_contacts || settings_->unstressed; }
  /// Factorisations that Newton's method may take before others are tried.
  int first_try() const { return system.contacts() <= few_contacts ? 20 : 8; }
  /// The solution next to half of the warm start, to nothing where there is none: of forces that hold each
  /// other in balance no more than the load asks for.
  bool unstressed(const SolveSettings& settings, SolveReport& report);
  /// Newton's method from the best so far: of a problem near to the last one.
  bool goes_on(const SolveSettings& settings, SolveReport& report);
  /// Before `give_about`, of a new system.
  void prepare() { hessian_.prepare(system); }
  /// From p to the tolerance [m/s] by the interior point of contacts that give about the given impulses.
  /// Iterations.
  int give_about(const std::vector<Vec3>& about, double tolerance);
  /// From p on. True if the best comes below what suffices.
  bool run(const SolveSettings& settings, SolveReport& report);

 private:
  // Each from p and v; true if the best comes below what suffices.
  bool newton(double epsilon, int max_newton, bool held = false);
  /// The interior point of bodies that give a little, then Newton's method from there.
  bool interior(double distance);
  /// Visits and Newton's method in turn: the former settle what is light or loose, over which the latter goes
  /// round in a cycle, the latter what runs through many bodies.
  bool alternated(std::vector<Vec3> start);
  /// The interior point, then from where it ended the above, then from the best Newton's method.
  bool path_from(double distance);
  bool polish();  // the last digits of a small problem, from the best
  double swept(int count);
  double visited(int count);  // residual after sweeps from p
  /// Nothing that would suffice is to be had.
  bool contradicted() const { return least_ > sufficient_; }
  void begin(const SolveSettings& settings, SolveReport& report);
  void ask_for_tolerance();  // or to where Newton's method stagnates at round-off
  const SolveSettings* settings_ = nullptr;
  SolveReport* report_ = nullptr;
  double tolerance_ = 0, sufficient_ = 0;  // [m/s]
  double most_ = 0;                        // that suffices of what moves [m/s]
  double least_ = 0;                       // that is known to be left by whatever solves the problem [m/s]
  double round_off_ = 0;  // below which three iterations that do not halve the residual end a Newton method
                          // that may not stop at what suffices [m/s]
  double polished_ = 0;   // residual from which the last polish started [m/s]
  Hessian hessian_;
  Newton newton_{hessian_};
  Interior interior_{hessian_};
  DualNewton dual_;
  LocalSweeps local_;
  std::vector<Vec3> trial_p_;
  std::vector<double> trial_v_;
};

}  // namespace talus::contact::detail
