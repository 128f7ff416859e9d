/// Nonsmooth block Gauss-Seidel: contact by contact, each solved for its own impulse with the others held
/// [jean1999].
///
///   u_i = W_i p_i + q_i,   q_i the velocity without p_i;   stick, separation or slip decided in that order
#pragma once
#include "contact/solver/solver_system.hpp"

namespace talus::contact::detail {

/// How closely the slip of one contact is solved: normal and tangential part in turn, until neither changes
/// by more than this part of them. `by_direction`: by Newton's method on the direction first, up to so small
/// a turn [rad].
struct SlipAccuracy {
  int iterations;
  double change;
  bool by_direction;
};
constexpr SlipAccuracy swept{4, 1e-4, false};  // by sweeps, which come back
constexpr SlipAccuracy visited{30, 1e-6,
                               true};  // by visits: a contact left half solved would not be visited again

/// One contact: the impulse that solves its own Coulomb problem to a few digits, starting from p.
Vec3 solve_one(const Touch& t, const Vec3& q, const Vec3& p, SlipAccuracy accuracy = swept);

/// `sweeps` passes, forward and backward in turn. v must be v(p); both are updated.
void sweep(const System& system, std::vector<Vec3>& p, std::vector<double>& v, int sweeps);

/// Gauss-Seidel where it is still needed: a contact is visited again only after its own impulse or that of a
/// neighbour has changed by most of the tolerance. Few contacts that are far off cost little, however large
/// the problem, and what is right stays where it is, which ends the play of neighbours against each other.
/// Some would go round in a cycle, since exact Coulomb has no energy that every visit lowers: from the 10th
/// visit on a contact with friction takes half its step.
class LocalSweeps {
 public:
  /// From p with v = v(p), both updated, until nothing is left to visit or `budget` visits per contact are
  /// spent on the average.
  void run(const System& system, std::vector<Vec3>& p, std::vector<double>& v, double tolerance, int budget);

 private:
  static constexpr int undamped_visits = 10;
  static constexpr double part_that_counts = 0.7;  // of the tolerance: a change or a residual above it
  static constexpr long few = 1000;                // visits of a round that are not worth a second thread
  bool mark(const System& system, const std::vector<Vec3>& p, const std::vector<double>& v, double limit);
  void fetch(const System& system, int contact, int way) const;
  bool visit(const System& system, int contact, std::vector<Vec3>& p, std::vector<double>& v,
             double change_that_counts);

  std::vector<int> visits_;
  std::vector<char> pending_;
};

}  // namespace talus::contact::detail
