// A stretch: groups that cannot meet go on their own steps.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "contact/apart.hpp"
#include "core/disjoint_sets.hpp"
#include "coupling/step/one_step.hpp"

namespace talus::coupling::step {

bool OneStep::takes(const dda::Model& model, const Environment& env, const ContactHistory& history, const Island& island) {
  if (!island.structures.empty() || !island.surfaces.empty() || !env.bonds.empty() || !env.joint_laws.empty()) return false;
  for (const ContactLaw& law : env.laws.law)
    if (law.stiffness != ContactLaw::Stiffness::hard || law.kind != ContactLaw::Kind::linear || law.cohesion > 0 || law.tension > 0 || law.rolling_resistance > 0 || law.changes_with_way()) return false;
  const auto rigid = [&](int block) {
    const dda::Model::Block& b = model.blocks[static_cast<std::size_t>(block)];
    return !b.deformable && b.fixed_points.empty();
  };
  for (const int block : island.blocks)
    if (!rigid(block) || std::any_of(history[static_cast<std::size_t>(block)].begin(), history[static_cast<std::size_t>(block)].end(), [](const ContactMemory& m) { return m.feature == born_inside || m.glued; })) return false;
  return std::all_of(island.pairs.begin(), island.pairs.end(), [&](const CandidatePair& p) {
    return p.a.kind == Partner::Kind::plane || p.a.kind == Partner::Kind::terrain || (p.a.kind == Partner::Kind::block && rigid(p.a.index));
  });
}

bool OneStep::near(const CandidatePair& pair, double reach) const {
  const Polyhedron& shape = *model_.blocks[static_cast<std::size_t>(pair.b)].shape;
  const Pose pose = dda::pose(state_, pair.b);
  const auto index = static_cast<std::size_t>(pair.a.index);
  switch (pair.a.kind) {
    case Partner::Kind::block: {
      const Polyhedron& other = *model_.blocks[index].shape;
      const double apart = shape.radius + other.radius + reach;
      if ((pose.c - state_.c[index]).squaredNorm() > apart * apart) return false;
      return !contact::apart(other, dda::pose(state_, pair.a.index), shape, pose, reach);
    }
    case Partner::Kind::plane: return env_.planes[index].normal.dot(pose.c - env_.planes[index].point) <= shape.radius + reach;
    case Partner::Kind::terrain: return env_.terrain->overlaps(contact::bounds(shape, pose, reach));
    case Partner::Kind::structure: return env_.structures[index].index->overlaps(contact::bounds(shape, pose, reach));
  }
  return true;
}

/// How far a point of a block may go within a time; impacts may double its speed.
double OneStep::reach(int block, double duration) const {
  const auto k = static_cast<std::size_t>(block);
  const double speed = state_.v[k].norm() + model_.blocks[k].shape->radius * state_.w[k].norm();
  return duration * (2 * speed + duration * model_.gravity.norm());
}

/// The parts of a group that cannot meet within a time.
std::vector<OneStep::Group> OneStep::split(const Group& group, double duration) const {
  std::vector<int> at(model_.blocks.size(), -1);
  for (std::size_t i = 0; i < group.blocks.size(); ++i) at[static_cast<std::size_t>(group.blocks[i])] = static_cast<int>(i);
  DisjointSets sets(group.blocks.size());
  const double touch = 0.1 * settings_.accuracy;
  std::vector<char> meets(group.pairs.size(), 1);
  for (std::size_t i = 0; i < group.pairs.size(); ++i) {
    const CandidatePair& pair = group.pairs[i];
    const int a = pair.a.kind == Partner::Kind::block ? at[static_cast<std::size_t>(pair.a.index)] : -1;
    if (a < 0) continue;
    const double band = touch * std::cbrt(std::min(model_.blocks[static_cast<std::size_t>(pair.b)].volume, model_.blocks[static_cast<std::size_t>(pair.a.index)].volume));
    meets[i] = near(pair, band + reach(pair.b, duration) + reach(pair.a.index, duration)) ? 1 : 0;
    if (meets[i] != 0) sets.join(a, at[static_cast<std::size_t>(pair.b)]);
  }
  std::vector<int> part_of(group.blocks.size(), -1);
  std::vector<Group> parts;
  for (std::size_t i = 0; i < group.blocks.size(); ++i) {
    const auto root = static_cast<std::size_t>(sets.root(static_cast<int>(i)));
    if (part_of[root] < 0) {
      part_of[root] = static_cast<int>(parts.size());
      parts.emplace_back();
    }
    part_of[i] = part_of[root];
    parts[static_cast<std::size_t>(part_of[i])].blocks.push_back(group.blocks[i]);
  }
  for (std::size_t i = 0; i < group.pairs.size(); ++i)
    if (meets[i] != 0) parts[static_cast<std::size_t>(part_of[static_cast<std::size_t>(at[static_cast<std::size_t>(group.pairs[i].b)])])].pairs.push_back(group.pairs[i]);
  return parts;
}

/// Advances a group. Where it falls into parts each goes alone; of several clusters that may meet, in which something happens, in halves of the time.
bool OneStep::run(const Group& group, double duration) {
  if (stopped()) return false;
  struct Before { Vec3 c, v, w; Quat q; double step; };
  std::vector<Before> before;
  std::vector<double> reaches;
  const auto save = [&] {
    before.clear();
    reaches.clear();
    for (const int block : group.blocks) {
      const auto k = static_cast<std::size_t>(block);
      before.push_back({state_.c[k], state_.v[k], state_.w[k], state_.q[k], step_[k]});
      reaches.push_back(reach(block, duration));
    }
  };
  const auto restore = [&] {
    for (std::size_t i = 0; i < group.blocks.size(); ++i) {
      const auto k = static_cast<std::size_t>(group.blocks[i]);
      state_.c[k] = before[i].c, state_.v[k] = before[i].v, state_.w[k] = before[i].w, state_.q[k] = before[i].q, step_[k] = before[i].step;
    }
  };
  const auto halves = [&] { return run(group, 0.5 * duration) && run(group, 0.5 * duration); };
  save();
  const Ledger ledger = report_.ledger;
  std::vector<Group> parts;
  if (group.blocks.size() > 1) parts = split(group, duration);
  if (parts.size() > 1) {
    for (const Group& part : parts)
      if (!run(part, duration)) return false;
    bool escaped = false;
    for (std::size_t i = 0; i < group.blocks.size(); ++i) {
      const auto k = static_cast<std::size_t>(group.blocks[i]);
      escaped = escaped || (state_.c[k] - before[i].c).norm() + 2 * model_.blocks[k].shape->radius * (before[i].q.conjugate() * state_.q[k]).vec().norm() > reaches[i] * (1 + 1e-9) + 1e-15;
    }
    if (!escaped || duration < settings_.min_step) return true;
    restore();
    report_.ledger = ledger;
    return halves();
  }
  const bool alone = group.blocks.size() == 1 || duration < 4 * settings_.min_step || split(group, 0).size() == 1;
  switch (go(group, duration, alone)) {
    case Way::done: return true;
    case Way::failed: return false;
    case Way::event: break;
  }
  restore();
  report_.ledger = ledger;
  return halves();
}

/// Step by step to the end. Not alone: the step's parts are clusters, of which an event concerns one; it is left as soon as one happens, or more than a few steps are needed.
OneStep::Way OneStep::go(const Group& group, double duration, bool alone) {
  constexpr int few = 2, cuts = 12;
  for (const int block : group.blocks) local_[static_cast<std::size_t>(block)] = -1;
  struct Leave {
    std::vector<int>& local;
    const std::vector<int>& blocks;
    ~Leave() { for (const int b : blocks) local[static_cast<std::size_t>(b)] = -1; }
  } leave{local_, group.blocks};
  double usual = 0;
  for (std::size_t i = 0; i < group.blocks.size(); ++i) {
    const auto k = static_cast<std::size_t>(group.blocks[i]);
    local_[k] = static_cast<int>(i);
    if (step_[k] > 0) usual = usual > 0 ? std::min(usual, step_[k]) : step_[k];
  }
  Moment now = moment(group);
  if (!(usual > 0)) usual = now.rows.empty() ? duration : std::min(duration, now.bodies.front().tol.memory * std::sqrt(settings_.accuracy));
  if (!alone && duration > few * usual) return Way::event;
  double done = 0;
  const bool controlled = settings_.fixed_step <= 0;
  while (duration - done > 1e-12 * duration) {
    if (stopped()) return Way::failed;
    if (!alone && std::any_of(now.rows.begin(), now.rows.end(), [](const Row& r) { return r.slip[0] < -r.open; })) return Way::event;
    if (!impacts(now)) {
      report_.failure = fmt::format("an impact could not be solved ({} contacts)", now.rows.size());
      return Way::failed;
    }
    put(now);
    if (controlled && !now.known && !now.rows.empty()) accelerations(now);
    const double remaining = duration - done;
    double h = std::min(remaining, controlled ? usual : settings_.fixed_step);
    for (const Body& b : now.bodies) {
      const double spin = b.v.tail<3>().norm();
      if (spin * h > 0.5 && !group.pairs.empty()) h = 0.5 / spin;   // motions between both ends are chords
    }
    Trial trial;
    bool cut = false;
    int tries = 0;
    const double e0 = energy(now);
    for (;; ++tries) {
      const bool least = h <= settings_.min_step;
      if (!smooth(now, h, trial)) {
        ++report_.counters.rejected;
        if (least) {
          report_.failure = fmt::format("the contact problem could not be solved at the smallest step ({} contacts)", now.rows.size());
          put(now);
          return Way::failed;
        }
        h *= 0.5;
        cut = false;
        continue;
      }
      put(trial.end);
      look(group, trial.end);
      find_event(group, now, h, trial);
      if (trial.event < h * (1 - 1e-9) && !least && tries < cuts) {
        if (!alone) return Way::event;
        h = std::max(trial.event, settings_.min_step);
        cut = true;
        continue;
      }
      put(trial.end);
      make_rows(group, trial.end);
      if (!controlled) break;
      accelerations(trial.end);
      trial.error = measure_error(now, h, trial);
      if (trial.error > 1 && !least) {
        ++report_.counters.rejected;
        h *= std::clamp(0.9 / std::sqrt(trial.error), 0.1, 0.7);
        cut = false;
        usual = std::min(usual, h);
        continue;
      }
      break;
    }
    put(trial.end);
    const double lost = e0 - energy(trial.end);
    report_.ledger.friction_work += trial.work.friction_work;
    report_.ledger.algorithmic += lost - trial.work.friction_work;
    ++report_.counters.steps;
    report_.counters.contacts += static_cast<long>(now.rows.size());
    report_.counters.last_step = h;
    if (now.rows.empty()) ++report_.counters.flights;
    for (const Row& r : trial.end.rows) report_.counters.worst_penetration = std::max(report_.counters.worst_penetration, -r.gap);
    if (controlled) {
      const double longer = h * std::min(3.0, 0.9 / std::cbrt(std::max(trial.error, 1e-9)));
      usual = cut || h < usual ? std::max(usual, longer) : longer;
    }
    now = std::move(trial.end);
    done += h;
  }
  for (const int block : group.blocks) step_[static_cast<std::size_t>(block)] = usual;
  return Way::done;
}

void OneStep::measure() {
  for (std::size_t i = 0; i < began_.size(); ++i) {
    const auto k = static_cast<std::size_t>(island_->blocks[i]);
    report_.went[i] = (state_.c[k] - began_[i].c).norm() + 2 * model_.blocks[k].shape->radius * (began_[i].q.conjugate() * state_.q[k]).vec().norm();
  }
}

/// Whether nothing moves, and nothing would if all stood still.
bool OneStep::rests() {
  const Group all{island_->blocks, island_->pairs};
  for (std::size_t i = 0; i < all.blocks.size(); ++i) local_[static_cast<std::size_t>(all.blocks[i])] = static_cast<int>(i);
  Moment m;
  bool still = true;
  for (const int block : all.blocks) {
    const auto k = static_cast<std::size_t>(block);
    const Tolerances tol(settings_.accuracy, std::cbrt(model_.blocks[k].volume), model_.gravity.norm());
    still = still && state_.v[k].norm() + model_.blocks[k].shape->radius * state_.w[k].norm() <= tol.open;
  }
  if (still) {
    m = moment(all);
    for (Body& b : m.bodies) b.v.setZero();
    slip(m);
    still = accelerations(m);
    for (const Body& b : m.bodies) still = still && b.acceleration.head<3>().norm() + b.radius * b.acceleration.tail<3>().norm() <= 10 * b.tol.open / b.tol.memory;
  }
  for (const int block : all.blocks) local_[static_cast<std::size_t>(block)] = -1;
  return still;
}

IslandReport OneStep::advance(const Island& island, double t, double duration, double first_step, const std::atomic<int>* stop) {
  (void)t;
  island_ = &island;
  stop_ = stop;
  report_ = IslandReport{};
  report_.went.assign(island.blocks.size(), 0.0);
  problems_ = Problems{};
  local_.assign(model_.blocks.size(), -1);
  step_.assign(model_.blocks.size(), first_step);
  began_.clear();
  for (const int block : island.blocks) began_.push_back({state_.c[static_cast<std::size_t>(block)], state_.q[static_cast<std::size_t>(block)]});
  if (run({island.blocks, island.pairs}, duration)) {
    measure();
    // No spring, no bond: nothing that a later step needs. What another stepper left to start its solver from is of another time.
    for (const int block : island.blocks) history_[static_cast<std::size_t>(block)].clear();
    report_.at_rest = rests();
    double next = 0;
    for (const int block : island.blocks) {
      const double h = step_[static_cast<std::size_t>(block)];
      if (h > 0) next = next > 0 ? std::min(next, h) : h;
    }
    report_.next_step = next;
  }
  report_.counters.newton = problems_.newton;
  report_.counters.sweeps = problems_.sweeps;
  report_.counters.outer = problems_.outer;
  report_.counters.tier_a = problems_.problems - problems_.unsolved;
  report_.counters.worst_residual = problems_.worst;
  return report_;
}

}  // namespace talus::coupling::step
