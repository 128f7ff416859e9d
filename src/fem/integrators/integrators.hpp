/// The integrators of a structure, and which of them moves it where nothing touches it: none while it is at
/// rest, modes, condensed steps or explicit ones.
#pragma once
#include "fem/integrators/condensed_motion.hpp"

namespace talus::fem {

struct Integrators {
  Integrators(Structure& whole, StructureBody& body, NodalFields& fields, Forces& forces,
              EnergyAccount& energy, MemberLoads& loads, Fracture& fracture)
      : leapfrog(body, fields, forces, energy, loads, fracture),
        factors(body, loads.stresses()),
        modal(body, fields, forces, energy, loads, leapfrog, factors),
        condensed(whole, body, fields, forces, energy, loads, leapfrog, factors, modal),
        body_(body),
        fields_(fields),
        energy_(energy) {}

  /// As Structure says.
  std::string advance_alone(double t, double duration);
  bool quiet() const;

  Leapfrog leapfrog;
  CondensedFactors factors;
  ModalMotion modal;
  CondensedMotion condensed;

 private:
  bool undisturbed(double t, double duration) const;  // at rest, and no load changes until t + duration
  double settling_time() const;  // for which kinetic energy has to stay small to mean rest [s]

  StructureBody& body_;
  NodalFields& fields_;
  EnergyAccount& energy_;
};

}  // namespace talus::fem
