// The island at the start of a step, kept so that a try can be taken back.
#include "coupling/step/bodies.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/tolerances.hpp"
#include "coupling/ground/ground_laws.hpp"

namespace talus::coupling {
namespace {

/// True if the free flow of a straining block makes more energy than a step that is shortened for it may
/// (gains_energy): where it does not resolve the vibration, the trapezoid of the strains and the turning of
/// their frame drive each other.
bool makes_energy(const IslandContext& in, const Body& b) {
  const dda::Model::Block& block = in.model.blocks[static_cast<std::size_t>(b.block)];
  const double kinetic = 0.5 * block.mass * b.v0.head<3>().squaredNorm(),
               round_off = 1e-14 * block.mass * in.scale.speed * in.scale.speed;
  return dda::internal_energy(block, b.free) - b.internal0 >
         contact::tolerances().gain * in.settings.accuracy * (kinetic + b.internal0) + round_off;
}

}  // namespace

void begin_step(const IslandContext& in, Step& step, double h, bool frozen_strain) {
  step.fastest = 0;
  for (const Body& b : step.bodies) step.fastest = std::max(step.fastest, in.speed_of(b.block));
  step.each_body([&](Body& b) {
    const auto k = static_cast<std::size_t>(b.block);
    b.start = dda::pose(in.state, b.block);
    b.q0 = in.state.q[k];
    b.rotation0 = in.state.rotation(b.block);
    b.eps0 = in.state.eps[k];
    b.v0 << in.state.v[k], in.state.w[k], in.state.eps_rate[k];
    b.momentum0 = dda::spin_momentum(in.model.blocks[k], in.state, b.block);
    b.ndof = in.model.blocks[k].deformable && !frozen_strain ? 12 : 6;
    if (h == 0) b.follows = false;
    if (h == 0 || !b.leapfrog || !b.strains())
      b.internal0 = h > 0 || in.model.blocks[k].deformable ? in.internal_energy(b.block) : 0;
    b.drag = h > 0 && in.vegetated ? vegetation_drag(in.model.blocks[k], in.env, in.state.c[k]) : 0.0;
    if (h > 0) {
      b.free = dda::free_flow(in.model, in.state, b.block, h,
                              b.end_rule         ? dda::FlowRule::implicit_end
                              : b.leapfrog       ? dda::FlowRule::leapfrog
                              : b.strains_at_end ? dda::FlowRule::strain_at_end
                                                 : dda::FlowRule::exact,
                              b.drag);
      if (b.guarded && b.strains() && !b.end_rule && !b.strains_at_end && makes_energy(in, b)) {
        b.strains_at_end = true;
        b.free = dda::free_flow(in.model, in.state, b.block, h, dda::FlowRule::strain_at_end, b.drag);
      }
      // without the parabola's part: x + h v^+
      if (b.pressed) b.free.pose.c += (1 - b.free.theta) * h * h * b.free_acceleration(in.model.gravity);
    } else {
      dda::impulse_mass(in.model, in.state, b.block, !b.strains(), b.free.mass, b.free.inverse);
      b.free.theta = 0.5;
      b.free.pose = b.start;
      b.free.q = b.q0;
      b.free.rotation = b.rotation0;
      b.free.eps = b.eps0;
      b.free.velocity = b.v0;
      b.free.spin = b.v0.segment<3>(3);
    }
    b.ref = b.free.pose;
    b.v_ref = b.free.velocity;
    b.impulse.setZero();
    b.shift.setZero();
    b.v_solved = b.free.velocity;
    linearise_about_end(b, b.free.q);
  });
}

void save_bodies(const IslandContext& in, Step& step) {
  step.saved.clear();
  for (const Body& b : step.bodies) {
    const auto k = static_cast<std::size_t>(b.block);
    step.saved.push_back(
        {in.state.c[k], in.state.v[k], in.state.w[k], in.state.q[k], in.state.eps[k], in.state.eps_rate[k]});
  }
}

void restore_bodies(const IslandContext& in, Step& step) {
  step.found_for = -1;
  for (std::size_t i = 0; i < step.bodies.size(); ++i) {
    const auto k = static_cast<std::size_t>(step.bodies[i].block);
    const dda::BlockState& s = step.saved[i];
    in.state.c[k] = s.c;
    in.state.v[k] = s.v;
    in.state.w[k] = s.w;
    in.state.q[k] = s.q;
    in.state.eps[k] = s.eps;
    in.state.eps_rate[k] = s.eps_rate;
  }
}

bool finite_bodies(const IslandContext& in, const Step& step) {
  return std::all_of(step.bodies.begin(), step.bodies.end(), [&](const Body& b) {
    const auto k = static_cast<std::size_t>(b.block);
    return in.state.c[k].allFinite() && in.state.q[k].coeffs().allFinite() && in.state.v[k].allFinite() &&
           in.state.w[k].allFinite() && in.state.eps[k].allFinite() && in.state.eps_rate[k].allFinite();
  });
}

double kinetic_energy(const Step& step, Vec12 Body::*velocity) {
  double sum = 0;
  for (const Body& b : step.bodies)
    sum += 0.5 * (b.*velocity)
                     .head(b.ndof)
                     .dot(b.free.mass.topLeftCorner(b.ndof, b.ndof) * (b.*velocity).head(b.ndof));
  return sum;
}

void linearise_resting(const IslandContext& in, Step& step, double h) {
  for (Body& b : step.bodies) {
    const auto k = static_cast<std::size_t>(b.block);
    if (b.v0.head<3>().norm() + in.model.blocks[k].shape->radius * b.v0.segment<3>(3).norm() >
        1e-3 * h * in.model.gravity.norm())
      continue;
    b.ref = b.start;
    b.v_ref.setZero();  // the pose that it is linearised about is reached by no motion
    linearise_about_end(b, b.q0);
  }
}

bool strain_from_start(Step& step) {
  if (!step.from_start) return false;
  bool found = false;
  for (Body& b : step.bodies)
    if (b.from_start && b.strains() && !b.end_rule && !b.strains_at_end && !b.impulse.isZero(0))
      found = b.strains_at_end = true;
  return found;
}

void linearise_about_end(Body& b, const Quat& q_end) {
  b.turn = dda::rotation_vector(q_end * b.q0.conjugate());
  b.mid_c = 0.5 * (b.start.c + b.ref.c);
  b.about = b.leapfrog ? b.start.c : b.mid_c;
  if (b.turn.isZero(0)) {
    b.half_turn.setIdentity();
    b.full_turn.setIdentity();
  } else {
    b.half_turn = dda::rotation_by(0.5 * b.turn).toRotationMatrix();
    b.full_turn = dda::rotation_by(b.turn).toRotationMatrix();
  }
  b.carry = b.strains() ? Mat3(b.ref.F * b.start.F.inverse()) : b.full_turn;
}

double fastest_among(const IslandContext& in, const Step& step) {
  Vec3 momentum = Vec3::Zero();
  double mass = 0;
  for (const Body& b : step.bodies) {
    const double own = in.model.blocks[static_cast<std::size_t>(b.block)].mass;
    momentum += own * b.v0.head<3>();
    mass += own;
  }
  const Vec3 mean = in.island->structures.empty() && mass > 0 ? Vec3(momentum / mass) : Vec3(Vec3::Zero());
  double fastest = 0;
  for (const Body& b : step.bodies) {
    const double radius = in.model.blocks[static_cast<std::size_t>(b.block)].shape->radius;
    fastest = std::max(fastest, (b.v0.head<3>() - mean).norm() + radius * b.v0.segment<3>(3).norm());
  }
  return fastest;
}

void reject_step(const IslandContext& in, Step& step, IslandReport& report) {
  restore_bodies(in, step);
  ++report.counters.rejected;
}

}  // namespace talus::coupling
