// What a time-stepped step meets that no row knows of.
#include "coupling/events/crossings.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <ranges>
#include <span>
#include <utility>
#include <vector>

#include "contact/tolerances.hpp"
#include "coupling/events/approach.hpp"
#include "coupling/events/step_motion.hpp"
#include "coupling/search/contact_search.hpp"
#include "coupling/step/step.hpp"

namespace talus::coupling {

namespace {

std::vector<contact::Motion> motions_of_bodies(const IslandContext& in, const Step& step) {
  std::vector<contact::Motion> motions;
  for (const Body& b : step.bodies) motions.push_back(motion_of(in, step, b.block, true));
  return motions;
}

}  // namespace

CrossingSearch::CrossingSearch(const IslandContext& in, Step& step, const ContactSearch& search)
    : in_(in), step_(step), search_(search), motion_(in, step, motions_of_bodies(in, step)) {}

/// Hard features of a pair that are in each other at the end of the step, deeper than is left to the
/// projection, and no rows of it. Each is returned once in a step.
std::vector<Touch> CrossingSearch::unforeseen(std::size_t pair, std::span<const Touch> known) const {
  std::vector<Touch> found;
  find_touches(in_.model, in_.state, in_.env, in_.island->pairs[pair], 0, in_.history, found);
  std::erase_if(found, [&](const Touch& t) {
    const auto same = [&](const Touch& k) { return k.at.key == t.at.key; };
    return t.stiffness > 0 || t.at.gap >= -in_.scale.unseen() ||
           std::ranges::any_of(known, [&](const Touch& k) { return k.row >= 0 && same(k); }) ||
           search_.was_met(pair, t.at.key);
  });
  for (Touch& t : found) t = carried_back(in_, step_, t);
  return found;
}

/// Fraction of the step at which a pair crosses what its rows leave open (above 1: never), and the bound on
/// how far its bodies moved [m].
std::pair<double, double> CrossingSearch::meeting(std::size_t i, const Known& known) const {
  // Rows bound the gap of the features they name. A pair without rows may not come closer than it was known
  // to be apart; one with rows may not move by more than a part of the thinner body's thickness unseen, or
  // than positions may be off by.
  constexpr double never = 2;
  const CandidatePair& pair = in_.island->pairs[i];
  bool listed = known.listed;
  const double thin = thickness(in_.model, pair), way = motion_.path(pair),
               off = in_.settings.accuracy * in_.scale.mass_length,
               unseen = std::max(contact::tolerances().unseen_way * thin, off);
  const double clear = listed ? unseen : known.any ? std::max(known.apart, 0.0) : search_.margin(i);
  if (way <= clear) return {never, way};
  double s = never;
  if (!listed) {
    s = motion_.time_of_impact(pair, contact::tolerances().located_gap * in_.scale.length);
    if (s > 1) return {never, way};
    // A level below all that is named, and met later: it was below already. Concave blocks graze each other
    // where the search names no contact; a step that ended there would be followed by one that ends as early.
    listed = motion_.time_of_impact(
                 pair, std::max(clear, contact::tolerances().overlap_none * in_.scale.length)) > s;
    if (listed && way <= unseen) return {never, way};
  }
  if (listed) {
    s = motion_.time_of_impact(  // which tells of ten tolerances of depth in what touches at the start
        pair, std::max(contact::tolerances().through * thin, 0.1 * off));
    if (s >= 1) return {never, way};  // rows end where they touch: that is no crossing
  }
  return {s, way};
}

Crossing CrossingSearch::find() {
  const std::size_t pairs = in_.island->pairs.size();
  std::vector<Known> known(pairs);
  const auto know = [&](std::size_t i) {
    const CandidatePair& pair = in_.island->pairs[i];
    Known& k = known[i];
    k = {.first = search_.first_of(i), .listed = search_.flush(i)};
    for (std::size_t t = k.first; t < search_.first_of(i + 1); ++t) {
      k.any = true;
      k.open = k.open || step_.touches[t].row < 0;
      k.listed = k.listed || step_.touches[t].row >= 0;
      k.apart = std::min(k.apart, step_.touches[t].at.gap);
      ++k.count;
    }
    if (std::isfinite(search_.left_out(i))) {
      k.any = k.open = true;
      k.apart = std::min(k.apart, search_.left_out(i));
    }
    // A skin moves along with what comes off it, which this motion knows nothing of: features within reach
    // are known, one that closes unforeseen starts unloaded where it is.
    k.listed = k.listed || (k.any && in_.moving_surface(pair.a));
  };
  std::vector<std::pair<double, double>> met(pairs);
  Crossing out;
  out.features.resize(pairs);
  search_.each_pair([&](std::size_t i) {
    know(i);
    met[i] = meeting(i, known[i]);
    const bool may = met[i].first > 1 && known[i].listed && met[i].second > in_.scale.unseen() &&
                     !in_.moving_surface(in_.island->pairs[i].a);
    if (may)
      out.features[i] = unforeseen(i, std::span(step_.touches).subspan(known[i].first, known[i].count));
  });
  for (std::size_t i = 0; i < pairs; ++i) {
    const auto [s, way] = met[i];
    out.listed = out.listed || !out.features[i].empty();
    if (s > 1) continue;
    if (i < step_.meets_to_rebound.size() &&
        step_.meets_to_rebound[i] != 0) {  // at the end of the step is where it is to meet
      if ((1 - s) * way > in_.scale.touch_gap()) out.first = std::min(out.first, s);
      continue;
    }
    if (step_.ahead[i] == 0 && (known[i].open || !known[i].any) &&
        !in_.moving_surface(in_.island->pairs[i].a)) {
      step_.ahead[i] = way;
      out.listed = true;
    } else {
      out.first = std::min(out.first, s);
    }
  }
  return out;
}

double first_rebound(const IslandContext& in, Step& step, const ContactSearch& search, double h) {
  step.meets_to_rebound.assign(in.island->pairs.size(), 0);
  std::vector<char> borne(step.bodies.size(), 0);
  const auto bear = [&](int block) {
    if (const int l = block < 0 ? -1 : in.local[static_cast<std::size_t>(block)]; l >= 0)
      borne[static_cast<std::size_t>(l)] = 1;
  };
  for (std::size_t i = 0; i < in.island->pairs.size(); ++i) {
    bool apart = true, thrown_back = false;
    for (std::size_t t = search.first_of(i); t < search.first_of(i + 1); ++t) {
      apart = apart && step.touches[t].at.gap > in.scale.touch_gap();
      thrown_back = thrown_back || rebounds(in, step.touches[t]);
    }
    step.meets_to_rebound[i] = apart && thrown_back;
    if (apart) continue;
    bear(in.island->pairs[i].b);
    if (in.island->pairs[i].a.kind == Partner::Kind::block) bear(in.island->pairs[i].a.index);
  }
  std::vector<contact::Motion> motions;
  for (std::size_t l = 0; l < step.bodies.size(); ++l) {
    const auto k = static_cast<std::size_t>(step.bodies[l].block);
    contact::Motion m;
    m.start = dda::pose(in.state, step.bodies[l].block);
    if (!borne[l]) m.half_gravity_step = 0.5 * h * h * in.model.gravity;
    m.displacement = h * in.state.v[k] + m.half_gravity_step;
    m.rotation = h * in.state.w[k];
    motions.push_back(m);
  }
  const StepMotion motion(in, step, std::move(motions));
  double first = 1;
  for (std::size_t i = 0; i < in.island->pairs.size(); ++i)
    if (step.meets_to_rebound[i] != 0)
      first = std::min(first, motion.time_of_impact(
                                  in.island->pairs[i],
                                  search.flush(i) ? 2 * in.scale.touch_gap()
                                                  : contact::tolerances().located_gap * in.scale.length));
  return std::max(first, contact::tolerances().time_round_off) * h;
}

}  // namespace talus::coupling
