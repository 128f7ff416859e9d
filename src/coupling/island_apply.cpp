// From impulses to positions, momenta and the ledger.
#include <algorithm>
#include <cmath>

#include "coupling/island_body.hpp"
#include "coupling/touch_bed.hpp"

namespace talus::coupling {
namespace {

Vec3 rotation_vector(const Quat& q) {
  const double w = q.w() < 0 ? -q.w() : q.w();
  const Vec3 v = q.w() < 0 ? Vec3(-q.vec()) : Vec3(q.vec());
  const double s = v.norm();
  if (s < 1e-12) return 2 * v;
  return (2 * std::atan2(s, w) / s) * v;
}

/// Mean generalised velocity whose product with an impulse is the kinetic energy it brings.
Vec12 mean_velocity(const Vec12& v0, const dda::FreeFlow& free, const Vec12& v) {
  Vec12 m = 0.5 * (v0 + v);
  m.segment<3>(3) = 0.5 * (free.spin + v.segment<3>(3));
  return m;
}

}  // namespace

void IslandStepper::linearise_at(Body& b, const Quat& q_end) {
  b.turn = rotation_vector(q_end * b.q0.conjugate());
  b.mid_c = 0.5 * (b.start.c + b.ref.c);
  if (b.turn.isZero(0)) {
    b.half_turn.setIdentity();
    b.full_turn.setIdentity();
  } else {
    b.half_turn = dda::rotation_by(0.5 * b.turn).toRotationMatrix();
    b.full_turn = dda::rotation_by(b.turn).toRotationMatrix();
  }
  b.carry = b.ndof == 12 ? Mat3(b.ref.F * b.start.F.inverse()) : b.full_turn;
}

void IslandStepper::confine(const Touch& t, const contact::ProblemContact& c) {
  // Takes from the free directions of both blocks what this spring holds: its normal, and all where a shear spring sticks.
  const bool slides = t.impulse.tail<2>().norm() >= (c.friction * t.impulse[0] + c.cohesion) * (1 - 1e-9);
  const auto hold = [&](int block) {
    const int l = local_[static_cast<std::size_t>(block)];
    if (l < 0) return;
    Mat3& along = bodies_[static_cast<std::size_t>(l)].along;
    if (t.shear_stiffness > 0 && !slides) {
      along.setZero();
      return;
    }
    const Vec3 n = along * t.normal;
    if (n.squaredNorm() > 1e-12) along -= n * n.transpose() / n.squaredNorm();
    else if (along.trace() < 0.5) along.setZero();
  };
  hold(t.b);
  if (t.a.kind == Partner::Kind::block) hold(t.a.index);
}

void IslandStepper::apply(double h) {
  if (h > 0) found_for_ = -1;   // an impulse leaves the positions
  using Rows = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>>;
  for (Body& b : bodies_) {
    b.impulse.setZero();
    b.shift.setZero();
    b.along = Mat3::Identity();
  }
  // With a hard onset in the step all its impulses act from the start: x + h v^+. Steps of closed touches alone keep the trapezoid, and
  // springs their own rule.
  bool onset = false, sprung = false;
  for (const Touch& t : touches_) {
    if (t.row < 0) continue;
    sprung = sprung || t.stiffness > 0;
    onset = onset || (t.mode == Mode::end && problem_.contacts[static_cast<std::size_t>(t.row)].impulse[0] > 0);
  }
  onset = onset && !sprung && h > 0 && island_->structures.empty();
  for (Touch& t : touches_) {
    if (t.row < 0) continue;
    const contact::ProblemContact& c = problem_.contacts[static_cast<std::size_t>(t.row)];
    t.impulse = c.impulse;
    if (onset) t.theta = 1;
    if (t.mode == Mode::spring_end && t.b >= 0 && t.impulse[0] > 0) confine(t, c);
    if (t.stiffness > 0 && h > 0) t.indentation = indentation_at_end(t, h);
    for (int k = 0; k < c.terms; ++k) {
      const contact::ContactTerm& term = problem_.terms[static_cast<std::size_t>(c.first_term + k)];
      if (term.body >= static_cast<int>(bodies_.size())) continue;
      Body& b = bodies_[static_cast<std::size_t>(term.body)];
      Vec12 g = Vec12::Zero();
      g.head(b.ndof) = Rows(problem_.jacobians.data() + term.jacobian, 3, b.ndof).transpose() * c.impulse;
      b.impulse += g;
      b.shift += (b.end_rule ? 1.0 : condensed_ && deformable_structure(t) ? 0.5 : t.theta) * g;
    }
  }
  each_rolling(touches_, problem_, [&](const Touch&, const contact::ProblemContact& c) {
    for (int k = 0; k < c.terms; ++k) {
      const contact::ContactTerm& term = problem_.terms[static_cast<std::size_t>(c.first_term + k)];
      Body& b = bodies_[static_cast<std::size_t>(term.body)];
      Vec12 g = Vec12::Zero();
      g.head(b.ndof) = Rows(problem_.jacobians.data() + term.jacobian, 3, b.ndof).transpose() * c.impulse;
      b.impulse += g;
      b.shift += (b.end_rule ? 1.0 : 0.5) * g;
    }
  });
  for (Body& b : bodies_) {
    const auto k = static_cast<std::size_t>(b.block);
    const dda::FreeFlow& f = b.free;
    b.v_solved = f.velocity;
    state_.c[k] = f.pose.c;
    state_.q[k] = f.q;
    state_.eps[k] = f.eps;
    if (!b.impulse.isZero(0)) {
      b.v_solved.head(b.ndof) += f.inverse.topLeftCorner(b.ndof, b.ndof) * b.impulse.head(b.ndof);
      Vec12 d = Vec12::Zero();
      d.head(b.ndof) = h * (f.inverse.topLeftCorner(b.ndof, b.ndof) * b.shift.head(b.ndof));
      state_.c[k] += d.head<3>();
      if (onset) state_.c[k] += 0.5 * h * h * model_.gravity;   // of free flow's own parabola only the velocity counts
      if (!d.segment<3>(3).isZero(0)) state_.q[k] = (dda::rotation_by(d.segment<3>(3)) * f.q).normalized();
      if (b.ndof == 12) state_.eps[k] += d.tail<6>();
    }
    // Along the contact faces nothing is stiff: there the path keeps the trapezoid, exact in steady sliding.
    if (b.end_rule) state_.c[k] -= 0.5 * h * (b.along * (b.v_solved.head<3>() - b.v0.head<3>()));
    state_.v[k] = b.v_solved.head<3>();
    state_.eps_rate[k] = b.ndof == 12 ? Vec6(b.v_solved.tail<6>()) : Vec6(Vec6::Zero());
    // Angular momentum exactly: w follows from it at the orientation reached.
    if (h == 0 || (b.impulse.segment<3>(3).isZero(0) && f.q.coeffs() == state_.q[k].coeffs())) {
      state_.w[k] = b.v_solved.segment<3>(3);
    } else {
      const Vec3 momentum = b.momentum0 + b.impulse.segment<3>(3);
      const Mat3 rotation = state_.rotation(b.block);
      const dda::Model::Block& block = model_.blocks[k];
      if (b.ndof == 6) {
        state_.w[k] = rotation * block.inertia.inverse() * (rotation.transpose() * momentum);
      } else {
        const Mat12 mass = dda::mass_matrix(block, dda::pose(state_, b.block), rotation);
        state_.w[k] = mass.block<3, 3>(3, 3).inverse() * (momentum - mass.block<3, 6>(3, 6) * state_.eps_rate[k]);
      }
    }
  }
}

void IslandStepper::book(double h) {
  using Rows = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>>;
  double onset = 0;   // what hard contacts and dashpots at structures take
  for (const Touch& t : touches_) {
    if (t.row < 0) continue;
    const contact::ProblemContact& c = problem_.contacts[static_cast<std::size_t>(t.row)];
    Vec3 blocks = Vec3::Zero(), structure = Vec3::Zero(), last = Vec3::Zero();   // mean relative velocity, split by side; that at the end
    for (int k = 0; k < c.terms; ++k) {
      const contact::ContactTerm& term = problem_.terms[static_cast<std::size_t>(c.first_term + k)];
      const int n = problem_.bodies[static_cast<std::size_t>(term.body)].ndof;
      const Rows j(problem_.jacobians.data() + term.jacobian, 3, n);
      if (term.body < static_cast<int>(bodies_.size())) {
        const Body& b = bodies_[static_cast<std::size_t>(term.body)];
        blocks += j * mean_velocity(b.v0, b.free, b.v_solved).head(n);
        last += j * b.v_solved.head(n);
      } else {
        // The leapfrog's work is impulse times the mean of the half-step velocities before and after.
        const int offset = problem_.bodies[static_cast<std::size_t>(term.body)].offset;
        const Eigen::Map<const VecX> end(problem_.v.data() + offset, n);
        const std::size_t part = static_cast<std::size_t>(term.body) - bodies_.size();
        last += j * end;
        if (condensed_) structure += j * (0.5 * (skins_[part].v_before + end));
        else structure += j * (0.5 * (nodes_[part].v_before + end));
      }
    }
    const Vec3 mean = blocks + structure;
    const double normal_work = c.impulse[0] * mean[0];
    const double slip_work = c.impulse.tail<2>().dot(mean.tail<2>());
    if (deformable_structure(t)) {
      pending_.blocks_contact_work += c.impulse.dot(blocks);
      pending_.structure_contact_work += c.impulse.dot(structure);
    }
    const bool sprung = t.stiffness > 0 && h > 0;
    if (!sprung) {
      pending_.friction_work -= slip_work;
      if (t.mode == Mode::closed)
        pending_.algorithmic -= normal_work;
      else
        pending_.damping_work -= normal_work;   // onset: what an impact takes
      if (t.mode != Mode::closed && h > 0 && deformable_structure(t)) onset -= normal_work;
      continue;
    }
    // Springs: what they store; the rest of the normal work is the rule's own loss, of the tangential friction.
    const double stretch = t.shear_stiffness > 0 ? 0.5 * t.shear_stiffness * (shear_at_end(t, h).squaredNorm() - t.shear.squaredNorm()) : 0;
    if (leapfrog(t) && t.shear_stiffness == 0) {
      // Friction takes its force times the slip at the end; that the leapfrog's work is with the mean velocity is the scheme's.
      const double slipped = std::max(0.0, -c.impulse.tail<2>().dot(last.tail<2>()));
      pending_.friction_work += slipped;
      pending_.algorithmic -= slip_work + slipped;
    } else if (leapfrog(t)) {
      const bool slides = c.impulse.tail<2>().norm() >= (c.friction * c.impulse[0] + c.cohesion) * (1 - 1e-9);
      const Vec3 end = shear_at_end(t, h), moved = t.shear + h * (t.frame.rightCols<2>() * last.tail<2>());
      const double slipped = slides ? std::max(0.0, t.shear_stiffness * end.dot(moved - end)) : 0.0;
      pending_.friction_work += slipped;
      pending_.algorithmic -= slip_work + stretch + slipped;
    } else {
      pending_.friction_work -= slip_work + stretch;
    }
    const double crushed = t.mode == Mode::spring_secant ? t.normal_law.crushing_by_half(-t.at.gap + h * t.approach, t.indentation) : t.normal_law.crushing(t.indentation);
    pending_.damping_work += crushed;
    // With a dashpot the loss is mostly its own. From what the ledger counts as stored: nothing is lost with a changed feature.
    const double lost = -(normal_work + (spring_energy_at_end(t, h) - t.stored) - stretch + crushed);
    (t.dashpot > 0 ? pending_.damping_work : pending_.algorithmic) += lost;
    if (t.dashpot > 0 && leapfrog(t)) onset += std::max(0.0, lost);
  }
  each_rolling(touches_, problem_, [&](const Touch&, const contact::ProblemContact& c) {
    for (int k = 0; k < c.terms; ++k) {
      const contact::ContactTerm& term = problem_.terms[static_cast<std::size_t>(c.first_term + k)];
      const Body& b = bodies_[static_cast<std::size_t>(term.body)];
      const Rows j(problem_.jacobians.data() + term.jacobian, 3, b.ndof);
      pending_.friction_work -= c.impulse.dot(j * mean_velocity(b.v0, b.free, b.v_solved).head(b.ndof));
    }
  });
  for (const Body& b : bodies_) {
    if (b.impulse.isZero(0) && !b.end_rule) continue;
    const auto k = static_cast<std::size_t>(b.block);
    const dda::Model::Block& block = model_.blocks[k];
    // Positions that left the trapezoid (theta = 1) met gravity and the block's own stiffness elsewhere than the velocities did.
    const Vec3 trapezoid = b.start.c + 0.5 * h * (b.v0.head<3>() + b.v_solved.head<3>());
    pending_.algorithmic += block.mass * model_.gravity.dot(state_.c[k] - trapezoid);
    if (b.ndof == 12 && b.end_rule) {
      // The velocities met the stress at the end all along the step.
      const Vec6 eps = b.eps0 + 0.5 * h * (b.v0.tail<6>() + b.v_solved.tail<6>());
      const Mat6 stiffness = block.volume * dda::elastic_matrix(block.young, block.poisson);
      const double stored = 0.5 * state_.eps[k].dot(stiffness * state_.eps[k]);
      pending_.algorithmic += (eps - b.eps0).dot(stiffness * state_.eps[k]) - (stored - 0.5 * b.eps0.dot(stiffness * b.eps0));
    }
  }
  for (const Body& b : bodies_) {
    if (b.ndof == 6) {
      // The momentum is exact at the orientation reached, where the inertia is another than the one that the impulse met. A rigid impulse of a
      // straining block turns its strain rate as well.
      const bool changes = h > 0 || model_.blocks[static_cast<std::size_t>(b.block)].deformable;
      if (changes && !b.impulse.isZero(0)) pending_.algorithmic -= internal_energy(b.block) - b.internal0 - b.impulse.segment<3>(3).dot(mean_velocity(b.v0, b.free, b.v_solved).segment<3>(3));
      continue;
    }
    const dda::Model::Block& block = model_.blocks[static_cast<std::size_t>(b.block)];
    const Vec6 rate = 0.5 * (b.v0.tail<6>() + b.v_solved.tail<6>());
    const Vec6 viscous = b.end_rule ? Vec6(b.v_solved.tail<6>()) : rate;   // the rate that made the viscous stress
    const double damped = h * block.strain_damping * block.volume * rate.dot(dda::elastic_matrix(block.young, block.poisson) * viscous);
    pending_.damping_work += damped;
    // Turning changes the inertia that straining meets and the other way round; the trapezoid of the strain keeps their energy to order 2.
    if (!b.end_rule && h > 0)
      pending_.algorithmic -= internal_energy(b.block) - b.internal0 + damped - b.impulse.tail<9>().dot(mean_velocity(b.v0, b.free, b.v_solved).tail<9>());
  }
  // A hard contact (or a stiff dashpot) at a structure acts at the end of the step, not along it: its work with the mean velocities counts as lost what the block's
  // own energy says was not, so that only the sum of both is known.
  const double overcounted = std::clamp(-pending_.algorithmic, 0.0, std::max(onset, 0.0));
  pending_.damping_work -= overcounted;
  pending_.algorithmic += overcounted;
}

double IslandStepper::internal_energy(int block) const {
  const dda::BlockEnergy e = dda::energy(model_, state_, block);
  return e.rotational + e.straining + e.strain_energy;
}

double IslandStepper::indentation_at_end(const Touch& t, double h) const {
  const contact::ProblemContact& c = problem_.contacts[static_cast<std::size_t>(t.row)];
  double u = 0;   // row 0 of J v
  for (int k = 0; k < c.terms; ++k) {
    const contact::ContactTerm& term = problem_.terms[static_cast<std::size_t>(c.first_term + k)];
    const contact::ProblemBody& body = problem_.bodies[static_cast<std::size_t>(term.body)];
    for (int i = 0; i < body.ndof; ++i) u += problem_.jacobians[static_cast<std::size_t>(term.jacobian + 3 * i)] * problem_.v[static_cast<std::size_t>(body.offset + i)];
  }
  return -(t.gap_ref + t.theta * h * (u - t.u_ref));
}

void IslandStepper::collect_node_impulses() {
  // What each structure node really gets: J^T p over its contacts.
  node_impulses_.clear();
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const NodeBody& n = nodes_[i];
    node_impulses_.push_back({n.structure, n.node, Vec3::Zero(), env_.structures[static_cast<std::size_t>(n.structure)].structure->node_position(n.node)});
  }
  std::vector<std::size_t> first;   // of each skin's nodes
  for (const Skin& s : skins_) {
    first.push_back(node_impulses_.size());
    for (const int node : s.node)
      node_impulses_.push_back({s.structure, node, Vec3::Zero(), env_.structures[static_cast<std::size_t>(s.structure)].structure->node_position(node)});
  }
  for (const contact::ProblemContact& c : problem_.contacts)
    for (int k = 0; k < c.terms; ++k) {
      const contact::ContactTerm& term = problem_.terms[static_cast<std::size_t>(c.first_term + k)];
      const int part = term.body - static_cast<int>(bodies_.size());
      if (part < 0 || c.impulse.isZero(0)) continue;
      const std::size_t at = condensed_ ? first[static_cast<std::size_t>(part)] : static_cast<std::size_t>(part);
      const std::size_t count = condensed_ ? skins_[static_cast<std::size_t>(part)].node.size() : 1;
      for (std::size_t i = 0; i < count; ++i)
        node_impulses_[at + i].impulse += Eigen::Map<const Mat3>(problem_.jacobians.data() + static_cast<std::size_t>(term.jacobian) + 9 * i).transpose() * c.impulse;
    }
  for (const Touch& t : touches_)
    for (const HeldShare& s : held_) {
      if (t.row < 0 || s.contact != t.row || t.impulse.isZero(0)) continue;
      const Structure& structure = *env_.structures[static_cast<std::size_t>(s.structure)].structure;
      node_impulses_.push_back({s.structure, s.node, s.weight * (t.frame * t.impulse), structure.node_position(s.node)});
    }
}

void IslandStepper::remember(const Touch& t, double h, std::vector<ContactMemory>& list) const {
  const contact::ProblemContact& c = problem_.contacts[static_cast<std::size_t>(t.row)];
  const Vec3 p = t.frame * c.impulse;
  ContactMemory memory;
  memory.partner = t.a.id();
  memory.feature = t.at.key;
  memory.force = p / h;
  memory.broken = t.broken;
  if (c.cohesion > 0 || c.tension > 0) {
    const bool opened = c.impulse.isZero(0);
    const bool slid = c.impulse.tail<2>().norm() >= (c.friction * c.impulse[0] + c.cohesion) * (1 - 1e-9);
    memory.broken = memory.broken || opened || slid;
  }
  if (t.shear_stiffness > 0) {
    memory.shear = shear_at_end(t, h);
    memory.shear_energy = 0.5 * t.shear_stiffness * memory.shear.squaredNorm();
  }
  if (t.stiffness > 0) {
    memory.normal_energy = normal_energy_at_end(t);
    memory.crushed = std::max(0.0, t.normal_law.crushed_after(t.indentation));
    memory.place = t.at.point_a;
    memory.normal = t.at.normal;
    // Deeper than the geometry says it comes back slowly, at its own cost; the other way round it waits for the contact to open, or to rest.
    const bool own = deformable_structure(t);
    const double led_out = std::clamp(t.offset, -lead_out(h), own || t.energetic ? 0.0 : lead_out(h));
    memory.indentation = std::max(0.0, t.indentation + (t.indentation > 0 ? led_out : 0.0));
    memory.offset = t.offset - led_out;
    memory.stiffness = own ? t.stiffness : t.normal_law.stiffness;
    memory.growth = t.normal_law.growth;
  }
  reopen_crater(memory, list);
  if (memory.broken || memory.crushed > 0 || memory.normal_energy + memory.shear_energy > 0 || !c.impulse.isZero(0)) list.push_back(memory);
}

/// What a block was born inside is forgotten once the touches of the step found nothing inside any more.
void IslandStepper::shrink_births(int block) {
  std::vector<ContactMemory>& list = history_[static_cast<std::size_t>(block)];
  for (ContactMemory& m : list) {
    double deepest = 0;
    for (const Touch& t : touches_)
      if (t.b == block && t.a.id() == m.partner) deepest = std::max(deepest, t.offset - t.at.gap);
    if (m.feature == born_inside) m.indentation = deepest;
  }
  std::erase_if(list, [](const ContactMemory& m) { return m.feature == born_inside && !(m.indentation > 0); });
}

void IslandStepper::commit(double t_end, double h) {
  report_.ledger += pending_;
  std::vector<std::vector<ContactMemory>*> memories;
  for (const Body& b : bodies_) memories.push_back(&history_[static_cast<std::size_t>(b.block)]);
  for (const SurfacePair& pair : island_->surfaces) memories.push_back(&surface_history_[static_cast<std::size_t>(pair.b)]);
  // Springs whose contact is no longer found take their energy along: booked as the scheme's loss.
  for (auto* memory : memories) {
    for (const ContactMemory& m : *memory) report_.ledger.algorithmic += m.normal_energy + m.shear_energy;
    std::erase_if(*memory, [](const ContactMemory& m) { return m.feature != born_inside && !is_crater(m); });
    for (ContactMemory& m : *memory)
      if (is_crater(m)) m.force = m.shear = Vec3::Zero(), m.normal_energy = m.shear_energy = m.stiffness = m.indentation = 0;
  }
  for (const Body& b : bodies_) shrink_births(b.block);
  for (const Touch& t : touches_)
    if (t.row >= 0 && t.stiffness > 0) report_.ledger.algorithmic -= t.stored;
  AuditSums& audit = report_.audit;
  double blocks_force = 0;
  Vec3 on_structures = Vec3::Zero(), on_blocks = Vec3::Zero(), moment = Vec3::Zero();
  double moment_scale = 0;
  for (const Touch& t : touches_) {
    if (t.row < 0) continue;
    const contact::ProblemContact& c = problem_.contacts[static_cast<std::size_t>(t.row)];
    const Vec3 p = t.frame * c.impulse;
    remember(t, h, t.b >= 0 ? history_[static_cast<std::size_t>(t.b)] : surface_history_[static_cast<std::size_t>(t.b_structure)]);
    if (t.b < 0) continue;   // between structures: what one gets the other gives
    if (t.a.kind == Partner::Kind::structure && !c.impulse.isZero(0)) {
      StructureContact row;
      row.time = t_end;
      row.dt = h;
      row.block = t.b;
      row.structure = t.a.index;
      row.point = t.at.point_a;
      row.normal = t.at.normal;
      row.force = -p / h;
      row.area = t.at.area;
      report_.rows.push_back(row);
      // Both sides as they were really applied: the block through its point, the structure through its nodes.
      on_blocks += p;
      blocks_force += p.norm();
      moment += t.acts_at.cross(p);
      moment_scale += (t.acts_at.norm() + length_) * p.norm();
    }
  }
  for (StructureContact& row : impacts_on_skin_) {   // as the mean over the step that they began
    row.time = t_end;
    row.dt = h;
    row.force /= h;
    report_.rows.push_back(row);
  }
  impacts_on_skin_.clear();
  for (const auto& n : node_impulses_) {
    on_structures += n.impulse;
    moment += n.position.cross(n.impulse);
  }
  if (blocks_force > 0 && !node_impulses_.empty()) {
    audit.worst_force = std::max(audit.worst_force, (on_blocks + on_structures).norm() / blocks_force);
    audit.worst_moment = std::max(audit.worst_moment, moment.norm() / std::max(moment_scale, 1e-300));
    audit.impulse_on_structure += on_structures;
    audit.impulse_on_blocks += on_blocks;
  }
  for (auto* memory : memories)
    std::sort(memory->begin(), memory->end(), [](const ContactMemory& x, const ContactMemory& y) {
      return x.partner != y.partner ? x.partner < y.partner : x.feature < y.feature;
    });
}

double IslandStepper::project(double h) {
  // min 1/2 d^T M d  subject to  g + J d >= 0 on every hard touch near enough to matter; no friction, no velocity.
  double thinnest = length_, far = 0;
  for (const Body& b : bodies_) {
    const auto k = static_cast<std::size_t>(b.block);
    thinnest = std::min(thinnest, 2 * model_.blocks[k].shape->inradius);
    far = std::max(far, state_.c[k].cwiseAbs().maxCoeff() + model_.blocks[k].shape->radius);
  }
  const double tolerance = std::max(5e-10 * thinnest, 5e-16 * far);
  const auto deepest_touch = [&] {
    double deepest = 0;
    for (const Touch& t : touches_)
      if (t.stiffness == 0 && !deformable_structure(t)) deepest = std::max(deepest, -t.at.gap);
    return deepest;
  };
  find(h);
  keep_late_overlaps();
  double deepest = deepest_touch();
  if (deepest <= tolerance) return deepest;
  std::vector<double> carried(island_->pairs.size(), 0.0);
  std::vector<Pose> before, last;
  for (const Body& b : bodies_) before.push_back(dda::pose(state_, b.block));
  for (int pass = 0; pass < 24 && deepest > tolerance; ++pass) {
    ++report_.counters.projections;
    begin_step(0, true);
    problem_.clear();
    nodes_.clear();
    held_.clear();
    for (Touch& t : touches_) {
      if (t.stiffness > 0 || deformable_structure(t) || t.at.gap > 4 * deepest + 1e-3 * length_) continue;
      t.mode = Mode::idle;
      add_row(t, 1, true);
      contact::ProblemContact& c = problem_.contacts.back();
      c.friction = 0;
      c.cohesion = c.tension = 0;
      c.bias = Vec3(t.at.gap - (t.at.gap < -tolerance ? 0.25 * tolerance : 0), 0, 0);
      c.compliance.setZero();
      c.impulse.setZero();
    }
    finish_bodies();
    std::fill(problem_.v_hat.begin(), problem_.v_hat.end(), 0.0);
    contact::SolveSettings settings;
    settings.velocity_scale = deepest;
    settings.tolerance = std::clamp(0.2 * tolerance / deepest, 1e-3, 0.2);   // the rows are no closer to the blocks' own gaps
    settings.sufficient = 0.3;   // of blocks jammed in each other: the next pass goes on from there
    settings.exact_coulomb = false;
    const contact::SolveReport r = solver_.solve(problem_, settings);
    report_.counters.newton += r.newton;
    if (!std::all_of(problem_.v.begin(), problem_.v.end(), [](double d) { return std::isfinite(d); })) break;   // nothing to go by
    last.clear();
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Body& b = bodies_[i];
      last.push_back(b.start);
      const Eigen::Map<const VecX> d(problem_.v.data() + problem_.bodies[i].offset, b.ndof);
      if (d.isZero(0)) continue;
      const auto k = static_cast<std::size_t>(b.block);
      const Vec3 momentum = dda::spin_momentum(model_.blocks[k], state_, b.block);
      const double turning = internal_energy(b.block);
      state_.c[k] += d.head<3>();
      state_.q[k] = (dda::rotation_by(d.segment<3>(3)) * state_.q[k]).normalized();
      report_.ledger.algorithmic += model_.blocks[k].mass * model_.gravity.dot(d.head<3>());
      if (!model_.blocks[k].deformable) {
        const Mat3 rotation = state_.rotation(b.block);
        state_.w[k] = rotation * (model_.blocks[k].inertia.inverse() * (rotation.transpose() * momentum));
      }
      report_.ledger.algorithmic -= internal_energy(b.block) - turning;
    }
    find_moved(last, carried);
    deepest = deepest_touch();
  }
  carry_at_structures(before);
  return deepest;
}

}  // namespace talus::coupling
