// What a step leaves to the next one: impulses on structure nodes, the memory of contacts, rows and audit
// sums.
#include "coupling/step/commit.hpp"

#include <algorithm>
#include <cmath>

#include "contact/structures/node_surface.hpp"
#include "contact/tolerances.hpp"
#include "coupling/events/approach.hpp"
#include "coupling/events/structure_impacts.hpp"
#include "coupling/ground/ground_laws.hpp"
#include "coupling/rows/bonds.hpp"
#include "coupling/springs/spring_energy.hpp"
#include "coupling/touch/touch_bed.hpp"

namespace talus::coupling {
namespace {
/// Largest correction of a spring at rest in a step [m]: its free oscillation has 0.3 of the speed that
/// counts as none, whatever its stiffness.
double led_in_quietly(const Touch& t) {
  return t.rate_sq > 0 ? 0.3 * t.quiet_speed / std::sqrt(t.rate_sq) : 0.0;
}
/// How much deeper a block lies on a bed at the end of a condensed step than the spring knew, which
/// acted by the velocity there: positions are the trapezoid's [m].
///
///   h (u_n + u_np) / 2 - h u_np = h (u_n - u_np) / 2,     h u_np = -x_np - g_n
double sunk_unseen(const IslandContext& in, const Touch& t, double h) {
  if (!in.condensed || t.mode != Mode::spring_end || !t.normal_law.bed) return 0;
  const double deep = t.indentation - 0.5 * (t.indentation + t.at.gap + h * t.approach);
  return std::max(0.0, deep) - std::max(0.0, t.indentation);
}

void remember_row(const IslandContext& in, const Step& step, const Touch& t, double h,
                  std::vector<ContactMemory>& list) {
  const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
  const Vec3 p = t.frame * c.impulse;
  ContactMemory memory;
  memory.partner = t.a.id();
  memory.feature = t.at.key;
  memory.force = p / h;
  memory.place = t.at.point_a;
  memory.broken = t.broken || bond_breaks(in, step, t);
  memory.glued = t.glued && !memory.broken;
  memory.bonded = t.bonded;
  if (t.shear_stiffness > 0) {
    memory.shear = shear_at_end(step, t, h);
    memory.shear_way = shear_way(step, t, h);
    memory.shear_energy = shear_energy_at_end(step, t, h);
  }
  if (t.stiffness > 0) {
    memory.normal_energy = normal_energy_at_end(step, t);
    memory.crushed =
        booked_by_craters(t) ? crushed_ahead(t) : std::max(0.0, t.normal_law.crushed_after(t.indentation));
    memory.normal = t.at.normal;
    // Deeper than the geometry says it comes back slowly, at its own cost; the other way round it waits for
    // the contact to open, or to rest.
    const bool own = in.deformable_structure(t);
    const double led_out =
        t.normal_law.bed
            ? 0
            : std::clamp(
                  t.offset, -in.scale.offset_correction(h),
                  own || t.energetic ? 0.0 : std::min(in.scale.offset_correction(h), led_in_quietly(t)));
    // What a bed did not know of lies unloaded: it holds what it took, wherever the next step begins.
    const double unseen = sunk_unseen(in, t, h);
    memory.offset = t.offset - led_out;
    double& unloaded = booked_by_craters(t) ? memory.offset : memory.crushed;
    unloaded = std::max(0.0, unloaded + unseen);
    memory.indentation =
        std::max(0.0, booked_by_craters(t) ? t.indentation
                                           : t.indentation + unseen + (t.indentation > 0 ? led_out : 0.0));
    memory.end_energy = memory.normal_energy;
    if (t.pulls() && memory.glued) {  // it goes on by its own stretch, as what presses does
      memory.indentation = t.indentation + led_out;
      if (memory.indentation < 0) memory.end_energy = pull_energy(t, memory.indentation);
    }
    if (!own && memory.indentation > 0) {
      contact::NormalLaw law = t.normal_law;
      law.crushed = memory.crushed;
      memory.end_energy = law.stored(memory.indentation);
    }
    memory.stiffness = own ? t.stiffness : t.normal_law.stiffness;
    memory.corner_normal = t.corner_normal;
    memory.lasted = in.leapfrog() ? h : 0;
  }
  const bool unloaded = booked_by_craters(t) && memory.offset > 0;
  if (memory.broken || memory.glued || memory.crushed > 0 || unloaded ||
      memory.normal_energy + memory.shear_energy > 0 || !c.impulse.isZero(0)) {
    if (t.of_part < 1 && !list.empty() && list.back().partner == memory.partner &&
        list.back().feature == memory.feature)
      add_point(memory, list.back());
    else
      list.push_back(memory);
  }
}

/// What a block was born inside is forgotten once the touches of the step found nothing inside any more.
void shrink_births(const IslandContext& in, const Step& step, int block) {
  std::vector<ContactMemory>& list = in.history[static_cast<std::size_t>(block)];
  for (ContactMemory& m : list) {
    if (m.feature != born_inside) continue;
    m.indentation = 0;
    for (const Touch& t : step.touches)
      if (t.b == block && t.a.id() == m.partner) m.indentation = std::max(m.indentation, t.offset - t.at.gap);
  }
  std::erase_if(list,
                [](const ContactMemory& m) { return m.feature == born_inside && !(m.indentation > 0); });
}

/// True if the face of a skin that a spring pressed on is no longer there: its cell eroded, or left with a
/// piece.
bool pressed_on_lost_face(const IslandContext& in, const ContactMemory& m) {
  constexpr double near = 0.25;  // of the edge of a face, which no step takes it
  for (const int s : in.island->structures) {
    if (m.partner != Partner{Partner::Kind::structure, s}.id()) continue;
    const contact::SurfaceIndex& skin = *in.env.structures[static_cast<std::size_t>(s)].index;
    contact::ContactPoint at;
    return !contact::node_surface(skin, m.place, -m.normal, in.scale.length, at) ||
           std::abs(at.gap) > near * face_edge(skin.surface(), at.face_a);
  }
  return false;
}

/// Energy of a block's shear springs that those of the step do not go on with; `rows`: these [J].
double left_sheared(const std::vector<ContactMemory>& memory, std::span<const Touch* const> rows) {
  double left = 0;
  for (const ContactMemory& m : memory) left += m.shear_energy;
  if (left == 0) return 0;
  for (const Touch* t : rows) left -= 0.5 * t->shear_stiffness * t->shear.squaredNorm();
  return std::max(0.0, left);
}

/// Energy of a block's springs that went with the faces that they pressed on; `rows`: those that it has now
/// [J].
double lost_with_faces(const IslandContext& in, const std::vector<ContactMemory>& memory,
                       std::span<const Touch* const> rows) {
  double held = 0, lost = 0;
  for (const ContactMemory& m : memory) held += m.normal_energy + m.shear_energy;
  for (const Touch* t : rows) held -= t->stored;
  if (!(held > 0)) return 0;
  for (const ContactMemory& m : memory) {
    const double energy = m.normal_energy + m.shear_energy;
    const auto goes_on = [&](const Touch* t) {
      return t->a.id() == m.partner && (t->at.key == m.feature || t->goes_on_from == m.feature);
    };
    if (energy > 0 && std::none_of(rows.begin(), rows.end(), goes_on) && pressed_on_lost_face(in, m))
      lost += energy;
  }
  return lost;
}

/// What restitution would have given back at the hard contacts of a step that locates no events, beside what
/// it did: of a contact thrown back at e' u, u its approach, an impulse p has taken p u (1 - e') / 2,
///
///   p u (e^2 - e'^2) / (2 (1 + e'))        [J],      e' = 0 of those that closed within the step
double restitution_lost(const IslandContext& in, const Step& step) {
  double lost = 0;
  for (const Touch& t : step.touches) {
    if (t.row < 0 || t.mode != Mode::end || t.persistent || !rebounds(in, t) || in.deformable_structure(t))
      continue;
    const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
    const double asked = t.law->restitution_at(t.approach), u = -t.approach,
                 got = std::clamp(step.problem.relative(c, step.problem.v)[0] / u, 0.0, asked);
    lost += 0.5 * t.impulse[0] * u * (asked * asked - got * got) / (1 + got);
  }
  return lost;
}

/// The ways that friction remembers.
void go_on_with_ways(const IslandContext& in, const Step& step, double h) {
  if (in.state.slid.empty()) return;
  const auto at_start = [&](int block, const Vec3& x) {  // velocity of a rigid block's point
    const int l = in.local[static_cast<std::size_t>(block)];
    if (l < 0) return Vec3(Vec3::Zero());
    const Body& b = step.bodies[static_cast<std::size_t>(l)];
    return Vec3(b.v0.head<3>() + b.v0.segment<3>(3).cross(x - b.start.c));
  };
  const auto slip_at_start = [&](const Touch& t) {
    Vec3 u = at_start(t.b, t.at.point_b);
    if (t.a.kind == Partner::Kind::block) u -= at_start(t.a.index, t.at.point_b);
    return (u - t.at.normal * t.at.normal.dot(u)).norm();
  };
  std::vector<double> slip_speed(step.bodies.size(), -1.0);
  const auto slides = [&](int block, double speed) {
    if (const int l = in.local[static_cast<std::size_t>(block)]; l >= 0)
      slip_speed[static_cast<std::size_t>(l)] = std::max(slip_speed[static_cast<std::size_t>(l)], speed);
  };
  for (const Touch& t : step.touches) {
    if (t.row < 0 || t.b < 0 || !(t.impulse[0] > 0) || !t.law->changes_with_way()) continue;
    const double speed = 0.5 * (slip_at_start(t) + slip_velocity(in, t, t.at.point_b).norm());
    slides(t.b, speed);
    if (t.a.kind == Partner::Kind::block) slides(t.a.index, speed);
  }
  for (std::size_t l = 0; l < step.bodies.size(); ++l) {
    const int material = in.model.blocks[static_cast<std::size_t>(step.bodies[l].block)].material;
    double recovery = 0;
    for (int m = 0; m < in.env.laws.materials; ++m)
      recovery = std::max(recovery, in.env.laws(m, material).friction_recovery);
    go_on_sliding(in.state, step.bodies[l].block, slip_speed[l], recovery, h);
  }
}

/// The memory of every body and skin anew, from the rows of the step.
void remember_all(const IslandContext& in, Step& step, IslandReport& report, bool shed, double h) {
  std::vector<const Touch*> craters;  // few have any, and a large island has a hundred thousand touches
  std::vector<std::size_t> first(step.bodies.size() + 2, 0);  // into `rows`, per body
  std::vector<const Touch*> rows;
  for (const Touch& t : step.touches) {
    if (!t.craters.empty()) craters.push_back(&t);
    if (t.row >= 0 && t.b >= 0)
      ++first[static_cast<std::size_t>(in.local[static_cast<std::size_t>(t.b)]) + 2];
  }
  for (std::size_t b = 2; b < first.size(); ++b) first[b] += first[b - 1];
  rows.resize(first.back());
  for (const Touch& t : step.touches)
    if (t.row >= 0 && t.b >= 0)
      rows[first[static_cast<std::size_t>(in.local[static_cast<std::size_t>(t.b)]) + 1]++] = &t;
  const auto clear = [](std::vector<ContactMemory>& memory) {
    double held = 0;
    for (const ContactMemory& m : memory) held += m.normal_energy + m.shear_energy;
    std::erase_if(memory, [](const ContactMemory& m) { return m.feature != born_inside && !is_crater(m); });
    return held;
  };
  const auto sort = [](std::vector<ContactMemory>& memory) {
    std::sort(memory.begin(), memory.end(), [](const ContactMemory& x, const ContactMemory& y) {
      return x.partner != y.partner ? x.partner < y.partner : x.feature < y.feature;
    });
  };
  // Springs whose contact is no longer found take their energy along: numerical dissipation, but for
  // what a structure's cells took with them. What their shear springs held slips away.
  std::vector<double> held(step.bodies.size()), torn(step.bodies.size()), slipped(step.bodies.size());
  step.each_body([&](const Body& b) {
    const auto i = static_cast<std::size_t>(&b - step.bodies.data());
    std::vector<ContactMemory>& memory = in.history[static_cast<std::size_t>(b.block)];
    if (shed)
      torn[i] = lost_with_faces(in, memory, std::span(rows).subspan(first[i], first[i + 1] - first[i]));
    if (!in.leapfrog())
      slipped[i] = left_sheared(memory, std::span(rows).subspan(first[i], first[i + 1] - first[i]));
    held[i] = clear(memory);
    keep_craters(craters, b.block, memory);
    shrink_births(in, step, b.block);
    for (std::size_t k = first[i]; k < first[i + 1]; ++k) remember_row(in, step, *rows[k], h, memory);
    sort(memory);
  });
  for (std::size_t i = 0; i < step.bodies.size(); ++i) {
    report.ledger.algorithmic += held[i] - torn[i] - slipped[i];
    report.ledger.damping_work += torn[i];
    report.ledger.friction_work += slipped[i];
  }
  for (const SurfacePair& pair : in.island->surfaces)
    report.ledger.algorithmic += clear(in.surface_history[static_cast<std::size_t>(pair.b)]);
  for (const Touch& t : step.touches)
    if (t.row >= 0 && t.b < 0)
      remember_row(in, step, t, h, in.surface_history[static_cast<std::size_t>(t.b_structure)]);
  for (const SurfacePair& pair : in.island->surfaces)
    sort(in.surface_history[static_cast<std::size_t>(pair.b)]);
}

/// The greatest depth that springs have crushed.
void report_crushing(const IslandContext& in, const Step& step, IslandReport& report) {
  Counters& n = report.counters;
  for (const Touch& t : step.touches) {
    if (t.row < 0 || t.stiffness == 0 || !t.law->crushes()) continue;
    const double depth = t.normal_law.crushed_after(t.indentation);
    n.crush_depth = std::max(n.crush_depth, depth);
    if (!(t.law->yield_thickness > 0) || depth / t.law->yield_thickness <= n.crush_share) continue;
    n.crush_share = depth / t.law->yield_thickness;
    n.crush_law = static_cast<int>(t.law - in.env.laws.law.data());
    if (n.crush_law < 0 || n.crush_law >= static_cast<int>(in.env.laws.law.size()))
      n.crush_law = -1;  // a joint's own
  }
}

}  // namespace

void collect_node_impulses(const IslandContext& in, Step& step) {
  // What each structure node really gets: J^T p over its contacts.
  step.node_impulses.clear();
  for (std::size_t i = 0; i < step.nodes.size(); ++i) {
    const NodeBody& n = step.nodes[i];
    step.node_impulses.push_back(
        {n.structure, n.node, Vec3::Zero(),
         in.env.structures[static_cast<std::size_t>(n.structure)].structure->skin().node_position(n.node)});
  }
  std::vector<std::size_t> first;  // of each skin's nodes
  for (const CondensedSurface& s : step.condensed_surfaces) {
    first.push_back(step.node_impulses.size());
    for (const int node : s.node)
      step.node_impulses.push_back(
          {s.structure, node, Vec3::Zero(),
           in.env.structures[static_cast<std::size_t>(s.structure)].structure->skin().node_position(node)});
  }
  for (const contact::ProblemContact& c : step.problem.contacts)
    for (int k = 0; k < c.terms; ++k) {
      const contact::ContactTerm& term = step.problem.terms[static_cast<std::size_t>(c.first_term + k)];
      const int part = term.body - static_cast<int>(step.bodies.size());
      if (part < 0 || c.impulse.isZero(0)) continue;
      const std::size_t at =
          in.condensed ? first[static_cast<std::size_t>(part)] : static_cast<std::size_t>(part);
      const std::size_t count =
          in.condensed ? step.condensed_surfaces[static_cast<std::size_t>(part)].node.size() : 1;
      for (std::size_t i = 0; i < count; ++i)
        step.node_impulses[at + i].impulse +=
            Eigen::Map<const Mat3>(step.problem.jacobians.data() + static_cast<std::size_t>(term.jacobian) +
                                   9 * i)
                .transpose() *
            c.impulse;
    }
  for (const Touch& t : step.touches)
    for (const HeldShare& s : step.held) {
      if (t.row < 0 || s.contact != t.row || t.impulse.isZero(0)) continue;
      const Structure& structure = *in.env.structures[static_cast<std::size_t>(s.structure)].structure;
      const Vec3 p = t.frame * t.impulse;
      step.node_impulses.push_back({s.structure, s.node, s.weight * p + s.tilt.dot(p) * t.normal,
                                    structure.skin().node_position(s.node)});
    }
}

void commit_step(const IslandContext& in, Step& step, IslandReport& report, bool shed, double t_end,
                 double h) {
  report.ledger += step.pending;
  report.counters.restitution_lost += restitution_lost(in, step);
  report_crushing(in, step, report);
  go_on_with_ways(in, step, h);
  remember_all(in, step, report, shed, h);
  for (const Touch& t : step.touches)
    if (t.row >= 0 && t.stiffness > 0) report.ledger.algorithmic -= t.stored;
  AuditSums& audit = report.audit;
  double blocks_force = 0, force_scale = 0;
  Vec3 on_structures = Vec3::Zero(), on_blocks = Vec3::Zero(), of_ground = Vec3::Zero(),
       moment = Vec3::Zero();
  double moment_scale = 0;
  for (const Touch& t : step.touches) {
    if (t.row < 0 || (t.b >= 0 && t.a.kind != Partner::Kind::structure)) continue;
    const contact::ProblemContact& c = step.problem.contacts[static_cast<std::size_t>(t.row)];
    const Vec3 p = t.frame * c.impulse;
    if (t.b < 0) {  // between structures what one gets the other gives: its round-off is that of its own size
      if (t.a.kind != Partner::Kind::structure) {
        of_ground += p;
        moment -= t.at.point_b.cross(p);
      } else if (!p.isZero(0)) {
        audit.meet(t.b_structure, t_end, p);
        audit.meet(t.a.index, t_end, -p);
      }
      force_scale += p.norm();
      moment_scale += (t.acts_at.norm() + in.scale.length) * p.norm();
      continue;
    }
    if (!c.impulse.isZero(0)) {
      StructureContact row;
      row.time = t_end;
      row.dt = h;
      row.block = t.b;
      row.structure = t.a.index;
      row.point = t.at.point_a;
      row.normal = t.at.normal;
      row.force = -p / h;
      row.area = t.at.area;
      row.arrival = arrival_of(in.model, step, t.b);
      report.rows.push_back(row);
      // Both sides as they were really applied: the block through its point, the structure through its nodes.
      on_blocks += p;
      blocks_force += p.norm();
      force_scale += p.norm();
      moment += t.acts_at.cross(p);
      moment_scale += (t.acts_at.norm() + in.scale.length) * p.norm();
    }
  }
  for (const auto& n : step.node_impulses) {
    on_structures += n.impulse;
    moment += n.position.cross(n.impulse);
  }
  if (blocks_force > 0 && !step.node_impulses.empty()) {
    audit.worst_force =
        std::max(audit.worst_force, (on_blocks + on_structures - of_ground).norm() / force_scale);
    if (moment_scale > 0) audit.worst_moment = std::max(audit.worst_moment, moment.norm() / moment_scale);
    audit.impulse_on_structure += on_structures - of_ground;
    audit.impulse_on_blocks += on_blocks;
  }
}

}  // namespace talus::coupling
