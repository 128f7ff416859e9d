/// Plain sums that an island reports.
#pragma once
#include <algorithm>
#include <vector>

#include "core/types.hpp"

namespace talus::coupling {

struct Counters {
  long steps = 0, rejected = 0, contacts = 0, newton = 0, sweeps = 0, outer = 0, impacts = 0, projections = 0;
  long newton_method = 0, interior_point = 0, above_tolerance = 0, halved = 0, convex = 0;
  long flights = 0, structure_steps = 0,
       condensed_steps = 0;  // steps of structures while blocks are at them: explicit, condensed
  double worst_residual = 0, worst_penetration = 0, last_step = 0;
  // Per step of the ledger, none of it hidden in another column [J]: numerical energy gain, in all and
  // in the worst step, and dissipation that was undone.
  double gained = 0, worst_gain = 0, undone = 0;
  double crush_depth = 0, crush_share = 0;  // greatest depth crushed [m], and over the thickness of its layer
  int crush_law = -1;  // that of the latter, by its place in ContactLaws; -1: no layer has a thickness
  long reduced = 0;    // impacts whose restitution was lowered to the largest that makes no energy
  double restitution_lost = 0;  // what it would have given back at contacts that closed within a step [J]
  Counters& operator+=(const Counters& o) {
    steps += o.steps;
    rejected += o.rejected;
    contacts += o.contacts;
    newton += o.newton;
    sweeps += o.sweeps;
    outer += o.outer;
    impacts += o.impacts;
    projections += o.projections;
    newton_method += o.newton_method;
    interior_point += o.interior_point;
    above_tolerance += o.above_tolerance;
    halved += o.halved;
    convex += o.convex;
    flights += o.flights;
    structure_steps += o.structure_steps;
    condensed_steps += o.condensed_steps;
    worst_residual = std::max(worst_residual, o.worst_residual);
    worst_penetration = std::max(worst_penetration, o.worst_penetration);
    last_step = o.last_step;
    gained += o.gained;
    undone += o.undone;
    reduced += o.reduced;
    restitution_lost += o.restitution_lost;
    worst_gain = std::max(worst_gain, o.worst_gain);
    crush_depth = std::max(crush_depth, o.crush_depth);
    if (o.crush_share > crush_share) crush_share = o.crush_share, crush_law = o.crush_law;
    return *this;
  }
};

/// One contact on a structure over one coupled step; force acts on the structure, mean over the step [N].
/// A block as it came to a contact: before the step or the impulse that is reported.
struct Arrival {
  bool known = false;
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();  // [m/s], [rad/s]
  double translational = 0, rotational = 0;  // kinetic energy, of the strain rate with the latter [J]
};

struct StructureContact {
  double time = 0, dt = 0;
  int block = 0, structure = 0;
  Vec3 point = Vec3::Zero(), force = Vec3::Zero(), normal = Vec3::Zero();
  double area = 0;
  Arrival arrival = {};
};

/// Sums over both sides of the interface, from the impulses that were really applied.
/// What a structure got from others that it can touch.
struct Met {
  double first = -1;            // when it first did; < 0: never [s]
  Vec3 impulse = Vec3::Zero();  // of all contacts with them [N s]
};

struct AuditSums {
  double worst_force = 0, worst_moment = 0;                                    // relative imbalance of a step
  Vec3 impulse_on_structure = Vec3::Zero(), impulse_on_blocks = Vec3::Zero();  // [N s]
  double work_on_blocks = 0, work_on_structure = 0;                            // [J]
  std::vector<Met> met;  // by structure; empty: none touched another

  void meet(int structure, double time, const Vec3& impulse) {
    const auto q = static_cast<std::size_t>(structure);
    if (met.size() <= q) met.resize(q + 1);
    if (met[q].first < 0) met[q].first = time;
    met[q].impulse += impulse;
  }
};

/// Sums over the whole run.
struct RunSums {
  Counters counters;
  AuditSums audit;
  long asleep_skipped = 0, structure_asleep = 0;
};

}  // namespace talus::coupling
