#include "sim/world.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/names.hpp"
#include "core/ranks.hpp"

namespace talus::sim {

Pose World::pose(int listed) const {
  const int block = placed(listed);
  if (paper) return dda::Shi1988::pose(system->state().blocks, paper->history, block);
  return dda::pose(system->state().blocks, block);
}

bool World::advance_to(double t, const std::atomic<int>* stop) {
  return paper ? advance_paper(t, stop) : system->advance_to(t, stop);
}

/// The blocks step by step; structures of scheme "one-way" take the forces of each. While nothing touches them they stay behind, at the system's time.
bool World::advance_paper(double t, const std::atomic<int>* stop) {
  PaperScheme& p = *paper;
  const double dt = scene.simulation.step.value_or(1e-4);
  const coupling::Environment& env = system->environment();
  const auto structures_to = [&](double time, std::span<const coupling::StructureContact> rows) {
    const double behind = time - system->state().time;
    if (behind > 1e-9 * dt) system->advance_structures(behind, rows);
    system->state().time = time;
  };
  while (t - p.time > 1e-9 * dt) {
    if (agreed(stop) != 0) return false;
    const double h = std::min(dt, t - p.time), start = p.time;
    const dda::State before = watch_paper ? system->state().blocks : dda::State{};
    const dda::Shi1988Report r = p.scheme.step(system->model(), system->state().blocks, p.history, env.planes, p.surfaces, env.laws, h);
    p.time += h;
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
    std::vector<coupling::StructureContact> rows;
    for (const dda::Shi1988Load& load : r.loads)
      if (load.surface >= p.first_structure)
        rows.push_back({.time = load.time < h ? start + load.time : p.time, .dt = load.dt, .block = load.block, .structure = load.surface - p.first_structure, .point = load.point, .force = load.force,
                        .normal = load.normal, .area = load.area});
    if (watch_paper) watch_paper(start, before);
    if (rows.empty()) continue;
    structures_to(start, {});
    structures_to(p.time, rows);
  }
  p.time = t;
  structures_to(t, {});
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
    std::set<std::string> names;   // those of an earlier run's pieces among them, where this one goes on with them
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
        throw NumericalFailure(fmt::format("t = {:.6g} s: a piece of {} has no closed surface: {}", time(), scene.structures[q].name, e.what()));
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
        const Vec3 &a = shape.vertices[static_cast<std::size_t>(t[0])], &v = shape.vertices[static_cast<std::size_t>(t[1])],
                   &c = shape.vertices[static_cast<std::size_t>(t[2])];
        const double det = a.dot(v.cross(c));
        volume += det / 6;
        const Vec3 sum = a + v + c;
        second += det / 120 * (sum * sum.transpose() + a * a.transpose() + v * v.transpose() + c * c.transpose());
      }
      if (!(volume > 0)) throw NumericalFailure(fmt::format("t = {:.6g} s: fragment {} has no volume", time(), b.name));
      b.volume = volume;
      b.second_moment = f.mass / volume * second;
      b.inertia = b.second_moment.trace() * Mat3::Identity() - b.second_moment;
      b.shape = std::make_shared<const Polyhedron>(shape);
      const Vec3 v = f.linear_momentum / f.mass;
      // Masses at nodes turn with more inertia than the same mass spread evenly: a piece that would turn with more energy than its nodes had
      // takes as much more inertia as that needs.
      Vec3 w = b.inertia.inverse() * f.angular_momentum;
      const double turning = 0.5 * w.dot(f.angular_momentum), left = f.kinetic - 0.5 * f.mass * v.squaredNorm();
      if (turning > left && left > 0) {
        b.second_moment *= turning / left;
        b.inertia = b.second_moment.trace() * Mat3::Identity() - b.second_moment;   // to the bits that a checkpoint gives back
        w *= left / turning;
      }
      const double kinetic = 0.5 * f.mass * v.squaredNorm() + 0.5 * w.dot(b.inertia * w);
      system->add_block(b, f.centroid, v, w);
      // What its nodes moved against each other dies out within the piece; its strain energy is the structure's loss by breaking.
      const double within = f.kinetic - kinetic;
      (within > 0 ? system->state().ledger.damping_work : system->state().ledger.algorithmic) += within;
      born.push_back({b.name, b.mass, b.volume, false, true, shape, scene.structures[q].young, scene.structures[q].poisson, static_cast<int>(q)});
    }
    structures[q].index = coupling::moving_index(structures[q].structure->surface());
  }
  if (!born.empty()) system->settle_newborn(static_cast<int>(header.blocks.size()));
  header.blocks.insert(header.blocks.end(), born.begin(), born.end());
  return born;
}

std::vector<std::string> World::take_warnings() {
  constexpr double least = 0.02;   // of a structure's mass: less is cover that comes loose
  std::vector<std::string> list;
  const bool one_way = scene.coupling.scheme == scene::Coupling::Scheme::one_way;   // nothing comes off there, whatever `fragments` says
  if (paper || (scene.coupling.fragments && !one_way)) return list;
  const auto& structures = system->environment().structures;
  told_unsupported.resize(structures.size());
  for (std::size_t q = 0; q < structures.size(); ++q) {
    if (!structures[q].stepped() || told_unsupported[q]) continue;
    const Structure::Unsupported lost = structures[q].structure->unsupported();
    if (lost.share < least) continue;
    told_unsupported[q] = 1;
    const Vec3& x = lost.centroid;
    list.push_back(fmt::format("{}: {:.3g} t of it ({:.0f} %, about [{:.4g}, {:.4g}, {:.4g}]) have lost their support by t = {:.4g} s and stay in the mesh ({}): nothing holds them, they sink "
                               "through the ground, slowed by the structure's damping. Their motion from here on is void; {} lets them fall as blocks",
                               scene.structures[q].name, lost.mass / 1e3, 100 * lost.share, x.x(), x.y(), x.z(), time(), one_way ? "coupling.scheme = \"one-way\"" : "coupling.fragments = false",
                               one_way ? "coupling.scheme = \"two-way\"" : "coupling.fragments = true"));
  }
  return list;
}

LedgerRow World::ledger() {
  LedgerRow l;
  const dda::Model& model = system->model();
  const dda::State& s = system->state().blocks;
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
  const coupling::Ledger& c = system->state().ledger;
  if (paper) {
    l.strain = paper->strain_energy;
    l.kinetic = paper->steps > 0 ? paper->kinetic : l.kinetic;
    l.contact = paper->contact_energy;
    l.friction_work = paper->friction_work;
    l.algorithmic = paper->algorithmic;
  } else {
    l.contact = system->spring_energy();
    l.friction_work = c.friction_work;
    l.damping_work = c.damping_work;
    l.algorithmic = c.algorithmic;
  }
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
    l.external_work += e.external_work + (part.one_way ? e.contact_work : 0);   // recorded loads come from outside
    l.linear_momentum += e.linear_momentum;
    l.angular_momentum += e.angular_momentum;
  }
  const double now = l.kinetic + l.potential + l.strain + l.contact;
  const double dissipated = l.friction_work + l.damping_work + l.damage_work + l.algorithmic;
  if (!built_energy) {
    energy_start = now;
    built_energy = true;
  }
  energy_peak = std::max(energy_peak, l.kinetic);
  l.residual = now + dissipated - energy_start - l.external_work;
  return l;
}

HistoryRow World::row() {
  HistoryRow r;
  r.time = time();
  const dda::Model& model = system->model();
  const dda::State& s = system->state().blocks;
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
  }
  for (const coupling::StructurePart& part : system->environment().structures) {
    HistoryRow::StructureRow q;
    q.base_force = part.structure->base_force();
    q.base_moment = part.structure->base_moment();
    q.probe_displacement = part.structure->probe_displacements();
    q.damage_max = part.structure->damage_max();
    q.damaged_volume = part.structure->damaged_volume();
    q.spalled_volume = part.structure->spalled_volume();
    if (part.stepped()) {
      q.members = part.structure->member_states();
      q.peaks = part.structure->load_peaks();
    }
    r.structures.push_back(std::move(q));
  }
  r.ledger = ledger();
  return r;
}

RunCounters World::counters() const {
  RunCounters n;
  if (paper) {
    n.steps = paper->steps;
    n.newton = paper->iterations;
    n.rejected = paper->cuts;
    n.tier_e = paper->unsettled;
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
  n.tier_a = c.tier_a;
  n.tier_b = c.tier_b;
  n.tier_c = c.tier_c;
  n.tier_d = c.tier_d;
  n.tier_e = c.tier_e;
  n.flight_closed_form = c.flights;
  n.structure_steps = c.structure_steps;
  n.condensed_steps = c.condensed_steps;
  n.structure_asleep = system->structure_asleep();
  n.asleep_skipped = system->asleep_skipped();
  n.worst_residual = c.worst_residual;
  n.worst_penetration = c.worst_penetration;
  n.dt = c.last_step;
  n.islands = system->islands();
  n.sleeping_blocks = system->sleeping_blocks();
  return n;
}

}  // namespace talus::sim
