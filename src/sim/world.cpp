#include "sim/world.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/multiples.hpp"
#include "core/names.hpp"
#include "core/place.hpp"
#include "core/ranks.hpp"

namespace talus::sim {

namespace {

constexpr double paper_at_once = 0.05;  // steps of dda-1988 are taken until so much time has passed [s]

double paper_step(const scene::Scene& scene) { return scene.simulation.step.value_or(1e-4); }

}  // namespace

Pose World::pose(int listed) const {
  const int block = placed(listed);
  if (paper) return dda::Shi1988::pose(system->state().blocks, paper->history, block);
  return dda::pose(system->state().blocks, block);
}

Pose World::pose(int listed, const Moment& moment) const {
  const int block = placed(listed);
  const auto k = static_cast<std::size_t>(block);
  if (paper && k < moment.map.size()) return {moment.blocks.c[k], moment.map[k]};
  return dda::pose(moment.blocks, block);
}

bool World::rows_end_steps() const {
  const auto& structures = system->environment().structures;
  return std::any_of(structures.begin(), structures.end(),
                     [](const coupling::StructurePart& part) { return part.stepped(); });
}

double World::longest_advance() const {
  return paper ? std::max(paper_at_once, paper_step(scene)) : system->longest_stretch();
}

double World::blocks_kinetic() const {
  if (paper && paper->steps > 0) return paper->kinetic;
  double sum = 0;
  for (int i = 0; i < static_cast<int>(system->model().blocks.size()); ++i) {
    if (system->model().blocks[static_cast<std::size_t>(i)].fixed) continue;
    const dda::BlockEnergy e = dda::energy(system->model(), system->state().blocks, i);
    sum += e.translational + e.rotational + e.straining;
  }
  return sum;
}

bool World::advance(double end, std::span<const double> rows, const std::atomic<int>* stop) {
  const bool arrived =
      paper ? advance_paper(end, rows, stop) : system->advance(foresee_strikes(end), stop, rows);
  if (!arrived) return false;
  energy_peak = std::max(energy_peak, system->state().kinetic_peak);
  // With that of structures, which costs as much as a step, where rows are taken.
  if (rows_end_steps() && !rows.empty() && rows.front() <= time()) {
    const LedgerRow l = ledger(now());
    if (!std::isfinite(l.residual))
      throw NumericalFailure(fmt::format("t = {:.6g} s: the motion of a structure is no number", time()));
    energy_peak = std::max(energy_peak, l.kinetic);
  }
  return true;
}

Moment World::at(double t) const {
  if (!paper) {
    Moment moment;
    static_cast<coupling::Moment&>(moment) = system->at(t);
    return moment;
  }
  const Moment after = paper_now();
  if (t >= paper->time || paper_before_.blocks.c.empty() || t < paper_before_.time) return after;
  // The scheme's displacements are those of the trapezoidal rule, Eq. (7); its maps and works go straight.
  const double t0 = paper_before_.time, h = paper->time - t0, r = (t - t0) / h;
  Moment between = after;
  between.time = t;
  const dda::Model& model = system->model();
  double dip = 0;  // of the kinetic energy, by velocities that change in proportion to time
  for (int i = 0; i < static_cast<int>(model.blocks.size()); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const dda::BlockState a = dda::block_state(paper_before_.blocks, i),
                          b = dda::block_state(after.blocks, i);
    dda::set_block_state(
        between.blocks, i,
        evaluate(coupling::MotionSegment{i, coupling::MotionSegment::Path::trapezoid, t0, paper->time, a, b},
                 t, model));
    if (!model.blocks[k].fixed) dip += 0.5 * model.blocks[k].mass * (b.v - a.v).squaredNorm();
    if (k < after.map.size() && k < paper_before_.map.size())
      between.map[k] = paper_before_.map[k] + r * (after.map[k] - paper_before_.map[k]);
  }
  const auto straight = [r](double a, double b) { return a + r * (b - a); };
  between.kinetic = straight(paper_before_.kinetic, after.kinetic) - r * (1 - r) * dip;
  between.strain_energy = straight(paper_before_.strain_energy, after.strain_energy);
  between.works.contact = straight(paper_before_.works.contact, after.works.contact);
  between.works.friction_work = straight(paper_before_.works.friction_work, after.works.friction_work);
  between.works.algorithmic = straight(paper_before_.works.algorithmic, after.works.algorithmic);
  return between;
}

Moment World::paper_now() const {
  Moment now;
  now.time = paper->time;
  now.blocks = system->state().blocks;
  now.map = paper->history.map;
  now.works.friction_work = paper->friction_work;
  now.works.algorithmic = paper->algorithmic;
  now.works.contact = paper->contact_energy;
  now.strain_energy = paper->strain_energy;
  now.kinetic = blocks_kinetic();
  return now;
}

/// The scheme's steps have no islands that report them.
void World::add_paper_peaks() {
  coupling::SystemState& s = system->state();
  const auto& blocks = system->model().blocks;
  for (std::size_t i = 0; i < blocks.size(); ++i)
    if (!blocks[i].fixed) s.peaks[i].add(blocks[i], dda::block_state(s.blocks, static_cast<int>(i)));
  s.kinetic_peak = std::max(s.kinetic_peak, paper->kinetic);
}

/// Steps of equal length on the run's own clock, up to the first whose end reaches a row, or for as long as a
/// macro step; structures of scheme "one-way" take the forces of each step. While nothing touches them they
/// stay behind, at the system's time.
bool World::advance_paper(double end, std::span<const double> rows, const std::atomic<int>* stop) {
  PaperScheme& p = *paper;
  const double dt = paper_step(scene), from = p.time, same = 1e-9 * dt;
  const Multiples clock(dt);
  const coupling::Environment& env = system->environment();
  const auto structures_to = [&](double time, std::span<const coupling::StructureContact> forces) {
    const double behind = time - system->state().time;
    if (behind > same) system->advance_structures(behind, forces);
    system->state().time = time;
  };
  while (end - p.time > same && p.time - from < paper_at_once - same &&
         (rows.empty() || p.time < rows.front())) {
    if (agreed(stop) != 0) return false;
    const double start = p.time, next = clock.at(clock.after(start + same));
    const bool last = next > end - same;
    const double h = last ? std::min(dt, end - start) : dt;
    if (coupling::falls_into(rows, start, last ? end : next)) paper_before_ = paper_now();
    const dda::State before = watch_paper ? system->state().blocks : dda::State{};
    const dda::Shi1988Report r = p.scheme.step(system->model(), system->state().blocks, p.history, env.planes,
                                               p.surfaces, env.laws, h);
    p.time = last ? end : next;
    p.steps += r.substeps;
    p.iterations += r.iterations;
    p.cuts += r.step_cuts;
    p.unsettled += r.unsettled;
    p.contacts += r.contacts;
    p.friction_work += r.friction_work;
    p.algorithmic += r.algorithmic();
    p.worst_penetration = std::max(p.worst_penetration, r.max_penetration);
    p.contact_energy = r.contact;
    p.strain_energy = r.strain;
    p.kinetic = r.kinetic;
    add_paper_peaks();
    std::vector<coupling::StructureContact> forces;
    for (const dda::Shi1988Load& load : r.loads)
      if (load.surface >= p.first_structure)
        forces.push_back({.time = load.time < h ? start + load.time : p.time,
                          .dt = load.dt,
                          .block = load.block,
                          .structure = load.surface - p.first_structure,
                          .point = load.point,
                          .force = load.force,
                          .normal = load.normal,
                          .area = load.area});
    if (watch_paper) watch_paper(start, before);
    if (forces.empty()) continue;
    structures_to(start, {});
    structures_to(p.time, forces);
  }
  if (end - p.time <= same) p.time = end;
  structures_to(p.time, {});
  return true;
}

std::vector<RunHeader::BlockInfo> World::take_fragments() {
  std::vector<RunHeader::BlockInfo> born;
  if (paper || !scene.coupling.fragments) return born;
  auto& structures = system->environment().structures;
  for (std::size_t q = 0; q < structures.size(); ++q) {
    if (structures[q].fixed_surface) continue;
    const std::vector<Fragment> pieces = structures[q].structure->take_fragments();
    if (pieces.empty()) continue;
    int serial = 0;
    std::set<std::string>
        names;  // those of an earlier run's pieces among them, where this one goes on with them
    for (const RunHeader::BlockInfo& b : header.blocks) {
      names.insert(b.name);
      if (b.fragment) ++serial;
    }
    for (const Fragment& f : pieces) {
      Polyhedron shape;
      std::vector<Vec3> vertices = f.vertices;
      for (Vec3& x : vertices) x -= f.centroid;
      try {
        shape = make_polyhedron(std::move(vertices), f.triangles);
      } catch (const InputError& e) {
        throw NumericalFailure(fmt::format("t = {:.6g} s: a piece of {} has no closed surface: {}", time(),
                                           scene.structures[q].name, e.what()));
      }
      dda::Model::Block b;
      do b.name = fragment_name(scene.structures[q].name, ++serial);
      while (!names.insert(b.name).second);
      b.mass = f.mass;
      b.material = structures[q].material;
      b.structure = static_cast<int>(q);
      // Uniform density over the polyhedron; mass and both momenta are the nodes' own.
      double volume = 0;
      Mat3 second = Mat3::Zero();
      for (const auto& t : shape.triangles) {
        const Vec3 &a = shape.vertices[static_cast<std::size_t>(t[0])],
                   &v = shape.vertices[static_cast<std::size_t>(t[1])],
                   &c = shape.vertices[static_cast<std::size_t>(t[2])];
        const double det = a.dot(v.cross(c));
        volume += det / 6;
        const Vec3 sum = a + v + c;
        second +=
            det / 120 * (sum * sum.transpose() + a * a.transpose() + v * v.transpose() + c * c.transpose());
      }
      if (!(volume > 0))
        throw NumericalFailure(fmt::format("t = {:.6g} s: fragment {} has no volume", time(), b.name));
      b.volume = volume;
      b.second_moment = f.mass / volume * second;
      b.inertia = b.second_moment.trace() * Mat3::Identity() - b.second_moment;
      b.shape = std::make_shared<const Polyhedron>(shape);
      const Vec3 v = f.linear_momentum / f.mass;
      // Masses at nodes turn with more inertia than the same mass spread evenly: a piece that would turn with
      // more energy than its nodes had takes as much more inertia as that needs.
      Vec3 w = b.inertia.inverse() * f.angular_momentum;
      const double turning = 0.5 * w.dot(f.angular_momentum),
                   left = f.kinetic - 0.5 * f.mass * v.squaredNorm();
      if (turning > left && left > 0) {
        b.second_moment *= turning / left;
        b.inertia = b.second_moment.trace() * Mat3::Identity() -
                    b.second_moment;  // to the bits that a checkpoint gives back
        w *= left / turning;
      }
      const double kinetic = 0.5 * f.mass * v.squaredNorm() + 0.5 * w.dot(b.inertia * w);
      system->add_block(b, f.centroid, v, w);
      // What its nodes moved against each other dies out within the piece; its strain energy is the
      // structure's loss by breaking.
      const double within = f.kinetic - kinetic;
      (within > 0 ? system->state().ledger.damping_work : system->state().ledger.algorithmic) += within;
      born.push_back({b.name, b.mass, b.volume, false, true, shape, scene.structures[q].young,
                      scene.structures[q].poisson, static_cast<int>(q), f.crushed});
    }
    structures[q].index = coupling::moving_index(structures[q].structure->skin().surface());
  }
  if (!born.empty()) settle_newborn(*system, static_cast<int>(header.blocks.size()));
  header.blocks.insert(header.blocks.end(), born.begin(), born.end());
  return born;
}

std::vector<std::string> World::take_warnings() {
  constexpr double least = 0.02;  // of a structure's mass: less is cover that comes loose
  std::vector<std::string> list = std::exchange(due_warnings, {});
  constexpr double through = 1 - 1e-6;
  if (const coupling::Counters& n = system->counters();
      !paper && !told_crushed_through && n.crush_share >= through) {
    told_crushed_through = true;
    const int materials = system->environment().laws.materials;
    const auto name = [&](int material) { return scene.materials[static_cast<std::size_t>(material)].name; };
    const std::string pair =
        n.crush_law >= 0
            ? fmt::format("between {} and {} ", name(n.crush_law / materials), name(n.crush_law % materials))
            : std::string();
    list.push_back(
        fmt::format("the layer {}that crushes is crushed through by t = {:.4g} s: from there on the contact "
                    "is as stiff as its normal_stiffness, and forces grow as if nothing were left of it; a "
                    "thicker or stronger layer would take more",
                    pair, time()));
  }
  const bool one_way =
      scene.coupling.scheme ==
      scene::Coupling::Scheme::one_way;  // nothing comes off there, whatever `fragments` says
  if (paper || (scene.coupling.fragments && !one_way)) return list;
  const auto& structures = system->environment().structures;
  told_unsupported.resize(structures.size());
  for (std::size_t q = 0; q < structures.size(); ++q) {
    if (!structures[q].stepped() || told_unsupported[q]) continue;
    const Structure::Unsupported lost = structures[q].structure->unsupported();
    if (lost.share < least) continue;
    told_unsupported[q] = 1;
    list.push_back(
        fmt::format("{}: {:.3g} t of it ({:.0f} %, about {}) have lost their support "
                    "by t = {:.4g} s and stay in the mesh ({}): {}, slowed by the structure's damping. Their "
                    "motion from here on is void; {} lets them fall as blocks",
                    scene.structures[q].name, lost.mass / 1e3, 100 * lost.share, place_text(lost.centroid),
                    time(), one_way ? "coupling.scheme = \"one-way\"" : "coupling.fragments = false",
                    structures[q].grounds.empty() ? "nothing holds them, they sink through the ground"
                                                  : "they fall as parts of it",
                    one_way ? "coupling.scheme = \"two-way\"" : "coupling.fragments = true"));
  }
  return list;
}

LedgerRow World::ledger(const Moment& moment) const {
  LedgerRow l;
  const dda::Model& model = system->model();
  const dda::State& s = moment.blocks;
  for (int i = 0; i < static_cast<int>(model.blocks.size()); ++i) {
    if (model.blocks[static_cast<std::size_t>(i)].fixed) continue;
    const dda::BlockEnergy e = dda::energy(model, s, i);
    l.kinetic += e.translational + e.rotational + e.straining;
    l.potential += e.potential;
    l.strain += e.strain_energy;
    Vec3 p, a;
    dda::momentum(model, s, i, p, a);
    l.linear_momentum += p;
    l.angular_momentum += a;
  }
  if (paper) {
    l.strain = moment.strain_energy;
    l.kinetic = moment.kinetic;
  }
  l.contact = moment.works.contact;
  l.friction_work = moment.works.friction_work;
  l.damping_work = moment.works.damping_work;
  l.yield_work = moment.works.yield_work;
  l.ploughing_work = moment.works.ploughing_work;
  l.vegetation_work = moment.works.vegetation_work;
  l.algorithmic = moment.works.algorithmic;
  for (const coupling::StructurePart& part : system->environment().structures) {
    if (!part.stepped()) continue;
    const StructureEnergy e = part.structure->energy();
    l.kinetic += e.kinetic;
    l.potential += e.gravity_potential;
    l.strain += e.elastic;
    l.damping_work += e.damping_work + e.bulk_viscosity_work;
    l.damage_work += e.damage_work + e.plastic_work + e.eroded_energy;
    l.algorithmic += e.algorithmic + e.step_dependence;
    l.step_dependence += e.step_dependence;
    l.external_work +=
        e.external_work + (part.one_way ? e.contact_work : 0);  // recorded loads come from outside
    l.linear_momentum += e.linear_momentum;
    l.angular_momentum += e.angular_momentum;
  }
  const double now = l.kinetic + l.potential + l.strain + l.contact;
  const double dissipated = l.dissipated();
  l.residual = now + dissipated - energy_start - l.external_work;
  return l;
}

void World::begin_ledger() {
  if (built_energy) return;
  const LedgerRow l = ledger(now());
  energy_start = l.kinetic + l.potential + l.strain + l.contact;
  energy_peak = std::max(energy_peak, l.kinetic);
  built_energy = true;
}

HistoryRow World::row(const Moment& moment) const {
  HistoryRow r;
  r.time = moment.time;
  const dda::Model& model = system->model();
  const dda::State& s = moment.blocks;
  for (int i = 0; i < static_cast<int>(model.blocks.size()); ++i) {
    const auto k = static_cast<std::size_t>(placed(i));
    const dda::BlockEnergy e = dda::energy(model, s, placed(i));
    r.position.push_back(s.c[k]);
    r.velocity.push_back(s.v[k]);
    r.spin.push_back(s.w[k]);
    r.orientation.emplace_back(s.q[k].w(), s.q[k].x(), s.q[k].y(), s.q[k].z());
    r.strain.push_back(s.eps[k]);
    r.kinetic_translational.push_back(e.translational);
    r.kinetic_rotational.push_back(e.rotational + e.straining);
    r.peaks.push_back(system->state().peaks[k]);
  }
  for (const coupling::StructurePart& part : system->environment().structures) {
    HistoryRow::StructureRow q;
    q.base_force = part.structure->loads().base_force();
    q.base_moment = part.structure->loads().base_moment();
    q.probe_displacement = part.structure->skin().probe_displacements();
    const Structure::Damage damage = part.structure->damage();
    q.damage_max = damage.largest, q.damaged_volume = damage.volume, q.spalled_volume = damage.spalled;
    if (part.stepped()) {
      q.members = part.structure->loads().states();
      q.peaks = part.structure->loads().peaks();
    }
    r.structures.push_back(std::move(q));
  }
  r.ledger = ledger(moment);
  r.kinetic_peak = energy_peak;
  return r;
}

RunCounters World::counters() const {
  RunCounters n;
  if (paper) {
    n.steps = paper->steps;
    n.newton = paper->iterations;
    n.rejected = paper->cuts;
    n.convex = paper->unsettled;
    n.contacts = paper->contacts;
    n.worst_penetration = paper->worst_penetration;
    n.dt = scene.simulation.step.value_or(1e-4);
    return n;
  }
  const coupling::Counters& c = system->counters();
  n.steps = c.steps;
  n.rejected = c.rejected;
  n.contacts = c.contacts;
  n.newton = c.newton;
  n.sweeps = c.sweeps;
  n.outer = c.outer;
  n.impacts = c.impacts;
  n.newton_method = c.newton_method;
  n.interior_point = c.interior_point;
  n.above_tolerance = c.above_tolerance;
  n.halved = c.halved;
  n.convex = c.convex;
  n.flight_closed_form = c.flights;
  n.structure_steps = c.structure_steps;
  n.condensed_steps = c.condensed_steps;
  n.structure_asleep = system->sums().structure_asleep;
  n.asleep_skipped = system->sums().asleep_skipped;
  n.worst_residual = c.worst_residual;
  n.worst_penetration = c.worst_penetration;
  n.crush_depth = c.crush_depth;
  n.crush_share = c.crush_share;
  n.gained = c.gained;
  n.worst_gain = c.worst_gain;
  n.undone = c.undone;
  n.reduced = c.reduced;
  n.restitution_lost = c.restitution_lost;
  n.dt = c.last_step;
  n.islands = system->islands();
  n.sleeping_blocks = sleeping_blocks(*system);
  return n;
}

}  // namespace talus::sim
