// What an island's bodies may touch within a step. Pairs whose bodies have not moved since the last search keep what it found.
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "coupling/island_body.hpp"
#include "coupling/spring_carry.hpp"
#include "coupling/touch_flush.hpp"

namespace talus::coupling {

double IslandStepper::reach(int block, double h) const {
  const int l = local_[static_cast<std::size_t>(block)];
  if (l < 0) return 0;
  const auto k = static_cast<std::size_t>(block);
  const double speed = state_.v[k].norm() + model_.blocks[k].shape->radius * state_.w[k].norm();
  return h * speed + h * h * model_.gravity.norm();
}

void IslandStepper::find(double h, bool at_start) {
  if (found_for_ >= h * (1 - 1e-9)) return;   // the touches at hand hold for this state and reach
  at_start_ = at_start;
  found_for_ = h;
  const std::size_t pairs = island_->pairs.size();
  touches_of_.resize(pairs);
  margins_.resize(pairs);
  each_pair([this](std::size_t i) { look(i); });
  touches_at_surfaces_.clear();
  for (const SurfacePair& pair : island_->surfaces) find_surface_touches(env_, pair, 0.5 * length_, surface_history_, touches_at_surfaces_);
  gather_touches();
}

/// The touches again after a projection moved blocks from their last poses, between blocks and with what is fixed: searched again, or where so
/// little was moved since (`carried`, per pair [m]) that its square is below what is projected to, carried along.
void IslandStepper::find_moved(const std::vector<Pose>& last, std::vector<double>& carried) {
  std::vector<double> way(bodies_.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Pose now = dda::pose(state_, bodies_[i].block);
    way[i] = (now.c - last[i].c).norm() + model_.blocks[static_cast<std::size_t>(bodies_[i].block)].shape->radius * (now.F - last[i].F).norm();
  }
  const auto way_of = [&](int block) {
    const int l = local_[static_cast<std::size_t>(block)];
    return l >= 0 ? way[static_cast<std::size_t>(l)] : 0.0;
  };
  each_pair([&](std::size_t i) {
    const CandidatePair& pair = island_->pairs[i];
    if (moving_skin(pair.a)) return;
    const double moved = way_of(pair.b) + (pair.a.kind == Partner::Kind::block ? way_of(pair.a.index) : 0.0);
    if (moved == 0) return;
    carried[i] += moved;
    if (carried[i] > 1e-5 * length_) {
      look(i);
      carried[i] = 0;
    } else {
      margins_[i] -= moved;
      carry_pair(i, last);
    }
  });
  gather_touches();
}

/// Points and gaps of a pair's touches go along with its blocks.
void IslandStepper::carry_pair(std::size_t pair, const std::vector<Pose>& last) {
  const auto way = [&](int block, const Vec3& x) -> Vec3 {
    const int l = local_[static_cast<std::size_t>(block)];
    if (l < 0) return Vec3::Zero();
    const Pose now = dda::pose(state_, block);
    const Pose& from = last[static_cast<std::size_t>(l)];
    return now.c + now.F * (from.F.inverse() * (x - from.c)) - x;
  };
  for (Touch& t : touches_of_[pair]) {
    const Vec3 of_b = way(t.b, t.at.point_b), of_a = t.a.kind == Partner::Kind::block ? way(t.a.index, t.at.point_a) : Vec3(Vec3::Zero());
    t.at.point_b += of_b;
    t.at.point_a += of_a;
    t.at.gap += t.at.normal.dot(of_b - of_a);
  }
}

/// Touches of moved blocks at structures: what a projection moves is far below the reach, so points and gaps go along with the block; only
/// after more than that they are searched again.
void IslandStepper::carry_at_structures(const std::vector<Pose>& before) {
  bool any = false;
  for (std::size_t i = 0; i < island_->pairs.size(); ++i) {
    const CandidatePair& pair = island_->pairs[i];
    if (!moving_skin(pair.a) || touches_of_[i].empty()) continue;
    const Pose& from = before[static_cast<std::size_t>(local_[static_cast<std::size_t>(pair.b)])];
    const Pose to = dda::pose(state_, pair.b);
    if (to.c == from.c && to.F == from.F) continue;
    any = true;
    const Mat3 carry = to.F * from.F.inverse();
    double farthest = 0;
    for (Touch& t : touches_of_[i]) {
      const Vec3 way = to.c + carry * (t.at.point_b - from.c) - t.at.point_b;
      t.at.point_b += way;
      t.at.gap += t.at.normal.dot(way);
      farthest = std::max(farthest, way.norm());
    }
    if (farthest > 1e-4 * length_) look(i);
  }
  if (any) gather_touches();
}

/// Concave blocks can hide an overlap from the search until a corner comes out of a notch. What no motion of this step can have made is not
/// thrown out, which would be a blow that nobody struck: it stays where it is, as where a piece was born inside another.
void IslandStepper::keep_late_overlaps() {
  bool any = false;
  for (std::size_t i = 0; i < island_->pairs.size(); ++i) {
    const CandidatePair& pair = island_->pairs[i];
    if (pair.a.kind != Partner::Kind::block) continue;
    if (model_.blocks[static_cast<std::size_t>(pair.a.index)].shape->convex && model_.blocks[static_cast<std::size_t>(pair.b)].shape->convex) continue;
    double known = 0, late = 0;
    for (const Touch& t : touches_of_[i]) (t.persistent ? known : late) = std::max(t.persistent ? known : late, -t.at.gap);
    if (late <= 1e-3 * length_ + 2 * known || late <= 1e-3 * length_ + 2 * (known + path(pair))) continue;
    ContactMemory memory;
    memory.partner = pair.a.id();
    memory.feature = born_inside;
    memory.indentation = late;
    auto& list = history_[static_cast<std::size_t>(pair.b)];
    list.push_back(memory);
    std::sort(list.begin(), list.end(), [](const ContactMemory& a, const ContactMemory& b) { return std::pair(a.partner, a.feature) < std::pair(b.partner, b.feature); });
    look(i);
    any = true;
  }
  if (any) gather_touches();
}

void IslandStepper::each_pair(const std::function<void(std::size_t)>& use) const {
  const std::size_t n = island_->pairs.size();
  if (settings_.threads < 2 || n < pairs_for_threads) {
    for (std::size_t i = 0; i < n; ++i) use(i);
    return;
  }
  // A thread that waits takes no other island's work meanwhile: its stepper is in use.
  tbb::this_task_arena::isolate([&] { tbb::parallel_for(std::size_t{0}, n, use); });
}

/// All that pair i may touch within the reach.
void IslandStepper::look(std::size_t i) {
  const CandidatePair& pair = island_->pairs[i];
  double margin = reach(pair.b, found_for_) + 1e-6 * length_;
  if (pair.a.kind == Partner::Kind::block) margin += reach(pair.a.index, found_for_);
  if (pair.a.kind == Partner::Kind::structure) margin += 1e-3 * length_;
  margins_[i] = margin;
  touches_of_[i].clear();
  find_touches(model_, state_, env_, pair, margin, history_, touches_of_[i]);
}

/// Springs go on from what the pairs remember.
void IslandStepper::carry() {
  for (std::size_t first = 0, last; first < touches_.size(); first = last) {
    const Touch& t = touches_[first];
    last = first + 1;
    while (last < touches_.size() && touches_[last].a == t.a && touches_[last].b == t.b) ++last;
    if (!moving_skin(t.a)) carry_springs(std::span(touches_).subspan(first, last - first), history_[static_cast<std::size_t>(t.b)]);
  }
}

void IslandStepper::gather_touches() {
  touches_.clear();
  flush_pair_.clear();
  for (const std::vector<Touch>& of : touches_of_) {
    touches_.insert(touches_.end(), of.begin(), of.end());
    flush_pair_.push_back(of.empty() ? 0 : 1);
  }
  drop_internal_edges(model_, state_, env_, flush(), touches_);
  std::size_t t = 0;
  for (std::size_t i = 0; i < island_->pairs.size(); ++i)
    for (; t < touches_.size() && touches_[t].a == island_->pairs[i].a && touches_[t].b == island_->pairs[i].b; ++t) flush_pair_[i] = 0;
  if (at_start_) carry();
  touches_.insert(touches_.end(), touches_at_surfaces_.begin(), touches_at_surfaces_.end());
  report_.counters.contacts += static_cast<long>(touches_.size());
}

}  // namespace talus::coupling
