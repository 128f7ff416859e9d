#include <cmath>

#include "fem/structure_fem.hpp"

namespace talus::fem {

void FemStructure::moved() {
  forces_valid_ = false;
  surface_stale_ = true;
  member_states_.clear();
}

void FemStructure::external_force(double t, AlignedVector& f) const {
  for (std::size_t i = 0; i < mass_.size(); ++i)
    for (int c = 0; c < 3; ++c) f[4 * i + c] = mass_[i] * gravity_[c];
  for (const PatchLoad& load : loads_) {
    const double factor = load.factor(t);
    if (factor == 0) continue;
    for (std::size_t k = 0; k < load.node.size(); ++k)
      for (int c = 0; c < 3; ++c) f[4 * load.node[k] + c] += factor * load.force[k][c];
  }
}

void FemStructure::forces(double t) {
  if (!forces_valid_) {
    const bool measures = finite_ || damage_;
    std::fill(f_int_.begin(), f_int_.end(), 0.0);
    const ElasticLimits limits = damage_ ? damage_->elastic_limits() : ElasticLimits{};
    operator_->add_internal_force(u_.data(), f_int_.data(), finite_, measures, damage_ ? &limits : nullptr);
    if (damage_) {
      const double* rate = spec_.rate_effect ? v_.data() : nullptr;
      damage_->add_forces(u_.data(), rate, f_int_.data());
      // An element below the bound cannot have reached a threshold anywhere; the others are asked.
      operator_->cells_above(limits.energy, candidates_);
      for (int cell : candidates_) {
        if (!damage_->try_cell(cell, u_.data(), rate, f_int_.data())) continue;
        operator_->add_internal_force_of({cell}, u_.data(), f_int_.data(), finite_, -1);
        operator_->set_on(cell, false);
      }
      std::fill(f_visc_.begin(), f_visc_.end(), 0.0);
      operator_->add_bulk_viscosity(v_.data(), f_visc_.data(), spec_.density, wave_speed_);
    }
    if (measures) {
      stored_now_ = operator_->total_energy() + (damage_ ? damage_->stored() : 0);
    } else {
      double twice = 0;
      for (std::size_t i = 0; i < u_.size(); ++i) twice += u_[i] * f_int_[i];
      stored_now_ = 0.5 * twice;
    }
    if (bars_) {
      bars_->add_forces(u_.data(), h_last_, live_, f_int_.data());
      stored_now_ += bars_->stored();
    }
    if (bearings_) {
      bearings_->add_forces(u_.data(), live_, f_int_.data());
      stored_now_ += bearings_->stored();
    }
  }
  if (!forces_valid_ || t != forces_time_) external_force(t, f_ext_);
  forces_valid_ = true;
  forces_time_ = t;
}

void FemStructure::predict(double t, double h) {
  leave_modal();
  forces(t);
  const double kick = 0.5 * (h_last_ > 0 ? h_last_ + h : h);
  const double a = 0.5 * alpha_ * kick;
  const double keep = (1 - a) / (1 + a), push = kick / (1 + a);
  const double* __restrict v = v_.data();
  const double* __restrict external = f_ext_.data();
  const double* __restrict internal = f_int_.data();
  const double* __restrict inverse = inverse_mass_.data();
  double* __restrict out = v_hat_.data();
  const std::size_t n = v_.size();
  for (std::size_t i = 0; i < n; ++i) out[i] = keep * v[i] + push * inverse[i] * (external[i] - internal[i]);
  if (!f_visc_.empty())
    for (std::size_t i = 0; i < n; ++i) out[i] -= push * inverse[i] * f_visc_[i];
}

void FemStructure::correct(double t, double h, std::span<const NodeImpulse> impulses) {
  const double kick = 0.5 * (h_last_ > 0 ? h_last_ + h : h);
  std::fill(contact_impulse_.begin(), contact_impulse_.end(), 0.0);
  contact_step_ = h;
  for (const NodeImpulse& p : impulses)
    for (int c = 0; c < 3; ++c) {
      const std::size_t i = 4 * static_cast<std::size_t>(p.node) + c;
      contact_impulse_[i] += p.impulse[c];
      v_hat_[i] += inverse_mass_[i] * p.impulse[c];
    }
  for (const NodeImpulse& p : impulses)
    for (int c = 0; c < 3; ++c) {
      const std::size_t i = 4 * static_cast<std::size_t>(p.node) + c;
      books_.contact_work += p.impulse[c] * 0.5 * (v_[i] + v_hat_[i]);
    }
  double damping = 0, external = 0, viscous = 0, power = 0, kinetic = 0, internal = 0;
  const double stored_before = h_last_ == 0 ? stored_now_ : stored_half_;
  const bool loaded = !loads_.empty();
  const double* visc = f_visc_.empty() ? nullptr : f_visc_.data();
  for (std::size_t node = 0; node < mass_.size(); ++node) {
    const double m = mass_[node];
    for (std::size_t i = 4 * node; i < 4 * node + 3; ++i) {
      const double before = v_[i], after = v_hat_[i];
      u_[i] += h * after;
      v_[i] = after;
      power += f_int_[i] * after;
      kinetic += m * after * after;
      if (inverse_mass_[i] == 0) continue;
      const double mean = 0.5 * (before + after);
      internal += kick * mean * f_int_[i];
      if (visc) viscous += kick * mean * visc[i];
      if (alpha_ != 0) damping -= mean * (m * (after - before) - kick * (f_ext_[i] - f_int_[i] - (visc ? visc[i] : 0.0)) - contact_impulse_[i]);
      if (loaded) external += kick * mean * (f_ext_[i] - m * gravity_[static_cast<int>(i - 4 * node)]);
    }
  }
  books_.damping_work += damping;
  books_.external_work += external;
  books_.bulk_viscosity_work += viscous;
  stored_half_ = stored_now_ + 0.5 * h * power;
  books_.algorithmic += internal - (stored_half_ - stored_before) - (damage_ ? damage_->dissipation() : 0.0) - (bars_ ? bars_->dissipation() : 0.0) -
                        (bearings_ ? bearings_->dissipation() : 0.0);
  h_last_ = h;
  time_ = t + h;
  kinetic *= 0.5;
  reference_kinetic_ = std::max(reference_kinetic_, kinetic);
  // Rounding alone never wakes a structure at rest.
  if ((kinetic > 1e-8 * reference_kinetic_ && kinetic > 1e-14 * stored_now_) || !impulses.empty()) still_ = false;
  else if (!still_) still_ = true, still_since_ = time_;
  if (bars_) {
    books_.plastic_work += bars_->dissipation();
    bars_->accept();
  }
  if (bearings_) {
    books_.plastic_work += bearings_->dissipation();
    bearings_->accept();
  }
  if (damage_) {
    books_.damage_work += damage_->dissipation();
    if (spec_.erosion) erode();
    damage_->accept();
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

bool FemStructure::undisturbed(double t, double duration) const {
  if (!still_) return false;
  const bool moved_before = reference_kinetic_ > 1e-14 * std::abs(stored_half_);
  const double since = moved_before ? still_since_ : 0;
  if (moved_before && t - since < settling_time()) return false;
  for (const PatchLoad& load : loads_) {
    // What the structure is in balance with: nothing before it ever moved, since the preload is gravity alone.
    const double held = moved_before ? load.factor(since) : 0;
    if (load.factor(t) != held || load.factor(t + duration) != held) return false;
    for (const auto& [when, factor] : load.history)
      if (when > since && when < t + duration && factor != held) return false;
  }
  return true;
}

double FemStructure::settling_time() const { return omega_1_ > 0 ? M_PI / omega_1_ : 200 * critical_step_; }

bool FemStructure::quiet() const {
  for (const PatchLoad& load : loads_)
    if (!load.history.empty() && time_ < load.history.back().first) return false;
  if (!still_) return false;
  if (reference_kinetic_ <= 1e-14 * std::abs(stored_half_)) return true;
  // Kinetic energy also vanishes at a turning point: it has to stay small for half a period (or many steps, if that is unknown).
  return time_ - still_since_ >= settling_time();
}

}  // namespace talus::fem
