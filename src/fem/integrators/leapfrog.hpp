/// Explicit steps of a structure.
///
///   m a = f_ext(t) - f_int(u) - f_visc - alpha m v + r,      M lumped by rows, r reactions of the supports
///   predict:  v_hat = (v_{n-1/2} (1 - a) + k m^-1 f_n) / (1 + a),  a = alpha k / 2,  k = (h_{n-1} + h_n) / 2
///   correct:  v_{n+1/2} = v_hat + m^-1 p,   u_{n+1} = u_n + h_n v_{n+1/2}
///
/// k equals h while the step does not change; after a change, and at the start (h_{-1} = 0), it keeps the
/// scheme of second order, since velocities live at half steps [belytschko2014, 6.2]. alpha = 2 zeta omega_1.
///
/// symbol   meaning                                   unit   shape
/// u        displacement from the unstressed shape    m      nodes x 4 (padded)
/// v        velocity at the last half step            m/s    nodes x 4
/// m        lumped mass                               kg     nodes
#pragma once
#include "fem/fracture/fracture.hpp"
#include "fem/integrators/moving_structure.hpp"

namespace talus::fem {

class Leapfrog : protected MovingStructure {
 public:
  Leapfrog(const MovingStructure& structure, Fracture& fracture)
      : MovingStructure(structure), fracture_(fracture) {}

  void predict(double t, double h);
  void correct(double t, double h, std::span<const NodeImpulse> impulses);
  /// Steps without any contact.
  void advance(double t, double duration);
  void synchronise(double t);
  const AlignedVector& jump() const { return jump_; }

 private:
  struct StepWorks;
  std::vector<NodeImpulse> impulses_here(std::span<const NodeImpulse> given) const;
  void take_impulses(double h, std::span<const NodeImpulse> impulses);
  void move_nodes(double h, double kick, StepWorks& works);
  void account(double h, double kick, const StepWorks& works);
  double excess_of_gravity(double kick, double h) const;
  double power_of_own_forces(double kick) const;
  void begin(double h);
  void find_jump(double h);  // into jump_
  void keep_momenta();       // of jump_, of a free structure

  Fracture& fracture_;
  AlignedVector
      jump_;  // what the velocities lose in the step that was predicted, whose length jumps; empty: nothing
};

}  // namespace talus::fem
