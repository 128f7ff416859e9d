// One step until it stands: solved, then shortened while its error, its energy or something met on the way
// asks for it.
#include "coupling/step/control.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "contact/tolerances.hpp"
#include "coupling/events/approach.hpp"
#include "coupling/events/crossings.hpp"
#include "coupling/events/drag.hpp"
#include "coupling/rows/bonds.hpp"
#include "coupling/rows/contact_rows.hpp"
#include "coupling/search/contact_search.hpp"
#include "coupling/springs/spring_limits.hpp"
#include "coupling/step/accelerations.hpp"
#include "coupling/step/bodies.hpp"
#include "coupling/step/failure.hpp"
#include "coupling/step/step_length.hpp"
#include "coupling/structures/condensed.hpp"

namespace talus::coupling {
namespace {

/// The touch that slid farthest at the start and sticks by the solution, if that matters; -1: none.
int stopped_touch(const IslandContext& in, const Step& step, double h) {
  int stopped = -1;
  double longest =
      std::max(contact::tolerances().stop_located * in.scale.error_limit(),
               std::min(in.scale.error_limit(), contact::tolerances().overlap_none)) *
      in.scale.length;  // what sliding on would add at most; to locate a stop costs little, down to round-off
  for (std::size_t i = 0; i < step.touches.size(); ++i) {
    const Touch& touch = step.touches[i];
    const bool trapezoid =
        touch.mode == Mode::closed || (touch.mode == Mode::spring_mean && touch.shear_stiffness == 0);
    if (touch.row < 0 || !trapezoid || !(touch.impulse[0] > 0)) continue;
    const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(touch.row)];
    const bool sticks = !at_coulomb_bound(c, touch.impulse);
    const double path = 0.5 * h * touch.slip.norm();
    if (!sticks || path <= longest) continue;
    longest = path;
    stopped = static_cast<int>(i);
  }
  return stopped;
}

/// True if the step just computed made more energy than the accuracy allows of what the island moves and
/// stores: its error, and order 2 or better. A body that oscillates on its fixed points alone may not lose
/// energy either: it gains going down what it loses going up, and steps shortened there alone would brake it
/// in every period.
bool gains_energy(const IslandContext& in, const Step& step) {
  double scale = 0, round_off = 0;
  bool swings = false;
  for (const Body& b : step.bodies) {
    const double mass = in.model.blocks[static_cast<std::size_t>(b.block)].mass;
    swings = swings || !in.model.blocks[static_cast<std::size_t>(b.block)].fixed_points.empty();
    round_off +=
        1e-14 * mass *
        (in.scale.speed * in.scale.speed + in.model.gravity.norm() * (in.scale.length + b.start.c.norm()));
    scale += 0.5 * mass * b.v0.head<3>().squaredNorm() + b.internal0 +
             0.1 * in.settings.accuracy * mass * in.model.gravity.norm() * in.scale.length;
  }
  for (const Touch& t : step.touches)
    if (t.row >= 0) scale += t.stored, swings = false;
  return (swings ? std::abs(step.pending.algorithmic) : -step.pending.algorithmic) >
         contact::tolerances().gain * in.settings.accuracy * scale + round_off;
}

}  // namespace

StepControl::StepControl(IslandContext& in, Step& step, IslandReport& report, ContactSearch& search,
                         SmoothStep& smooth, ProblemSolver& solver)
    : in_(in), step_(step), report_(report), search_(search), smooth_(smooth), solver_(solver) {}

StepControl::Taken StepControl::take(Trial& trial) {
  trial.closed = any_contact(in_, step_);
  trial.passes = trial.time_stepped || !trial.closed ? 1 : 3;
  trial.adaptive = !trial.time_stepped && in_.settings.fixed_step <= 0;
  trial.asked = trial.h;
  save_bodies(in_, step_);
  step_.solution.stagnated = false;
  const bool ahead = trial.adaptive && trial.closed && looks_ahead(in_, step_);
  if (ahead && !allowed_) allowed_ = allowed_accelerations(in_, step_, report_, solver_.solver());
  std::optional<std::vector<Vec6>> allowed_at_end;
  for (;;) {
    if (stopped(in_, report_)) return Taken::ended;
    step_.length = trial.h;
    for (int s : in_.island->structures) {
      Structure& structure = *in_.env.structures[static_cast<std::size_t>(s)].structure;
      in_.condensed ? structure.condensed().predict(trial.start, trial.h)
                    : structure.predict(trial.start, trial.h);
    }
    if (in_.condensed) {
      gather_condensed_surfaces(in_, step_);
      update_surface_approaches(in_, step_);
    }
    // Halving brings the solution nearer to the last one's; where that does not help, what can be solved is
    // taken.
    const int halvings =
        !in_.island->structures.empty() && !in_.condensed ? 2 : 8;  // sub-steps are as near already
    const SmoothStep::Outcome o =
        smooth_.solve(trial.h, trial.time_stepped, trial.passes,
                      trial.halved >= halvings || 0.5 * trial.h < in_.settings.min_step);
    if (refused(trial, o)) {
      if (!trial.time_stepped && in_.over_constrained()) return Taken::unsolved;
      if (trial.h >= in_.settings.min_step) continue;
      fail_at_smallest_step(in_, step_, report_);
      return Taken::ended;
    }
    if (shortened(trial)) continue;
    double by_ends = 0;  // error by the accelerations at both ends, over what it may be
    if (ahead && allowed_ && (allowed_at_end = allowed_accelerations(in_, step_, report_, solver_.solver())))
      by_ends = error_by_ends(in_, step_, trial.h, *allowed_, *allowed_at_end);
    if (trial.adaptive) by_ends = std::max(by_ends, error_by_end_rule(in_, step_, trial.h));
    if (by_ends > 1 && may_shorten(trial)) {
      reject_step(in_, step_, report_);
      trial.h *= std::clamp(0.9 / std::sqrt(by_ends), 0.1, 0.7);
      continue;
    }
    allowed_ = std::move(allowed_at_end);
    if (trial.adaptive && trial.closed) {
      const double error = std::max(o.error / in_.scale.error_limit(), by_ends),
                   fastest_growth = ahead ? 5.0 : 2.0;  // what an event made short grows again
      const double grow =
          error > 0 ? std::clamp(0.9 / std::cbrt(error), 0.3, fastest_growth) : fastest_growth;
      // The rest of a macro step, shorter than the step would be, says nothing against the longer one.
      const bool clipped =
          trial.h >= trial.remaining * (1 - contact::tolerances().time_round_off) && grow >= 1;
      step_.suggested = clipped ? std::max(step_.suggested, trial.h * grow) : trial.h * grow;
      if (trial.breaks > 0 || step_.settling || trial.at_layer)
        step_.suggested =
            std::max(step_.suggested, trial.asked);  // short for its bond's sake, or for a bounce's
    }
    return Taken::yes;
  }
}

bool StepControl::refused(Trial& trial, const SmoothStep::Outcome& o) {
  if (trial.usual > 0 &&
      !(o.ok && step_.solution.certified &&
        all_slow(in_.model, in_.state, in_.island->blocks, rest_speed(in_.model, trial.usual)))) {
    reject_step(in_, step_, report_);  // it does not go on standing: a step like any other
    trial.h = std::exchange(trial.usual, 0.0);
    return true;
  }
  const double limit = in_.scale.error_limit();
  if (o.ok && !(trial.adaptive && o.error > limit && may_shorten(trial))) return false;
  reject_step(in_, step_, report_);
  if (!o.ok) {
    ++report_.counters.halved, ++trial.halved;
    in_.unsolved += solver_.not_worth_more() ? IslandContext::most_unsolved : 1;
  }
  trial.h *= o.ok && !in_.condensed ? std::clamp(0.9 * std::cbrt(limit / o.error), 0.2, 0.9) : 0.5;
  return true;
}

bool StepControl::shortened(Trial& trial) {
  if (cut_at_layer(trial)) return true;
  if (trial.adaptive && may_shorten(trial) && gains_energy(in_, step_) && ++trial.refined <= 8) {
    reject_step(in_, step_, report_);
    trial.h *= 0.5;
    return true;
  }
  if (trial.time_stepped && may_shorten(trial) && ++trial.cuts <= 30 && resolve_crossings(trial)) return true;
  if (in_.island->structures.empty() && in_.settings.fixed_step <= 0 && may_shorten(trial) &&
      cut_at_break(trial))
    return true;
  if (in_.condensed && in_.settings.fixed_step <= 0) {
    const double error = condensed_error(in_, step_, trial.h);
    if (error > in_.scale.error_limit() && may_shorten(trial)) {
      reject_step(in_, step_, report_);
      trial.h *= 0.5;
      return true;
    }
    step_.suggested = error < in_.scale.error_limit() / 8 ? 2 * trial.h : trial.h;
  }
  if (!trial.adaptive || !trial.closed) return false;
  if (trial.releases < 3 && cut_at_release(in_, step_, trial.h)) {
    ++trial.releases;
    restore_bodies(in_, step_);
    return true;
  }
  if (cut_at_settling(trial)) return true;
  return cut_at_stop(trial);
}

bool StepControl::resolve_crossings(Trial& trial) {
  const Crossing met = CrossingSearch(in_, step_, search_).find();
  if (met.first >= 1 && !met.listed) return false;
  reject_step(in_, step_, report_);
  step_.each_touch([&](Touch& touch) {
    if (touch.row >= 0 && touch.stiffness == 0) touch.warm = touch.frame * touch.impulse / trial.h;
  });
  if (met.first < 1) trial.h *= in_.condensed ? 0.5 : std::clamp(0.99 * met.first, 0.01, 0.99);
  if (met.listed) search_.add_rows(met.features);
  return true;
}

bool StepControl::cut_at_break(Trial& trial) {
  const auto gives = [&](const Touch& t) {
    return t.row >= 0 && !t.impulse.isZero(0) && bond_breaks(in_, step_, t);
  };  // what merely opens bears nothing
  const bool broken = std::any_of(step_.touches.begin(), step_.touches.end(), gives);
  if (!broken && (trial.breaks == 0 || trial.h <= trial.holds)) return false;
  (broken ? trial.breaks : trial.holds) = trial.h;
  const double sharp = std::max(
      10 * in_.settings.min_step,
      (trial.time_stepped ? 1 : 1e-3) * in_.settings.accuracy * in_.scale.length / in_.scale.speed);  // [s]
  const bool found = trial.breaks - trial.holds <= sharp;
  if (found && broken) return false;
  restore_bodies(in_, step_);
  // Most bonds that break are overloaded from the start of the step on, since something else broke there.
  if (found)
    trial.h = trial.breaks;
  else
    trial.h = trial.holds > 0 ? 0.5 * (trial.holds + trial.breaks) : sharp;
  return true;
}

bool StepControl::cut_at_settling(Trial& trial) {
  if (step_.settling || !may_shorten(trial)) return false;
  double fastest = 0;  // what was pressed before is closed again soon
  for (const Touch& t : step_.touches)
    if (t.row >= 0 && t.mode == Mode::closed && !t.persistent && t.impulse[0] > 0 &&
        0.5 * t.approach * trial.h > 1e-2 * in_.scale.touch_gap())
      fastest = std::max(fastest, t.approach);
  if (fastest == 0) return false;
  restore_bodies(in_, step_);
  step_.settling = true;
  trial.h = std::min(trial.h, std::max(4 * fastest / in_.model.gravity.norm(), 10 * in_.settings.min_step));
  return true;
}

bool StepControl::cut_at_stop(Trial& trial) {
  if (trial.stop_located || !may_shorten(trial)) return false;
  if (const int stopped = stopped_touch(in_, step_, trial.h); stopped >= 0) {
    trial.stopping = stopped;
    restore_bodies(in_, step_);
    trial.h *= 0.5;
    return true;
  }
  if (trial.stopping < 0) return false;
  // Slides to the end of this shorter step: friction takes its speed at a steady rate.
  trial.stop_located = true;
  const Touch& touch = step_.touches[static_cast<std::size_t>(trial.stopping)];
  const Body& b = step_.bodies[static_cast<std::size_t>(in_.local[static_cast<std::size_t>(touch.b)])];
  const Vec3 from = touch.slip;
  const Pose now = dda::pose(in_.state, touch.b);
  const double left =
      slip_velocity(in_, touch, now.c + now.F * (b.start.F.inverse() * (touch.acts_at - b.start.c)))
          .dot(from) /
      from.squaredNorm();
  if (!(left > 0.05 && left < 1)) return false;
  restore_bodies(in_, step_);
  trial.h = std::min(trial.h / (1 - left), 2 * trial.h);  // it has stopped in twice the step
  return true;
}

bool StepControl::cut_at_layer(Trial& trial) {
  if (!in_.vegetated || in_.leapfrog() || !may_shorten(trial)) return false;
  double first = trial.h;
  for (const Body& b : step_.bodies) first = std::min(first, first_change_of_drag(in_, b, trial.h));
  // A little beyond, so that the next step begins in the other layer; what is left of this one is no matter.
  const double end = first + in_.settings.min_step;
  if (end + in_.settings.min_step >= trial.h) return false;
  restore_bodies(in_, step_);
  trial.h = end;
  trial.at_layer = true;
  return true;
}

}  // namespace talus::coupling
