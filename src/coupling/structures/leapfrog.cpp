// Blocks at a structure in explicit steps: where those that are pressed go, and strain rates.
//
// Impulses act at the start of the step, and so does what a hard contact asks: x_np = x_n + h v^+ in contact,
// along normal and tangents. Free flow adds the parabola, x_n + h v^+ - h^2 g / 2. A block that is held would
// then have to leave each step with v^+ = h g / 2 along its normals, but with v^+ = 0 along its tangents
// where friction holds it: it creeps against gravity at h g / 2, which pieces held by several contacts cannot
// do, so that they chatter. What is pressed goes by x_n + h v^+, at rest with v^+ = 0, as the structure's
// nodes do; what flies keeps the parabola, exact.
//
// So v^+ of what is pressed is its velocity at the half step, as the structure's are: what lands comes with
// v_n - h g / 2, what takes off flies on with v^+ + h g / 2. Without that each bounce of speed v would make m
// g h v.
//
// Strain rates of blocks at a structure in explicit steps. The state holds them at full steps, as everywhere;
// within the step they are those of the half steps before and after, like the structure's velocities:
//
//   (S + h^2 K / 4) epsdot_- = S epsdot_n + h/2 K eps_n      S: mass of the strains at constant momentum
//   the step (dda::FlowRule::leapfrog) from epsdot_- to epsdot_+
//   S epsdot_np = (S + h^2 K / 4) epsdot_+ - h/2 K eps_np
//
// Without impulses that is the trapezoid, A = S + h^2 K / 4. An impulse p at n changes epsdot_n by A^-1 p,
// epsdot_+ by A^-1 S A^-1 p: so it brings p . (epsdot_- + epsdot_+) / 2 for any step. With the trapezoid's
// strain rates and the positions of theta = 1 each step of a contact lost 1/2 h p A^-1 K eps.
#include "coupling/structures/leapfrog.hpp"

#include "coupling/rows/contact_rows.hpp"
#include "coupling/springs/half_steps.hpp"

namespace talus::coupling {
namespace {

/// New strain rates, the angular momentum kept.
void set_rates(dda::State& s, std::size_t k, const StrainDynamics& d, const Vec6& rates) {
  s.w[k] = d.spin_with(s, k, rates);
  s.eps_rate[k] = rates;
}

/// Takes a block's velocity on by that time under gravity alone.
void convert(const IslandContext& in, Body& b, double time) {
  const auto k = static_cast<std::size_t>(b.block);
  const Vec3 before = in.state.v[k];
  in.state.v[k] += time * in.model.gravity;
  b.converted += 0.5 * in.model.blocks[k].mass * (in.state.v[k].squaredNorm() - before.squaredNorm());
}

/// Per body, whether a hard contact pressed on it in the step.
std::vector<char> held_by_hard_contacts(const IslandContext& in, const Step& step) {
  std::vector<char> held(step.bodies.size(), 0);
  const auto hold = [&](int block) {
    if (const int l = in.local[static_cast<std::size_t>(block)]; l >= 0)
      held[static_cast<std::size_t>(l)] = 1;
  };
  for (const Touch& t : step.touches) {
    if (t.row < 0 || t.stiffness > 0 || t.impulse.isZero(0)) continue;
    if (t.b >= 0) hold(t.b);
    if (t.a.kind == Partner::Kind::block) hold(t.a.index);
  }
  return held;
}

/// Normal velocity at which such a spring's sides part, at the point that its impulse acts at, in the present
/// state [m/s].
double separation_speed(const IslandContext& in, const Touch& t) {
  if (!goes_by_its_row(in, t))
    return t.at.normal.dot(point_velocity(in.state, t.b, t.at.point_b) -
                           partner_velocity(in.state, in.env, t));
  if (in.deformable_structure(t))
    return t.at.normal.dot(point_velocity(in.state, t.b, t.at.point_a) -
                           partner_velocity(in.state, in.env, t));
  const bool blocks = t.a.kind == Partner::Kind::block;
  const Pose pose = blocks ? dda::pose(in.state, t.a.index) : Pose{};
  const Vec3 x = acts_between(normal_owner(t, in.model, in.env, &pose), t.at.point_a, t.at.point_b);
  return t.at.normal.dot(point_velocity(in.state, t.b, x) -
                         (blocks ? point_velocity(in.state, t.a.index, x) : Vec3(Vec3::Zero())));
}

}  // namespace

StrainDynamics strain_dynamics(const dda::Model::Block& block, const dda::State& s, int i) {
  StrainDynamics d;
  d.full = dda::mass_matrix(block, dda::pose(s, i), s.rotation(i));
  const Eigen::Matrix<double, 3, 6> couple = d.full.block<3, 6>(3, 6);
  d.mass = d.full.block<6, 6>(6, 6) - couple.transpose() * d.full.block<3, 3>(3, 3).inverse() * couple;
  d.stiffness = block.volume * dda::elastic_matrix(block.young, block.poisson);
  return d;
}

BeforeFullStep::BeforeFullStep(const dda::Model& m, const dda::State& s, int block, double lasted)
    : strains_(lasted > 0 && m.blocks[static_cast<std::size_t>(block)].deformable) {
  if (!strains_) return;
  const auto k = static_cast<std::size_t>(block);
  const StrainDynamics d = strain_dynamics(m.blocks[k], s, block);
  const Vec6 rates = d.rates_before(s, k, lasted);
  centre_ = s.c[k];
  spin_ = d.spin_with(s, k, rates) - s.w[k];
  gradient_ = s.rotation(block) * dda::strain_tensor(rates - s.eps_rate[k]) * dda::pose(s, block).F.inverse();
}

Vec3 BeforeFullStep::operator()(const Vec3& x) const {
  if (!strains_) return Vec3::Zero();
  return spin_.cross(x - centre_) + gradient_ * (x - centre_);
}

void find_pressed(const IslandContext& in, Step& step) {
  for (Body& b : step.bodies) b.pressed = b.at_half_step = false, b.converted = 0;
  if (!in.leapfrog()) return;
  const auto set = [&](int block, bool Body::*flag) {
    if (const int l = in.local[static_cast<std::size_t>(block)]; l >= 0)
      step.bodies[static_cast<std::size_t>(l)].*flag = true;
  };
  const auto press = [&](int block) { set(block, &Body::pressed); };
  for (const Body& b : step.bodies)
    for (const ContactMemory& m : in.history[static_cast<std::size_t>(b.block)]) {
      if (m.stiffness > 0 || m.force.isZero(0)) continue;
      set(b.block, &Body::at_half_step);
      if (static_cast<Partner::Kind>(m.partner >> 32) == Partner::Kind::block)
        set(static_cast<int>(m.partner & 0xffffffff), &Body::at_half_step);
    }
  for (const Touch& t : step.touches) {
    if (t.b < 0 || t.stiffness > 0 || !(t.persistent || t.at.gap <= in.scale.touch_gap())) continue;
    press(t.b);
    if (t.a.kind == Partner::Kind::block) press(t.a.index);
  }
}

void to_half_steps(const IslandContext& in, Step& step, double h) {
  for (Body& b : step.bodies) {
    if (b.pressed && !b.at_half_step) convert(in, b, -0.5 * h);
    if (!b.pressed && b.at_half_step) convert(in, b, 0.5 * (step.last_length > 0 ? step.last_length : h));
  }
  for (Body& b : step.bodies) {
    if (!b.leapfrog || !in.model.blocks[static_cast<std::size_t>(b.block)].deformable) continue;
    const auto k = static_cast<std::size_t>(b.block);
    b.internal0 = in.internal_energy(b.block);
    const StrainDynamics d = strain_dynamics(in.model.blocks[k], in.state, b.block);
    set_rates(in.state, k, d, d.rates_before(in.state, k, h));
  }
  for (Touch& t : step.touches)
    if (in.leapfrog() && t.b >= 0) t.approach = separation_speed(in, t);
}

void to_full_steps(const IslandContext& in, Step& step, double h) {
  if (in.leapfrog()) {
    const std::vector<char> held = held_by_hard_contacts(in, step);
    for (std::size_t l = 0; l < step.bodies.size(); ++l)
      if (step.bodies[l].pressed != (held[l] != 0))
        convert(in, step.bodies[l], step.bodies[l].pressed ? 0.5 * h : -0.5 * h);
  }
  for (const Body& b : step.bodies) {
    if (!b.leapfrog || !b.strains()) continue;
    const auto k = static_cast<std::size_t>(b.block);
    const StrainDynamics d = strain_dynamics(in.model.blocks[k], in.state, b.block);
    set_rates(in.state, k, d,
              in.state.eps_rate[k] + d.mass.llt().solve(0.25 * h * h * (d.stiffness * in.state.eps_rate[k]) -
                                                        0.5 * h * (d.stiffness * in.state.eps[k])));
  }
}

bool goes_by_its_row(const IslandContext& in, const Touch& t) {
  const auto strains = [&](int block) { return in.model.blocks[static_cast<std::size_t>(block)].deformable; };
  return in.leapfrog() && t.stiffness > 0 && t.b >= 0 && !t.normal_law.bed &&
         (strains(t.b) || (t.a.kind == Partner::Kind::block && strains(t.a.index)));
}

}  // namespace talus::coupling
