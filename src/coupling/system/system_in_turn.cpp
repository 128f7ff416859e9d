// Blocks that go by themselves between their meetings: in stretches of their own, each so short that all that
// meets in it is foreseen. A blow that runs through n blocks so costs n stretches with one pair in each; as
// one island it would cost n solutions of all.
#include <algorithm>
#include <iterator>

#include "coupling/step/integrator.hpp"
#include "coupling/system/island_run.hpp"

namespace talus::coupling {
namespace {

/// An island's report with nothing in it yet.
IslandReport none_yet(std::size_t blocks) {
  IslandReport all;
  all.peaks.resize(blocks), all.went.resize(blocks), all.ways.resize(blocks);
  all.at_rest = true;
  return all;
}

/// Adds the sums of a part, and what its blocks did, to the report of the whole.
void add(const Island& whole, const Island& part, IslandReport& r, IslandReport& all) {
  all.ledger += r.ledger;
  all.counters += r.counters;
  all.at_rest = all.at_rest && r.at_rest;
  all.time_stepped = all.time_stepped || r.time_stepped;
  for (std::size_t j = 0; j < part.blocks.size(); ++j) {
    const auto k = static_cast<std::size_t>(whole.place(part.blocks[j]));
    all.peaks[k].add(r.peaks[j]);
    all.went[k] += r.went[j];
    std::ranges::move(r.ways[j], std::back_inserter(all.ways[k]));
  }
  std::ranges::move(r.motions, std::back_inserter(all.motions));
}

/// True if the report is that of the island to its end; else `all` ends as it did.
bool arrived(const IslandReport& r, IslandReport& all) {
  all.stopped = r.stopped;
  all.failure = r.failure;
  all.shorter = r.shorter;
  return !r.stopped && r.failure.empty();
}

}  // namespace

CoupledSystem::Began CoupledSystem::began_of(int block) const {
  const auto b = static_cast<std::size_t>(block);
  return {dda::block_state(state_.blocks, block), state_.blocks.slid.empty() ? 0.0 : state_.blocks.slid[b],
          state_.step[b], state_.contacts[b]};
}

void CoupledSystem::put_back(const Island& island, const std::vector<Began>& began) {
  for (std::size_t k = 0; k < island.blocks.size(); ++k) {
    const auto b = static_cast<std::size_t>(island.blocks[k]);
    dda::set_block_state(state_.blocks, island.blocks[k], began[k].state);
    if (!state_.blocks.slid.empty()) state_.blocks.slid[b] = began[k].slid;
    state_.contacts[b] = began[k].contacts;
    state_.step[b] = began[k].step;
  }
}

IslandReport CoupledSystem::advance_island(const Island& island, const Stretch& stretch,
                                           const IslandRun& run) {
  if (island.course == Course::in_turn) return advance_in_turn(island, stretch, run);
  return run.integrator.advance(island, stretch, hint_of(island), run.stop, run.rows);
}

IslandReport CoupledSystem::advance_in_turn(const Island& island, const Stretch& stretch,
                                            const IslandRun& run) {
  constexpr double before_meeting = 0.9;  // part of the way to the first that was not foreseen
  const std::size_t n = island.blocks.size();
  IslandReport all = none_yet(n);
  std::vector<Began> began(n);
  BlockPairs met;  // so soon that no stretch is short enough
  Stretch now = stretch;
  while (now.start < stretch.end) {
    now.end = now.start + now.duration < stretch.end ? now.start + now.duration : stretch.end;
    now.duration = now.end - now.start;
    for (std::size_t k = 0; k < n; ++k) began[k] = began_of(island.blocks[k]);
    DisjointSets sets = planner_.parts(island, now.duration);
    for (const auto& [a, b] : met) sets.join(island.place(a), island.place(b));
    const IslandPlan parts = planner_.divide(island, sets);
    std::vector<IslandReport> reports;
    for (const Island& part : parts.islands) {
      reports.push_back(run.integrator.advance(part, now, hint_of(part), run.stop, run.rows));
      if (!arrived(reports.back(), all)) return all;
    }
    if (const Meetings more = planner_.meetings(parts, reports, state_.blocks, now); !more.pairs.empty()) {
      put_back(island, began);
      const double shorter = std::min(0.5 * now.duration, before_meeting * (more.first - now.start));
      if (shorter >= settings_.step.min_step)
        now.duration = shorter;
      else
        met.insert(met.end(), more.pairs.begin(), more.pairs.end());
      continue;
    }
    double kinetic = 0;
    all.at_rest = true;
    all.next_step = 0;
    for (std::size_t i = 0; i < reports.size(); ++i) {
      IslandReport& r = reports[i];
      kinetic += r.kinetic_peak;
      if (r.next_step > 0)
        all.next_step = all.next_step > 0 ? std::min(all.next_step, r.next_step) : r.next_step;
      IslandMotion& motion = r.motions.front();
      if (now.start > stretch.start) motion.t0 = now.start;
      if (now.end < stretch.end) motion.t1 = now.end;
      motion.done = r.ledger;
      motion.done.contact = 0;
      for (const int b : parts.islands[i].blocks) state_.step[static_cast<std::size_t>(b)] = r.next_step;
      add(island, parts.islands[i], r, all);
    }
    all.kinetic_peak = std::max(all.kinetic_peak, kinetic);
    now.start = now.end;
    now.duration *= 2;
    met.clear();
  }
  return all;
}

}  // namespace talus::coupling
