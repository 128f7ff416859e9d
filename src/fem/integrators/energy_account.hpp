/// The energy of a structure, kinetic and stored, and the works that have changed it.
///
/// Energies are those of the half step n + 1/2, for which the central difference closes its account exactly
/// when the structure is linear: kinetic 1/2 m v_{n+1/2}^2, stored U(u_n) + h/2 f_int(u_n) . v_{n+1/2} = 1/2
/// u_n K u_{n+1}. Every work is the impulse times the mean of the velocities before and after.
///
/// These energies depend on h: where it changes from h1 to h2 at t_n, the motion as it was, they change by
/// -(h2^2 - h1^2)/8 a . f, a the acceleration and f what the structure does by itself, gravity and internal
/// forces. What that is on the average over the phases of whatever rings is accounted for apart, as
/// step_dependence:
///
///   (h2^2 - h1^2)/8 Q,   Q = 1/2 v . (df_int/dt) + 1/2 a . f,
///                        v . (df_int/dt) = v_{n-1/2} . (f_int,n - f_int,n-1) / h1
///
/// The two halves differ by the rate of v . f, which is nothing on the average of what stays in bounds,
/// whatever the laws of the cells. Of a mode of amplitude A, Q is omega^4 A^2 / 2 on the average, for any h
/// below the stable step. The phase's part stays among the scheme's, algorithmic: a step that changes in time
/// with what rings feeds it.
#pragma once
#include "fem/integrators/forces.hpp"

namespace talus::fem {

struct EnergyAccount {
  EnergyAccount(StructureBody& body, NodalFields& fields, Forces& forces)
      : body_(body), fields_(fields), forces_(forces) {}

  StructureEnergy works;     // the cumulative ones
  double stored_half = 0;    // elastic energy at the half step
  double power = 0;          // f_int . v of the last step, with the forces that it began from [W]
  bool power_valid = false;  // they have not jumped since, as cells went

  StructureEnergy total() const;
  double mechanical() const;  // kinetic, stored and gravity, at the time of the velocities [J]
  void lengthen(double h, double own, double strained);
  /// Accounts for the last evaluation of the laws, and makes it the accepted one.
  void accept_laws();

 private:
  StructureBody& body_;
  NodalFields& fields_;
  Forces& forces_;
};

}  // namespace talus::fem
