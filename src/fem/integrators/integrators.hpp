/// The integrators of a structure, and which of them moves it where nothing touches it: none while it is at
/// rest, modes, condensed steps or explicit ones.
#pragma once
#include "fem/integrators/condensed_motion.hpp"

namespace talus::fem {

struct Integrators : protected MovingStructure {
  Integrators(Structure& whole, const MovingStructure& structure, Fracture& fracture)
      : MovingStructure(structure),
        leapfrog(structure, fracture),
        factors(body_, loads_.stresses()),
        modal(structure, leapfrog, factors),
        condensed(whole, structure, leapfrog, factors, modal) {}

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
};

}  // namespace talus::fem
