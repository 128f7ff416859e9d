// Which blocks go by themselves: what does not touch and does not meet within a stretch may be stepped alone,
// however near it is. A cluster is what touches or will meet on its present motion. What was stepped apart
// and met on the ways that it took is stepped anew, together.
#include "coupling/islands/planner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "contact/geometry/apart.hpp"
#include "contact/parallel.hpp"
#include "contact/tolerances.hpp"
#include "coupling/step/scales.hpp"

namespace talus::coupling {
namespace {

/// The part of a motion between the fractions s0 and s1 of its time.
contact::Motion part(const contact::Motion& m, double s0, double s1) {
  contact::Motion out;
  out.start = m.at(s0);
  out.displacement = m.at(s1).c - out.start.c;
  out.half_gravity_step = (s1 - s0) * (s1 - s0) * m.half_gravity_step;
  out.rotation = (s1 - s0) * m.rotation;
  return out;
}

/// The fraction of these motions at which two bodies come within `level` of each other, above 1: not; the
/// bound on their relative way spares most the search.
double come_within(const Polyhedron& A, const contact::Motion& a, const Polyhedron& B,
                   const contact::Motion& b, double level) {
  constexpr double never = 2;
  const double way = (b.displacement - a.displacement).norm() +
                     0.25 * (b.half_gravity_step - a.half_gravity_step).norm() +
                     A.radius * a.rotation.norm() + B.radius * b.rotation.norm();
  return contact::apart(A, a.start, B, b.start, level + way) ? never
                                                             : contact::time_of_impact(A, a, B, b, level);
}

/// A block's way over a stretch; one that was not stepped stays where it is.
class Way {
 public:
  Way(std::span<const Leg> legs, const Pose& at) : legs_(legs) { still_.start = at; }
  /// The motion from t0 to t1, which lie within one leg.
  contact::Motion between(double t0, double t1) {
    if (legs_.empty()) return still_;
    while (k_ + 1 < legs_.size() && legs_[k_].t1 <= t0) ++k_;
    const Leg& leg = legs_[k_];
    const auto fraction = [&](double t) { return std::clamp((t - leg.t0) / (leg.t1 - leg.t0), 0.0, 1.0); };
    return part(leg.motion, fraction(t0), fraction(t1));
  }
  /// The earliest end of a leg after t, or `end`.
  double next(double t, double end) const {
    for (std::size_t k = k_; k < legs_.size(); ++k)
      if (legs_[k].t1 > t) return std::min(end, legs_[k].t1);
    return end;
  }

 private:
  std::span<const Leg> legs_;
  contact::Motion still_;
  std::size_t k_ = 0;
};

}  // namespace

/// Distance from which on a block is touched [m].
double IslandPlanner::touching(int block) const {
  return contact::tolerances().cluster_gap * model_.blocks[static_cast<std::size_t>(block)].shape->radius +
         env_.bond_stretch;
}

/// True if the two pressed on each other, or held together, when they were last stepped.
bool IslandPlanner::touched(int i, int j) const {
  const auto knows = [&](int b, int partner) {
    const auto& known = state_.contacts[static_cast<std::size_t>(b)];
    return std::ranges::any_of(known, [id = Partner{Partner::Kind::block, partner}.id()](
                                          const ContactMemory& m) { return m.partner == id; });
  };
  return knows(i, j) || knows(j, i);
}

/// A block's motion over the stretch if it goes on as it goes: what touches nothing falls, what is borne goes
/// straight on, what sleeps stays.
contact::Motion IslandPlanner::foreseen(int block, double duration) const {
  const auto k = static_cast<std::size_t>(block);
  contact::Motion m;
  m.start = dda::pose(state_.blocks, block);
  if (state_.asleep[k] != 0) return m;
  if (state_.contacts[k].empty()) m.half_gravity_step = 0.5 * duration * duration * model_.gravity;
  m.displacement = duration * state_.blocks.v[k] + m.half_gravity_step;
  m.rotation = duration * state_.blocks.w[k];
  return m;
}

/// True if two blocks touch, or will within the stretch on the motions foreseen.
bool IslandPlanner::will_meet(int i, int j, double duration) const {
  const dda::State& s = state_.blocks;
  const Polyhedron &A = *model_.blocks[static_cast<std::size_t>(i)].shape,
                   &B = *model_.blocks[static_cast<std::size_t>(j)].shape;
  const double level = touching(i) + touching(j);
  if (!contact::apart(A, dda::pose(s, i), B, dda::pose(s, j), level)) return true;
  return come_within(A, foreseen(i, duration), B, foreseen(j, duration), level) <= 1;
}

bool IslandPlanner::rebounds(int i, int j) const {
  const auto material = [&](int b) { return model_.blocks[static_cast<std::size_t>(b)].material; };
  return env_.laws(material(i), material(j)).restitution.value_or(0) > 0;
}

bool IslandPlanner::both_move(const CandidatePair& pair) const {
  return pair.a.kind == Partner::Kind::block &&
         model_.blocks[static_cast<std::size_t>(pair.a.index)].ndof() > 0;
}

/// True if two blocks may come to touch within the stretch by their motion against each other, wherever that
/// turns: what goes along beside each other stays apart.
bool IslandPlanner::may_meet(int i, int j, double duration) const {
  const dda::State& s = state_.blocks;
  const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
  const Polyhedron &A = *model_.blocks[a].shape, &B = *model_.blocks[b].shape;
  const double way =
      duration * ((s.v[a] - s.v[b]).norm() + A.radius * s.w[a].norm() + B.radius * s.w[b].norm());
  return !contact::apart(A, dda::pose(s, i), B, dda::pose(s, j), touching(i) + touching(j) + way);
}

/// Joins what is stepped as one: what shares a structure, and of all that may meet within the stretch the
/// clusters that are too dear to locate their events. To locate one event at each of its k
/// contacts costs a cluster k solutions of k contacts; time stepping costs it one solution in each of the n
/// time steps of the stretch. It goes by itself, with its events located, up to k = `dearer` n. One whose
/// parts are all cheaper than that, and throw each other back, goes part by part (Course, per block).
void IslandPlanner::join_clusters(double duration, const BlockPairs& pairs, const BlockPairs& met,
                                  DisjointSets& sets, std::vector<Course>& course) const {
  const int n = static_cast<int>(model_.blocks.size());
  const auto moves = [&](int i) { return model_.blocks[static_cast<std::size_t>(i)].ndof() > 0; };
  const auto both_move = [&](const std::pair<int, int>& pair) {
    return moves(pair.first) && moves(pair.second);
  };
  // The time of impact is of rigid motions: what strains may come nearer than it says.
  const auto strains = [&](int i) { return model_.blocks[static_cast<std::size_t>(i)].deformable; };
  DisjointSets clusters(n), near = sets, meeting(n);
  std::vector<double> ahead(static_cast<std::size_t>(n), 0.0);  // contacts that will be, at the first of two
  std::vector<char> thrown_back(static_cast<std::size_t>(n), 0);  // there
  const auto contacts = [&](int i) {
    return static_cast<double>(state_.contacts[static_cast<std::size_t>(i)].size());
  };
  for (const auto& pair : pairs) {
    if (!both_move(pair)) continue;
    near.join(pair.first, pair.second);
    if (may_meet(pair.first, pair.second, duration)) meeting.join(pair.first, pair.second);
    if (strains(pair.first) || strains(pair.second) || touched(pair.first, pair.second))
      clusters.join(pair.first, pair.second);
  }
  for (const auto& [i, j] : met) clusters.join(i, j);
  DisjointSets touching = clusters;
  std::vector<char> at_structure(static_cast<std::size_t>(n) + env_.structures.size(), 0);
  for (std::size_t q = 0; q < env_.structures.size(); ++q)
    at_structure[static_cast<std::size_t>(near.root(n + static_cast<int>(q)))] = 1;
  const auto shares_structure = [&](int i) {
    return at_structure[static_cast<std::size_t>(near.root(i))] != 0;
  };
  for (const auto& pair : pairs) {
    if (!both_move(pair)) continue;
    if (shares_structure(pair.first)) {
      sets.join(pair.first, pair.second);
    } else if (clusters.root(pair.first) != clusters.root(pair.second) &&
               will_meet(pair.first, pair.second, duration)) {
      clusters.join(pair.first, pair.second);
      ahead[static_cast<std::size_t>(pair.first)] +=
          4;  // of two faces: an edge has fewer, a guess too low is dear
      thrown_back[static_cast<std::size_t>(pair.first)] = rebounds(pair.first, pair.second);
    }
  }
  struct Cluster {
    double contacts = 0;
    MassLength length;
    double most = 0;        // of the contacts of its parts that touch now
    bool rebounds = false;  // between its parts
  };
  std::vector<Cluster> cluster(static_cast<std::size_t>(n));  // at the first of its blocks
  std::vector<double> of_part(static_cast<std::size_t>(n), 0.0);
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    Cluster& c = cluster[static_cast<std::size_t>(clusters.root(i))];
    c.contacts += contacts(i) + ahead[k];
    c.length.add(model_.blocks[k].mass, model_.blocks[k].shape->radius);
    c.most = std::max(c.most, of_part[static_cast<std::size_t>(touching.root(i))] += contacts(i));
    c.rebounds = c.rebounds || thrown_back[k] != 0;
  }
  std::vector<int> heap(static_cast<std::size_t>(n),
                        -1);  // first block of the dear ones, by what they may meet
  for (int i = 0; i < n; ++i) {
    if (!moves(i) || shares_structure(i)) continue;
    const int root = clusters.root(i);
    sets.join(i, root);
    const Cluster& mine = cluster[static_cast<std::size_t>(root)];
    const double most =
        StepSettings::dearer *
        std::ceil(duration / settings_.step.time_step(mine.length.value(), model_.gravity.norm()));
    if (mine.contacts <= most) continue;
    if (mine.rebounds && mine.most <= most) {
      course[static_cast<std::size_t>(i)] = Course::in_turn;
      continue;
    }
    course[static_cast<std::size_t>(i)] = Course::as_one;
    int& first = heap[static_cast<std::size_t>(meeting.root(i))];
    if (first < 0) first = i;
    sets.join(i, first);
  }
}

DisjointSets IslandPlanner::parts(const Island& island, double duration) const {
  const auto strains = [&](int i) { return model_.blocks[static_cast<std::size_t>(i)].deformable; };
  DisjointSets sets(static_cast<int>(island.blocks.size()));
  for (const CandidatePair& pair : island.pairs) {
    if (!both_move(pair)) continue;
    const int a = island.place(pair.a.index), b = island.place(pair.b);
    if (sets.root(a) != sets.root(b) &&
        (strains(pair.a.index) || strains(pair.b) || touched(pair.a.index, pair.b) ||
         will_meet(pair.a.index, pair.b, duration)))
      sets.join(a, b);
  }
  return sets;
}

IslandPlan IslandPlanner::divide(const Island& island, DisjointSets& sets) const {
  IslandPlan p;
  std::vector<std::size_t> part_of(island.blocks.size());
  std::vector<std::size_t> place(island.blocks.size());  // within its part
  std::vector<int> of_root(island.blocks.size(), -1);
  for (std::size_t k = 0; k < island.blocks.size(); ++k) {
    int& part = of_root[static_cast<std::size_t>(sets.root(static_cast<int>(k)))];
    if (part < 0) {
      part = static_cast<int>(p.islands.size());
      p.islands.emplace_back();
    }
    part_of[k] = static_cast<std::size_t>(part);
    Island& mine = p.islands[part_of[k]];
    place[k] = mine.blocks.size();
    mine.blocks.push_back(island.blocks[k]);
    mine.watched.push_back(island.watched[k]);
  }
  for (const CandidatePair& pair : island.pairs) {
    const auto b = static_cast<std::size_t>(island.place(pair.b));
    if (both_move(pair)) {
      const auto a = static_cast<std::size_t>(island.place(pair.a.index));
      if (part_of[a] != part_of[b]) {
        for (const std::size_t k : {a, b}) p.islands[part_of[k]].watched[place[k]] = 1;
        p.beside.emplace_back(pair.a.index, pair.b);
        continue;
      }
    }
    p.islands[part_of[b]].pairs.push_back(pair);
  }
  return p;
}

Meetings IslandPlanner::meetings(const IslandPlan& p, std::span<const IslandReport> reports,
                                 const dda::State& begun, const Stretch& stretch) const {
  constexpr int pairs_at_once = 64;
  std::unordered_map<int, std::span<const Leg>> ways;
  std::unordered_map<int, Leg> ahead;  // of islands that are still to be stepped
  for (std::size_t i = 0; i < reports.size(); ++i) {
    const Island& island = p.islands[i];
    for (std::size_t k = 0; k < island.blocks.size(); ++k)
      if (!reports[i].ways.empty())
        ways[island.blocks[k]] = reports[i].ways[k];
      else if (island.watched[k] != 0)
        ways[island.blocks[k]] = {&(ahead[island.blocks[k]] = {stretch.start, stretch.end,
                                                               foreseen(island.blocks[k], stretch.duration)}),
                                  1};
  }
  const auto way_of = [&](int block) {
    const auto of = ways.find(block);
    return Way(of != ways.end() ? of->second : std::span<const Leg>{}, dda::pose(begun, block));
  };
  constexpr double never = std::numeric_limits<double>::infinity();
  std::vector<double> came(p.beside.size(), never);  // no sooner [s]
  const auto look = [&](int first, int last) {
    for (auto k = static_cast<std::size_t>(first); k < static_cast<std::size_t>(last); ++k) {
      const auto [i, j] = p.beside[k];
      const Polyhedron &A = *model_.blocks[static_cast<std::size_t>(i)].shape,
                       &B = *model_.blocks[static_cast<std::size_t>(j)].shape;
      const double level = 1e-2 * (touching(i) + touching(j));  // both were farther apart at the start
      Way a = way_of(i), b = way_of(j);
      for (double t = stretch.start; came[k] == never && t < stretch.end;) {
        const double end = std::min(a.next(t, stretch.end), b.next(t, stretch.end));
        if (const double s = come_within(A, a.between(t, end), B, b.between(t, end), level); s <= 1)
          came[k] = t + s * (end - t);
        t = end;
      }
    }
  };
  contact::in_ranges(static_cast<int>(p.beside.size()), pairs_at_once, look);
  Meetings met{{}, never};
  for (std::size_t k = 0; k < came.size(); ++k) {
    if (came[k] == never) continue;
    met.pairs.push_back(p.beside[k]);
    met.first = std::min(met.first, came[k]);
  }
  return met;
}

}  // namespace talus::coupling
