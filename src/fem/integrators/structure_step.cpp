#include <algorithm>
#include <cmath>

#include "fem/materials/material_simd.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {

// Nodal vectors hold three components and a zero: one node is one vector of the processor.
using material::V4, material::load4, material::store4;

double sum_of(V4 a) { return (a[0] + a[2]) + (a[1] + a[3]); }

/// What a step adds to the works, in sums of four.
struct StepSums {
  V4 damping{}, external{}, viscous{}, power{}, kinetic{}, internal{}, jump{};
};

}  // namespace

void FemStructure::moved() {
  discretisation_.distribute(u_);
  discretisation_.distribute(v_);
  forces_valid_ = false;
  surface_stale_ = true;
  member_states_.clear();
}

/// Weight and prescribed loads. The weight is written anew where it may differ: at all nodes once masses have
/// changed, else at the loads'.
void FemStructure::external_force(double t) {
  const auto weigh = [&](int i) {
    for (int c = 0; c < 3; ++c) f_ext_[4 * i + c] = mass_[i] * gravity_[c];
  };
  if (!weights_valid_)
    for (int i = 0; i < static_cast<int>(mass_.size()); ++i) weigh(i);
  weights_valid_ = true;
  for (const PatchLoad& load : loads_)
    for (int i : load.node) weigh(i);
  for (const PatchLoad& load : loads_) {
    const double factor = load.factor(t);
    if (factor == 0) continue;
    for (std::size_t k = 0; k < load.node.size(); ++k)
      for (int c = 0; c < 3; ++c) f_ext_[4 * load.node[k] + c] += factor * load.force[k][c];
  }
}

void FemStructure::forces(double t) {
  if (!forces_valid_) {
    laws_taken_ = false;
    const bool measures = finite_ || damage_;
    const auto clear = [&](AlignedVector& f) {
      for (const auto& [first, last] : touched_)
        std::fill(f.begin() + 4L * first, f.begin() + 4L * last, 0.0);
    };
    clear(f_int_);
    if (damage_)
      for (int cell : damage_->drop_unaccepted()) operator_->set_on(cell, live_[cell]);
    const ElasticLimits limits = damage_ ? damage_->elastic_limits() : ElasticLimits{};
    operator_->add_internal_force(u_.data(), f_int_.data(), finite_, measures, damage_ ? &limits : nullptr);
    if (damage_) {
      const Motion motion{u_.data(), v_.data(), h_last_, spec_.rate_effect};
      damage_->add_forces(motion, f_int_.data());
      // An element below the bound cannot have reached a threshold anywhere; the others are asked.
      operator_->cells_above(limits.energy, candidates_);
      for (int cell : candidates_) {
        if (!damage_->try_cell(cell, motion, f_int_.data())) continue;
        operator_->add_internal_force_of({cell}, u_.data(), f_int_.data(), finite_, -1);
        operator_->set_on(cell, false);
      }
      clear(f_visc_);
      operator_->add_bulk_viscosity(u_.data(), v_.data(), f_visc_.data(), spec_.density, wave_speed_);
    }
    if (measures) {
      stored_part_ = operator_->total_energy() + (damage_ ? damage_->stored() : 0);
    } else {
      V4 twice{};
      for (const auto& [first, last] : own_)
        for (int i = 4 * first; i < 4 * last; i += 4) twice += load4(&u_[i]) * load4(&f_int_[i]);
      stored_part_ = 0.5 * sum_of(twice);
    }
    if (bars_) {
      bars_->add_forces(u_.data(), h_last_, live_, f_int_.data());
      stored_part_ += bars_->stored();
    }
    if (bearings_) {
      bearings_->add_forces(u_.data(), live_, f_int_.data());
      if (first_rank()) stored_part_ += bearings_->stored();
    }
    discretisation_.condense(f_int_);
    if (!f_visc_.empty()) discretisation_.condense(f_visc_);
  }
  if (!forces_valid_ || t != forces_time_) external_force(t);
  forces_valid_ = true;
  forces_time_ = t;
}

void FemStructure::predict(double t, double h) {
  leave_modal();
  if (h_last_ == 0 && steps_taken_ > 0) begin_leapfrog(h);
  forces(t);
  find_jump(h);
  const double kick = 0.5 * (h_last_ > 0 ? h_last_ + h : h);
  const double a = 0.5 * alpha_ * kick;
  const double keep = (1 - a) / (1 + a), push = kick / (1 + a);
  drag_ = 1 + a;
  const bool jumped = !jump_.empty();
  const double* visc = f_visc_.empty() ? nullptr : f_visc_.data();
  for (const auto& [first, last] : own_)
    for (int i = 4 * first; i < 4 * last; i += 4) {
      const V4 pushed = push * load4(&inverse_mass_[i]);
      V4 out = keep * load4(&v_[i]) + pushed * (load4(&f_ext_[i]) - load4(&f_int_[i]));
      if (jumped) out -= load4(&jump_[i]);
      if (visc != nullptr) out -= pushed * load4(visc + i);
      store4(&v_hat_[i], out);
    }
  discretisation_.distribute(v_hat_);
  prediction_shared_ = !partition_;
}

/// Gravity's work in an uneven step beyond the potential lost between the half steps, this rank's part [J].
double FemStructure::excess_of_gravity(double kick, double h) const {
  double excess = 0;
  for (const auto& [first, last] : own_)
    for (int node = first; node < last; ++node)
      for (int k = 0; k < 3; ++k) {
        const std::size_t i = 4 * static_cast<std::size_t>(node) + static_cast<std::size_t>(k);
        if (inverse_mass_[i] == 0) continue;
        excess += 0.5 * mass_[node] * gravity_[k] *
                  (kick * (v_[i] + v_hat_[i]) - (h_last_ * v_[i] + h * v_hat_[i]));
      }
  return excess;
}

/// Acceleration of the step by the forces that are the structure's own, this rank's part [W/s].
double FemStructure::power_of_own_forces(double kick) const {
  const V4 fall{gravity_[0], gravity_[1], gravity_[2], 0}, none{};
  V4 power{};
  for (const auto& [first, last] : own_)
    for (int node = first; node < last; ++node) {
      const int i = 4 * node;
      const V4 own = mass_[node] * fall - load4(&f_int_[i]);
      power +=
          material::select(load4(&inverse_mass_[i]) != none, (load4(&v_hat_[i]) - load4(&v_[i])) * own, none);
    }
  return sum_of(power) / kick;
}

/// Of a step that becomes h, with a . f = `own` and v . (df_int/dt) = `strained` of all ranks. Where the
/// latter is not known, after a jump of the forces and where no step went before, the other half stands for
/// both: right on the average, too.
void FemStructure::book_step_dependence(double h, double own, double strained) {
  const double q = h_last_ > 0 && power_valid_ ? 0.5 * (own + strained) : own;
  const double less = (h * h - h_last_ * h_last_) / 8 * q;
  books_.step_dependence += less;
  books_.algorithmic -= less;
}

void FemStructure::correct(double t, double h, std::span<const NodeImpulse> given) {
  std::vector<NodeImpulse> moved_on;
  if (!mesh_.hanging.empty()) moved_on = discretisation_.condense(given);
  for (const NodeImpulse& p : divided() ? given : std::span<const NodeImpulse>{})
    if (const int n = partition_->node_here(p.node); n >= 0) moved_on.push_back({n, p.impulse});
  const std::span<const NodeImpulse> impulses =
      mesh_.hanging.empty() && !divided() ? given : std::span<const NodeImpulse>(moved_on);
  const double kick = 0.5 * (h_last_ > 0 ? h_last_ + h : h);
  for (int n : struck_) std::fill_n(&contact_impulse_[4 * static_cast<std::size_t>(n)], 3, 0.0);
  struck_.clear();
  contact_step_ = h;
  ++steps_taken_;
  for (const NodeImpulse& p : impulses) {
    struck_.push_back(p.node);
    for (int c = 0; c < 3; ++c) {
      const std::size_t i = 4 * static_cast<std::size_t>(p.node) + c;
      contact_impulse_[i] += p.impulse[c];
      v_hat_[i] += inverse_mass_[i] * p.impulse[c] / drag_;
    }
  }
  discretisation_.distribute(v_hat_);
  drag_ = 1;
  watch_loads(t + h, h);  // by the forces of this step, before the displacements move on
  // This rank's part of the works, then of all.
  double contact = 0, gravity = h == h_last_ ? 0 : excess_of_gravity(kick, h),
         own = h == h_last_ ? 0 : power_of_own_forces(kick);
  for (const NodeImpulse& p : impulses) {
    if (!own_node(p.node)) continue;
    for (int c = 0; c < 3; ++c) {
      const std::size_t i = 4 * static_cast<std::size_t>(p.node) + c;
      contact += p.impulse[c] * 0.5 * (v_[i] + v_hat_[i]);
    }
  }
  const bool loaded = !loads_.empty();
  const double* visc = f_visc_.empty() ? nullptr : f_visc_.data();
  const double* jump = jump_.empty() ? nullptr : jump_.data();
  const V4 fall{gravity_[0], gravity_[1], gravity_[2], 0}, none{};
  StepSums sums;
  for (const auto& [first, last] : own_)
    for (int node = first; node < last; ++node) {
      const int i = 4 * node;
      const double m = mass_[node];
      const V4 before = load4(&v_[i]), after = load4(&v_hat_[i]), f = load4(&f_int_[i]);
      store4(&u_[i], load4(&u_[i]) + h * after);
      store4(&v_[i], after);
      sums.power += f * after;
      sums.kinetic += m * after * after;
      const V4 mean = material::select(load4(&inverse_mass_[i]) != none, 0.5 * (before + after),
                                       none);  // what is held does no work
      sums.internal += kick * mean * f;
      if (visc != nullptr) sums.viscous += kick * mean * load4(visc + i);
      const V4 lost = jump != nullptr ? load4(jump + i) : none;
      sums.jump += m * mean * lost;
      if (alpha_ != 0)
        sums.damping -= mean * (m * (after - before + lost) -
                                kick * (load4(&f_ext_[i]) - f - (visc != nullptr ? load4(visc + i) : none)) -
                                load4(&contact_impulse_[i]));
      if (loaded) sums.external += kick * mean * (load4(&f_ext_[i]) - m * fall);
    }
  double damping = sum_of(sums.damping), external = sum_of(sums.external), viscous = sum_of(sums.viscous),
         power = sum_of(sums.power), kinetic = sum_of(sums.kinetic), internal = sum_of(sums.internal);
  if (partition_) {
    partition_->exchange(v_hat_);
    for (const auto& [first, last] : partition_->border_nodes())
      for (int i = 4 * first; i < 4 * last; ++i) {
        u_[i] += h * v_hat_[i];
        v_[i] = v_hat_[i];
      }
    motion_changed();
  }
  const double bearing_loss = bearings_ && first_rank() ? bearings_->dissipation() : 0.0;
  double plastic = (bars_ ? bars_->dissipation() : 0.0) + bearing_loss;
  double cracking = damage_ ? damage_->dissipation() : 0.0;
  if (laws_taken_)
    plastic = cracking = 0;  // a condensed step that was begun and dropped has accounted for them
  double stored = stored_part_;
  const std::vector<int> eroding = damage_ ? spent_cells() : std::vector<int>{};
  auto spent = static_cast<double>(eroding.size());
  double breaking = bars_ ? bars_->breaking() : 0.0;
  double jumped = sum_of(sums.jump);
  std::array<double*, 15> parts{&contact,  &damping,  &external, &viscous,  &power,
                                &kinetic,  &internal, &gravity,  &own,      &plastic,
                                &cracking, &stored,   &spent,    &breaking, &jumped};
  if (partition_) {
    std::array<double, parts.size()> values;
    for (std::size_t k = 0; k < parts.size(); ++k) values[k] = *parts[k];
    sum(values);
    for (std::size_t k = 0; k < parts.size(); ++k) *parts[k] = values[k];
  }
  books_.contact_work += contact;
  books_.damping_work += damping;
  books_.external_work += external;
  books_.bulk_viscosity_work += viscous;
  books_.plastic_work += plastic;
  books_.damage_work += cracking;
  const double stored_before = h_last_ == 0 ? stored : stored_half_;
  stored_half_ = stored + 0.5 * h * power;
  // What the laws took in the last condensed step is in its own books; here they are accepted.
  books_.algorithmic += jumped;
  jump_.clear();
  books_.algorithmic +=
      internal - (stored_half_ - stored_before) - (h_last_ > 0 ? cracking + plastic : 0.0) - gravity;
  if (h != h_last_)
    book_step_dependence(h, own, h_last_ > 0 ? (2 * internal / kick - power - power_) / h_last_ : 0.0);
  power_ = power;
  power_valid_ = true;
  h_last_ = h;
  time_ = t + h;
  kinetic *= 0.5;
  reference_kinetic_ = std::max(reference_kinetic_, kinetic);
  // Rounding alone never wakes a structure at rest.
  if ((kinetic > 1e-8 * reference_kinetic_ && kinetic > 1e-14 * stored) || !given.empty())
    still_ = false;
  else if (!still_)
    still_ = true, still_since_ = time_;
  if (bars_) {
    bars_->accept();
    if (partition_ && breaking > 0) bars_->find_broken();
  }
  if (bearings_) bearings_->accept();
  if (damage_) {
    if (spent > 0) erode(joined(eroding));
    damage_->accept();
    if (bars_) bars_->see_cracks(*damage_, u_.data(), live_);
  }
  moved();
}

void FemStructure::explicit_steps(double t, double duration) {
  const long steps = std::max(1L, static_cast<long>(std::ceil(duration / critical_step_ * (1 - 1e-12))));
  const double h = duration / static_cast<double>(steps);
  for (long i = 0; i < steps; ++i) {
    const double now = t + duration * (static_cast<double>(i) / static_cast<double>(steps));
    predict(now, h);
    correct(now, h, {});
  }
  time_ = t + duration;
}

namespace {

/// Whether anything moved since the preload, which is gravity alone, by the largest kinetic energy so far.
bool has_moved(double kinetic, double stored) { return kinetic > 1e-14 * std::abs(stored); }

}  // namespace

bool FemStructure::undisturbed(double t, double duration) const {
  if (!still_) return false;
  const bool moved_before = has_moved(reference_kinetic_, stored_half_);
  const double since = moved_before ? still_since_ : 0;
  if (moved_before && t - since < settling_time()) return false;
  for (const PatchLoad& load : loads_) {
    // What the structure is in balance with: nothing before it ever moved, since the preload is gravity
    // alone.
    const double held = moved_before ? load.factor(since) : 0;
    if (load.factor(t) != held || load.factor(t + duration) != held) return false;
    for (const auto& [when, factor] : load.history)
      if (when > since && when < t + duration && factor != held) return false;
  }
  return true;
}

double FemStructure::settling_time() const {
  if (condensable()) return M_PI / lowest_frequency();
  return omega_1_ > 0 ? M_PI / omega_1_ : 200 * critical_step_;
}

bool FemStructure::quiet() const {
  for (const PatchLoad& load : loads_)
    if (!load.history.empty() && time_ < load.history.back().first) return false;
  if (!still_) return false;
  if (!has_moved(reference_kinetic_, stored_half_))
    return std::all_of(loads_.begin(), loads_.end(),
                       [&](const PatchLoad& load) { return load.factor(time_) == 0; });
  // Kinetic energy also vanishes at a turning point: it has to stay small for half a period (or many steps,
  // if that is unknown).
  return time_ - still_since_ >= settling_time();
}

}  // namespace talus::fem
