#include "coupling/solution/solve_settings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/tolerances.hpp"

namespace talus::coupling {

namespace {

/// Round-off is asked for at the finer accuracies alone.
double coarser(double accuracy) { return std::clamp(accuracy / 1e-3, 1.0, 100.0); }

/// Where rows that repeat each other can keep a residual, relative to the speed.
double repeating_rows(double accuracy) { return 1e-10 * coarser(accuracy); }

}  // namespace

contact::SolveSettings how_closely(const StepToSolve& s) {
  contact::SolveSettings settings;
  settings.unstressed = s.small;
  // What springs press Newton's method finds at once.
  settings.goes_on = s.sub_step && !s.gives;
  // Impulses (h = 0) and where events are located to round-off; else to a small part of the speed there is,
  // so that what comes to rest does.
  settings.velocity_scale = s.small || s.h == 0 ? s.speed : std::clamp(s.fastest, 1e-4 * s.speed, s.speed);
  // Of an error of accuracy times the block size a tenth is left to the solver, or a thousandth of what moves
  // still. An error of velocity acts on beyond its step: over the time of a fall by half
  // the size, as in the error of a step: blocks that hardly move are hit by those that do.
  const double fall = std::sqrt(s.length / s.gravity);       // [s]
  const double ordinary = 2 * std::sqrt(s.accuracy) * fall;  // a step of blocks among themselves [s]
  const double allowed = s.h > 0 ? contact::tolerances().solved * s.accuracy * s.length /
                                       std::max(s.h, fall) / settings.velocity_scale
                                 : 0;
  const double coarse = coarser(s.accuracy);
  settings.tolerance = s.small ? 1e-12 * coarse
                       : s.sub_step
                           ? contact::tolerances().still * coarse * s.speed / settings.velocity_scale
                           : std::max(std::min(allowed, s.accuracy),
                                      std::clamp(contact::tolerances().solved * s.accuracy, 1e-8, 1e-4));
  // Where springs make hundreds of steps of one, what they leave adds up, of one sign here and of the other
  // there: so much less is left by each.
  if (s.sprung && !s.small && s.h > 0) settings.tolerance *= std::sqrt(std::min(1.0, s.h / ordinary));
  // Touches that lie close together can keep round-off above the tolerance. Rows linearised about a rough end
  // contradict each other by what that end is off; those of a provisional pass need not be solved closer.
  if (s.small)
    settings.sufficient = s.provisional ? 1e-7 : repeating_rows(s.accuracy);
  else if (s.sub_step)
    settings.sufficient = std::max(settings.tolerance, s.accuracy);
  else if (s.h > 0 && s.heap) {  // twice the part of what moves, at the start or at the end
    settings.of_motion = 2 * s.accuracy;
    settings.most = 0.5 / contact::tolerances().solved * allowed;  // half of all that a step may be off
    settings.sufficient = std::max(2 * settings.tolerance, std::min(settings.most, settings.of_motion));
  }
  // A bond is judged by what it bears, r m/h of a residual r, times the levers of all that hangs on it: as
  // close as it can be had, down to the motion by which one breaks.
  if (s.heap && s.bonded && !s.small && s.h > 0) {
    settings.most = 0;
    settings.sufficient = std::max(settings.sufficient, settings.tolerance);
    settings.tolerance =
        std::min(settings.tolerance, contact::tolerances().still * s.speed / settings.velocity_scale);
  }
  // A loaded spring's row holds its elongation over h: of short steps that leaves no more than round-off of
  // it.
  const double round_off = std::numeric_limits<double>::epsilon() * s.largest_bias / settings.velocity_scale;
  settings.tolerance = std::max(settings.tolerance, 16 * round_off);
  settings.sufficient = std::max(settings.sufficient, 4096 * round_off);
  return settings;
}

bool accepted(const StepToSolve& s, const contact::SolveSettings& settings, Patience patience,
              const contact::SolveReport& r) {
  // Where contacts contradict each other by so little no other rows would help, and where events are located
  // the error of the step is a hundred times as large. The same of a provisional pass: the next would cost as
  // much.
  if (patience.no_better && s.small &&
      r.residual <= std::max(100 * std::max(settings.tolerance, repeating_rows(s.accuracy)),
                             s.located / settings.velocity_scale))
    return true;
  // Of sub-steps at structures no shorter one would be solved closer: a tenth of the accuracy.
  return patience.last_resort && s.sub_step && r.residual <= contact::tolerances().solved * s.accuracy;
}

}  // namespace talus::coupling
