// Events within a step: onsets that end it, and crossings that no row knows of.
#include "coupling/events/event_locator.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <ranges>
#include <span>
#include <utility>

#include "contact/tolerances.hpp"
#include "coupling/events/approach.hpp"
#include "coupling/events/step_motion.hpp"
#include "coupling/search/contact_search.hpp"
#include "coupling/step/bodies.hpp"

namespace talus::coupling {
namespace {
constexpr int most_trials = 40;  // of ends of a step, of which some lie before an onset and some after

}  // namespace

EventLocator::EventLocator(const IslandContext& in, Step& step, IslandReport& report, ContactSearch& search,
                           SmoothStep& smooth)
    : in_(in), step_(step), report_(report), search_(search), smooth_(smooth) {}

double EventLocator::first_impact() const {
  // Earliest onset of a pair that is not in closed contact already, on the motion just computed. Across
  // internal edges pairs touch without contact: within the reach of the contact search, else they would meet
  // again and again. One in closed contact that goes far may go through the other beside its rows, and then
  // have no contact at the end: no deeper than a part of its thickness, which drift stays far below, and
  // springs mostly.
  const StepMotion motion(in_, step_, false), way(in_, step_, true);
  double first = 2;
  std::size_t t = 0;  // touches follow the order of the pairs
  for (std::size_t i = 0; i < in_.island->pairs.size(); ++i) {
    const CandidatePair& pair = in_.island->pairs[i];
    bool closed = false, sprung = false;
    for (; t < step_.touches.size() && step_.touches[t].a == pair.a && step_.touches[t].b == pair.b; ++t) {
      closed = closed || step_.touches[t].row >= 0;
      sprung = sprung || (step_.touches[t].row >= 0 && step_.touches[t].stiffness > 0);
    }
    const double thin = thickness(in_.model, pair);
    if (!closed)
      first =
          std::min(first, motion.time_of_impact(
                              pair, search_.flush(i) ? 2 * in_.scale.touch_gap()
                                                     : contact::tolerances().located_gap * in_.scale.length));
    else if (way.path(pair) > contact::tolerances().unseen_way * thin)
      first = std::min(first, motion.time_of_impact(pair, (sprung ? contact::tolerances().through_springs
                                                                  : contact::tolerances().through) *
                                                              thin));
  }
  return first;
}

bool EventLocator::locate(double& h, int passes) {
  std::vector<Touch> start = step_.touches;
  struct ByPair {
    static std::pair<std::uint64_t, int> pair(const Touch* t) { return {t->a.id(), t->b}; }
    bool operator()(const Touch* s, const Touch* t) const { return pair(s) < pair(t); }
  };
  std::vector<const Touch*> by_pair;
  for (const Touch& t : start) by_pair.push_back(&t);
  std::stable_sort(by_pair.begin(), by_pair.end(), ByPair{});
  const auto of_pair = [&](const Touch& t) {
    const auto range = std::equal_range(by_pair.begin(), by_pair.end(), &t, ByPair{});
    return std::span<const Touch* const>(range.first, range.second);
  };
  const auto was_row = [&](const Touch& t) {
    for (const Touch* s : of_pair(t))
      if (s->at.key == t.at.key) return s->row >= 0;
    return false;
  };
  // Gap at the start of the step of a touch found now.
  const auto gap_before = [&](const Touch& t) {
    return t.at.normal.dot(
        carried_back(in_, step_, t.b, t.at.point_b) -
        carried_back(in_, step_, t.a.kind == Partner::Kind::block ? t.a.index : -1, t.at.point_a));
  };
  // In closed contact one feature may take the place of another, deep as it is: that crosses nothing. What
  // sank by more than half of its depth did.
  const auto swapped = [&](const Touch& t) {
    return std::ranges::any_of(of_pair(t), [](const Touch* s) { return s->row >= 0; }) &&
           gap_before(t) < std::min(-10 * in_.scale.touch_gap(), 0.5 * t.at.gap);
  };
  // Nor is what comes on slowly an onset, while it is near.
  const auto slow = [&](const Touch& t) {
    return t.stiffness == 0 && t.approach >= -impact_speed(in_, t) && t.at.gap >= -in_.scale.near_gap();
  };
  // What went in and is on its way back at the end crossed all the same. What strains seems to be by the
  // rates of its strains, which turn about many times within a long step, and the search, whose motion does
  // not strain, knows nothing of it.
  const auto strains = [&](int block) {
    return in_.local[static_cast<std::size_t>(block)] >= 0 &&
           in_.model.blocks[static_cast<std::size_t>(block)].deformable;
  };
  bool any_depth = false;  // rounding of what rests is none, unless something deeper is sought
  const auto came_through = [&](const Touch& t) {
    const bool rings =
        t.stiffness == 0 && (strains(t.b) || (t.a.kind == Partner::Kind::block && strains(t.a.index)));
    return t.at.gap < (rings || any_depth ? 0 : -in_.scale.near_gap()) && gap_before(t) > 0;
  };
  double rate = 0, before = 0;
  const auto worst_onset = [&](double step) {
    // Deepest new touch at the end of the step, its approach velocity, and its gap before.
    double gap = std::numeric_limits<double>::infinity();
    rate = 0;
    for (const Touch& t : search_.find_at_end(step))
      if (!was_row(t) && t.at.gap < gap &&
          ((t.approach <
                (t.stiffness > 0 ? -t.quiet_speed : -contact::tolerances().slips * in_.scale.speed) &&
            !slow(t)) ||
           came_through(t)) &&
          !swapped(t)) {
        gap = t.at.gap;
        rate = t.approach;
        before = gap_before(t);
      }
    return gap;
  };
  const auto solve_for = [&](double step) {
    // Contact forces change little with the end of the step: those of the last trial start the next.
    for (std::size_t i = 0; i < start.size(); ++i)
      if (step_.touches[i].row >= 0)
        start[i].warm = step_.touches[i].frame * step_.touches[i].impulse / step_.length;
    restore_bodies(in_, step_);
    step_.touches = start;
    step_.length = step;
    if (smooth_.solve(step, false, passes).ok) return true;
    restore_bodies(in_, step_);
    return smooth_.solve(step, false, passes, true).ok;
  };
  // Thin blocks may have gone through each other on the way to what is met at the end of a step, whose
  // touches then do not tell.
  const StepMotion way(in_, step_, true);
  const auto far_enough_to_pass = [&] {
    return std::any_of(in_.island->pairs.begin(), in_.island->pairs.end(), [&](const CandidatePair& pair) {
      return way.path(pair) > contact::tolerances().unseen_way * thickness(in_.model, pair);
    });
  };
  // As close as coordinates of this size can tell; Newton's iteration gets there in a turn or two.
  double far = 0;
  for (const Body& b : step_.bodies) far = std::max(far, b.start.c.cwiseAbs().maxCoeff());
  const double onset_tolerance = 1e-13 * in_.scale.length + 4e-15 * far, passed = -1e-8 * in_.scale.length;
  double step = h;
  double s = first_impact(), gap = worst_onset(step);
  while ((s <= 1 || gap < passed) && !stopped(in_, report_)) {
    // The onset is sought between the time by which the search is sure of none and the end; there it is
    // passed, or met on the search's path, which between the ends of the step is not quite the blocks' own.
    bool bracketed = gap < passed;
    any_depth = bracketed && !(rate < 0);
    const double sure = s <= 1 ? std::max(s, contact::tolerances().time_round_off) * step : 0;
    double low = 0, high = step, trial = s <= 1 ? sure : step + gap / -rate;
    // Between an end still apart and one that is past, the gap is taken for the parabola of both gaps and the
    // rate at the end past.
    double apart = bracketed ? before : 0, past = gap, closing = rate;
    const auto on_parabola = [&] {
      const double width = high - low, bend = (apart - past + closing * width) / (width * width);
      return high - 2 * past / (closing - std::sqrt(std::max(0.0, closing * closing - 4 * bend * past)));
    };
    if (bracketed && !(rate < 0))
      trial = std::max(0.5 * step, sure);
    else if (bracketed && apart > 0)
      trial = std::max(on_parabola(), sure);
    bool met = false;
    double tried = 0, gap_there = std::numeric_limits<double>::infinity();
    for (int iteration = 0; iteration < (bracketed ? most_trials : 12); ++iteration) {
      if (!(trial > low && trial < high)) {
        if (!bracketed) break;
        trial = 0.5 * (low + high);
      }
      if (!solve_for(trial)) return false;
      gap = worst_onset(trial);
      met = std::abs(gap) <= onset_tolerance || high - low < 1e-15 * h;
      if (met || (!bracketed && !std::isfinite(gap))) break;
      bracketed = bracketed || gap < 0;
      if (gap > 0) {
        low = trial, apart = gap;
      } else {
        high = trial, past = gap, closing = rate;
      }
      // What strains, or turns in closed contact, does not approach by its speed at the end alone: by what
      // the last two trials tell.
      const double secant = trial - gap * (trial - tried) / (gap - gap_there);
      const bool lags = bracketed && iteration > 3 && std::abs(gap) > 0.25 * std::abs(gap_there);
      tried =
          std::exchange(trial, lags && std::isfinite(secant)                                   ? secant
                               : bracketed && std::isfinite(apart) && apart > 0 && closing < 0 ? on_parabola()
                               : std::isfinite(gap) && rate < 0 ? trial + gap / -rate
                                                                : 0.5 * (low + high));
      gap_there = gap;
    }
    if (met || bracketed) {
      step = step_.length;
      if (!far_enough_to_pass() || (s = first_impact()) >= 0.999) break;
      gap = std::numeric_limits<double>::infinity();
      continue;
    }
    // None on the blocks' own path: a shorter step, whose path is known better.
    step = 0.5 * step > sure ? 0.5 * step : sure;
    if (!solve_for(step)) return false;
    if (step <= sure) {
      // Met by the search, and still no contact is named there: on by a thousandth of the size at a time,
      // else it would be met again at once.
      const double least = std::min(h, 1e-3 * in_.scale.length / in_.scale.speed);
      if (step < least && !std::isfinite(worst_onset(step))) {
        if (!solve_for(least)) return false;
        step = least;
      }
      break;
    }
    s = first_impact();
    gap = worst_onset(step);
  }
  h = step;
  return true;
}

}  // namespace talus::coupling
