/// Modal propagation of a structure that stays elastic and rings on alone: exact in time for what the modes
/// hold (linear/modal.hpp).
///
///   u = u_g + sum_l c_l r_l + Phi q,   v = Phi q' + what the modes leave out
///
/// What they leave out keeps its energy and is damped as they are; its phase is lost. More modes are taken
/// until they hold enough of the motion, as far as that costs less than explicit steps.
#pragma once
#include "fem/integrators/condensed_factors.hpp"
#include "fem/integrators/leapfrog.hpp"
#include "fem/linear/modal.hpp"

namespace talus::fem {

class ModalMotion : protected MovingStructure {
 public:
  ModalMotion(const MovingStructure& structure, Leapfrog& leapfrog, CondensedFactors& factors)
      : MovingStructure(structure), leapfrog_(leapfrog), factors_(factors) {}

  /// Whether the structure is linear, and may be factored.
  bool possible() const;
  /// Whether explicit steps alone have cost what the modes would: at most twice what would have been least
  /// then, however long it rings on.
  bool due() const;
  /// Starts from the present state. False, but where it is `forced`: modes that do not hold the motion; the
  /// next try is due later.
  bool enter(double t, bool forced);
  bool running() const { return running_; }
  void advance(double t, double duration);
  void leave() { running_ = false; }
  /// Longest step of the midpoint rule that keeps the phases of what rings, so that no displacement is off by
  /// more than `within` [m] (0: a small part of its greatest so far) by them; infinite if nothing rings by
  /// more than half of that [s].
  double ringing_step(double t, double within = 0);
  /// What stepping for so long [s] may hold, condensed steps included, at most [bytes].
  double memory(double duration) const;
  void save(std::vector<double>& state) const;
  void restore(StateReader& state);

 private:
  struct Basis {
    ModalBasis modes;
    VecX mass;                 // per free degree of freedom, as built
    VecX gravity;              // u_g
    MatX pattern, correction;  // P_l, r_l
    MatX participation;        // Phi^T P, m x l
  };
  /// What feet, members and probes carry, f = f_g + D q + C c, rows as MemberLoads::carried(). Moments have
  /// the arms that the permanent load leaves.
  struct Carried {
    VecX permanent;     // f_g
    MatX modes, loads;  // D, C
  };
  Basis& basis();
  const Carried& carried();
  bool at_rest(const VecX& next) const;
  void watch(double t, double h, const VecX& next);
  VecX displacement(const VecX& q, const VecX& factor) const;
  int modes_at_most() const;
  int modes_within(double duration) const;
  bool more_modes();
  bool project(double t);
  void put_off();
  void materialise();

  Leapfrog& leapfrog_;
  CondensedFactors& factors_;
  Basis basis_;                 // empty until needed
  Carried carried_;             // of that basis, likewise
  int modes_ = 24;              // asked for; more where the energy needs them
  double try_ = 100;            // lone steps after which modal motion is tried next
  double last_excess_ = 1e300;  // what was left out at the last try, over what may be
  // the motion
  bool running_ = false;
  VecX q_, rate_, factor_;  // factor: c_l at the present time
  struct Rest {
    VecX velocity;                     // that holds the energy, as of its start [m/s]
    double energy = 0, amplitude = 1;  // [J], as of its start; amplitude left of it
    double excess = 1;                 // amplitude of it as of its start, over what may be left out
  };
  Rest rest_;  // what the modes leave out
};

}  // namespace talus::fem
