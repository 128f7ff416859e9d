#include "sim/simulation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/ranks.hpp"
#include "sim/world.hpp"

namespace talus::sim {

Simulation::Simulation(scene::Scene scene, std::function<void(const std::string&)> report)
    : world_(build(std::move(scene), std::move(report))) {
  world_->header.plan = plan();
}

Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;

const RunHeader& Simulation::header() const { return world_->header; }
const scene::Scene& Simulation::scene() const { return world_->scene; }
double Simulation::time() const { return world_->time(); }
std::vector<std::string> Simulation::departed() const {
  std::vector<std::string> names;
  if (!world_->paper)
    for (const int b : world_->system->departed()) names.push_back(world_->system->model().blocks[static_cast<std::size_t>(b)].name);
  return names;
}
std::vector<Structure*> Simulation::structures() {
  std::vector<Structure*> list;
  for (const coupling::StructurePart& part : world_->system->environment().structures) list.push_back(part.fixed_surface ? nullptr : part.structure.get());
  return list;
}

World& Simulation::world() { return *world_; }

RunResult Simulation::run(Sink& sink, const std::atomic<int>* stop) {
  World& w = *world_;
  const scene::Scene& s = w.scene;
  RunResult result;
  const auto wall_start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  const auto clocks = [&](RunCounters& n) {
    n.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count();
    n.cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  };
  const double dh = s.output.history_interval, df = s.output.interval, duration = s.simulation.duration;
  // Times are multiples of the intervals, so that every island hits them exactly and a restart finds the same ones.
  long history_index = static_cast<long>(std::floor(w.time() / dh + 1e-9)) + 1;
  long field_index = static_cast<long>(std::floor(w.time() / df + 1e-9)) + 1;
  std::vector<ContactRow> rows;
  const auto flush_contacts = [&] {
    rows.clear();
    for (const coupling::StructureContact& c : w.system->take_structure_contacts()) {
      ContactRow r;
      r.time = c.time;
      r.dt = c.dt;
      r.block = c.block;
      r.structure = c.structure;
      r.point = c.point;
      r.force = c.force;
      r.normal = c.normal;
      r.area = c.area;
      rows.push_back(r);
    }
    if (!rows.empty()) sink.contacts(rows);
  };
  const auto record_field = [&] {
    std::vector<Pose> poses;
    for (int i = 0; i < static_cast<int>(w.system->model().blocks.size()); ++i) poses.push_back(w.pose(i));
    std::vector<Structure::Snapshot> snapshots;
    for (const coupling::StructurePart& p : w.system->environment().structures) snapshots.push_back(p.structure->snapshot());
    sink.field(w.time(), poses, snapshots);
  };
  const auto record_history = [&] {
    const HistoryRow row = w.row();
    sink.history(row);
    RunCounters n = w.counters();
    clocks(n);
    sink.progress(w.time(), duration, n, w.energy_peak > 0 ? row.ledger.residual / w.energy_peak : 0);
  };
  if (w.time() == 0 && !w.restored) {
    record_history();
    record_field();
  }
  const int checkpoint_rows = s.output.checkpoint_steps > 0 ? s.output.checkpoint_steps : 200;
  long since_checkpoint = 0;
  double last_recorded = w.time();
  try {
    while (duration - w.time() > 1e-12 * duration) {
      double th = static_cast<double>(history_index) * dh, tf = static_cast<double>(field_index) * df;
      if (th > duration * (1 - 1e-12)) th = duration;
      if (tf > duration * (1 - 1e-12)) tf = duration;
      const double t = std::min(th, tf);
      const bool arrived = agreed(stop) == 0 && w.advance_to(t, stop);
      flush_contacts();
      if (!arrived) {
        result.status = "interrupted";
        const int signal = agreed(stop);
        result.message = fmt::format("stopped by signal {} at t = {:.6g} s", signal, w.time());
        result.exit_code = 128 + signal;
        sink.checkpoint(save());
        break;
      }
      const std::vector<RunHeader::BlockInfo> born = w.take_fragments();
      if (!born.empty()) sink.extend(born);
      const bool rest = s.simulation.until_rest && !w.paper && w.system->at_rest();
      const bool last = t >= duration || rest;
      if (t >= th || last) {
        record_history();
        last_recorded = w.time();
        ++history_index;
        ++since_checkpoint;
      }
      if (t >= tf || last) {
        record_field();
        ++field_index;
      }
      // After everything of this instant: a restart records only what comes later.
      if (since_checkpoint >= checkpoint_rows && !last) {
        since_checkpoint = 0;
        sink.checkpoint(save());
      }
      if (rest) {
        result.status = "at rest";
        break;
      }
    }
  } catch (const NumericalFailure& e) {
    result.status = "failed";
    result.message = e.what();
    result.exit_code = 3;
    flush_contacts();
    if (w.time() > last_recorded) {
      record_history();
      record_field();   // where it failed is what one wants to see
    }
    sink.checkpoint(save());
  }
  result.counters = w.counters();
  clocks(result.counters);
  if (!w.system->environment().structures.empty() && !w.paper) {
    const coupling::AuditSums& a = w.system->audit();
    result.audit_made = w.system->counters().structure_steps + w.system->counters().condensed_steps > 0;
    result.audit.worst_force_imbalance = a.worst_force;
    result.audit.worst_moment_imbalance = a.worst_moment;
    result.audit.work_on_blocks = a.work_on_blocks;
    result.audit.work_on_structure = a.work_on_structure;
    result.audit.impulse_on_structure = a.impulse_on_structure;
    const double scale = a.impulse_on_structure.norm();
    result.audit.impulse_defect = scale > 0 ? (a.impulse_on_structure + a.impulse_on_blocks).norm() / scale : 0;
    if (s.coupling.strict && result.exit_code == 0 && result.audit_made) {
      const double residual = w.energy_peak > 0 ? std::abs(w.ledger().residual) / w.energy_peak : 0;
      if (a.worst_force > 1e-12 || result.audit.impulse_defect > 1e-9 || residual > 0.01) {
        result.exit_code = 1;
        result.message = fmt::format(
            "audit: force imbalance {:.3g} (limit 1e-12), impulse defect {:.3g} (limit 1e-9), energy residual {:.3g} of the largest kinetic energy (limit 0.01)",
            a.worst_force, result.audit.impulse_defect, residual);
      }
    }
  }
  return result;
}

}  // namespace talus::sim
