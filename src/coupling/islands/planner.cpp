// Who may meet whom within a stretch, and the islands that follow from it.
#include "coupling/islands/planner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ranges>

#include "contact/geometry/apart.hpp"
#include "contact/parallel.hpp"
#include "contact/tolerances.hpp"
#include "coupling/ground/ground.hpp"

namespace talus::coupling {
namespace {

/// Of pairs whose boxes overlap, those that can touch: one of the two moves, and no plane between them proves
/// that they stay apart.
void drop_apart(const dda::Model& model, const dda::State& s, std::span<const double> near,
                std::vector<std::pair<int, int>>& pairs) {
  constexpr int pairs_at_once = 256;
  std::vector<char> drop(pairs.size());
  const auto look = [&](int from, int to) {
    for (auto k = static_cast<std::size_t>(from); k < static_cast<std::size_t>(to); ++k) {
      const auto i = static_cast<std::size_t>(pairs[k].first), j = static_cast<std::size_t>(pairs[k].second);
      const bool stand = model.blocks[i].ndof() == 0 && model.blocks[j].ndof() == 0;
      drop[k] =
          stand || contact::apart(*model.blocks[i].shape, dda::pose(s, pairs[k].first),
                                  *model.blocks[j].shape, dda::pose(s, pairs[k].second), near[i] + near[j])
              ? 1
              : 0;
    }
  };
  contact::in_ranges(static_cast<int>(pairs.size()), pairs_at_once, look);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < pairs.size(); ++k)
    if (drop[k] == 0) pairs[kept++] = pairs[k];
  pairs.resize(kept);
}

/// Where a structure's skin is, whatever of it the index follows.
Box3 skin_box(const StructurePart& part) {
  if (part.fixed_surface) return part.index->bounds();
  Box3 box;
  for (const Vec3& x : part.structure->skin().surface().vertices) box.extend(x);
  return box;
}

}  // namespace

IslandPlanner::IslandPlanner(const dda::Model& model, const SystemState& state, const Environment& env,
                             const SystemSettings& settings)
    : model_(model), state_(state), env_(env), settings_(settings) {}

/// How far each structure's skin may move, and which of them may meet.
void IslandPlanner::pair_structures(double duration, std::span<const Farther> farther, IslandPlan& p) const {
  p.structure_reach.assign(env_.structures.size(), 0.0);
  p.surfaces.clear();
  for (std::size_t q = 0; q < env_.structures.size(); ++q) {
    const StructurePart& part = env_.structures[q];
    if (part.fixed_surface || part.structure->quiet()) continue;
    double fastest = 0;
    for (const Vec3& v : part.structure->skin().surface().velocities) fastest = std::max(fastest, v.norm());
    p.structure_reach[q] = 1.5 * duration * fastest;
  }
  for (const Farther& f : farther)
    if (f.kind == Partner::Kind::structure)
      p.structure_reach[static_cast<std::size_t>(f.index)] =
          std::max(p.structure_reach[static_cast<std::size_t>(f.index)], f.way);
  for (const auto& [a, b] : env_.touching_structures) {
    const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
    if (env_.structures[i].structure->quiet() && env_.structures[j].structure->quiet()) continue;
    Box3 near = skin_box(env_.structures[i]);
    const double reach = p.structure_reach[i] + p.structure_reach[j] + 1e-3 * near.sizes().norm();
    near.min().array() -= reach;
    near.max().array() += reach;
    if (near.intersects(skin_box(env_.structures[j])))
      p.surfaces.push_back({{Partner::Kind::structure, a}, b});
  }
  for (std::size_t q = 0; q < env_.structures.size(); ++q) {
    const StructurePart& part = env_.structures[q];
    if (part.fixed_surface || part.structure->quiet()) continue;
    for (const int g : part.grounds)
      if (const Ground& ground = env_.grounds[static_cast<std::size_t>(g)];
          may_come_to(env_, ground, *part.structure, p.structure_reach[q]))
        p.surfaces.push_back({ground.partner, static_cast<int>(q)});
  }
}

IslandPlan IslandPlanner::plan(double duration, std::span<const Farther> farther,
                               const BlockPairs& met) const {
  IslandPlan p;
  const int n = static_cast<int>(model_.blocks.size());
  const dda::State& s = state_.blocks;
  p.reach.assign(static_cast<std::size_t>(n), 0.0);
  p.structure_used.assign(env_.structures.size(), 0);
  pair_structures(duration, farther, p);
  std::vector<double> known(static_cast<std::size_t>(n), 0.0);  // ways of blocks
  for (const Farther& f : farther)
    if (f.kind == Partner::Kind::block)
      known[static_cast<std::size_t>(f.index)] = std::max(known[static_cast<std::size_t>(f.index)], f.way);
  std::vector<Box3> boxes(static_cast<std::size_t>(n));
  std::vector<double> near(static_cast<std::size_t>(n));  // how far each may come, and is touched from [m]
  const double g = model_.gravity.norm();
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const dda::Model::Block& b = model_.blocks[k];
    const double radius = b.shape->radius;
    if (b.ndof() > 0)  // asleep or not: what wakes may move
      p.reach[k] =
          1.5 * duration * (s.v[k].norm() + radius * s.w[k].norm()) + duration * duration * g + 1e-3 * radius;
    p.reach[k] = std::max(p.reach[k], known[k]);
    near[k] = p.reach[k] + 1e-5 * radius + env_.bond_stretch;
    boxes[k] = contact::bounds(*b.shape, dda::pose(s, i), near[k]);
  }
  std::vector<std::pair<int, int>> pairs;
  contact::overlapping_pairs(boxes, pairs);

  const auto moves = [&](int i) { return model_.blocks[static_cast<std::size_t>(i)].ndof() > 0; };
  drop_apart(model_, s, near, pairs);
  DisjointSets sets(n + static_cast<int>(env_.structures.size()));  // blocks, then structures
  // Fixed partners, and structures as hubs: all that is near one structure shares its sub-step.
  std::vector<CandidatePair> fixed;
  for (const SurfacePair& pair : p.surfaces)
    if (pair.a.kind == Partner::Kind::structure) sets.join(n + pair.a.index, n + pair.b);
  for (int i = 0; i < n; ++i) {
    if (!moves(i)) continue;
    const auto k = static_cast<std::size_t>(i);
    for (std::size_t q = 0; q < env_.planes.size(); ++q) {
      const Plane& plane = env_.planes[q];
      const Vec3 half = 0.5 * boxes[k].sizes();
      const double lowest =
          plane.normal.dot(boxes[k].center() - plane.point) - plane.normal.cwiseAbs().dot(half);
      if (lowest <= 0) fixed.push_back({{Partner::Kind::plane, static_cast<int>(q)}, i});
    }
    if (env_.terrain != nullptr && env_.terrain->overlaps(boxes[k]))
      fixed.push_back({{Partner::Kind::terrain, 0}, i});
    for (std::size_t q = 0; q < env_.structures.size(); ++q) {
      Box3 box = boxes[k];
      box.min().array() -= p.structure_reach[q];
      box.max().array() += p.structure_reach[q];
      if (!env_.structures[q].index->overlaps(box) ||
          contact::apart(*env_.structures[q].index, *model_.blocks[k].shape, dda::pose(s, i),
                         near[k] + p.structure_reach[q]))
        continue;
      fixed.push_back({{Partner::Kind::structure, static_cast<int>(q)}, i});
      if (!env_.structures[q].fixed_surface) sets.join(i, n + static_cast<int>(q));
    }
  }
  std::vector<Course> course(static_cast<std::size_t>(n), Course::by_itself);
  join_clusters(duration, pairs, met, sets, course);
  group(pairs, fixed, sets, course, p);
  return p;
}

/// One island per set of blocks and structures (numbered after the blocks), in the order of their first
/// blocks; islands asleep as a whole are skipped.
void IslandPlanner::group(const BlockPairs& pairs, std::span<const CandidatePair> fixed, DisjointSets& sets,
                          std::span<const Course> course, IslandPlan& p) const {
  const int n = static_cast<int>(model_.blocks.size());
  const auto moves = [&](int i) { return model_.blocks[static_cast<std::size_t>(i)].ndof() > 0; };
  std::vector<int> island_of(static_cast<std::size_t>(n) + env_.structures.size(), -1);
  std::vector<char> awake(island_of.size(), 0);
  for (const SurfacePair& pair : p.surfaces) awake[static_cast<std::size_t>(sets.root(n + pair.b))] = 1;
  for (int i = 0; i < n; ++i)
    if (moves(i) && state_.asleep[static_cast<std::size_t>(i)] == 0)
      awake[static_cast<std::size_t>(sets.root(i))] = 1;
  // A structure that may come to what sleeps wakes it. What rests on it sleeps on while it rings.
  for (const CandidatePair& c : fixed) {
    const auto b = static_cast<std::size_t>(c.b);
    if (c.a.kind != Partner::Kind::structure ||
        p.structure_reach[static_cast<std::size_t>(c.a.index)] <=
            contact::tolerances().woken_by * model_.blocks[b].shape->radius)
      continue;
    const auto& known = state_.contacts[b];
    if (std::none_of(known.begin(), known.end(),
                     [&](const ContactMemory& m) { return m.partner == c.a.id(); }))
      awake[static_cast<std::size_t>(sets.root(c.b))] = 1;
  }
  for (int i = 0; i < n; ++i) {
    if (!moves(i)) continue;
    const int root = sets.root(i);
    if (awake[static_cast<std::size_t>(root)] == 0) {
      ++p.skipped;
      continue;
    }
    int& id = island_of[static_cast<std::size_t>(root)];
    if (id < 0) {
      id = static_cast<int>(p.islands.size());
      p.islands.emplace_back();
    }
    Island& island = p.islands[static_cast<std::size_t>(id)];
    island.blocks.push_back(i);
    island.course = std::max(island.course, course[static_cast<std::size_t>(i)]);
  }
  const auto use = [&](Island& island, int structure) {
    p.structure_used[static_cast<std::size_t>(structure)] = 1;
    auto& list = island.structures;
    if (std::find(list.begin(), list.end(), structure) == list.end()) list.push_back(structure);
  };
  for (const SurfacePair& pair : p.surfaces) {
    int& id = island_of[static_cast<std::size_t>(sets.root(n + pair.b))];
    if (id < 0) {
      id = static_cast<int>(p.islands.size());
      p.islands.emplace_back();
    }
    Island& island = p.islands[static_cast<std::size_t>(id)];
    island.surfaces.push_back(pair);
    if (pair.a.kind == Partner::Kind::structure) use(island, pair.a.index);
    use(island, pair.b);
  }
  const auto island_at = [&](int block) -> Island* {
    const int id = island_of[static_cast<std::size_t>(sets.root(block))];
    return id < 0 ? nullptr : &p.islands[static_cast<std::size_t>(id)];
  };
  for (Island& island : p.islands) island.watched.assign(island.blocks.size(), 0);
  const auto watch = [&](int block) {
    Island* island = island_at(block);
    if (island == nullptr) return false;
    island->watched[static_cast<std::size_t>(std::ranges::lower_bound(island->blocks, block) -
                                             island->blocks.begin())] = 1;
    return true;
  };
  for (const auto& [i, j] : pairs) {
    // B is the block with DOFs (the later one if both have).
    const int b = moves(j) ? j : i, a = b == j ? i : j;
    if (moves(a) && sets.root(a) != sets.root(b)) {
      const bool of_a = watch(a), of_b = watch(b);
      (of_a || of_b ? p.beside : p.asleep).emplace_back(a, b);
    } else if (Island* island = island_at(b)) {
      island->pairs.push_back({{Partner::Kind::block, a}, b});
    }
  }
  for (const CandidatePair& c : fixed)
    if (Island* island = island_at(c.b)) {
      island->pairs.push_back(c);
      if (c.a.kind == Partner::Kind::structure &&
          !env_.structures[static_cast<std::size_t>(c.a.index)].fixed_surface)
        use(*island, c.a.index);
    }
}

}  // namespace talus::coupling
