/// Condensed steps: the midpoint rule with cached factors, an affine map of the contact impulses.
///
///   A dv = h (f_ext - f_int(u_n) - alpha M v_n) - h^2 theta K v_n + p,   u_np = u_n + h (v_n + theta dv)
///   A = (1 + alpha h/2) M + h^2 theta^2 K,   W = J A^-1 J^T,   theta = 1/2 + delta
///
/// A, K and W: condensed_factors.hpp. Where the structure is linear this is the midpoint rule itself, and
/// with delta = 0 keeps the energy to round-off. Damaged cells and bars are softer than K: f_int(u_n) is
/// theirs, and K - K_now acts as a viscosity h/2 (K - K_now), which is stable and vanishes with h; were K the
/// softer one, motion would grow from step to step. delta, only where there is damping, falls with h^2 and
/// damps what the step does not resolve.
///
/// After explicit steps parts of a structure ring faster than the step resolves. Of a node that a contact
/// holds the midpoint rule would move the skin by h v_n / 2, many times its amplitude, and friction would
/// keep it there, strained. Where there is damping the first step is therefore that of backward Euler, theta
/// = 1, from velocities that h resolves, without (1 - A^-1 M)^3 v_n [rannacher1984]: a node that is held
/// stays where it is. What that would take of the motion is to be little (may_begin()).
#pragma once
#include "fem/integrators/modal_motion.hpp"

namespace talus::fem {

class CondensedMotion : public CondensedSteps, protected MovingStructure {
 public:
  /// `whole`: what it is a part of, whose state a step that is undone goes back to.
  CondensedMotion(Structure& whole, const MovingStructure& structure, Leapfrog& leapfrog,
                  CondensedFactors& factors, ModalMotion& modal)
      : MovingStructure(structure), whole_(whole), leapfrog_(leapfrog), factors_(factors), modal_(modal) {}

  double longest_step(double t, double accuracy, double within) override;
  double lowest_frequency() const override { return factors_.lowest_frequency(); }
  bool by_choice() const override {
    return body_.spec.integrator == "implicit" || body_.spec.integrator == "modal";
  }
  bool may_begin(double t, double h, double accuracy) override;
  void predict(double t, double h) override { predict(t, h, body_.spec.damping_ratio > 0); }
  MatX compliance(std::span<const int> nodes) override { return factors_.compliance(nodes); }
  bool correct(double t, double h, std::span<const NodeImpulse> impulses) override;
  void undo() override;
  void struck(double t) override { blow_time_ = t; }
  /// Without any contact, by condensed steps alone; false: not now.
  bool advance(double t, double duration);
  void start_over(double t) { taken_ = 0, blow_time_ -= t; }  ///< t: 0 from now on [s]
  void go_on_from(const CondensedMotion& coarser) {
    taken_ = coarser.taken_, blow_time_ = coarser.blow_time_;
  }
  void save(std::vector<double>& state) const { state.insert(state.end(), {blow_time_, taken_}); }
  void restore(StateReader& state) { blow_time_ = state.next(), taken_ = state.next(); }

 private:
  /// Whether such steps may be taken now, whatever rings; the laws may take `laws_share` of the stored energy
  /// in a period of the first mode.
  bool possible(double t, double laws_share);
  double lone_step(double t, double duration);
  /// `smoothed`: for contacts that may hold nodes, after explicit steps by backward Euler from smoothed
  /// velocities.
  void predict(double t, double h, bool smoothed);
  double taken_at_ease(double h) const;
  double budget(double accuracy) const;
  bool at_ease(double h) const;
  bool viscosity_at_ease(double h, double taken, double damped, double kinetic) const;
  void leave_explicit(double t, double h, bool smoothed);
  VecX unresolved_velocities(double h);
  bool loads_hold(double from, double to) const;

  Structure& whole_;
  Leapfrog& leapfrog_;
  CondensedFactors& factors_;
  ModalMotion& modal_;
  bool starting_ = false;  // the first step after explicit ones is not taken yet
  double laws_share_ = 0;  // of the last longest_step()
  double taken_ = 0;       // of the energy of motions, by starts and viscosity of condensed steps so far [J]
  double blow_time_ = -1e300;  // when a blow was last taken that a condensed step may not take [s]; later,
                               // where ringing has to decay first
  // the step at hand
  VecX v_hat_;
  std::vector<double> before_;  // state at its start
  double stored_ = 0;           // elastic energy then [J]
};

}  // namespace talus::fem
