#include "coupling/system/system.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "contact/tolerances.hpp"
#include "core/error.hpp"
#include "core/multiples.hpp"
#include "core/ranks.hpp"
#include "coupling/ground/ground_laws.hpp"
#include "coupling/step/integrator.hpp"
#include "coupling/system/island_run.hpp"

namespace talus::coupling {

/// Where a structure's skin was as a stretch began.
struct SkinBefore {
  std::uint64_t revision = 0;
  std::vector<Vec3> vertices;
};

namespace {

constexpr int few_blocks = 12;         // in motion, up to which a stretch beside a structure is not shortened
constexpr double crowded_steps = 128;  // sub-steps of a structure in a stretch, among debris

/// The whole skin as it is now.
void bring_up_to_date(StructurePart& part) {
  if (part.followed.between >= 0)
    part.index->unfocus(part.structure->skin().surface());
  else
    part.index->refit(part.structure->skin().surface());
  part.followed = {};
  part.lagging_index = false;
}

/// Longest next stretch after one in which structures took sub-steps [s]; 0: any. All that may come near
/// within a stretch is one island, which shares the structure's sub-steps: among more than a few blocks in
/// motion a short stretch leaves most of them out.
double crowd_limit(const dda::Model& model, const Environment& env, const std::vector<char>& asleep,
                   int few) {
  int awake = 0;
  for (std::size_t i = 0; i < asleep.size(); ++i) awake += asleep[i] == 0 && model.blocks[i].ndof() > 0;
  if (awake <= few) return 0;
  double stable = std::numeric_limits<double>::infinity();
  for (const StructurePart& s : env.structures)
    if (s.stepped()) stable = std::min(stable, s.structure->critical_step());
  return std::isfinite(stable) ? crowded_steps * stable : 0;
}

}  // namespace

struct CoupledSystem::Threads {
  tbb::task_arena arena;
};

CoupledSystem::CoupledSystem(dda::Model model, SystemState state, Environment environment,
                             const SystemSettings& settings)
    : model_(std::move(model)),
      state_(std::move(state)),
      env_(std::move(environment)),
      settings_(settings),
      planner_(model_, state_, env_, settings_),
      threads_(new Threads{tbb::task_arena(std::max(1, settings.threads))}) {
  const std::size_t n = model_.blocks.size();
  state_.contacts.resize(n);
  state_.surface_contacts.resize(env_.structures.size());
  state_.asleep.resize(n, 0);
  state_.step.resize(n, 0.0);
  state_.peaks.resize(n);
  if (remembers_way(env_.laws)) state_.blocks.slid.resize(n, 0.0);
  state_.structure_step.resize(env_.structures.size(), 0.0);
  settings_.step.threads = settings_.threads;
  glue();
}

CoupledSystem::~CoupledSystem() = default;

std::vector<StructureContact> CoupledSystem::take_structure_contacts() {
  std::vector<StructureContact> rows;
  rows.swap(rows_);
  return rows;
}

int CoupledSystem::add_block(const dda::Model::Block& block, const Vec3& c, const Vec3& v, const Vec3& w) {
  model_.blocks.push_back(block);
  dda::State& s = state_.blocks;
  s.c.push_back(c);
  s.v.push_back(v);
  s.w.push_back(w);
  s.q.push_back(Quat::Identity());
  s.eps.push_back(Vec6::Zero());
  s.eps_rate.push_back(Vec6::Zero());
  if (!s.slid.empty()) s.slid.push_back(0);
  state_.contacts.emplace_back();
  state_.asleep.push_back(0);
  state_.step.push_back(0);
  state_.peaks.emplace_back();
  return static_cast<int>(model_.blocks.size()) - 1;
}

namespace {

/// What sleeping blocks press on a structure with: the forces that they fell asleep under, as rows that last
/// over the stretch.
std::vector<StructureContact> resting_rows(const SystemState& state, const std::vector<char>& awake,
                                           int structure, double duration) {
  const std::uint64_t partner = Partner{Partner::Kind::structure, structure}.id();
  std::vector<StructureContact> rows;
  for (std::size_t b = 0; b < awake.size(); ++b) {
    if (awake[b] != 0 || state.asleep[b] == 0) continue;
    for (const ContactMemory& m : state.contacts[b]) {
      if (m.partner != partner || m.force.isZero(0)) continue;
      StructureContact& row = rows.emplace_back();
      row.time = state.time + duration, row.dt = duration;
      row.block = static_cast<int>(b), row.structure = structure;
      row.point = m.place, row.force = -m.force, row.normal = m.normal;
    }
  }
  return rows;
}

/// Farthest that a vertex of the skin is from where it was; of one that has lost cells since, unknown and
/// none [m].
double farthest(const SkinBefore& before, const StructurePart& part) {
  if (before.vertices.empty()) return 0;
  const TriangleSurface& now = part.structure->skin().surface();
  if (now.revision != before.revision || now.vertices.size() != before.vertices.size()) return 0;
  double way = 0;
  for (std::size_t i = 0; i < now.vertices.size(); ++i)
    way = std::max(way, (now.vertices[i] - before.vertices[i]).squaredNorm());
  return std::sqrt(way);
}

/// Puts recorded contact forces on a structure: each acts over the time it was the mean of, at its point of
/// the undeformed skin.
void replay(StructurePart& part, double start, double duration, std::span<const StructureContact> rows,
            RunSums& sums) {
  struct Load {
    const StructureContact* row;
    SurfaceWeights at;
  };
  std::vector<Load> loads;
  for (const StructureContact& r : rows)
    loads.push_back({&r, surface_weights(part.index->surface(), part.index->triangle_at(r.point), r.point)});
  Structure& s = *part.structure;
  const double work_before = s.energy().contact_work;
  const long steps = std::max(1L, static_cast<long>(std::ceil(duration / s.critical_step() *
                                                              (1 - contact::tolerances().time_round_off))));
  const double h = duration / static_cast<double>(steps);
  std::vector<NodeImpulse> impulses;
  for (long k = 0; k < steps; ++k) {
    const double from = start + duration * (static_cast<double>(k) / static_cast<double>(steps)),
                 to = start + duration * (static_cast<double>(k + 1) / static_cast<double>(steps));
    impulses.clear();
    for (const Load& load : loads) {
      // The last step also takes what rounding left at the end.
      const double lo = std::max(from, load.row->time - load.row->dt),
                   hi = k + 1 == steps ? load.row->time : std::min(to, load.row->time);
      if (hi <= lo) continue;
      for (int i = 0; i < load.at.count; ++i)
        impulses.push_back({load.at.node[static_cast<std::size_t>(i)],
                            (hi - lo) * load.at.weight[static_cast<std::size_t>(i)] * load.row->force});
    }
    s.predict(from, h);
    s.correct(from, h, impulses);
    for (const NodeImpulse& p : impulses) sums.audit.impulse_on_structure += p.impulse;
  }
  sums.counters.structure_steps += steps;
  for (const Load& load : loads) sums.audit.impulse_on_blocks -= load.row->dt * load.row->force;
  sums.audit.work_on_structure += s.energy().contact_work - work_before;
}

}  // namespace

/// What a macro step begins with, and what its islands report.
struct CoupledSystem::MacroStep {
  IslandPlan plan;
  SystemState before;
  std::vector<std::vector<double>> structures;  // as they are when the macro step begins
  std::vector<SkinBefore> skins;
  std::vector<char> started;  // per structure
  dda::State begun;           // where islands that may meet others begin
  std::vector<IslandReport> reports;
  std::vector<char> stepped;  // per island: its report is there
};

/// A structure as it is when the macro step begins: kept, or where it has been stepped in vain, put back.
void CoupledSystem::start_structure(MacroStep& m, std::size_t q) {
  StructurePart& part = env_.structures[q];
  if (std::exchange(m.started[q], 1) != 0) {
    part.structure->restore_here(m.structures[q]);
    bring_up_to_date(part);
    state_.surface_contacts[q] = m.before.surface_contacts[q];
    return;
  }
  part.structure->save_here(m.structures[q]);
  if (!part.fixed_surface)
    m.skins[q] = {part.structure->skin().surface().revision, part.structure->skin().surface().vertices};
}

/// The smallest step suggested among its blocks and structures; 0: none [s].
double CoupledSystem::hint_of(const Island& island) const {
  double hint = 0;
  const auto count = [&](double h) {
    if (h > 0) hint = hint > 0 ? std::min(hint, h) : h;
  };
  for (int b : island.blocks) count(state_.step[static_cast<std::size_t>(b)]);
  for (int q : island.structures) count(state_.structure_step[static_cast<std::size_t>(q)]);
  return hint;
}

/// Per block: all events of its island are located, or it is in none.
std::vector<char> CoupledSystem::events_located(const MacroStep& m) const {
  std::vector<char> located(model_.blocks.size(), 1);
  for (std::size_t i = 0; i < m.reports.size(); ++i)
    for (const int b : m.plan.islands[i].blocks)
      located[static_cast<std::size_t>(b)] =
          !m.reports[i].time_stepped && m.plan.islands[i].structures.empty() &&
          (m.stepped[i] != 0 || m.plan.islands[i].course != Course::as_one);
  return located;
}

/// A blow that runs on from block to block: what was divided and has met another one is joined with what lies
/// near, as many neighbours on as `hops`, so that twice as far is reached with each try.
void CoupledSystem::reach_on(const MacroStep& m, const BlockPairs& pairs, int hops, BlockPairs& met) const {
  const std::vector<char> located = events_located(m);
  std::vector<char> reached(model_.blocks.size(), 0), runs_on(model_.blocks.size(), 0);
  for (const Island& island : m.plan.islands)
    for (const int b : island.blocks) runs_on[static_cast<std::size_t>(b)] = island.course == Course::in_turn;
  std::map<int, std::vector<int>> near;
  const auto found = [](const std::vector<char>& of, int b) { return of[static_cast<std::size_t>(b)] != 0; };
  for (const BlockPairs* of : {&m.plan.beside, &m.plan.asleep})
    for (const auto& [a, b] : *of)
      if (found(located, a) && found(located, b)) near[a].push_back(b), near[b].push_back(a);
  std::vector<int> front;
  for (const auto& [a, b] : pairs)
    if (found(runs_on, a) || found(runs_on, b))
      for (const int block : {a, b})
        if (std::exchange(reached[static_cast<std::size_t>(block)], 1) == 0) front.push_back(block);
  for (int hop = 0; hop < hops && !front.empty(); ++hop) {
    std::vector<int> next;
    for (const int a : front)
      if (const auto of = near.find(a); of != near.end())
        for (const int b : of->second)
          if (std::exchange(reached[static_cast<std::size_t>(b)], 1) == 0) {
            met.emplace_back(a, b);
            next.push_back(b);
          }
    front = std::move(next);
  }
}

/// Steps all islands, dear masses last, together with what the others have met on the ways that the masses
/// are foreseen to take; what met on its way is stepped once more, as one.
void CoupledSystem::step_islands(MacroStep& m, double duration, const std::atomic<int>* stop,
                                 std::span<const double> rows) {
  const Stretch all = Stretch::from(state_.time, duration);
  tbb::enumerable_thread_specific<std::unique_ptr<IslandIntegrator>> integrators;
  const auto run = [&](std::size_t i) {
    auto& integrator = integrators.local();
    if (!integrator)
      integrator = std::make_unique<IslandIntegrator>(model_, state_.blocks, env_, state_.contacts,
                                                      state_.surface_contacts, settings_.step);
    m.reports[i] = advance_island(m.plan.islands[i], all, {*integrator, stop, rows});
  };
  const auto ended = [](const IslandReport& r) { return r.stopped || !r.failure.empty(); };
  m.reports.resize(m.plan.islands.size());
  m.stepped.resize(m.plan.islands.size(), 0);
  BlockPairs met;
  int hops = 0;
  for (;;) {
    std::vector<std::size_t> due, masses;
    for (std::size_t i = 0; i < m.stepped.size(); ++i)
      if (m.stepped[i] == 0) (m.plan.islands[i].course == Course::as_one ? masses : due).push_back(i);
    if (due.empty()) due.swap(masses);
    if (due.empty()) return;
    if (settings_.threads > 1 && due.size() > 1) {
      tbb::parallel_for(std::size_t{0}, due.size(), [&](std::size_t k) { run(due[k]); });
    } else {
      for (const std::size_t i : due) run(i);
    }
    for (const std::size_t i : due) m.stepped[i] = 1;
    if (std::ranges::any_of(m.reports, ended)) return;
    if (m.plan.beside.empty()) continue;
    const BlockPairs more = planner_.meetings(m.plan, m.reports, m.begun, all).pairs;
    if (more.empty()) continue;
    met.insert(met.end(), more.begin(), more.end());
    reach_on(m, more, hops, met);
    hops = std::max(1, 2 * hops);
    join_met(met, duration, m);
  }
}

/// Why islands failed, and what went farther than foreseen; true if the run was stopped.
bool CoupledSystem::note_ends(const MacroStep& m, Failure& failure) {
  bool stopped = false;
  for (std::size_t i = 0; i < m.reports.size(); ++i) {
    const IslandReport& r = m.reports[i];
    const std::vector<int>& blocks = m.plan.islands[i].blocks;
    stopped = stopped || r.stopped;
    if (!r.failure.empty() && (failure.text.empty() || (failure.shorter && !r.shorter)))
      failure.shorter = r.shorter,
      failure.text = fmt::format(
          "t = {:.6g} s, {}: {}", state_.time,
          blocks.empty() ? std::string("structures that touch")
                         : fmt::format("island of {} blocks with {}", blocks.size(),
                                       model_.blocks[static_cast<std::size_t>(blocks.front())].name),
          r.failure);
    for (std::size_t j = 0; j < r.went.size(); ++j)
      if (r.went[j] > m.plan.reach[static_cast<std::size_t>(blocks[j])])
        escapes_.push_back({Partner::Kind::block, blocks[j], r.went[j]});
  }
  for (std::size_t q = 0; q < m.skins.size(); ++q) {
    const double moved = farthest(m.skins[q], env_.structures[q]);
    if (moved > m.plan.structure_reach[q])
      escapes_.push_back({Partner::Kind::structure, static_cast<int>(q), moved});
  }
  return stopped;
}

/// Sums and states by what the islands report; blocks that rest fall asleep.
void CoupledSystem::take_reports(const MacroStep& m) {
  double kinetic = 0;
  for (std::size_t i = 0; i < m.reports.size(); ++i) {
    const IslandReport& r = m.reports[i];
    state_.ledger += r.ledger;
    sums_.counters += r.counters;
    sums_.audit.worst_force = std::max(sums_.audit.worst_force, r.audit.worst_force);
    sums_.audit.worst_moment = std::max(sums_.audit.worst_moment, r.audit.worst_moment);
    sums_.audit.impulse_on_structure += r.audit.impulse_on_structure;
    sums_.audit.impulse_on_blocks += r.audit.impulse_on_blocks;
    for (std::size_t q = 0; q < r.audit.met.size(); ++q)
      if (const Met& met = r.audit.met[q]; met.first >= 0)
        sums_.audit.meet(static_cast<int>(q), met.first, met.impulse);
    sums_.audit.work_on_blocks += r.ledger.blocks_contact_work;
    sums_.audit.work_on_structure += r.ledger.structure_contact_work;
    rows_.insert(rows_.end(), r.rows.begin(), r.rows.end());
    kinetic += r.kinetic_peak;
    for (std::size_t j = 0; j < m.plan.islands[i].blocks.size(); ++j) {
      const int b = m.plan.islands[i].blocks[j];
      const auto k = static_cast<std::size_t>(b);
      state_.peaks[k].add(r.peaks[j]);
      state_.step[k] = r.next_step;
      if (!r.at_rest || !settings_.sleeping) continue;
      const dda::BlockEnergy e = dda::energy(model_, state_.blocks, b);
      state_.ledger.algorithmic += e.translational + e.rotational + e.straining;
      state_.blocks.v[k].setZero();
      state_.blocks.w[k].setZero();
      state_.blocks.eps_rate[k].setZero();
      state_.asleep[k] = 1;
    }
  }
  state_.kinetic_peak = std::max(state_.kinetic_peak, kinetic);
  std::fill(state_.structure_step.begin(), state_.structure_step.end(), 0.0);
  for (std::size_t i = 0; i < m.reports.size(); ++i)
    for (int q : m.plan.islands[i].structures)
      state_.structure_step[static_cast<std::size_t>(q)] = m.reports[i].next_step;
}

/// Structures that no island stepped: by recorded forces, or by themselves.
void CoupledSystem::step_other_structures(const MacroStep& m, double duration) {
  std::vector<char> awake(model_.blocks.size(), 0);
  for (const Island& island : m.plan.islands)
    for (int b : island.blocks) awake[static_cast<std::size_t>(b)] = 1;
  for (std::size_t q = 0; q < env_.structures.size(); ++q) {
    StructurePart& part = env_.structures[q];
    if (!part.stepped() || m.plan.structure_used[q]) continue;
    if (part.one_way) {
      std::vector<StructureContact> mine;
      for (const IslandReport& r : m.reports)
        for (const StructureContact& row : r.rows)
          if (row.structure == static_cast<int>(q)) mine.push_back(row);
      const std::vector<StructureContact> resting =
          resting_rows(state_, awake, static_cast<int>(q), duration);
      mine.insert(mine.end(), resting.begin(), resting.end());
      if (!mine.empty()) {
        replay(part, state_.time, duration, mine, sums_);
        continue;
      }
    }
    if (part.structure->quiet()) {
      ++sums_.structure_asleep;
      continue;
    }
    part.structure->advance_alone(state_.time, duration);
    part.lagging_index = !part.fixed_surface;
    const bool new_topology =
        part.structure->skin().surface().revision !=
        part.index->surface().revision;  // is never left behind: a checkpoint keeps positions alone
    if (part.lagging_index && (new_topology || part.followed.between >= 0)) bring_up_to_date(part);
  }
}

bool CoupledSystem::stretch(double duration, const std::atomic<int>* stop, std::span<const double> rows,
                            Failure& failure) {
  const bool blocks_move = std::any_of(model_.blocks.begin(), model_.blocks.end(),
                                       [](const dda::Model::Block& b) { return b.ndof() > 0; });
  const bool searched =
      blocks_move || !env_.touching_structures.empty() || !env_.grounds.empty();  // else they meet nothing
  for (StructurePart& part : env_.structures)
    if ((part.lagging_index && (searched || part.one_way)) || (blocks_move && part.followed.between >= 0))
      bring_up_to_date(part);
  const std::size_t structures = env_.structures.size();
  MacroStep m;
  m.plan = planner_.plan(duration, wider_);
  m.before = state_;
  m.structures.resize(structures), m.skins.resize(structures), m.started.resize(structures, 0);
  for (std::size_t q = 0; q < structures; ++q)
    if (m.plan.structure_used[q]) start_structure(m, q);
  for (const Island& island : m.plan.islands)
    for (int b : island.blocks) state_.asleep[static_cast<std::size_t>(b)] = 0;
  if (!m.plan.beside.empty()) m.begun = state_.blocks;
  step_islands(m, duration, stop, rows);
  const bool stopped = note_ends(m, failure);
  const bool escaped = !escapes_.empty() && meets_others(duration, m.plan, m.before);
  if (escaped || stopped || !failure.text.empty()) {
    state_ = m.before;
    for (std::size_t q = 0; q < structures; ++q)
      if (m.plan.structure_used[q]) {
        env_.structures[q].structure->restore_here(m.structures[q]);
        bring_up_to_date(env_.structures[q]);
      }
    if (escaped || stopped) failure = {};
    return false;
  }
  if (!rows.empty()) recorded_.keep(m.reports, model_, state_);
  if (watch_) before_ = std::move(m.before);
  take_reports(m);
  step_other_structures(m, duration);
  islands_ = static_cast<int>(m.plan.islands.size());
  sums_.asleep_skipped += m.plan.skipped;
  ++state_.stretches;
  return true;
}

void CoupledSystem::advance_structures(double duration, std::span<const StructureContact> rows) {
  threads_->arena.execute([&] {
    for (std::size_t q = 0; q < env_.structures.size(); ++q) {
      StructurePart& part = env_.structures[q];
      if (!part.one_way) continue;
      std::vector<StructureContact> mine;
      std::copy_if(rows.begin(), rows.end(), std::back_inserter(mine),
                   [&](const StructureContact& row) { return row.structure == static_cast<int>(q); });
      if (!mine.empty())
        replay(part, state_.time, duration, mine, sums_);
      else if (!part.structure->quiet())
        part.structure->advance_alone(state_.time, duration);
    }
  });
  rows_.insert(rows_.end(), rows.begin(), rows.end());
  state_.time += duration;
}

/// True if what came farther than foreseen (escapes_) may have met a partner that is not in the plan of the
/// stretch, which began at `before`.
bool CoupledSystem::meets_others(double duration, const IslandPlan& p, SystemState& before) {
  using Pair = std::array<int, 3>;
  const auto listed = [](const IslandPlan& of) {
    std::vector<Pair> pairs;
    for (const Island& island : of.islands)
      for (const CandidatePair& pair : island.pairs)
        pairs.push_back({static_cast<int>(pair.a.kind), pair.a.index, pair.b});
    for (const auto& [a, b] : of.beside) pairs.push_back({static_cast<int>(Partner::Kind::block), a, b});
    std::sort(pairs.begin(), pairs.end());
    return pairs;
  };
  std::vector<Farther> farther = wider_;
  farther.insert(farther.end(), escapes_.begin(), escapes_.end());
  std::swap(state_, before);
  const IslandPlan wide = planner_.plan(duration, farther);
  std::swap(state_, before);
  const std::vector<Pair> known = listed(p), all = listed(wide);
  return !std::includes(known.begin(), known.end(), all.begin(), all.end());
}

/// Plans the stretch anew with what met as one island. Islands that stay as they were keep their reports; the
/// blocks of the others, which are due again, go back to where they began.
void CoupledSystem::join_met(const BlockPairs& met, double duration, MacroStep& m) {
  std::map<std::pair<std::vector<int>, std::vector<int>>, std::size_t> stepped;
  const std::vector<char> located = events_located(m);
  for (std::size_t i = 0; i < m.reports.size(); ++i)
    if (m.stepped[i] != 0) stepped[{m.plan.islands[i].blocks, m.plan.islands[i].structures}] = i;
  std::swap(state_, m.before);
  IslandPlan joined = planner_.plan(duration, wider_, met);
  std::swap(state_, m.before);
  std::vector<IslandReport> kept(joined.islands.size());
  std::vector<char> done(joined.islands.size(), 0);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    Island& island = joined.islands[i];
    if (const auto same = stepped.find({island.blocks, island.structures}); same != stepped.end()) {
      kept[i] = std::move(m.reports[same->second]);
      done[i] = 1;
      island.course = m.plan.islands[same->second].course;
      continue;
    }
    const auto goes_by_itself = [&](int b) { return located[static_cast<std::size_t>(b)] != 0; };
    const auto at_structure = [](const CandidatePair& pair) {
      return pair.a.kind == Partner::Kind::structure;
    };
    const bool in_turn = std::ranges::all_of(island.blocks, goes_by_itself) &&
                         std::ranges::none_of(island.pairs, at_structure);
    if (in_turn)
      island.course = Course::in_turn;
    else if (island.course == Course::in_turn)
      island.course = Course::as_one;
    for (const int b : island.blocks) {
      const auto k = static_cast<std::size_t>(b);
      dda::set_block_state(state_.blocks, b, dda::block_state(m.begun, b));
      if (!m.begun.slid.empty()) state_.blocks.slid[k] = m.begun.slid[k];
      state_.contacts[k] = m.before.contacts[k];
      state_.step[k] = m.before.step[k];
      state_.asleep[k] = 0;
    }
  }
  m.plan = std::move(joined);
  m.reports = std::move(kept);
  m.stepped = std::move(done);
  for (std::size_t i = 0; i < m.stepped.size(); ++i)
    for (const int q : m.plan.islands[i].structures)
      if (m.stepped[i] == 0) start_structure(m, static_cast<std::size_t>(q));
}

namespace {
/// Where a structure takes steps, rows are of its own state: whoever advances the system ends stretches at
/// them.
bool rows_end_stretches(const Environment& env) {
  return std::any_of(env.structures.begin(), env.structures.end(),
                     [](const StructurePart& part) { return part.stepped(); });
}
}  // namespace

/// Neighbours of what went farther than foreseen are searched for twice as far as it went, over a stretch of
/// the same length: other islands are stepped as before. Each of them is a new one, or went farther than
/// twice what it did the last time: the tries end. Beside a structure that takes steps, where all that is
/// near shares them, a stretch is halved first, and this is for what is pushed out of an overlap, however
/// short it is.
void CoupledSystem::widen() {
  for (const Farther& f : escapes_) {
    if (rows_end_stretches(env_) && f.kind == Partner::Kind::block &&
        !(f.way <= model_.blocks[static_cast<std::size_t>(f.index)].shape->radius))
      throw NumericalFailure(
          fmt::format("t = {:.6g} s: block {} moves {:.3g} m in the shortest macro step, more than its size",
                      state_.time, model_.blocks[static_cast<std::size_t>(f.index)].name, f.way));
    wider_.push_back({f.kind, f.index, 2 * f.way});
  }
}

bool CoupledSystem::advance(double end, const std::atomic<int>* stop, std::span<const double> rows) {
  bool arrived = false;
  threads_->arena.execute([&] { arrived = go_on(end, stop, rows); });
  return arrived;
}

bool CoupledSystem::advance_to(double t, const std::atomic<int>* stop) {
  while (state_.time < t)
    if (!advance(t, stop)) return false;
  return true;
}

double CoupledSystem::longest_stretch() const {
  const double step = settings_.step.fixed_step;
  if (!(step > 0) || rows_end_stretches(env_)) return settings_.longest_stretch;
  return Multiples(step).at(std::max(1L, std::lround(std::floor(settings_.longest_stretch / step *
                                                                (1 + contact::tolerances().same_instant)))));
}

/// The next multiple of the longest stretch on the run's clock, or `end` if that is not later.
double CoupledSystem::stretch_end(double end) const {
  if (rows_end_stretches(env_)) return end;
  const double longest = longest_stretch();
  const Multiples ends(longest);
  const long k = ends.after(state_.time + contact::tolerances().same_instant * longest);
  return ends.at(k) < end - contact::tolerances().same_instant * longest ? ends.at(k) : end;
}

std::vector<dda::State> CoupledSystem::again(const SystemState& from, std::span<const double> times) {
  SystemState now = std::exchange(state_, from);
  const RunSums sums = sums_;
  std::vector<StructureContact> rows = std::exchange(rows_, {});
  Watch watch = std::exchange(watch_, nullptr);
  SystemState before = std::move(before_);
  RecordedMotion recorded = std::exchange(recorded_, {});
  const int islands = islands_;
  const double end = now.time;
  const auto put_back = [&] {
    state_ = std::move(now);
    sums_ = sums;
    rows_ = std::move(rows);
    watch_ = std::move(watch);
    before_ = std::move(before);
    recorded_ = std::move(recorded);
    islands_ = islands;
  };
  std::vector<dda::State> states;
  try {
    threads_->arena.execute([&] { go_on(end, nullptr, times); });
    for (const double t : times) states.push_back(at(t).blocks);
  } catch (const NumericalFailure&) {  // the stretch itself did not fail: what is known of it are its ends
  }
  put_back();
  return states;
}

/// One stretch, tried with what it met until it stands, or shorter where a structure takes steps.
bool CoupledSystem::go_on(double end, const std::atomic<int>* stop, std::span<const double> rows) {
  recorded_.clear();
  while (end - state_.time > contact::tolerances().time_round_off * std::max(1.0, std::abs(end))) {
    const double t = stretch_end(end), remaining = t - state_.time;
    const double longest = state_.stretch > 0 ? state_.stretch : longest_stretch();
    double duration = std::min(remaining, longest);
    if (duration < remaining)
      duration = remaining / std::ceil(remaining / duration - contact::tolerances().same_instant);
    Failure failure;
    const double start = state_.time;
    if (agreed(stop) != 0) return false;
    // Several ranks stop between stretches: within one, each would see the signal at another step.
    const std::atomic<int>* within = ranks() == nullptr ? stop : nullptr;
    escapes_.clear();
    const long sub_steps = sums_.counters.structure_steps;
    if (!stretch(duration, within, rows, failure)) {
      const bool halves = 0.5 * duration >= settings_.step.min_step;
      if (!failure.text.empty() && !(failure.shorter && halves)) throw NumericalFailure(failure.text);
      if (within != nullptr && within->load() != 0) return false;
      if (halves && rows_end_stretches(env_))
        state_.stretch = 0.5 * duration;
      else
        widen();
      continue;
    }
    wider_.clear();
    state_.time = duration == remaining ? t : start + duration;
    if (watch_) watch_(before_);
    state_.stretch = 2 * longest < longest_stretch() ? 2 * longest : 0;
    if (sums_.counters.structure_steps == sub_steps) return true;
    const double limit = crowd_limit(model_, env_, state_.asleep, few_blocks);
    if (limit > 0 && limit < longest_stretch() && (state_.stretch == 0 || state_.stretch > limit))
      state_.stretch = limit;
    return true;
  }
  state_.time = end;
  return true;
}

Moment CoupledSystem::at(double t) const { return recorded_.at(t, model_, state_); }

}  // namespace talus::coupling
