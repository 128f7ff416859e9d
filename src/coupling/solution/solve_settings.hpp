/// How closely the contact problem of a step is solved, and what its solution is good for.
///
/// A residual is a contact velocity that the solution leaves [m/s]; it is asked for relative to a scale,
///
///   scale = speed of the island,      where events are located, and for impulses of no duration
///         = its fastest block's,      in steps that locate none, against the blocks' mean motion; at least
///                                     1e-4 of the island's
///
#pragma once
#include "contact/solver/problem.hpp"

namespace talus::coupling {

struct StepToSolve {
  double h = 0;        // [s]; 0: an impulse of no duration
  bool small = false;  // events are located, or the structures' steps are condensed: solved to round-off
  double located = 0;  // what its solution may leave where events are located, and the step's error is known;
                       // 0: they are not [m/s]
  bool provisional = false;  // its rows are made again about its solution
  bool heap = false;         // many blocks, no structure
  bool bonded = false;       // hard bonds hold
  bool sub_step = false;     // explicit, at a structure
  bool gives = false;        // some of its contacts
  bool sprung =
      false;  // contacts on springs among blocks, which make steps far shorter than the accuracy asks for
  double speed = 0, fastest = 0;  // that the island can have, of its blocks against their mean motion [m/s]
  double length = 0;              // of its smallest block [m]
  double gravity = 0;             // [m/s^2]
  double accuracy = 0;
  double largest_bias = 0;  // of the rows [m/s]
};

contact::SolveSettings how_closely(const StepToSolve& step);

/// When no better solution is to be had.
struct Patience {
  bool no_better = false;    // the rows of another pass are no better
  bool last_resort = false;  // no shorter step is left
};

/// True if a solution that did not meet the tolerance is used all the same. It proves no rest.
bool accepted(const StepToSolve& step, const contact::SolveSettings& settings, Patience patience,
              const contact::SolveReport& report);

}  // namespace talus::coupling
