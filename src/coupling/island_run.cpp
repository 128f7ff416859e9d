// A stretch step by step: its length, the tries, events, projection, commit.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "contact/tolerances.hpp"
#include "coupling/island_body.hpp"
#include "coupling/name_contacts.hpp"

namespace talus::coupling {
namespace {
constexpr double lengthening = 1.02;  // of a step at a structure, at most
constexpr double most_work = 10000;  // contacts times factorisations that events may cost per step of a large
                                     // island, or `dearer` times what such a step costs itself
constexpr double factorisations = 15;  // of a time step, or of an event
constexpr int most_grazes = 10;        // steps of a stretch cut short by an onset that was none

/// The longest of equal parts of a time that is at most h [s].
double equal_part(double time, double h) {
  return h < time ? time / std::ceil(time / h - contact::tolerances().same_instant) : time;
}

bool hard_alone(const std::vector<Touch>& touches) {
  return std::all_of(touches.begin(), touches.end(), [](const Touch& t) { return t.stiffness == 0; });
}
/// Time in which a rigid block can meet none of its partners: the balls around it and around blocks, by their
/// speeds and all of gravity; 0 beside terrain and structures [s].
double apart_for(const IslandContext& in, const Body& body) {
  const auto ball = [&](int block) {
    return 1.001 * in.model.blocks[static_cast<std::size_t>(block)].shape->radius;
  };
  const auto rigid = [&](int block) {
    return !in.model.blocks[static_cast<std::size_t>(block)].deformable &&
           in.model.blocks[static_cast<std::size_t>(block)].fixed_points.empty();
  };
  if (!rigid(body.block)) return 0;
  double time = std::numeric_limits<double>::infinity();
  for (const CandidatePair& pair : in.island->pairs) {
    const bool is_b = pair.b == body.block,
               is_a = pair.a.kind == Partner::Kind::block && pair.a.index == body.block;
    if (!is_a && !is_b) continue;
    const auto k = static_cast<std::size_t>(pair.b), of_a = static_cast<std::size_t>(pair.a.index);
    double gap = 0, closing = 0;
    if (pair.a.kind == Partner::Kind::plane) {
      const Plane& plane = in.env.planes[of_a];
      gap = plane.normal.dot(in.state.c[k] - plane.point) - ball(pair.b);
      closing = -plane.normal.dot(in.state.v[k]);
    } else if (pair.a.kind == Partner::Kind::block && rigid(pair.a.index) && rigid(pair.b)) {
      gap = (in.state.c[k] - in.state.c[of_a]).norm() - ball(pair.b) - ball(pair.a.index);
      // Drag that brakes one of them alone brings on the other.
      closing = in.vegetated ? in.state.v[k].norm() + in.state.v[of_a].norm()
                             : (in.state.v[k] - in.state.v[of_a]).norm();
    }
    if (!(gap > 0)) return 0;
    const double g = in.model.gravity.norm(),
                 root = std::sqrt(closing * closing + 2 * g * gap);  // closing t + g t^2 / 2 = gap
    if (root + closing > 0) time = std::min(time, 2 * gap / (root + closing));
  }
  return time;
}

}  // namespace

IslandReport IslandStepper::advance(const Island& island, double t, double duration, double first_step,
                                    const std::atomic<int>* stop, std::span<const double> rows) {
  begin(island);
  stop_ = stop;
  rows_ = rows;
  suggested_ = first_step;
  IslandReport report = run(t, duration);
  end_following();
  return report;
}

IslandReport IslandStepper::run(double t, double duration) {
  const bool with_structure = !in_.island->structures.empty();
  if (in_.event_driven()) {
    find(equal_part(duration, step_limit(duration, false)));
    if (hard_alone(step_.touches) && too_much_happens(duration)) go_time_stepped();
  }
  const bool small = in_.event_driven();
  double done = 0;
  stretch_start_ = t, stretch_ = duration;
  step_.last_length = 0;
  sheds_ = shed_ = false;
  int grazes = 0, impacts_when_cut = -1;  // the latter: negative if the last step was not cut short
  double longest =
      std::numeric_limits<double>::infinity();  // of the next step, where the last try found no solution [s]
  in_.condensed = with_structure && may_condense(t, duration);
  bool restless = small || with_structure || in_.settings.fixed_step > 0;  // no long steps of what stands
  for (int b : in_.island->blocks)
    restless = restless || in_.model.blocks[static_cast<std::size_t>(b)].deformable;
  while (duration - done > contact::tolerances().time_round_off * duration) {
    Trial trial;
    trial.start = t + done;
    trial.remaining = duration - done;
    if (in_.event_driven() && hard_alone(step_.touches) && (in_.jammed() || too_much_happens(duration)))
      go_time_stepped();
    trial.lumped = !in_.event_driven() || grazes > most_grazes || in_.jammed();
    trial.h = next_length(trial, duration, longest);
    if (!restless && trial.h < trial.remaining * (1 - contact::tolerances().same_instant) &&
        any_contact(in_, step_) && hard_alone(step_.touches) &&
        stand(in_.model, in_.state, in_.island->blocks, still_speed(in_.model, trial.h)))
      trial.usual = std::exchange(trial.h, trial.remaining);
    find(trial.h);
    const int impacts_before = impacts_;
    release_springs(trial.h);
    if (with_structure && !in_.condensed) strikes_structure(in_, step_, trial.start, trial.h);
    if (!trial.lumped && !impact_stage(trial.start)) {  // what no impulse of no duration solves is jammed
      in_.unsolved = IslandContext::most_unsolved;
      trial.lumped = true;
      trial.h = std::min(trial.h, step_limit(trial.remaining, true));
    }
    step_.meets_to_rebound.clear();
    if (trial.lumped && !with_structure && in_.settings.fixed_step <= 0 &&
        std::ranges::any_of(step_.touches, [&](const Touch& t) { return rebounds(in_, t); }) &&
        !costs_too_much(duration, true)) {
      if (rebound_waits(in_, step_))
        impact_stage(trial.start);  // where it has no solution, the rows of the step have what they can of it
      trial.h = std::min(trial.h, first_rebound(trial.h));
    }
    if (impacts_ != impacts_before) allowed_.reset();
    grazes += impacts_when_cut == impacts_;
    estimate_spring_frequencies(in_, step_);
    if (in_.settings.fixed_step <= 0 && !in_.condensed)
      trial.h = std::min(trial.h, spring_limit(in_, step_, trial.h, trial.lumped));
    // Where no error is judged at both ends (springs, strains, fixed points) motion within a step stays a
    // small part of the block size.
    if (in_.settings.fixed_step <= 0 && in_.event_driven() && any_contact(in_, step_) &&
        !looks_ahead(in_, step_))
      trial.h = std::min(trial.h, step_limit(trial.remaining, true));
    const bool long_step = trial.usual > 0;
    before_drift_.overlaps = sum_of_overlaps(step_);
    if (!take(trial)) return report_;
    restless = restless || (long_step && trial.usual == 0);
    if (!small && !with_structure)
      suggested_ = trial.usual > 0 ? trial.h : 0;  // as far is searched next time
    double taken = trial.h;
    if (!trial.lumped && !locate_event(taken, trial.passes)) {
      reject();
      ++in_.unsolved;
      longest = 0.5 * trial.h;
      if (longest < in_.settings.min_step) return fail_at_smallest_step();
      continue;
    }
    if (report_.stopped) return report_;  // no onset was sought
    if (taken != trial.h) allowed_.reset();
    longest = std::numeric_limits<double>::infinity();
    impacts_when_cut = taken < 0.02 * trial.h ? impacts_ : -1;
    if (in_.condensed && !correct_skins(trial.start, taken)) {
      reject();
      in_.condensed = false;  // for the rest of the stretch
      continue;
    }
    keep_for_drift();
    correct_structures(trial.start, taken);
    const bool released = released_;  // at its start
    const bool recorded = begin_motion(trial.start, t + (done + taken));
    commit(t + done + taken, taken);
    step_.last_length = in_.leapfrog() ? taken : 0;
    ++report_.counters.steps;
    report_.counters.contacts += static_cast<long>(step_.touches.size());
    report_.counters.last_step = taken;
    std::vector<contact::Motion> made(
        step_.bodies.size());  // of watched blocks: the correction of drift has starts of its own
    for (std::size_t i = 0; i < step_.bodies.size(); ++i)
      if (in_.island->watched[i] != 0) made[i] = motion_of(step_.bodies[i].block, trial.lumped);
    if (!step_.problem.contacts.empty() || trial.closed) {
      rest_check(taken);
      // At structures as far as the next step reaches, which then need not search again.
      const double penetration =
          project(with_structure && !in_.condensed ? lengthening * std::max(suggested_, taken) : taken);
      if (drift_beyond_motion(taken)) {
        take_back();
        released_ = released;
        allowed_.reset();
        longest = 0.5 * taken;
        if (with_structure || longest < in_.settings.min_step) return fail_at_drift();
        continue;
      }
      report_.counters.worst_penetration = std::max(report_.counters.worst_penetration, penetration);
      look_for_gains();
    } else {
      ++report_.counters.flights;
      report_.at_rest = false;
    }
    measure_way(trial.start, t + done + taken, made);
    if (recorded) end_motion();
    done += taken;
  }
  report_.next_step = suggested_;
  return report_;
}

/// For the rest of the stretch: its steps are others, and so is what they reach. Time steps lose energy of
/// first order in their length: they are as short as the work that events have taken in vain would have paid
/// for over the stretch, so that neither costs more than the other.
void IslandStepper::go_time_stepped() {
  in_.crowded = true;
  const auto closed = static_cast<double>(
      std::ranges::count_if(step_.touches, [&](const Touch& t) { return t.at.gap <= in_.scale.near_gap(); }));
  suggested_ = work_ > 0 ? stretch_ * factorisations * closed / work_ : 0;
  step_.found_for = -1;
}

bool IslandStepper::too_much_happens(double duration) const {
  if (in_.settings.fixed_step > 0) return false;
  const auto closed =
      std::ranges::count_if(step_.touches, [&](const Touch& t) { return t.at.gap <= in_.scale.near_gap(); });
  return closed > static_cast<std::ptrdiff_t>(many_contacts) || costs_too_much(duration, false);
}

/// Events are worth their exactness as long as they cost no more than so many steps of a large island would:
/// each of those `most_work`.
bool IslandStepper::costs_too_much(double duration, bool rebounds_alone) const {
  // What it costs to locate every contact that will close, at the closed contacts that each of them shakes.
  const double fall = duration * duration * in_.model.gravity.norm();
  double closed = 0, closing = 0;
  for (std::size_t i = 0; i < step_.touches.size(); ++i) {
    const Touch& t = step_.touches[i];
    if (t.at.gap <= in_.scale.near_gap()) ++closed;
    const bool first = i == 0 || !(step_.touches[i - 1].a == t.a && step_.touches[i - 1].b == t.b);
    closing += first && t.at.gap > in_.scale.near_gap() && t.at.gap + duration * t.approach < fall &&
               (!rebounds_alone || rebounds(in_, t));
  }
  const double ahead = factorisations * closed * closing;
  const double worth = std::max(most_work, StepSettings::dearer * factorisations * closed);
  return work_ + ahead > worth * std::ceil(duration / step_limit(duration, true));
}

/// Length of the next step by what moves and what it stands at; the touches within its reach are found on the
/// way.
double IslandStepper::next_length(const Trial& trial, double duration, double longest) {
  const bool with_structure = !in_.island->structures.empty();
  const double remaining = trial.remaining;
  // No farther than the step will reach: what the last one's projection found then serves again.
  const double expected =
      suggested_ > 0
          ? std::min(remaining, (with_structure && !in_.condensed ? lengthening : 1.0) * suggested_)
          : equal_part(remaining, step_limit(remaining, trial.lumped));
  if (with_structure && !in_.condensed && (suggested_ > 0 || in_.island->blocks.empty()))
    follow_skins(expected);
  find(expected);
  double h = step_limit(remaining, trial.lumped);
  if (in_.crowded && suggested_ > 0) h = std::min(h, suggested_);
  if (in_.condensed) {
    const double length = condensed_length(trial.start, duration, remaining, h);
    in_.condensed = length > 0;
    if (in_.condensed)
      h = length;
    else
      step_.found_for = -1;  // a bed then stands on other points
  }
  if (!in_.condensed) step_.skins.clear();
  if (with_structure && !in_.condensed) h = structure_step(duration, h);
  h = std::min({h, remaining, longest});
  return in_.condensed ? h : equal_part(remaining, h);
}

double IslandStepper::step_limit(double remaining, bool lumped) const {
  if (in_.settings.fixed_step > 0) return in_.settings.fixed_step;
  if (!lumped) {
    double h = any_contact(in_, step_) && suggested_ > 0 ? suggested_ : remaining;
    // In flight the onset search follows chords: half a radian at most, of what may meet anything within the
    // step however it turns.
    for (const Body& b : step_.bodies) {
      const double spin = in_.state.w[static_cast<std::size_t>(b.block)].norm();
      if (spin * h > 0.5 && !in_.island->pairs.empty())
        h = std::min(h, std::max(0.5 / spin, apart_for(in_, b)));
      if (in_.vegetated) h = std::min(h, drag_limit(in_, b));
    }
    return h;
  }
  // Large islands: motion within a step stays a small part of the block size, set by accuracy.
  double h = in_.settings.time_step(in_.scale.length, in_.model.gravity.norm());
  for (const Body& b : step_.bodies) {
    const auto k = static_cast<std::size_t>(b.block);
    const double radius = in_.model.blocks[k].shape->radius;
    const double spin = in_.state.w[k].norm();
    if (spin > 0) h = std::min(h, std::sqrt(in_.settings.accuracy * 8) / spin);
    const double speed = in_.state.v[k].norm();
    if (speed > 0) h = std::min(h, 5 * std::sqrt(in_.settings.accuracy) * radius / speed);
  }
  return h;
}

/// Step at structures: equal parts of the stretch below the stable step, halved as the contacts ask. They are
/// lengthened again by little at a time: a leapfrog whose step jumps near its stable one feeds its highest
/// modes, jump by jump. Short parts of a short stretch bind no later one.
double IslandStepper::structure_step(double duration, double longest) {
  double stable = std::numeric_limits<double>::infinity();
  for (int s : in_.island->structures)
    stable = std::min(stable, in_.env.structures[static_cast<std::size_t>(s)].structure->critical_step());
  double h = duration / std::ceil(duration / stable * (1 - contact::tolerances().time_round_off));
  longest = std::min(longest, rise_limit(in_, step_, h));
  bool bound = h > longest * (1 + contact::tolerances().same_instant);
  while (h > longest * (1 + contact::tolerances().same_instant)) h *= 0.5;
  if (suggested_ > 0 && h > lengthening * suggested_) h = lengthening * suggested_, bound = true;
  suggested_ = bound ? h : stable;
  return h;
}

/// The leapfrog's own correction (the condensed one has had its), and where the skins are then.
void IslandStepper::correct_structures(double t, double h) {
  shed_ = std::exchange(sheds_, false);
  for (int s : in_.island->structures) {
    StructurePart& part = in_.env.structures[static_cast<std::size_t>(s)];
    if (!in_.condensed) {
      shares_.clear();
      for (const NodeShare& n : step_.node_impulses)
        if (n.structure == s) shares_.push_back({n.node, n.impulse});
      part.structure->correct(t, h, shares_);
    }
    sheds_ = sheds_ || part.structure->surface().revision != part.index->surface().revision;
    part.index->refit(part.structure->surface());
    ++(in_.condensed ? report_.counters.condensed_steps : report_.counters.structure_steps);
  }
}

/// Whatever a block was struck by, the partners that were looked for are those that it can meet within what
/// it was expected to go, turning included.
void IslandStepper::measure_way(double from, double to, std::span<contact::Motion> made) {
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const auto k = static_cast<std::size_t>(step_.bodies[i].block);
    const Began& began = began_[i];
    const double chord =
        2 * (began.q.conjugate() * in_.state.q[k]).vec().norm() + (in_.state.eps[k] - began.eps).norm();
    report_.went[i] = std::max(report_.went[i],
                               (in_.state.c[k] - began.c).norm() + in_.model.blocks[k].shape->radius * chord);
    if (in_.island->watched[i] == 0) continue;
    made[i].displacement = in_.state.c[k] - made[i].start.c;  // with the correction
    report_.ways[i].push_back({from, to, made[i]});
  }
}

void IslandStepper::reject() {
  restore_bodies(in_, step_);
  ++report_.counters.rejected;
}

IslandReport IslandStepper::fail_at_smallest_step() {
  report_.failure = fmt::format(
      "the contact problem could not be solved at the smallest step (residual {:.2g} of the speeds there, {} "
      "contacts: {})",
      step_.solution.residual, step_.problem.contacts.size(), name_contacts(in_.model, step_.touches));
  return report_;
}

/// Energy that the step just taken made, and dissipation that it undid, its correction of positions included.
void IslandStepper::look_for_gains() {
  const Ledger &before = before_drift_.ledger, &after = report_.ledger;
  Counters& n = report_.counters;
  const double made = before.algorithmic - after.algorithmic;
  if (made > 0) {
    n.gained += made;
    n.worst_gain = std::max(n.worst_gain, made);
  }
  for (const double undone :
       {before.friction_work - after.friction_work, before.damping_work - after.damping_work,
        before.yield_work - after.yield_work, before.ploughing_work - after.ploughing_work})
    n.undone += std::max(0.0, undone);
}

IslandReport IslandStepper::fail_at_drift() {
  report_.failure = fmt::format(
      "the correction of overlaps would move a block farther than its motion in the step explains, down to "
      "the smallest step ({} contacts: {})",
      step_.touches.size(), name_contacts(in_.model, step_.touches));
  return report_;
}

void IslandStepper::rest_check(double h) {
  double still = still_speed(in_.model, h);
  bool rest = still > 0 && step_.solution.certified;
  for (int s : in_.island->structures)
    rest = rest && in_.condensed && in_.env.structures[static_cast<std::size_t>(s)].structure->quiet();
  if (in_.condensed) still += 2 * skin_speed(in_, step_);
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

}  // namespace talus::coupling
