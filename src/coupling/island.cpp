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
    : model_(model),
      state_(state),
      env_(environment),
      history_(history),
      surface_history_(surface_history),
      settings_(settings),
      vegetated_(any_vegetation(environment.laws)) {}

IslandStepper::~IslandStepper() = default;

bool IslandStepper::moving_skin(const Partner& a) const {
  return a.kind == Partner::Kind::structure &&
         !env_.structures[static_cast<std::size_t>(a.index)].fixed_surface;
}

void IslandStepper::begin(const Island& island) {
  island_ = &island;
  report_ = IslandReport{};
  impacts_ = unsolved_ = 0;
  crowded_ = released_ = condensed_ = sprung_ = false;  // or the search would depend on the island before
  work_ = 0;
  allowed_.reset();
  found_for_ = -1;
  followed_ = -1;
  skin_path_ = skin_travel_ = step_length_ = 0;
  watches_.assign(island.pairs.size(), PairWatch{});
  seen_.clear();
  impacts_on_skin_.clear();
  for (const Body& b : bodies_)  // of the island before
    if (static_cast<std::size_t>(b.block) < local_.size()) local_[static_cast<std::size_t>(b.block)] = -1;
  local_.resize(model_.blocks.size(), -1);
  bodies_.assign(island.blocks.size(), Body{});
  began_.resize(island.blocks.size());
  report_.went.assign(island.blocks.size(), 0.0);
  report_.ways.resize(island.blocks.size());
  length_ = std::numeric_limits<double>::infinity();
  speed_ = 0;
  for (std::size_t i = 0; i < island.blocks.size(); ++i) {
    const auto k = static_cast<std::size_t>(island.blocks[i]);
    bodies_[i].block = island.blocks[i];
    began_[i] = {state_.c[k], state_.q[k], state_.eps[k]};
    local_[k] = static_cast<int>(i);
    const double radius = model_.blocks[k].shape->radius;
    length_ = std::min(length_, radius);
    speed_ = std::max({speed_, state_.v[k].norm() + radius * state_.w[k].norm(),
                       std::sqrt(model_.gravity.norm() * radius)});
  }
  if (island.blocks.empty())
    for (int s : island.structures) {
      length_ = std::min(length_, face_edge(skin(s)));
      for (const Vec3& v : skin(s).velocities) speed_ = std::max(speed_, v.norm());
    }
  if (!(speed_ > 0)) speed_ = 1;
  go_on_following();
}

/// True if the free flow of a straining block makes more energy than a step that is shortened for it may
/// (gains_energy): where it does not resolve the vibration, the trapezoid of the strains and the turning of
/// their frame drive each other.
bool IslandStepper::makes_energy(const Body& b) const {
  const dda::Model::Block& block = model_.blocks[static_cast<std::size_t>(b.block)];
  const double kinetic = 0.5 * block.mass * b.v0.head<3>().squaredNorm(),
               round_off = 1e-14 * block.mass * speed_ * speed_;
  return dda::internal_energy(block, b.free) - b.internal0 >
         contact::tolerances().gain * settings_.accuracy * (kinetic + b.internal0) + round_off;
}

/// No point of a rigid block is faster [m/s].
double IslandStepper::speed_of(int block) const {
  const auto k = static_cast<std::size_t>(block);
  return state_.v[k].norm() + model_.blocks[k].shape->radius * state_.w[k].norm();
}

void IslandStepper::begin_step(double h, bool frozen_strain) {
  fastest_ = 0;
  for (const Body& b : bodies_) fastest_ = std::max(fastest_, speed_of(b.block));
  each_body([&](Body& b) {
    const auto k = static_cast<std::size_t>(b.block);
    b.start = dda::pose(state_, b.block);
    b.q0 = state_.q[k];
    b.rotation0 = state_.rotation(b.block);
    b.eps0 = state_.eps[k];
    b.v0 << state_.v[k], state_.w[k], state_.eps_rate[k];
    b.momentum0 = dda::spin_momentum(model_.blocks[k], state_, b.block);
    b.ndof = model_.blocks[k].deformable && !frozen_strain ? 12 : 6;
    if (h == 0) b.follows = false;
    if (h == 0 || !b.leapfrog || b.ndof == 6)
      b.internal0 = h > 0 || model_.blocks[k].deformable ? internal_energy(b.block) : 0;
    b.drag = h > 0 && vegetated_ ? vegetation_drag(model_.blocks[k], env_, state_.c[k]) : 0.0;
    if (h > 0) {
      b.free = dda::free_flow(model_, state_, b.block, h,
                              b.end_rule         ? dda::FlowRule::implicit_end
                              : b.leapfrog       ? dda::FlowRule::leapfrog
                              : b.strains_at_end ? dda::FlowRule::strain_at_end
                                                 : dda::FlowRule::exact,
                              b.drag);
      if (b.guarded && b.ndof == 12 && !b.end_rule && !b.strains_at_end && makes_energy(b)) {
        b.strains_at_end = true;
        b.free = dda::free_flow(model_, state_, b.block, h, dda::FlowRule::strain_at_end, b.drag);
      }
      // without the parabola's part: x + h v^+
      if (b.pressed) b.free.pose.c += (1 - b.free.theta) * h * h * b.free_acceleration(model_.gravity);
    } else {
      dda::impulse_mass(model_, state_, b.block, b.ndof == 6, b.free.mass, b.free.inverse);
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
  for (const Body& b : bodies_)
    if (!model_.blocks[static_cast<std::size_t>(b.block)].fixed_points.empty()) return true;
  for (const Touch& t : touches_)
    // A spring that meets has a row from here on; on which side of zero round-off put its gap must not tell.
    if (t.stiffness > 0
            ? t.at.gap <= 0 || (t.at.gap <= touch_gap() && t.approach < 0) || t.pulls()
            : t.at.gap <= touch_gap() || (t.at.gap <= near_gap() && std::abs(t.approach) <= impact_speed(t)))
      return true;
  return false;
}

void IslandStepper::save() {
  saved_.clear();
  for (const Body& b : bodies_) {
    const auto k = static_cast<std::size_t>(b.block);
    saved_.push_back({state_.c[k], state_.v[k], state_.w[k], state_.q[k], state_.eps[k], state_.eps_rate[k]});
  }
}

void IslandStepper::restore() {
  found_for_ = -1;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const auto k = static_cast<std::size_t>(bodies_[i].block);
    const Saved& s = saved_[i];
    state_.c[k] = s.c;
    state_.v[k] = s.v;
    state_.w[k] = s.w;
    state_.q[k] = s.q;
    state_.eps[k] = s.eps;
    state_.eps_rate[k] = s.eps_rate;
  }
}

bool IslandStepper::finite() const {
  return std::all_of(bodies_.begin(), bodies_.end(), [&](const Body& b) {
    const auto k = static_cast<std::size_t>(b.block);
    return state_.c[k].allFinite() && state_.q[k].coeffs().allFinite() && state_.v[k].allFinite() &&
           state_.w[k].allFinite() && state_.eps[k].allFinite() && state_.eps_rate[k].allFinite();
  });
}

}  // namespace talus::coupling
