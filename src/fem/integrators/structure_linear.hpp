/// What a structure that stays elastic needs to ring on alone: its modes, and its motion in them.
#pragma once
#include "fem/linear/modal.hpp"

namespace talus::fem {

constexpr double steps_worth_a_factor = 2000;  // explicit ones that cost as much as it and the first
                                               // frequency: 1200 at 10,000 degrees of freedom, 4000 at 80,000

/// Explicit steps that cost about as much as the search for so many modes, factor included. Both grow about
/// alike with the structure: 0.3 s for 24 modes of 9720 degrees of freedom, where a step takes 0.1 ms, of
/// which motion in modes with dense records saves two thirds.
inline double steps_worth(int modes) { return 3500 + 40.0 * modes + static_cast<double>(modes) * modes / 6; }

struct LinearDynamics {
  ModalBasis modes;
  VecX mass;                 // per free degree of freedom, as built
  VecX gravity;              // u_g
  MatX pattern, correction;  // P_l, r_l
  MatX participation;        // Phi^T P, m x l
  // motion, valid while `running`
  bool running = false;
  VecX q, rate, factor;  // factor: c_l at the present time
  // What the modes leave out: it keeps its energy and is damped as they are; its phase is lost.
  VecX rest;                                   // velocity that holds the energy, as of its start [m/s]
  double rest_energy = 0, rest_amplitude = 1;  // [J], as of its start; amplitude left of it
  double excess = 1;                           // amplitude of it as of its start, over what may be left out
};

}  // namespace talus::fem
