// The onset of hard contacts in event-driven islands: an impulse of no duration on all closed touches.
#include "coupling/events/impact_stage.hpp"

#include <algorithm>
#include <cmath>

#include "contact/tolerances.hpp"
#include "coupling/events/approach.hpp"
#include "coupling/events/structure_impacts.hpp"
#include "coupling/rows/assembly.hpp"
#include "coupling/rows/contact_rows.hpp"
#include "coupling/rows/rolling.hpp"
#include "coupling/step/bodies.hpp"
#include "coupling/step/works.hpp"

namespace talus::coupling {
namespace {

constexpr double impact_round_off =
    1e-10;  // of the energy: impacts are solved to some 1e-12 of the velocities, and e = 1 is no gain

/// True if one of the two is a block that strains.
bool strains(const dda::Model& model, const Touch& t) {
  const auto deformable = [&](int block) { return model.blocks[static_cast<std::size_t>(block)].deformable; };
  return (t.b >= 0 && deformable(t.b)) || (t.a.kind == Partner::Kind::block && deformable(t.a.index));
}

}  // namespace

ImpactStage::ImpactStage(const IslandContext& in, Step& step, IslandReport& report, RowAssembly& assembly,
                         ProblemSolver& solver, BodyUpdate& update, StructureImpacts& on_structures)
    : in_(in),
      step_(step),
      report_(report),
      assembly_(assembly),
      solver_(solver),
      update_(update),
      on_structures_(on_structures) {}

ImpactStage::Restitution ImpactStage::impact_rows(const Restitution& part) {
  assembly_.clear();
  Restitution asked;
  for (Touch& t : step_.touches) {
    t.row = -1;
    if (!meets_hard(in_, t)) continue;
    t.mode = Mode::end;
    assembly_.add_row(t, 1, true);
    contact::ProblemContact& c = step_.problem.contacts.back();
    c.bias.setZero();
    c.compliance.setZero();
    c.cohesion = c.tension = 0;
    c.impulse.setZero();
    const double approach = std::min(strains(in_.model, t) ? t.u_ref : t.approach, 0.0);
    if (spring_presses(in_, t)) {
      c.bias[0] = -approach;  // it goes on: a blow elsewhere presses it no faster
    } else if (t.law->restitution && t.approach < -std::max(slow_speed(in_, t), impact_speed(in_, t))) {
      const double restitution = t.law->restitution_at(approach);
      c.bias[0] = part.normal * restitution * approach;
      asked.normal = std::max(asked.normal, restitution);
    }
    if (t.law->restitution_tangential) {
      const Vec3 slip = t.frame.transpose() * (point_velocity(in_.state, t.b, t.at.point_b) -
                                               partner_velocity(in_.state, in_.env, t));
      c.bias.tail<2>() = part.along * *t.law->restitution_tangential * slip.tail<2>();
      asked.along = std::max(asked.along, std::abs(*t.law->restitution_tangential));
    }
  }
  add_rolling_rows(in_, step_);
  double mass = 0;
  for (const Body& b : step_.bodies) mass += in_.model.blocks[static_cast<std::size_t>(b.block)].mass;
  add_held_rows(step_.problem, in_.model, step_.bodies, 0, 1e6 * mass * in_.scale.speed);
  return asked;
}

ImpactStage::Impact ImpactStage::apply_impulse(const Restitution& part, bool frozen_strain) {
  begin_step(in_, step_, 0, frozen_strain);
  // A rigid impulse meets the mean motion of a straining block, whose spin has all of its angular momentum,
  // J^-1 L: the energies of that motion and of the strain rates add up, and what the contact gives and takes
  // is all that changes. Where the inertia is not a cube's, the spin beside the strain rates is another.
  for (Body& b : step_.bodies) {
    if (b.strains() || !in_.model.blocks[static_cast<std::size_t>(b.block)].deformable) continue;
    b.free.spin = b.free.inverse.block<3, 3>(3, 3) * b.momentum0;
    for (Vec12* v : {&b.v0, &b.free.velocity, &b.v_ref, &b.v_solved}) v->segment<3>(3) = b.free.spin;
  }
  const Restitution asked = impact_rows(part);
  assembly_.finish_bodies();
  if (!solver_.solve_rolling(0, Effort::last_resort)) return Impact::unsolved;
  step_.pending = Ledger{};
  update_.apply(0);
  if (!finite_bodies(in_, step_)) {
    restore_bodies(in_, step_);
    return Impact::unsolved;
  }
  const bool gives = part.normal * asked.normal > 0 || part.along * asked.along > 0;
  return gives && kinetic_energy(step_, &Body::v_solved) >
                      kinetic_energy(step_, &Body::v0) * (1 + impact_round_off)
             ? Impact::gains
             : Impact::done;
}

ImpactStage::Impact ImpactStage::largest_restitution(const Restitution& none, const Restitution& all,
                                                     bool frozen_strain) {
  constexpr int halvings = 12;
  double least = 0, most = 1;
  const auto part = [&](double k) {
    return Restitution{none.normal + k * (all.normal - none.normal),
                       none.along + k * (all.along - none.along)};
  };
  Impact impact = Impact::done;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (least + most);
    restore_bodies(in_, step_);
    impact = apply_impulse(part(middle), frozen_strain);
    if (impact == Impact::unsolved) return impact;
    (impact == Impact::gains ? most : least) = middle;
  }
  if (impact == Impact::done) return impact;
  restore_bodies(in_, step_);
  return apply_impulse(part(least), frozen_strain);
}

bool ImpactStage::resolve(double time) {
  bool approaching = false, given = false, along = false;
  for (Touch& t : step_.touches) {
    t.row = -1;
    if (!meets_hard(in_, t)) continue;
    along = along || t.law->restitution_tangential.value_or(0) != 0;
    const bool closes = in_.scale.left_open(t) && t.approach > -2 * in_.scale.closing_speed();
    // What a bond's two points approach by is the error of the last step, and comes with either sign.
    const bool held = t.holds() && t.persistent;
    if (t.approach < -impact_speed(in_, t) && !closes && !held && !spring_presses(in_, t)) {
      approaching = true;
      given = given || t.law->restitution.has_value();
    }
  }
  if (!approaching) return true;
  ++count_;
  ++report_.counters.impacts;
  save_bodies(in_, step_);
  // What a contact is asked to keep of its slip, or to turn round, may take more work than stopping its
  // normal motion gives: with its velocity before and after u0 and u1, W its own inverse mass, the energy
  // changes by 1/2 (u0 + u1) . W^-1 (u1 - u0), of either sign where W couples the two. Restitution along the
  // face is reduced first, to the most that makes none; that along the normals, which makes some with
  // friction at several contacts alone, after it.
  Impact impact = apply_impulse({1, 1}, given);
  if (impact == Impact::gains && along) {
    restore_bodies(in_, step_);
    impact = apply_impulse({1, 0}, given);
    if (impact == Impact::done) impact = largest_restitution({1, 0}, {1, 1}, given);
    ++report_.counters.reduced;
  }
  if (impact == Impact::gains) {
    restore_bodies(in_, step_);
    impact = apply_impulse({0, 0}, given);
    if (impact == Impact::done) impact = largest_restitution({0, 0}, {1, 0}, given);
    ++report_.counters.reduced;
  }
  if (impact == Impact::unsolved) return false;
  // Strain rates are not part of a rigid impulse, nor what they have of the spin.
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const Body& b = step_.bodies[i];
    const auto k = static_cast<std::size_t>(b.block);
    if (b.strains() || !in_.model.blocks[k].deformable) continue;
    in_.state.eps_rate[k] = step_.saved[i].eps_rate;
    in_.state.w[k] = step_.saved[i].w + (b.v_solved - b.v0).segment<3>(3);
  }
  account_works(in_, step_, 0);
  report_.ledger += step_.pending;
  on_structures_.note(in_.model, step_, time);
  for (Touch& t : step_.touches) {
    t.approach = t.at.normal.dot(point_velocity(in_.state, t.b, t.at.point_b) -
                                 partner_velocity(in_.state, in_.env, t));
    if (t.row >= 0 && std::abs(t.approach) < contact::tolerances().still * in_.scale.speed) t.approach = 0;
    if (t.holds() && t.approach > slow_speed(in_, t)) t.persistent = false;  // the blow tears it
    t.row = -1;
  }
  return true;
}

}  // namespace talus::coupling
