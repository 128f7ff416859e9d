// The run: the world advances by macro steps, rows are interpolated in the steps that they fall into and
// passed to the sink.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/multiples.hpp"
#include "core/ranks.hpp"
#include "sim/audit.hpp"
#include "sim/simulation.hpp"
#include "sim/world.hpp"

namespace talus::sim {

namespace {

/// Clocks of a run: by the wall, and of the processor.
class Clocks {
 public:
  void write(RunCounters& n) const {
    n.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count();
    n.cpu_seconds = static_cast<double>(std::clock() - cpu_) / CLOCKS_PER_SEC;
  }

 private:
  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
  std::clock_t cpu_ = std::clock();
};

/// The instants at which histories or fields are due: multiples of their interval and the end. All up to the
/// world's time have been recorded, so that a restart finds the same ones.
class Instants {
 public:
  Instants(double from, double duration, double interval)
      : duration_(duration), multiples_(interval), index_(multiples_.after(from)) {}
  double next() const {
    const double t = multiples_.at(index_);
    return t > duration_ * (1 - 1e-12) ? duration_ : t;
  }
  void pass() { ++index_; }
  /// Adds those up to t.
  void list(double t, std::vector<double>& to) const {
    for (Instants i = *this; i.next() <= t; i.pass()) {
      to.push_back(i.next());
      if (i.next() == duration_) break;
    }
  }

 private:
  double duration_;
  Multiples multiples_;
  long index_;
};

/// What relative energies are relative to: the largest kinetic energy, or that of all free blocks at 1 cm/s
/// where nothing got so fast [J].
double energy_scale(const World& w) {
  constexpr double least = 5e-5;  // [J/kg]
  double mass = 0;
  for (const dda::Model::Block& b : w.system->model().blocks) mass += b.fixed ? 0 : b.mass;
  return std::max(w.energy_peak, least * mass);
}

/// Tells the sink what the world is at an instant.
class Telling {
 public:
  Telling(World& world, Sink& sink) : w_(world), sink_(sink), last_row_(world.time()) {}

  void contacts() {
    std::vector<ContactRow> rows;
    for (const coupling::StructureContact& c : w_.system->take_structure_contacts()) {
      ContactRow r;
      r.time = c.time;
      r.dt = c.dt;
      r.block = w_.listed(c.block);
      r.structure = c.structure;
      r.point = c.point;
      r.force = c.force;
      r.normal = c.normal;
      r.area = c.area;
      r.arrival = c.arrival;
      rows.push_back(r);
    }
    if (!rows.empty()) sink_.contacts(rows);
  }

  void fragments() {
    const std::vector<RunHeader::BlockInfo> born = w_.take_fragments();
    if (!born.empty()) sink_.extend(born);
  }

  void warnings() {
    for (const std::string& text : w_.take_warnings()) sink_.warning(text);
  }

  void history(const Moment& moment) {
    if (sink_.quiet()) return;
    const HistoryRow row = w_.row(moment);
    sink_.history(row);
    residual_ = w_.energy_peak > 0 ? row.ledger.residual / energy_scale(w_) : 0;
    last_row_ = moment.time;
  }

  void field(const Moment& moment) {
    if (sink_.quiet()) return;
    std::vector<Pose> poses;
    for (int i = 0; i < static_cast<int>(w_.system->model().blocks.size()); ++i)
      poses.push_back(w_.pose(i, moment));
    std::vector<Structure::Fields> structures;
    for (const coupling::StructurePart& p : w_.system->environment().structures)
      structures.push_back(p.structure->fields());
    sink_.field(moment.time, poses, structures);
  }

  void progress() { sink_.progress(w_.time(), w_.scene.simulation.duration, counters(), residual_); }

  /// Everything of an instant that has not been recorded yet: where a run failed is what one wants to see.
  void failure() {
    contacts();
    if (w_.time() <= last_row_) return;
    const Moment now = w_.now();
    history(now);
    field(now);
  }

  RunCounters counters() const {
    RunCounters n = w_.counters();
    clocks_.write(n);
    return n;
  }

 private:
  World& w_;
  Sink& sink_;
  Clocks clocks_;
  double last_row_;      // time of the last history row [s]
  double residual_ = 0;  // its energy residual over the largest kinetic energy
};

bool all_left(const World& w) {
  const auto& blocks = w.system->model().blocks;
  const auto moving = static_cast<std::size_t>(
      std::count_if(blocks.begin(), blocks.end(), [](const dda::Model::Block& b) { return b.ndof() > 0; }));
  return moving > 0 && departed(*w.system).size() == moving;
}

bool audited(const World& w) { return !w.system->environment().structures.empty(); }

/// The interface's sums over the run (interface.md: audit).
InterfaceAudit audit_of(const World& w) {
  const coupling::AuditSums& a = w.system->sums().audit;
  InterfaceAudit audit;
  audit.worst_force_imbalance = a.worst_force;
  audit.worst_moment_imbalance = a.worst_moment;
  audit.work_on_blocks = a.work_on_blocks;
  audit.work_on_structure = a.work_on_structure;
  audit.impulse_on_structure = a.impulse_on_structure;
  audit.met = a.met;
  const double scale = a.impulse_on_structure.norm();
  audit.impulse_defect = scale > 0 ? (a.impulse_on_structure + a.impulse_on_blocks).norm() / scale : 0;
  return audit;
}

void interrupted(RunResult& result, int signal, double time) {
  result.status = "interrupted";
  result.message = fmt::format("stopped by signal {} at t = {:.6g} s", signal, time);
  result.exit_code = 128 + signal;
}

}  // namespace

RunResult Simulation::run(Sink& sink, const std::atomic<int>* stop) {
  World& w = *world_;
  const scene::Scene& s = w.scene;
  const double duration = s.simulation.duration;
  RunResult result;
  Telling tell(w, sink);
  Instants histories(w.time(), duration, s.output.history_interval),
      fields(w.time(), duration, s.output.interval);
  w.begin_ledger();
  if (w.time() == 0 && !w.restored) {
    const Moment start = w.now();
    tell.history(start);
    tell.field(start);
    tell.progress();
  }
  const int checkpoint_steps = s.output.checkpoint_steps > 0 ? s.output.checkpoint_steps : 200;
  long since_checkpoint = 0;
  std::vector<double> rows;  // that the next macro step may reach
  const bool told = !sink.quiet();
  try {
    while (duration - w.time() > 1e-12 * duration) {
      const double end = w.rows_end_steps() ? std::min(histories.next(), fields.next()) : duration;
      rows.clear();
      const double reach = w.time() + 1.01 * w.longest_advance();  // more than it can reach, by rounding
      if (told || w.rows_end_steps())
        for (const Instants* due : {&histories, &fields}) due->list(reach, rows);
      if (const double watched = sink.watched_interval(); watched > 0)
        Instants(w.time(), duration, watched).list(reach, rows);
      std::sort(rows.begin(), rows.end());
      rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
      const bool arrived = agreed(stop) == 0 && w.advance(end, rows, stop);
      tell.contacts();
      if (!arrived) {
        interrupted(result, agreed(stop), w.time());
        sink.checkpoint(save());
        break;
      }
      tell.fragments();
      tell.warnings();
      const bool rest = s.simulation.until_rest && !w.paper && at_rest(*w.system);
      const bool last = w.time() >= duration || rest;
      if (rest && (rows.empty() || !std::binary_search(rows.begin(), rows.end(), w.time())))
        rows.insert(std::upper_bound(rows.begin(), rows.end(), w.time()), w.time());
      for (const double t : rows) {
        if (t > w.time()) break;
        if (!told && !w.rows_end_steps()) continue;
        const Moment moment = w.at(t);
        const bool at_end = last && t == w.time();
        if (histories.next() <= t || at_end) tell.history(moment);
        if (fields.next() <= t || at_end) tell.field(moment);
        if (histories.next() <= t) histories.pass();
        if (fields.next() <= t) fields.pass();
      }
      tell.progress();
      // After everything of this instant: a restart records only what comes later.
      if (++since_checkpoint >= checkpoint_steps && !last) {
        since_checkpoint = 0;
        sink.checkpoint(save());
      }
      if (rest) {
        result.status = all_left(w) ? "all left" : "at rest";
        break;
      }
    }
  } catch (const NumericalFailure& e) {
    result.status = "failed";
    result.message = e.what();
    result.exit_code = 3;
    tell.failure();
    sink.checkpoint(save());
  }
  result.counters = tell.counters();
  if (audited(w)) {
    result.audit = audit_of(w);
    result.audit_made = w.system->counters().structure_steps + w.system->counters().condensed_steps > 0;
  }
  if (s.coupling.strict && result.exit_code == 0) {
    const LedgerRow ledger = w.ledger(w.now());
    const double scale = w.energy_peak > 0 ? 1 / energy_scale(w) : 0;
    result.message = audit_failure(result.audit, scale * std::abs(ledger.residual),
                                   scale * std::max(0.0, -ledger.numerical_dissipation()),
                                   scale * result.counters.worst_gain);
    if (!result.message.empty()) result.exit_code = 1;
  }
  return result;
}

}  // namespace talus::sim
