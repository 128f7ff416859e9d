// What an island's bodies may touch within a step. Pairs whose bodies have not moved since the last search
// keep what it found.
#include "coupling/search/contact_search.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "contact/tolerances.hpp"
#include "coupling/events/step_motion.hpp"
#include "coupling/search/surface_focus.hpp"
#include "coupling/springs/skin_carry.hpp"
#include "coupling/springs/spring_limits.hpp"
#include "coupling/step/step.hpp"
#include "coupling/touch/touch_flush.hpp"

namespace talus::coupling {
namespace {

constexpr std::size_t pairs_for_threads = 500;  // whose search is worth a second thread

/// Forces of a pair's features that have vanished go to the nearest of its closed ones (gap up to `closed`),
/// first of those that have just appeared: faces that lie on each other name their corners now by the one,
/// now by the other, and still carry the load that the solver starts from.
void hand_over(std::span<Touch> pair, const std::vector<ContactMemory>& memory, double closed) {
  const std::uint64_t partner = pair.front().a.id();
  for (const ContactMemory& m : memory) {
    if (m.partner != partner || m.force.isZero(0) ||
        std::any_of(pair.begin(), pair.end(), [&](const Touch& t) { return t.at.key == m.feature; }))
      continue;
    Touch* heir = nullptr;
    const auto rank = [&](const Touch& t) {
      return std::pair(t.persistent, (t.at.point_a - m.place).squaredNorm());
    };
    for (Touch& t : pair)
      if (t.at.gap <= closed && (heir == nullptr || rank(t) < rank(*heir))) heir = &t;
    if (heir != nullptr) heir->warm += m.force;
  }
}

/// True if the spheres about two blocks say that no features of theirs are within the margin.
bool far_apart(const dda::Model& model, const dda::State& state, const CandidatePair& pair, double margin) {
  if (pair.a.kind != Partner::Kind::block) return false;
  const auto a = static_cast<std::size_t>(pair.a.index), b = static_cast<std::size_t>(pair.b);
  if (!state.eps[a].isZero(0) || !state.eps[b].isZero(0)) return false;
  const double reach = model.blocks[a].shape->radius + model.blocks[b].shape->radius + margin;
  return (state.c[b] - state.c[a]).squaredNorm() > reach * reach;
}

/// Hard contact with what stands fast, whichever of its materials is touched: a feature that is open within
/// the step exerts no force in it.
bool rigid_ground(const dda::Model& model, const Environment& env, const CandidatePair& pair) {
  if (pair.a.kind != Partner::Kind::plane && pair.a.kind != Partner::Kind::terrain) return false;
  const int block = model.blocks[static_cast<std::size_t>(pair.b)].material;
  for (int ground = 0; ground < env.laws.materials; ++ground) {
    if (env.laws(ground, block).sprung()) return false;
  }
  return true;
}

/// Of open features the one that comes first, if all keep their speeds; those that part, come last.
void keep_nearest(std::vector<Touch>& touches) {
  const auto rank = [](const Touch& t) { return std::pair(!(t.approach < 0), t.at.gap); };
  const auto nearest = std::min_element(touches.begin(), touches.end(),
                                        [&](const Touch& s, const Touch& t) { return rank(s) < rank(t); });
  if (nearest != touches.end()) touches = {*nearest};
}

/// Blocks of a time-stepped island move along with each other: as far as the two can approach on their
/// present motions, and what rows are made for ahead. What impulses change in the step is met by its solution
/// (crossing()).
double approach_reach(const IslandContext& in, const CandidatePair& pair, double h) {
  const auto a = static_cast<std::size_t>(pair.a.index), b = static_cast<std::size_t>(pair.b);
  const double turning = in.model.blocks[a].shape->radius * in.state.w[a].norm() +
                         in.model.blocks[b].shape->radius * in.state.w[b].norm();
  return h * ((in.state.v[b] - in.state.v[a]).norm() + turning) + h * h * in.model.gravity.norm() +
         in.scale.row_reach();
}

}  // namespace

double reach_of(const IslandContext& in, int block, double h) {
  const int l = in.local[static_cast<std::size_t>(block)];
  if (l < 0) return 0;
  return h * in.speed_of(block) + h * h * in.model.gravity.norm();
}

ContactSearch::ContactSearch(const IslandContext& in, Step& step, const SurfaceFocus& focus)
    : in_(in), step_(step), focus_(focus) {}

void ContactSearch::begin() { watches_.assign(in_.island->pairs.size(), PairWatch{}); }

void ContactSearch::forget_surfaces() {
  for (std::size_t i = 0; i < in_.island->pairs.size(); ++i)
    if (in_.moving_surface(in_.island->pairs[i].a)) watches_[i].forget();
}

bool ContactSearch::was_met(std::size_t pair, contact::FeatureKey key) const {
  return std::ranges::any_of(touches_of_[pair], [&](const Touch& t) { return t.met && t.at.key == key; });
}

std::vector<Touch> ContactSearch::find_at_end(double h) {
  std::vector<Touch> other;
  other.swap(step_.touches);
  std::vector<std::size_t> first_kept = first_of_pair_;
  step_.found_for = -1;
  find(h, false);
  step_.touches.swap(other);
  first_of_pair_.swap(first_kept);
  step_.found_for = -1;
  return other;
}

void ContactSearch::find(double h, bool at_start) {
  if (step_.found_for >= h * (1 - contact::tolerances().same_instant))
    return;  // the touches at hand hold for this state and reach
  at_start_ = at_start;
  step_.found_for = h;
  carried_ = false;
  const std::size_t pairs = in_.island->pairs.size();
  touches_of_.resize(pairs);
  margins_.resize(pairs);
  left_out_.resize(pairs);
  each_pair([this](std::size_t i) { search_pair(i); });
  touches_at_surfaces_.clear();
  for (const SurfacePair& pair : in_.island->surfaces)
    find_surface_touches(in_.env, pair, in_.scale.surface_reach(), in_.surface_history, touches_at_surfaces_);
  gather();
}

void ContactSearch::find_moved(const std::vector<Pose>& last, std::vector<double>& carried) {
  struct Way {
    Vec3 shift = Vec3::Zero();
    double turn = 0;  // of its farthest points [m]
  };
  std::vector<Way> ways(step_.bodies.size());
  contact::in_ranges(static_cast<int>(step_.bodies.size()), bodies_at_once, [&](int from, int to) {
    for (auto i = static_cast<std::size_t>(from); i < static_cast<std::size_t>(to); ++i) {
      const Pose now = dda::pose(in_.state, step_.bodies[i].block);
      ways[i] = {now.c - last[i].c,
                 in_.model.blocks[static_cast<std::size_t>(step_.bodies[i].block)].shape->radius *
                     (now.F - last[i].F).norm()};
    }
  });
  const auto way_of = [&](int block) {
    const int l = in_.local[static_cast<std::size_t>(block)];
    return l >= 0 ? ways[static_cast<std::size_t>(l)] : Way{};
  };
  const double carries = contact::tolerances().same_point * in_.scale.length;
  std::atomic<bool> searched = false, any_carried = false;
  each_pair([&](std::size_t i) {
    const CandidatePair& pair = in_.island->pairs[i];
    const Way b = way_of(pair.b), a = pair.a.kind == Partner::Kind::block ? way_of(pair.a.index) : Way{};
    const double moved = (b.shift - a.shift).norm() + b.turn + a.turn;
    if (moved == 0 && b.shift.isZero(0)) return;
    carried[i] += moved;
    if (carried[i] > carries) {
      search_pair(i);
      carried[i] = 0;
      searched.store(true, std::memory_order_relaxed);
    } else {
      margins_[i] -= moved;
      left_out_[i] -= moved;
      carry_pair(i, last);
      any_carried.store(true, std::memory_order_relaxed);
    }
  });
  carried_ = carried_ || any_carried;
  if (searched)
    gather();
  else
    take_carried();
}

/// The touches gathered before, where their pairs have been carried to.
void ContactSearch::take_carried() {
  each_pair([this](std::size_t i) {  // the order of the touches within a pair is the same; some were dropped
    std::size_t k = first_of_pair_[i];
    for (const Touch& t : touches_of_[i])
      if (k < first_of_pair_[i + 1] && step_.touches[k].at.key == t.at.key) step_.touches[k++].at = t.at;
  });
}

/// Points and gaps of a pair's touches go along with its blocks.
void ContactSearch::carry_pair(std::size_t pair, const std::vector<Pose>& last) {
  if (touches_of_[pair].empty()) return;
  struct Carry {
    Mat3 turn = Mat3::Identity();
    Vec3 from = Vec3::Zero(), to = Vec3::Zero();
    Vec3 operator()(const Vec3& x) const { return to + turn * (x - from) - x; }
  };
  const auto carry_of = [&](int block) {
    const int l = block < 0 ? -1 : in_.local[static_cast<std::size_t>(block)];
    if (l < 0) return Carry{};
    const Pose now = dda::pose(in_.state, block);
    const Pose& from = last[static_cast<std::size_t>(l)];
    return Carry{now.F * from.F.inverse(), from.c, now.c};
  };
  const CandidatePair& of = in_.island->pairs[pair];
  const Carry way_b = carry_of(of.b), way_a = carry_of(of.a.kind == Partner::Kind::block ? of.a.index : -1);
  for (Touch& t : touches_of_[pair]) {
    const Vec3 of_b = way_b(t.at.point_b), of_a = way_a(t.at.point_a);
    t.at.point_b += of_b;
    t.at.point_a += of_a;
    t.at.gap += t.at.normal.dot(of_b - of_a);
  }
}

void ContactSearch::keep_late_overlaps() {
  bool any = false;
  for (std::size_t i = 0; i < in_.island->pairs.size(); ++i) {
    const CandidatePair& pair = in_.island->pairs[i];
    if (pair.a.kind != Partner::Kind::block) continue;
    if (in_.model.blocks[static_cast<std::size_t>(pair.a.index)].shape->convex &&
        in_.model.blocks[static_cast<std::size_t>(pair.b)].shape->convex)
      continue;
    double known = 0, late = 0;
    for (const Touch& t : touches_of_[i])
      if (t.stiffness == 0) (t.persistent ? known : late) = std::max(t.persistent ? known : late, -t.at.gap);
    if (late <= contact::tolerances().late_overlap * in_.scale.length + 2 * known ||
        late <= contact::tolerances().late_overlap * in_.scale.length +
                    2 * (known + StepMotion(in_, step_, true).path(pair)))
      continue;
    ContactMemory memory;
    memory.partner = pair.a.id();
    memory.feature = born_inside;
    memory.indentation = late;
    auto& list = in_.history[static_cast<std::size_t>(pair.b)];
    list.push_back(memory);
    std::sort(list.begin(), list.end(), [](const ContactMemory& a, const ContactMemory& b) {
      return std::pair(a.partner, a.feature) < std::pair(b.partner, b.feature);
    });
    search_pair(i);
    any = true;
  }
  if (any) gather();
}

void ContactSearch::each_pair(const std::function<void(std::size_t)>& use) const {
  const std::size_t n = in_.island->pairs.size();
  if (in_.settings.threads < 2 || n < pairs_for_threads) {
    for (std::size_t i = 0; i < n; ++i) use(i);
    return;
  }
  // A thread that waits takes no other island's work meanwhile: its integrator is in use.
  tbb::this_task_arena::isolate([&] { tbb::parallel_for(std::size_t{0}, n, use); });
}

/// All that pair i may touch within the reach.
void ContactSearch::search_pair(std::size_t i) {
  const CandidatePair& pair = in_.island->pairs[i];
  const bool blocks = pair.a.kind == Partner::Kind::block;
  double margin = blocks && in_.time_stepped()
                      ? approach_reach(in_, pair, step_.found_for)
                      : reach_of(in_, pair.b, step_.found_for) + 1e-6 * in_.scale.length +
                            (blocks ? reach_of(in_, pair.a.index, step_.found_for) : 0.0);
  if (pair.a.kind == Partner::Kind::structure) margin += 1e-3 * in_.scale.length;
  margin += in_.env.bond_stretch;
  margins_[i] = margin;
  touches_of_[i].clear();
  left_out_[i] = std::numeric_limits<double>::infinity();
  if (far_apart(in_.model, in_.state, pair, margin)) return;
  const Tilts tilts = [this](const Touch& t) { return in_.condensed || !part_resolved(in_, step_, t); };
  if (in_.condensed || !focus_.active() || !PairWatch::serves(in_.model, in_.env, pair)) {
    watches_[i].forget();
    // Rows are made for what is closed; what closes within the step of events is found by the time of impact.
    // A scan that slides has hundreds of corners within the reach of a step, and a handful of them near the
    // ground.
    const double near = contact::tolerances().listed_near * in_.scale.length + in_.env.bond_stretch;
    const bool ground = in_.event_driven() && near < margin && rigid_ground(in_.model, in_.env, pair);
    find_touches(in_.model, in_.state, in_.env, pair, ground ? near : margin, in_.history, touches_of_[i],
                 tilts);
    if (ground) {
      left_out_[i] = near;
      if (touches_of_[i].empty()) {
        find_touches(in_.model, in_.state, in_.env, pair, margin, in_.history, touches_of_[i], tilts);
        keep_nearest(touches_of_[i]);
      }
    }
    if (in_.time_stepped()) drop_distant(i);
    return;
  }
  thread_local std::vector<FoundPoint> points;
  points.clear();
  const double ahead =
      reach_of(in_, pair.b, step_.found_for) +
      (pair.a.kind == Partner::Kind::block ? reach_of(in_, pair.a.index, step_.found_for) : 0.0);
  watches_[i].look(in_.model, in_.state, in_.env, pair, margin, ahead, focus_.surface_travel(), points);
  make_touches(in_.model, in_.state, in_.env, pair, points, in_.history, touches_of_[i]);
}

/// Most touches of a time-stepped island can neither close within the reach nor come near enough to be rows:
/// of those the least gap alone is kept.
void ContactSearch::drop_distant(std::size_t i) {
  const double h = step_.found_for, fall = h * h * in_.model.gravity.norm();
  std::erase_if(touches_of_[i], [&](const Touch& t) {
    if (t.stiffness > 0 || t.persistent || t.glued ||
        std::min(t.at.gap, t.at.gap + h * t.approach - fall) < in_.scale.row_reach())
      return false;
    left_out_[i] = std::min(left_out_[i], t.at.gap);
    return true;
  });
}

/// Springs, and in time-stepped islands the forces that the solver starts from, go on from what the pairs
/// remember.
void ContactSearch::carry() {
  std::vector<std::vector<LooseSpring>> loose(in_.island->pairs.size());
  each_pair([&](std::size_t i) {
    const CandidatePair& pair = in_.island->pairs[i];
    const std::vector<ContactMemory>& memory = in_.history[static_cast<std::size_t>(pair.b)];
    const std::span touches =
        std::span(step_.touches).subspan(first_of_pair_[i], first_of_pair_[i + 1] - first_of_pair_[i]);
    if (in_.leapfrog() && in_.moving_surface(pair.a) && !presses_on_bed(in_.model, in_.env, pair))
      leave_to_others(pair.a.id(), touches, memory,
                      [this](const Touch& t) { return step_.length_before(t, step_.found_for); });
    if (in_.moving_surface(pair.a) || (touches.empty() && memory.empty())) return;
    carry_springs(pair, touches, memory, in_.leapfrog(), loose[i]);
    if (in_.time_stepped() && !touches.empty())
      hand_over(touches, memory, contact::tolerances().same_point * in_.scale.length);
  });
  loose_.clear();
  for (const std::vector<LooseSpring>& of : loose) loose_.insert(loose_.end(), of.begin(), of.end());
  carry_out_of_reach();
}

/// Springs at partners that are out of reach.
void ContactSearch::carry_out_of_reach() {
  const auto loaded = [](const ContactMemory& m) { return m.normal_energy > 0; };
  if (std::none_of(step_.bodies.begin(), step_.bodies.end(), [&](const Body& b) {
        return std::ranges::any_of(in_.history[static_cast<std::size_t>(b.block)], loaded);
      }))
    return;
  std::vector<std::pair<int, std::uint64_t>> known;
  for (const CandidatePair& pair : in_.island->pairs) known.emplace_back(pair.b, pair.a.id());
  std::sort(known.begin(), known.end());
  for (const Body& b : step_.bodies)
    for (const ContactMemory& m : in_.history[static_cast<std::size_t>(b.block)]) {
      if (!loaded(m) || std::binary_search(known.begin(), known.end(), std::pair(b.block, m.partner)))
        continue;
      const Partner a{static_cast<Partner::Kind>(m.partner >> 32), static_cast<int>(m.partner & 0xffffffff)};
      const auto index = static_cast<std::size_t>(a.index);
      const bool here =
          a.kind != Partner::Kind::block || in_.local[index] >= 0 || in_.model.blocks[index].ndof() == 0;
      if (here && !in_.moving_surface(a)) loose_.push_back({a, b.block, m.place, m.normal, m.normal_energy});
    }
}

void ContactSearch::gather() {
  flush_pair_.clear();
  first_of_pair_.assign(1, 0);
  for (const std::vector<Touch>& of : touches_of_) {
    first_of_pair_.push_back(first_of_pair_.back() + of.size());
    flush_pair_.push_back(of.empty() ? 0 : 1);
  }
  step_.touches.resize(first_of_pair_.back());
  each_pair([this](std::size_t i) {
    std::copy(touches_of_[i].begin(), touches_of_[i].end(),
              step_.touches.begin() + static_cast<std::ptrdiff_t>(first_of_pair_[i]));
  });
  drop_internal_edges(in_.model, in_.state, in_.env, in_.scale.flush(), in_.scale.flush_skins(),
                      step_.touches);
  if (step_.touches.size() == first_of_pair_.back()) {
    std::fill(flush_pair_.begin(), flush_pair_.end(), static_cast<char>(0));
  } else {
    std::size_t t = 0;
    for (std::size_t i = 0; i < in_.island->pairs.size(); ++i) {
      first_of_pair_[i] = t;
      for (; t < step_.touches.size() && step_.touches[t].a == in_.island->pairs[i].a &&
             step_.touches[t].b == in_.island->pairs[i].b;
           ++t)
        flush_pair_[i] = 0;
    }
    first_of_pair_.back() = t;
  }
  if (at_start_) carry();
  step_.touches.insert(step_.touches.end(), touches_at_surfaces_.begin(), touches_at_surfaces_.end());
}

void ContactSearch::add_rows(const std::vector<std::vector<Touch>>& features) {
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
    for (const Touch& feature : features[i]) {
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
  gather();
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

}  // namespace talus::coupling
