// Events within a step: onsets that end it, and crossings that no row knows of.
#include "coupling/events/event_locator.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <ranges>
#include <span>
#include <utility>

#include "contact/tolerances.hpp"
#include "coupling/events/approach.hpp"
#include "coupling/events/step_motion.hpp"
#include "coupling/search/contact_search.hpp"
#include "coupling/springs/spring_limits.hpp"
#include "coupling/step/bodies.hpp"

namespace talus::coupling {
namespace {
constexpr int most_trials = 40;  // of ends of a step, of which some lie before an onset and some after
constexpr int most_apart = 12;   // the same while none lies after one

/// The deepest new contact at the end of a step.
struct Onset {
  double gap = std::numeric_limits<double>::infinity();  // [m]
  double rate = 0;                                       // its approach velocity, < 0: nearer [m/s]
  double before = 0;                                     // its gap at the start of the step [m]
  Partner a;
  int b = -1;  // with the feature its name; -1: there is none
  contact::FeatureKey key = 0;
  bool is(const Touch& t) const { return b == t.b && a.id() == t.a.id() && key == t.at.key; }
  bool is(const Onset& o) const { return b == o.b && a.id() == o.a.id() && key == o.key; }
};

/// An end of the step that was tried, and the gap there.
struct End {
  double time = 0, gap = std::numeric_limits<double>::infinity();
  Onset of;
};

/// Where a gap is closed that has these values at two ends, and at the first of them its rate, which is
/// negative: of a parabola, towards the nearer root.
double parabola_root(const End& at, const End& other) {
  const double way = other.time - at.time, bend = (other.gap - at.gap - at.of.rate * way) / (way * way),
               square = at.of.rate * at.of.rate - 4 * bend * at.gap;
  return at.time - 2 * at.gap / (at.of.rate - std::sqrt(std::max(0.0, square)));
}

/// The step solved again with other ends, and what begins there.
class Trials {
 public:
  Trials(const IslandContext& in, Step& step, ContactSearch& search, SmoothStep& smooth, int passes);
  /// False: no solution.
  bool solve_for(double length);
  /// `sought`: what is told of that contact, or where it is none of all, where its spring holds nothing that
  /// counts as well.
  Onset onset_at(double length, const Onset* sought = nullptr) const;
  /// Looks for the end of a step of at most `length` at which the onset found there begins, after `sure`.
  /// Nothing if an end tried has no solution, else whether it was found.
  std::optional<bool> seek(const Onset& there, double length, double sure, bool impact);

  double passed() const { return -1e-8 * in_.scale.length; }  // deeper is an onset [m]

 private:
  std::span<const Touch* const> of_pair(const Touch& t) const;
  double gap_before(const Touch& t) const;
  double unloaded(const Touch& t) const;
  bool begins(const Touch& t, bool unloaded_too) const;
  bool came_through(const Touch& t) const;

  const IslandContext& in_;
  Step& step_;
  ContactSearch& search_;
  SmoothStep& smooth_;
  int passes_;
  std::vector<Touch> start_;
  std::vector<const Touch*> by_pair_;
  bool any_depth_ = false;  // round-off of what rests is no onset, unless something deeper is sought
};

struct ByPair {
  static std::pair<std::uint64_t, int> pair(const Touch* t) { return {t->a.id(), t->b}; }
  bool operator()(const Touch* s, const Touch* t) const { return pair(s) < pair(t); }
};

Trials::Trials(const IslandContext& in, Step& step, ContactSearch& search, SmoothStep& smooth, int passes)
    : in_(in), step_(step), search_(search), smooth_(smooth), passes_(passes), start_(step.touches) {
  for (const Touch& t : start_) by_pair_.push_back(&t);
  std::stable_sort(by_pair_.begin(), by_pair_.end(), ByPair{});
}

std::span<const Touch* const> Trials::of_pair(const Touch& t) const {
  const auto range = std::equal_range(by_pair_.begin(), by_pair_.end(), &t, ByPair{});
  return {range.first, range.second};
}

/// Gap at the start of the step of a contact found now.
double Trials::gap_before(const Touch& t) const {
  return t.at.normal.dot(
      carried_back(in_, step_, t.b, t.at.point_b) -
      carried_back(in_, step_, t.a.kind == Partner::Kind::block ? t.a.index : -1, t.at.point_a));
}

/// What went in and is on its way back at the end crossed all the same. What strains seems to be by the rates
/// of its strains, which turn about many times within a long step, and the search, whose motion does not
/// strain, knows nothing of it.
bool Trials::came_through(const Touch& t) const {
  const auto strains = [&](int block) {
    return in_.local[static_cast<std::size_t>(block)] >= 0 &&
           in_.model.blocks[static_cast<std::size_t>(block)].deformable;
  };
  const bool rings =
      t.stiffness == 0 && (strains(t.b) || (t.a.kind == Partner::Kind::block && strains(t.a.index)));
  return t.at.gap < (rings || any_depth_ ? 0 : -in_.scale.near_gap()) && gap_before(t) > 0;
}

/// A spring begins unloaded where it is found, late by a way whose square goes with what its stiffness would
/// hold there.
double Trials::unloaded(const Touch& t) const {
  if (!(t.stiffness > 0)) return 0;
  return std::sqrt(2 * in_.settings.accuracy * energy_of_no_event(in_, t, in_.gentle_speed()) / t.stiffness);
}

bool Trials::begins(const Touch& t, bool unloaded_too) const {
  const auto own = of_pair(t);
  const auto same = std::ranges::find_if(own, [&](const Touch* s) { return s->at.key == t.at.key; });
  if (same != own.end() && (*same)->row >= 0) return false;
  // Nor is what comes on slowly an onset, while it is near.
  const bool slow =
      t.stiffness == 0 && t.approach >= -impact_speed(in_, t) && t.at.gap >= -in_.scale.near_gap();
  const bool comes = t.approach < -contact::tolerances().slips * in_.scale.speed;
  if (!(comes && !slow) && !came_through(t)) return false;
  if (!unloaded_too && std::abs(t.at.gap) <= unloaded(t)) return false;
  if (std::ranges::none_of(own, [](const Touch* s) { return s->row >= 0; })) return true;
  // In closed contact one feature may take the place of another, deep as it is: that crosses nothing. What
  // sank by more than half of its depth did, unless it lay closed before, where another stood for it.
  const double before = gap_before(t);
  return before > in_.scale.touch_gap() ||
         (same != own.end() && before >= std::min(-10 * in_.scale.touch_gap(), 0.5 * t.at.gap));
}

Onset Trials::onset_at(double length, const Onset* sought) const {
  Onset deepest;
  for (const Touch& t : search_.find_at_end(length))
    if (t.at.gap < deepest.gap && begins(t, sought != nullptr && (sought->b < 0 || sought->is(t))))
      deepest = {t.at.gap, t.approach, gap_before(t), t.a, t.b, t.at.key};
  return deepest;
}

bool Trials::solve_for(double length) {
  // Contact forces change little with the end of the step: those of the last trial start the next.
  for (std::size_t i = 0; i < start_.size(); ++i)
    if (step_.touches[i].row >= 0)
      start_[i].warm = step_.touches[i].frame * step_.touches[i].impulse / step_.length;
  restore_bodies(in_, step_);
  step_.touches = start_;
  step_.length = length;
  if (smooth_.solve(length, false, passes_).ok) return true;
  restore_bodies(in_, step_);
  return smooth_.solve(length, false, passes_, true).ok;
}

std::optional<bool> Trials::seek(const Onset& there, double length, double sure, bool impact) {
  // As close as coordinates of this size can tell; Newton's iteration gets there in a turn or two.
  double far = 0;
  for (const Body& b : step_.bodies) far = std::max(far, b.start.c.cwiseAbs().maxCoeff());
  const double onset_tolerance = 1e-13 * in_.scale.length + 4 * contact::tolerances().far_off * far;
  // The onset is sought between the time by which the search is sure of none and the end; there it is passed,
  // or met on the search's path, which between the ends of the step is not quite the blocks' own.
  bool bracketed = there.gap < passed();
  any_depth_ = bracketed && !(there.rate < 0);
  End low, high{length, there.gap, there}, last = high;
  if (bracketed) low = {0, there.before, there};
  double trial = impact ? sure : length + high.gap / -there.rate;
  if (any_depth_)
    trial = std::max(0.5 * length, sure);
  else if (bracketed && low.gap > 0)
    trial = std::max(parabola_root(high, low), sure);
  for (int iteration = 0; iteration < (bracketed ? most_trials : most_apart); ++iteration) {
    if (!(trial > low.time && trial < high.time)) {
      if (!bracketed) break;
      trial = low.of.is(high.of) && std::isfinite(low.gap - high.gap)
                  ? low.time + (high.time - low.time) * low.gap / (low.gap - high.gap)
                  : 0.5 * (low.time + high.time);
      if (!(trial > low.time && trial < high.time)) trial = 0.5 * (low.time + high.time);
    }
    if (!solve_for(trial)) return std::nullopt;
    const Onset onset = onset_at(trial, &last.of);
    const End now{trial, onset.gap, onset};
    if (std::abs(now.gap) <= onset_tolerance) return true;
    const bool met = std::isfinite(now.gap);
    if (!bracketed && !met) break;
    bracketed = bracketed || now.gap < 0;
    (now.gap > 0 ? low : high) = now;
    if (high.time - low.time < contact::tolerances().time_round_off * length) {
      // It begins deeper than that, as a feature that takes another's place.
      if (now.gap > 0 && !solve_for(high.time)) return std::nullopt;
      return true;
    }
    // Of a contact that is past from the start on, what the step began with is known.
    if (met && low.time == 0) low = {0, onset.before, onset};
    // By the parabola through both ends, or, where the lower one knows nothing of this contact, through the
    // last two; what strains, or turns in closed contact, does not approach by its speed at the end alone,
    // and goes by the last two.
    const End &from = bracketed ? high : now,
              &to = bracketed && low.of.is(high.of) && low.gap > 0 ? low : last;
    const bool again = last.of.is(onset) && last.time != trial,
               lags = again && iteration > 1 && std::abs(now.gap) > 0.1 * std::abs(last.gap);
    if (!met && !(high.of.rate < 0))
      trial = low.time;  // half of the way
    else if (lags)
      trial -= now.gap * (trial - last.time) / (now.gap - last.gap);
    else if (!(from.of.rate < 0))
      trial = low.time;
    else if (to.of.is(from.of) && std::isfinite(to.gap) && to.time != from.time)
      trial = parabola_root(from, to);
    else
      trial = from.time + from.gap / -from.of.rate;
    if (met) last = now;
  }
  return bracketed;
}

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
  Trials trials(in_, step_, search_, smooth_, passes);
  // Thin blocks may have gone through each other on the way to what is met at the end of a step, whose
  // contacts then do not tell.
  const StepMotion way(in_, step_, true);
  const auto far_enough_to_pass = [&] {
    return std::any_of(in_.island->pairs.begin(), in_.island->pairs.end(), [&](const CandidatePair& pair) {
      return way.path(pair) > contact::tolerances().unseen_way * thickness(in_.model, pair);
    });
  };
  double step = h, s = first_impact(), met = 0;  // met: where the search met something on the last path [s]
  Onset onset = trials.onset_at(step);
  while ((s <= 1 || onset.gap < trials.passed()) && !stopped(in_, report_)) {
    const double sure = s <= 1 ? std::max(s, contact::tolerances().time_round_off) * step : 0;
    const std::optional<bool> found = trials.seek(onset, step, sure, s <= 1);
    if (!found) return false;
    if (*found) {
      // What the search meets on the way there, and is no contact on the blocks' own path, is met again.
      const bool earlier = step_.length < step;
      step = step_.length;
      if (!earlier || !far_enough_to_pass() || (s = first_impact()) >= 0.999) break;
      onset = {};
      continue;
    }
    // None on the blocks' own path: a shorter step, whose path is known better, unless the last one told the
    // same.
    step = std::abs(sure - met) <= 0.1 * sure ? sure : std::max(0.5 * step, sure);
    met = sure;
    if (!trials.solve_for(step)) return false;
    if (step <= sure) {
      // Met by the search, and still no contact is named there: on by a thousandth of the size at a time,
      // else it would be met again at once.
      const double least = std::min(h, 1e-3 * in_.scale.length / in_.scale.speed);
      if (step < least && !std::isfinite(trials.onset_at(step).gap)) {
        if (!trials.solve_for(least)) return false;
        step = least;
      }
      break;
    }
    s = first_impact();
    onset = trials.onset_at(step);
  }
  h = step;
  return true;
}

}  // namespace talus::coupling
