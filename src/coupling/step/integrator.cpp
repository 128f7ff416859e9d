// A macro step, step by step: its length, the tries, events, drift correction, commit.
#include "coupling/step/integrator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "contact/tolerances.hpp"
#include "coupling/events/approach.hpp"
#include "coupling/events/crossings.hpp"
#include "coupling/events/step_motion.hpp"
#include "coupling/ground/ground_laws.hpp"
#include "coupling/springs/release.hpp"
#include "coupling/springs/spring_limits.hpp"
#include "coupling/springs/spring_rules.hpp"
#include "coupling/step/accelerations.hpp"
#include "coupling/step/bodies.hpp"
#include "coupling/step/commit.hpp"
#include "coupling/step/failure.hpp"
#include "coupling/step/step_length.hpp"
#include "coupling/structures/condensed.hpp"

namespace talus::coupling {
namespace {
constexpr int most_grazes = 10;  // steps of a macro step cut short by an onset that was none

/// The longest of equal parts of a time that is at most h [s].
double equal_part(double time, double h) {
  return h < time ? time / std::ceil(time / h - contact::tolerances().same_instant) : time;
}

}  // namespace

IslandIntegrator::IslandIntegrator(const dda::Model& model, dda::State& state, Environment& environment,
                                   ContactHistory& history, ContactHistory& surface_history,
                                   const StepSettings& settings)
    : in_{model, state, environment, history, surface_history, settings, any_vegetation(environment.laws)},
      focus_(in_, step_),
      search_(in_, step_, focus_),
      assembly_(in_, step_),
      solver_(in_, step_, report_),
      update_(in_, step_),
      smooth_(in_, step_, assembly_, solver_, update_),
      impacts_(in_, step_, report_, assembly_, solver_, update_, impacts_on_structures_),
      control_(in_, step_, report_, search_, smooth_, solver_),
      locator_(in_, step_, report_, search_, smooth_),
      guard_(in_, step_, report_, impacts_on_structures_),
      correction_(in_, step_, report_, search_, assembly_, solver_),
      record_(in_, step_, report_) {
  in_.scale.accuracy = settings.accuracy;
}

IslandReport IslandIntegrator::advance(const Island& island, const Stretch& stretch, double first_step,
                                       const std::atomic<int>* stop, std::span<const double> rows) {
  in_.stop = stop;
  start_ = stretch.start;
  duration_ = stretch.duration;
  end_ = stretch.end;
  begin(island, rows);
  step_.suggested = first_step;
  run();
  focus_.end();
  return report_;
}

double IslandIntegrator::clock(double done) const {
  return duration_ - done > contact::tolerances().time_round_off * duration_ ? start_ + done : end_;
}

void IslandIntegrator::run() {
  Progress p = begin_steps();
  while (clock(p.done) < end_) {
    Trial trial = next_trial(p);
    resolve_onsets(trial);
    p.grazes += p.impacts_when_cut == impacts_.count();
    limit_length(trial);
    const bool long_step = trial.usual > 0;
    guard_.begin_step();
    const StepControl::Taken result = control_.take(trial);
    if (result == StepControl::Taken::ended) return;
    if (result == StepControl::Taken::unsolved) continue;  // it is time-stepped from here on
    p.restless = p.restless || (long_step && trial.usual == 0);
    if (!p.small && !with_structure())
      step_.suggested = trial.usual > 0 ? trial.h : 0;  // as far is searched next time
    double taken = trial.h;
    if (!trial.time_stepped && !locator_.locate(taken, trial.passes)) {
      reject_step(in_, step_, report_);
      ++in_.unsolved;
      p.longest = 0.5 * trial.h;
      if (p.longest < in_.settings.min_step) return fail_at_smallest_step(in_, step_, report_);
      continue;
    }
    if (report_.stopped) return;  // no onset was sought
    if (taken != trial.h) control_.forget_accelerations();
    p.longest = std::numeric_limits<double>::infinity();
    p.impacts_when_cut = taken < 0.02 * trial.h ? impacts_.count() : -1;
    if (in_.condensed && !correct_condensed(in_, step_, trial.start, taken)) {
      reject_step(in_, step_, report_);
      in_.condensed = false;  // for the rest of the macro step
      continue;
    }
    if (finish(trial, p.done, taken)) {
      p.done += taken;
      continue;
    }
    p.longest = 0.5 * taken;
    // A structure has gone its step: it goes back to the start of the macro step alone.
    report_.shorter = with_structure();
    if (with_structure() || p.longest < in_.settings.min_step)
      return fail_at_drift(in_, report_, guard_.worst());
  }
  report_.next_step = step_.suggested;
}

IslandIntegrator::Progress IslandIntegrator::begin_steps() {
  if (in_.event_driven()) {
    search_.find(equal_part(duration_, step_limit(in_, step_, duration_, false)));
    if (hard_alone(step_.touches) && too_much_happens(in_, step_, solver_.work(), duration_))
      start_time_stepping();
  }
  Progress p;
  p.small = in_.event_driven();
  in_.condensed = with_structure() && may_condense(in_, step_, search_, start_, duration_);
  p.restless = p.small || with_structure() || in_.settings.fixed_step > 0;
  for (const int b : in_.island->blocks)
    p.restless = p.restless || in_.model.blocks[static_cast<std::size_t>(b)].deformable;
  return p;
}

Trial IslandIntegrator::next_trial(const Progress& p) {
  Trial trial;
  trial.start = clock(p.done);
  trial.remaining = duration_ - p.done;
  if (in_.event_driven() && hard_alone(step_.touches) &&
      (in_.over_constrained() || too_much_happens(in_, step_, solver_.work(), duration_)))
    start_time_stepping();
  trial.time_stepped = !in_.event_driven() || p.grazes > most_grazes || in_.over_constrained();
  trial.h = next_length(trial, p.longest);
  if (!p.restless && trial.h < trial.remaining * (1 - contact::tolerances().same_instant) &&
      any_contact(in_, step_) && hard_alone(step_.touches) &&
      all_slow(in_.model, in_.state, in_.island->blocks, rest_speed(in_.model, trial.h)))
    trial.usual = std::exchange(trial.h, trial.remaining);
  return trial;
}

void IslandIntegrator::resolve_onsets(Trial& trial) {
  step_.settling = false;  // of the last step: an impact before this one holds nothing by it
  step_.ahead.assign(in_.island->pairs.size(), 0.0);
  search_.find(trial.h);
  const int impacts_before = impacts_.count();
  release(trial.h);
  if (with_structure() && !in_.condensed) strikes_structure(in_, step_, trial.start, trial.h);
  if (!trial.time_stepped &&
      !impacts_.resolve(trial.start)) {  // without a solution the island is over-constrained
    in_.unsolved = IslandContext::most_unsolved;
    trial.time_stepped = true;
    trial.h = std::min(trial.h, step_limit(in_, step_, trial.remaining, true));
  }
  step_.meets_to_rebound.clear();
  if (trial.time_stepped && !with_structure() && in_.settings.fixed_step <= 0 &&
      std::ranges::any_of(step_.touches, [&](const Touch& t) { return rebounds(in_, t); }) &&
      !costs_too_much(in_, step_, solver_.work(), duration_, true)) {
    if (rebound_waits(in_, step_))
      impacts_.resolve(
          trial.start);  // where it has no solution, the rows of the step have what they can of it
    trial.h = std::min(trial.h, first_rebound(in_, step_, search_, trial.h));
  }
  if (impacts_.count() != impacts_before) control_.forget_accelerations();
}

void IslandIntegrator::limit_length(Trial& trial) {
  estimate_spring_frequencies(in_, step_);
  if (in_.settings.fixed_step <= 0 && !in_.condensed)
    trial.h = std::min(trial.h, spring_limit(in_, step_, trial.h, trial.time_stepped));
  // Where no error is judged at both ends (springs, strains, fixed points) motion within a step stays a small
  // part of the block size.
  if (in_.settings.fixed_step <= 0 && in_.event_driven() && any_contact(in_, step_) &&
      !looks_ahead(in_, step_))
    trial.h = std::min(trial.h, step_limit(in_, step_, trial.remaining, true));
}

bool IslandIntegrator::finish(const Trial& trial, double done, double taken) {
  guard_.keep();
  correct_structures(trial.start, taken);
  const bool released = released_;  // at its start
  const double end = clock(done + taken);
  record_.begin_step(trial.start, end);
  commit_step(in_, step_, report_, shed_, end, taken);
  impacts_on_structures_.report(in_.env, end, start_, duration_,
                                in_.settings.fixed_step > 0 ? in_.settings.fixed_step : duration_,
                                report_.rows);
  released_ = false;
  step_.last_length = in_.leapfrog() ? taken : 0;
  ++report_.counters.steps;
  report_.counters.contacts += static_cast<long>(step_.touches.size());
  report_.counters.last_step = taken;
  std::vector<contact::Motion> made(
      step_.bodies.size());  // of watched blocks: the correction of drift has starts of its own
  for (std::size_t i = 0; i < step_.bodies.size(); ++i)
    if (in_.island->watched[i] != 0)
      made[i] = motion_of(in_, step_, step_.bodies[i].block, trial.time_stepped);
  if (!step_.problem.contacts.empty() || trial.closed) {
    rest_check(taken);
    // At structures as far as the next step reaches, which then need not search again.
    const double penetration = correction_.correct(
        with_structure() && !in_.condensed ? lengthening * std::max(step_.suggested, taken) : taken);
    if (guard_.beyond_motion(taken)) {
      guard_.revert();
      released_ = released;
      control_.forget_accelerations();
      return false;
    }
    report_.counters.worst_penetration = std::max(report_.counters.worst_penetration, penetration);
    guard_.account_gains();
  } else {
    ++report_.counters.flights;
    report_.at_rest = false;
  }
  record_.measure_way(trial.start, end, made);
  record_.end_step();
  return true;
}

void IslandIntegrator::release(double h) {
  if (released_ || search_.loose().empty()) return;
  released_ = true;
  if (!release_springs(in_, search_.loose(), report_.ledger)) return;
  step_.found_for = -1;
  search_.find(h);
}

void IslandIntegrator::start_time_stepping() {
  in_.time_stepping = report_.time_stepped = true;
  const auto closed = static_cast<double>(
      std::ranges::count_if(step_.touches, [&](const Touch& t) { return t.at.gap <= in_.scale.near_gap(); }));
  const double events = solver_.work() - solver_.in_vain();
  step_.suggested = events > 0 ? duration_ * factorisations * closed / events : 0;
  step_.found_for = -1;
}

double IslandIntegrator::next_length(const Trial& trial, double longest) {
  const double remaining = trial.remaining;
  // No farther than the step will reach: what the last one's projection found then serves again.
  const double expected =
      step_.suggested > 0
          ? std::min(remaining, (with_structure() && !in_.condensed ? lengthening : 1.0) * step_.suggested)
          : equal_part(remaining, step_limit(in_, step_, remaining, trial.time_stepped));
  if (with_structure() && !in_.condensed && (step_.suggested > 0 || in_.island->blocks.empty()))
    if (focus_.follow(expected)) search_.forget_surfaces();
  search_.find(expected);
  double h = step_limit(in_, step_, remaining, trial.time_stepped);
  if (in_.time_stepping && step_.suggested > 0) h = std::min(h, step_.suggested);
  if (in_.condensed) {
    const double length = condensed_length(in_, step_, search_, trial.start, duration_, remaining, h);
    in_.condensed = length > 0;
    if (in_.condensed)
      h = length;
    else
      step_.found_for = -1;  // a bed then stands on other points
  }
  if (!in_.condensed) step_.condensed_surfaces.clear();
  if (with_structure() && !in_.condensed) h = structure_step(in_, step_, duration_, h);
  h = std::min({h, remaining, longest});
  return in_.condensed ? h : equal_part(remaining, h);
}

void IslandIntegrator::correct_structures(double t, double h) {
  shed_ = std::exchange(sheds_, false);
  for (int s : in_.island->structures) {
    StructurePart& part = in_.env.structures[static_cast<std::size_t>(s)];
    if (!in_.condensed) part.structure->correct(t, h, shares_of(step_, s));
    sheds_ = sheds_ || part.structure->skin().surface().revision != part.index->surface().revision;
    part.index->refit(part.structure->skin().surface());
    ++(in_.condensed ? report_.counters.condensed_steps : report_.counters.structure_steps);
  }
}

void IslandIntegrator::rest_check(double h) {
  double still = rest_speed(in_.model, h);
  bool rest = still > 0 && step_.solution.certified;
  for (int s : in_.island->structures)
    rest = rest && in_.condensed && in_.env.structures[static_cast<std::size_t>(s)].structure->quiet();
  if (in_.condensed) still += 2 * surface_speed(in_, step_);
  for (const Body& b : step_.bodies) {
    const auto k = static_cast<std::size_t>(b.block);
    const double radius = in_.model.blocks[k].shape->radius;
    rest = rest && b.v0.head<3>().norm() + radius * b.v0.segment<3>(3).norm() <= still &&
           in_.state.v[k].norm() + radius * in_.state.w[k].norm() <= still &&
           (!in_.model.blocks[k].deformable ||
            radius * (in_.state.eps_rate[k].norm() + b.v0.tail<6>().norm()) <= still);
  }
  report_.at_rest = rest;
}

void IslandIntegrator::begin(const Island& island, std::span<const double> rows) {
  in_.begin(island);
  report_ = IslandReport{};
  step_ = Step{};  // or an island would go on with what is left of another one
  step_.bodies.resize(island.blocks.size());
  for (std::size_t i = 0; i < island.blocks.size(); ++i) step_.bodies[i].block = island.blocks[i];
  released_ = sheds_ = shed_ = false;
  focus_.begin();
  search_.begin();
  solver_.begin();
  impacts_.begin();
  impacts_on_structures_.clear();
  control_.forget_accelerations();
  record_.begin(rows);
}

}  // namespace talus::coupling
