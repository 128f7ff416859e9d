// The run: the world advances from instant to instant of recording, the sink is told.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

#include <fmt/format.h>

#include "core/error.hpp"
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

/// The instants at which histories and fields are due: multiples of their intervals and the end, so that every island hits them exactly and a
/// restart finds the same ones.
class Instants {
 public:
  Instants(double from, double duration, double interval) : duration_(duration), interval_(interval), index_(static_cast<long>(std::floor(from / interval + same)) + 1) {}
  double next() const {
    const double t = static_cast<double>(index_) * interval_;
    return t > duration_ * (1 - 1e-12) ? duration_ : t;
  }
  /// Instants that differ by rounding are one: a restart at the first takes the other for passed.
  bool due(double t) const { return t >= next() - same * std::min(interval_, duration_); }
  void pass() { ++index_; }

 private:
  static constexpr double same = 1e-9;
  double duration_, interval_;
  long index_;
};

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

  void history() {
    if (sink_.quiet()) return;
    const HistoryRow row = w_.row();
    sink_.history(row);
    RunCounters n = counters();
    sink_.progress(w_.time(), w_.scene.simulation.duration, n, w_.energy_peak > 0 ? row.ledger.residual / w_.energy_peak : 0);
    last_row_ = w_.time();
  }

  void field() {
    if (sink_.quiet()) return;
    std::vector<Pose> poses;
    for (int i = 0; i < static_cast<int>(w_.system->model().blocks.size()); ++i) poses.push_back(w_.pose(i));
    std::vector<Structure::Snapshot> snapshots;
    for (const coupling::StructurePart& p : w_.system->environment().structures) snapshots.push_back(p.structure->snapshot());
    sink_.field(w_.time(), poses, snapshots);
  }

  /// Everything of an instant that nothing has been told of yet: where a run failed is what one wants to see.
  void failure() {
    contacts();
    if (w_.time() <= last_row_) return;
    history();
    field();
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
  double last_row_;   // time of the last history row [s]
};

bool all_left(const World& w) {
  const auto& blocks = w.system->model().blocks;
  const auto moving = static_cast<std::size_t>(std::count_if(blocks.begin(), blocks.end(), [](const dda::Model::Block& b) { return b.ndof() > 0; }));
  return moving > 0 && w.system->departed().size() == moving;
}

bool audited(const World& w) { return !w.system->environment().structures.empty(); }

/// The interface's sums over the run (interface.md: audit).
InterfaceAudit audit_of(const World& w) {
  const coupling::AuditSums& a = w.system->audit();
  InterfaceAudit audit;
  audit.worst_force_imbalance = a.worst_force;
  audit.worst_moment_imbalance = a.worst_moment;
  audit.work_on_blocks = a.work_on_blocks;
  audit.work_on_structure = a.work_on_structure;
  audit.impulse_on_structure = a.impulse_on_structure;
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
  Instants histories(w.time(), duration, s.output.history_interval), fields(w.time(), duration, s.output.interval);
  if (w.time() == 0 && !w.restored) {
    tell.history();
    tell.field();
  }
  const int checkpoint_rows = s.output.checkpoint_steps > 0 ? s.output.checkpoint_steps : 200;
  long since_checkpoint = 0;
  try {
    while (duration - w.time() > 1e-12 * duration) {
      const double t = std::min(histories.next(), fields.next());
      const bool arrived = agreed(stop) == 0 && w.advance_to(t, stop);
      tell.contacts();
      if (!arrived) {
        interrupted(result, agreed(stop), w.time());
        sink.checkpoint(save());
        break;
      }
      tell.fragments();
      tell.warnings();
      const bool rest = s.simulation.until_rest && !w.paper && w.system->at_rest();
      const bool last = t >= duration || rest;
      if (histories.due(t) || last) {
        tell.history();
        histories.pass();
        ++since_checkpoint;
      }
      if (fields.due(t) || last) {
        tell.field();
        fields.pass();
      }
      // After everything of this instant: a restart records only what comes later.
      if (since_checkpoint >= checkpoint_rows && !last) {
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
    if (s.coupling.strict && result.exit_code == 0 && result.audit_made) {
      const LedgerRow ledger = w.ledger();
      const double scale = w.energy_peak > 0 ? 1 / w.energy_peak : 0;
      result.message = audit_failure(result.audit, scale * std::abs(ledger.residual), scale * std::max(0.0, -ledger.by_the_scheme()));
      if (!result.message.empty()) result.exit_code = 1;
    }
  }
  return result;
}

}  // namespace talus::sim
