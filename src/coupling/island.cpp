// The island at the start of a step, kept so that a try can be taken back.
#include "coupling/island.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/tolerances.hpp"
#include "coupling/ground_laws.hpp"
#include "coupling/island_body.hpp"

namespace talus::coupling {

IslandStepper::IslandStepper(const dda::Model& model, dda::State& state, Environment& environment,
                             ContactHistory& history, ContactHistory& surface_history,
                             const StepSettings& settings)
    : in_{model, state, environment, history, surface_history, settings, any_vegetation(environment.laws)} {
  in_.scale.accuracy = settings.accuracy;
}

IslandStepper::~IslandStepper() = default;

void IslandStepper::begin(const Island& island) {
  in_.begin(island);
  report_ = IslandReport{};
  impacts_ = 0;
  released_ = step_.sprung = false;
  work_ = 0;
  allowed_.reset();
  step_.found_for = -1;
  followed_ = -1;
  skin_path_ = skin_travel_ = step_.length = 0;
  watches_.assign(island.pairs.size(), PairWatch{});
  seen_.clear();
  impacts_on_skin_.clear();
  step_.bodies.assign(island.blocks.size(), Body{});
  began_.resize(island.blocks.size());
  report_.went.assign(island.blocks.size(), 0.0);
  report_.ways.resize(island.blocks.size());
  for (std::size_t i = 0; i < island.blocks.size(); ++i) {
    const auto k = static_cast<std::size_t>(island.blocks[i]);
    step_.bodies[i].block = island.blocks[i];
    began_[i] = {in_.state.c[k], in_.state.q[k], in_.state.eps[k]};
  }
  go_on_following();
}

/// True if the free flow of a straining block makes more energy than a step that is shortened for it may
/// (gains_energy): where it does not resolve the vibration, the trapezoid of the strains and the turning of
/// their frame drive each other.
bool IslandStepper::makes_energy(const Body& b) const {
  const dda::Model::Block& block = in_.model.blocks[static_cast<std::size_t>(b.block)];
  const double kinetic = 0.5 * block.mass * b.v0.head<3>().squaredNorm(),
               round_off = 1e-14 * block.mass * in_.scale.speed * in_.scale.speed;
  return dda::internal_energy(block, b.free) - b.internal0 >
         contact::tolerances().gain * in_.settings.accuracy * (kinetic + b.internal0) + round_off;
}

void IslandStepper::begin_step(double h, bool frozen_strain) {
  step_.fastest = 0;
  for (const Body& b : step_.bodies) step_.fastest = std::max(step_.fastest, in_.speed_of(b.block));
  step_.each_body([&](Body& b) {
    const auto k = static_cast<std::size_t>(b.block);
    b.start = dda::pose(in_.state, b.block);
    b.q0 = in_.state.q[k];
    b.rotation0 = in_.state.rotation(b.block);
    b.eps0 = in_.state.eps[k];
    b.v0 << in_.state.v[k], in_.state.w[k], in_.state.eps_rate[k];
    b.momentum0 = dda::spin_momentum(in_.model.blocks[k], in_.state, b.block);
    b.ndof = in_.model.blocks[k].deformable && !frozen_strain ? 12 : 6;
    if (h == 0) b.follows = false;
    if (h == 0 || !b.leapfrog || b.ndof == 6)
      b.internal0 = h > 0 || in_.model.blocks[k].deformable ? in_.internal_energy(b.block) : 0;
    b.drag = h > 0 && in_.vegetated ? vegetation_drag(in_.model.blocks[k], in_.env, in_.state.c[k]) : 0.0;
    if (h > 0) {
      b.free = dda::free_flow(in_.model, in_.state, b.block, h,
                              b.end_rule         ? dda::FlowRule::implicit_end
                              : b.leapfrog       ? dda::FlowRule::leapfrog
                              : b.strains_at_end ? dda::FlowRule::strain_at_end
                                                 : dda::FlowRule::exact,
                              b.drag);
      if (b.guarded && b.ndof == 12 && !b.end_rule && !b.strains_at_end && makes_energy(b)) {
        b.strains_at_end = true;
        b.free = dda::free_flow(in_.model, in_.state, b.block, h, dda::FlowRule::strain_at_end, b.drag);
      }
      // without the parabola's part: x + h v^+
      if (b.pressed) b.free.pose.c += (1 - b.free.theta) * h * h * b.free_acceleration(in_.model.gravity);
    } else {
      dda::impulse_mass(in_.model, in_.state, b.block, b.ndof == 6, b.free.mass, b.free.inverse);
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
    linearise_at(b, b.free.q);
  });
}

bool IslandStepper::has_closed() const {
  for (const Body& b : step_.bodies)
    if (!in_.model.blocks[static_cast<std::size_t>(b.block)].fixed_points.empty()) return true;
  for (const Touch& t : step_.touches)
    // A spring that meets has a row from here on; on which side of zero round-off put its gap must not tell.
    if (t.stiffness > 0 ? t.at.gap <= 0 || (t.at.gap <= in_.scale.touch_gap() && t.approach < 0) || t.pulls()
                        : t.at.gap <= in_.scale.touch_gap() ||
                              (t.at.gap <= in_.scale.near_gap() && std::abs(t.approach) <= impact_speed(t)))
      return true;
  return false;
}

void IslandStepper::save() {
  step_.saved.clear();
  for (const Body& b : step_.bodies) {
    const auto k = static_cast<std::size_t>(b.block);
    step_.saved.push_back({in_.state.c[k], in_.state.v[k], in_.state.w[k], in_.state.q[k], in_.state.eps[k],
                           in_.state.eps_rate[k]});
  }
}

void IslandStepper::restore() {
  step_.found_for = -1;
  for (std::size_t i = 0; i < step_.bodies.size(); ++i) {
    const auto k = static_cast<std::size_t>(step_.bodies[i].block);
    const dda::BlockState& s = step_.saved[i];
    in_.state.c[k] = s.c;
    in_.state.v[k] = s.v;
    in_.state.w[k] = s.w;
    in_.state.q[k] = s.q;
    in_.state.eps[k] = s.eps;
    in_.state.eps_rate[k] = s.eps_rate;
  }
}

bool IslandStepper::finite() const {
  return std::all_of(step_.bodies.begin(), step_.bodies.end(), [&](const Body& b) {
    const auto k = static_cast<std::size_t>(b.block);
    return in_.state.c[k].allFinite() && in_.state.q[k].coeffs().allFinite() && in_.state.v[k].allFinite() &&
           in_.state.w[k].allFinite() && in_.state.eps[k].allFinite() && in_.state.eps_rate[k].allFinite();
  });
}

}  // namespace talus::coupling
