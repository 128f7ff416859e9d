// Events within a step: onsets that end it, and crossings that no row knows of.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <ranges>
#include <span>
#include <utility>

#include "contact/tolerances.hpp"
#include "coupling/island_body.hpp"

namespace talus::coupling {
namespace {
constexpr int most_trials = 40;  // of ends of a step, of which some lie before an onset and some after

/// Inradius of the thinner one [m].
double thickness(const dda::Model& model, const CandidatePair& pair) {
  const double b = model.blocks[static_cast<std::size_t>(pair.b)].shape->inradius;
  return pair.a.kind == Partner::Kind::block
             ? std::min(b, model.blocks[static_cast<std::size_t>(pair.a.index)].shape->inradius)
             : b;
}

}  // namespace

contact::Motion IslandStepper::motion_of(int block, bool lumped) const {
  // From the start of the step to the state just computed: rotation vector, and a parabola, of pushed blocks
  // of lumped steps the chord.
  contact::Motion m;
  m.start = dda::pose(in_.state, block);
  const int l = in_.local[static_cast<std::size_t>(block)];
  if (l < 0) return m;
  const Body& b = step_.bodies[static_cast<std::size_t>(l)];
  m.start = b.start;
  m.displacement = in_.state.c[static_cast<std::size_t>(block)] - b.start.c;
  if (!lumped || b.impulse.isZero(0))
    m.half_gravity_step =
        m.displacement - step_.length * b.v0.head<3>();  // leaves with the velocity that it has
  const Quat turn = in_.state.q[static_cast<std::size_t>(block)] * b.q0.conjugate();
  const Vec3 v = turn.w() < 0 ? Vec3(-turn.vec()) : Vec3(turn.vec());
  const double s = v.norm();
  m.rotation = s < 1e-12 ? Vec3(2 * v) : Vec3(2 * std::atan2(s, std::abs(turn.w())) / s * v);
  return m;
}

contact::Motion IslandStepper::lumped_motion(int block) const {
  const int l = in_.local[static_cast<std::size_t>(block)];
  return l < 0 || motions_.empty() ? motion_of(block, true) : motions_[static_cast<std::size_t>(l)];
}

double IslandStepper::time_of_impact(const CandidatePair& pair, double tolerance, bool lumped) const {
  const Polyhedron& shape = *in_.model.blocks[static_cast<std::size_t>(pair.b)].shape;
  const auto motion_in_step = [&](int block) {
    return lumped ? lumped_motion(block) : motion_of(block, false);
  };
  const contact::Motion motion = motion_in_step(pair.b);
  const auto index = static_cast<std::size_t>(pair.a.index);
  switch (pair.a.kind) {
    case Partner::Kind::block:
      return contact::time_of_impact(*in_.model.blocks[index].shape, motion_in_step(pair.a.index), shape,
                                     motion, tolerance);
    case Partner::Kind::plane:
      return contact::time_of_impact(in_.env.planes[index], shape, motion, tolerance);
    case Partner::Kind::terrain: return contact::time_of_impact(*in_.env.terrain, shape, motion, tolerance);
    case Partner::Kind::structure:
      return contact::time_of_impact(*in_.env.structures[index].index, shape, motion, tolerance);
  }
  return 2;
}

double IslandStepper::first_impact() const {
  // Earliest onset of a pair that is not in closed contact already, on the motion just computed. Across
  // internal edges pairs touch without contact: as widely as contacts are told, else they would meet again
  // and again. One in closed contact that goes far may go through the other beside its rows, and then have no
  // contact at the end: no deeper than a part of its thickness, which drift stays far below, and springs
  // mostly.
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
      first = std::min(
          first, time_of_impact(pair,
                                flush_pair_[i] != 0 ? 2 * in_.scale.touch_gap()
                                                    : contact::tolerances().located_gap * in_.scale.length,
                                false));
    else if (path(pair) > contact::tolerances().unseen_way * thin)
      first = std::min(
          first,
          time_of_impact(
              pair, (sprung ? contact::tolerances().through_springs : contact::tolerances().through) * thin,
              false));
  }
  return first;
}

/// Time at which the first pair that is apart meets and is thrown back; h: none within it [s]. Bodies that
/// touch nothing fall, the others go on as they go: exact in flight, of what slides or turns on others met by
/// ever shorter steps.
double IslandStepper::first_rebound(double h) {
  step_.meets_to_rebound.assign(in_.island->pairs.size(), 0);
  std::vector<char> borne(step_.bodies.size(), 0);
  const auto bear = [&](int block) {
    if (const int l = block < 0 ? -1 : in_.local[static_cast<std::size_t>(block)]; l >= 0)
      borne[static_cast<std::size_t>(l)] = 1;
  };
  for (std::size_t i = 0; i < in_.island->pairs.size(); ++i) {
    bool apart = true, thrown_back = false;
    for (std::size_t t = first_of_pair_[i]; t < first_of_pair_[i + 1]; ++t) {
      apart = apart && step_.touches[t].at.gap > in_.scale.touch_gap();
      thrown_back = thrown_back || rebounds(in_, step_.touches[t]);
    }
    step_.meets_to_rebound[i] = apart && thrown_back;
    if (apart) continue;
    bear(in_.island->pairs[i].b);
    if (in_.island->pairs[i].a.kind == Partner::Kind::block) bear(in_.island->pairs[i].a.index);
  }
  for (std::size_t l = 0; l < step_.bodies.size(); ++l) {
    const auto k = static_cast<std::size_t>(step_.bodies[l].block);
    contact::Motion m;
    m.start = dda::pose(in_.state, step_.bodies[l].block);
    if (!borne[l]) m.half_gravity_step = 0.5 * h * h * in_.model.gravity;
    m.displacement = h * in_.state.v[k] + m.half_gravity_step;
    m.rotation = h * in_.state.w[k];
    motions_.push_back(m);
  }
  double first = 1;
  for (std::size_t i = 0; i < in_.island->pairs.size(); ++i)
    if (step_.meets_to_rebound[i] != 0)
      first = std::min(
          first, time_of_impact(in_.island->pairs[i],
                                flush_pair_[i] != 0 ? 2 * in_.scale.touch_gap()
                                                    : contact::tolerances().located_gap * in_.scale.length,
                                true));
  motions_.clear();
  return std::max(first, contact::tolerances().time_round_off) * h;
}

/// Bound on how far points of the two have moved against each other in the step just computed [m].
double IslandStepper::path(const CandidatePair& pair) const {
  const contact::Motion b = lumped_motion(pair.b);
  Vec3 moved = b.displacement, bulge = b.half_gravity_step;
  double turned = in_.model.blocks[static_cast<std::size_t>(pair.b)].shape->radius * b.rotation.norm();
  if (pair.a.kind == Partner::Kind::block) {
    const contact::Motion a = lumped_motion(pair.a.index);
    moved -= a.displacement;
    bulge -= a.half_gravity_step;
    turned += in_.model.blocks[static_cast<std::size_t>(pair.a.index)].shape->radius * a.rotation.norm();
  }
  return moved.norm() + bulge.norm() / 4 + turned;
}

/// Where a point of a block (or of what is fixed) was at the start of the step.
Vec3 IslandStepper::carried_back(int block, const Vec3& x) const {
  const int l = block < 0 ? -1 : in_.local[static_cast<std::size_t>(block)];
  if (l < 0) return x;
  const Pose now = dda::pose(in_.state, block);
  const Pose& then = step_.bodies[static_cast<std::size_t>(l)].start;
  return then.c + then.F * (now.F.inverse() * (x - now.c));
}

/// A touch found at the end of a step as it was at its start: points and normal go back with the bodies that
/// own them.
Touch IslandStepper::carried_back(Touch t) const {
  const int a = t.a.kind == Partner::Kind::block ? t.a.index : -1;
  const Pose pose_a = a >= 0 ? dda::pose(in_.state, a) : Pose{};
  const NormalOwner owner = normal_owner(t, in_.model, in_.env, &pose_a);
  const int carrier = owner == NormalOwner::a ? a : owner == NormalOwner::b ? t.b : -1;
  const Vec3 x = carrier >= 0 ? in_.state.c[static_cast<std::size_t>(carrier)] : Vec3(Vec3::Zero());
  t.at.normal = (carried_back(carrier, x + t.at.normal) - carried_back(carrier, x)).normalized();
  t.at.point_b = carried_back(t.b, t.at.point_b);
  t.at.point_a = carried_back(a, t.at.point_a);
  t.at.gap = t.at.normal.dot(t.at.point_b - t.at.point_a);
  return t;
}

/// Hard features of a pair that are in each other at the end of the step, deeper than is left to the
/// projection, and no rows of it. Each is told once in a step: what was met before and is no row yet will be
/// none.
std::vector<Touch> IslandStepper::unforeseen(std::size_t pair, std::span<const Touch> known) const {
  std::vector<Touch> found;
  find_touches(in_.model, in_.state, in_.env, in_.island->pairs[pair], 0, in_.history, found);
  std::erase_if(found, [&](const Touch& t) {
    const auto same = [&](const Touch& k) { return k.at.key == t.at.key; };
    return t.stiffness > 0 || t.at.gap >= -in_.scale.unseen() ||
           std::ranges::any_of(known, [&](const Touch& k) { return k.row >= 0 && same(k); }) ||
           std::ranges::any_of(touches_of_[pair], [&](const Touch& k) { return k.met && same(k); });
  });
  for (Touch& t : found) t = carried_back(t);
  return found;
}

/// Fraction of the step at which a pair crosses what its rows leave open (above 1: never), and the bound on
/// how far its bodies moved [m].
std::pair<double, double> IslandStepper::meeting(std::size_t i, const Known& known) const {
  // Rows bound the gap of the features they name. A pair without rows may not come closer than it was known
  // to be apart; one with rows may not move by more than a part of the thinner body's thickness unseen.
  constexpr double never = 2;
  const CandidatePair& pair = in_.island->pairs[i];
  bool listed = known.listed;
  const double thin = thickness(in_.model, pair), way = path(pair);
  const double clear = listed      ? contact::tolerances().unseen_way * thin
                       : known.any ? std::max(known.apart, 0.0)
                                   : margins_[i];
  if (way <= clear) return {never, way};
  double s = never;
  if (!listed) {
    s = time_of_impact(pair, contact::tolerances().located_gap * in_.scale.length, true);
    if (s > 1) return {never, way};
    // A level below all that is named, and met later: it was below already. Concave blocks graze each other
    // where the search names no contact; a step that ended there would be followed by one that ends as early.
    listed =
        time_of_impact(pair, std::max(0.9 * clear, contact::tolerances().overlap_none * in_.scale.length),
                       true) > s;
    if (listed && way <= contact::tolerances().unseen_way * thin) return {never, way};
  }
  if (listed) {
    s = time_of_impact(pair, contact::tolerances().through * thin, true);
    if (s >= 0.9) return {never, way};  // rows end where they touch: that is no crossing
  }
  return {s, way};
}

IslandStepper::Crossing IslandStepper::crossing() {
  const std::size_t pairs = in_.island->pairs.size();
  std::vector<Known> known(pairs);
  const auto know = [&](std::size_t i) {
    const CandidatePair& pair = in_.island->pairs[i];
    Known& k = known[i];
    k = {.first = first_of_pair_[i], .listed = flush_pair_[i] != 0};
    for (std::size_t t = k.first; t < first_of_pair_[i + 1]; ++t) {
      k.any = true;
      k.open = k.open || step_.touches[t].row < 0;
      k.listed = k.listed || step_.touches[t].row >= 0;
      k.apart = std::min(k.apart, step_.touches[t].at.gap);
      ++k.count;
    }
    if (std::isfinite(left_out_[i])) {
      k.any = k.open = true;
      k.apart = std::min(k.apart, left_out_[i]);
    }
    // A skin moves along with what comes off it, which this motion knows nothing of: features within reach
    // are known, one that closes unforeseen starts unloaded where it is.
    k.listed = k.listed || (k.any && in_.moving_skin(pair.a));
  };
  std::vector<std::pair<double, double>> met(pairs);
  Crossing out;
  out.features.resize(pairs);
  for (const Body& b : step_.bodies) motions_.push_back(motion_of(b.block, true));
  each_pair([&](std::size_t i) {
    know(i);
    met[i] = meeting(i, known[i]);
    const bool may = met[i].first > 1 && known[i].listed && met[i].second > in_.scale.unseen() &&
                     !in_.moving_skin(in_.island->pairs[i].a);
    if (may)
      out.features[i] = unforeseen(i, std::span(step_.touches).subspan(known[i].first, known[i].count));
  });
  motions_.clear();
  for (std::size_t i = 0; i < pairs; ++i) {
    const auto [s, way] = met[i];
    out.listed = out.listed || !out.features[i].empty();
    if (s > 1) continue;
    if (i < step_.meets_to_rebound.size() &&
        step_.meets_to_rebound[i] != 0) {  // at the end of the step is where it is to meet
      if ((1 - s) * way > in_.scale.touch_gap()) out.first = std::min(out.first, s);
      continue;
    }
    if (step_.ahead[i] == 0 && (known[i].open || !known[i].any) && !in_.moving_skin(in_.island->pairs[i].a)) {
      step_.ahead[i] = way;
      out.listed = true;
    } else {
      out.first = std::min(out.first, s);
    }
  }
  return out;
}

/// Rows for what a solution met: the touches of pairs ahead that lay beyond the reach of the step, at its
/// start, and the features that it met unforeseen. All others keep the impulses of the last solution.
void IslandStepper::look_ahead(const Crossing& met) {
  const auto gathered = [this](std::size_t i) {
    return std::span(step_.touches).subspan(first_of_pair_[i], first_of_pair_[i + 1] - first_of_pair_[i]);
  };
  std::atomic<bool> any = false;
  each_pair([&](std::size_t i) {
    bool here = false;
    if (step_.ahead[i] != 0 && (touches_of_[i].empty() || std::isfinite(left_out_[i]))) {
      margins_[i] = std::max(margins_[i], step_.ahead[i]);
      left_out_[i] = std::numeric_limits<double>::infinity();
      std::vector<Touch> all;
      find_touches(in_.model, in_.state, in_.env, in_.island->pairs[i], margins_[i], in_.history, all);
      for (Touch& t : all) {
        if (std::ranges::any_of(touches_of_[i], [&](const Touch& known) { return known.at.key == t.at.key; }))
          continue;
        touches_of_[i].push_back(std::move(t));
        here = true;
      }
    }
    for (const Touch& feature : met.features[i]) {
      auto& list = touches_of_[i];
      const auto same =
          std::find_if(list.begin(), list.end(), [&](const Touch& t) { return t.at.key == feature.at.key; });
      // A feature of that name which was no contact at the start, but an edge within a surface that goes on,
      // is replaced by what it became.
      const bool none = same != list.end() && std::ranges::none_of(gathered(i), [&](const Touch& t) {
                          return t.at.key == same->at.key;
                        });
      if (none) *same = feature;
      Touch& t = same != list.end() ? *same : list.emplace_back(feature);
      t.met = here = true;
    }
    if (here) any.store(true, std::memory_order_relaxed);
  });
  if (!any) return;
  const std::vector<std::size_t> first_before = first_of_pair_;
  std::vector<std::pair<contact::FeatureKey, Vec3>> before(
      first_before.back());  // name and force of every touch
  std::vector<Vec3> at_surfaces;
  for (std::size_t k = first_before.back(); k < step_.touches.size(); ++k)
    at_surfaces.push_back(step_.touches[k].warm);
  each_pair([&](std::size_t i) {
    for (std::size_t k = first_before[i]; k < first_before[i + 1]; ++k)
      before[k] = {step_.touches[k].at.key, step_.touches[k].warm};
  });
  gather_touches();
  each_pair([&](std::size_t i) {
    std::size_t k = first_before[i];
    for (std::size_t t = first_of_pair_[i]; t < first_of_pair_[i + 1];
         ++t) {  // the order of the touches within a pair is the same
      std::size_t same = k;
      while (same < first_before[i + 1] && before[same].first != step_.touches[t].at.key) ++same;
      if (same == first_before[i + 1]) continue;
      step_.touches[t].warm = before[same].second;
      k = same + 1;
    }
  });
  for (std::size_t k = 0; k < at_surfaces.size(); ++k)
    step_.touches[first_of_pair_.back() + k].warm = at_surfaces[k];
}

bool IslandStepper::locate_event(double& h, int passes) {
  // Shortens the step so that it ends at the first onset. Touches that were rows of this step are not onsets;
  // what they cross is drift and is projected. False: no solution at an end tried, the state is of no use.
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
    return t.at.normal.dot(carried_back(t.b, t.at.point_b) -
                           carried_back(t.a.kind == Partner::Kind::block ? t.a.index : -1, t.at.point_a));
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
    std::vector<Touch> keep;
    keep.swap(step_.touches);
    std::vector<std::size_t> first_kept = first_of_pair_;
    step_.found_for = -1;
    find(step, false);
    double gap = std::numeric_limits<double>::infinity();
    rate = 0;
    for (const Touch& t : step_.touches)
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
    step_.touches.swap(keep);
    first_of_pair_.swap(first_kept);
    step_.found_for = -1;
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
    if (smooth(step, false, passes).ok) return true;
    restore_bodies(in_, step_);
    return smooth(step, false, passes, true).ok;
  };
  // Thin blocks may have gone through each other on the way to what is met at the end of a step, whose
  // touches then do not tell.
  const auto far_enough_to_pass = [&] {
    return std::any_of(in_.island->pairs.begin(), in_.island->pairs.end(), [&](const CandidatePair& pair) {
      return path(pair) > contact::tolerances().unseen_way * thickness(in_.model, pair);
    });
  };
  // As close as coordinates of this size can tell; Newton's iteration gets there in a turn or two.
  double far = 0;
  for (const Body& b : step_.bodies) far = std::max(far, b.start.c.cwiseAbs().maxCoeff());
  const double onset_tolerance = 1e-13 * in_.scale.length + 4e-15 * far, passed = -1e-8 * in_.scale.length;
  double step = h;
  double s = first_impact(), gap = worst_onset(step);
  while ((s <= 1 || gap < passed) && !stopped()) {
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
