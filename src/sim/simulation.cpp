#include "sim/simulation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

#include <fmt/format.h>

#include "core/error.hpp"
#include "geometry/mesh.hpp"
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
  if (w.time() == 0) {
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
      const bool arrived = (stop == nullptr || stop->load() == 0) && w.advance_to(t, stop);
      flush_contacts();
      if (!arrived) {
        result.status = "interrupted";
        result.message = fmt::format("stopped by signal {} at t = {:.6g} s", stop->load(), w.time());
        result.exit_code = 128 + stop->load();
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
    result.audit_made = w.system->counters().structure_steps > 0;
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

namespace {

/// Upper bound of the peak memory [MB], from peaks measured on six scenes (docs/results/robustness.md): the program, the raster and
/// structure modules with their libraries, and what grows with blocks, triangles and elements. The factor of a structure's stiffness
/// grows faster than its elements, up to the size beyond which multigrid takes its place.
double memory_bound(const World& w) {
  const coupling::Environment& env = w.system->environment();
  double sum = 30 + 0.024 * static_cast<double>(w.system->model().blocks.size());
  if (w.scene.site && !geometry::is_mesh_file(w.scene.site->terrain)) sum += 30;
  if (env.terrain) sum += 1e-3 * static_cast<double>(env.terrain->surface().triangles.size());
  if (!env.structures.empty()) sum += 155;
  for (const coupling::StructurePart& p : env.structures) {
    const auto n = static_cast<double>(p.structure->elements());
    sum += n * (0.02 + 4e-7 * std::min(n, 50000.0));
  }
  return sum;
}

}  // namespace

std::vector<std::string> Simulation::plan() const {
  const World& w = *world_;
  const scene::Scene& s = w.scene;
  std::vector<std::string> lines;
  const dda::Model& model = w.system->model();
  int fixed = 0, rigid = 0, strained = 0;
  for (const dda::Model::Block& b : model.blocks) ++(b.fixed ? fixed : b.deformable ? strained : rigid);
  if (w.paper) {
    lines.push_back(fmt::format("Method dda-1988: the paper's scheme, 12 degrees of freedom for every block, step {:g} s.", s.simulation.step.value_or(1e-4)));
    for (const std::string& line : w.paper->scheme.plan(model, s.laws)) lines.push_back(line);
  } else if (s.simulation.step) {
    lines.push_back(fmt::format("Method talus: one convex contact problem per island and step, fixed step {:g} s.", *s.simulation.step));
  } else {
    lines.push_back(fmt::format("Method talus: one convex contact problem per island and step, step chosen for an accuracy of {:g} of the block size.", s.simulation.accuracy.value_or(1e-3)));
  }
  if (!w.paper)
    lines.push_back(fmt::format("Blocks: {} with 6 degrees of freedom, {} with 12 (strain asked for), {} fixed without any: {} in all.", rigid, strained, fixed, 6 * rigid + 12 * strained));
  const coupling::Environment& env = w.system->environment();
  if (env.terrain) lines.push_back(fmt::format("Terrain: {} triangles, fixed, no degrees of freedom.", env.terrain->surface().triangles.size()));
  else lines.push_back("Terrain: none; no raster library is loaded.");
  if (!env.planes.empty()) lines.push_back(fmt::format("Planes: {}, fixed.", env.planes.size()));
  if (env.structures.empty()) {
    lines.push_back("Structures: none; the finite-element module is not loaded, no MPI start-up.");
  } else {
    for (std::size_t i = 0; i < env.structures.size(); ++i) {
      const Structure& st = *env.structures[i].structure;
      lines.push_back(fmt::format("Structure {}: {} elements, {} degrees of freedom{}.", s.structures[i].name, st.elements(), st.dofs(),
                                  env.structures[i].one_way         ? "; blocks strike its undeformed skin as a fixed surface, their loads are put on it afterwards"
                                  : env.structures[i].fixed_surface ? "; its skin is a fixed surface, it is not stepped"
                                                                    : ""));
      std::string text = st.plan();
      std::size_t from = 0;
      while (from < text.size()) {
        std::size_t to = text.find('\n', from);
        if (to == std::string::npos) to = text.size();
        if (to > from) lines.push_back("  " + text.substr(from, to - from));
        from = to + 1;
      }
    }
  }
  bool springs = false, restitution = false, cohesion = false;
  for (const ContactLaw& l : s.laws.law) {
    springs = springs || l.stiffness != ContactLaw::Stiffness::hard;
    restitution = restitution || l.restitution.has_value();
    cohesion = cohesion || l.cohesion > 0 || l.tension > 0;
  }
  lines.push_back(springs ? "Contact: springs where a stiffness is given or chosen, hard elsewhere." : "Contact: hard; no springs, no shear history is kept.");
  if (!restitution) lines.push_back("Restitution: not given; impacts on hard contacts are inelastic.");
  if (!cohesion) lines.push_back("Cohesion and tension: none.");
  if (!w.paper) lines.push_back(s.simulation.sleeping ? "Resting islands sleep on a static certificate and cost nothing; islands in flight take closed-form steps." : "Sleeping is off.");
  lines.push_back(fmt::format("Memory: at most about {:.0f} MB.", memory_bound(w)));
  for (const std::string& n : w.notes) lines.push_back(n);
  for (const std::string& n : s.notes) lines.push_back(n);
  return lines;
}

}  // namespace talus::sim
