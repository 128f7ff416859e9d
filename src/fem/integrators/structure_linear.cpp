// How a structure goes on that nothing touches: asleep, in modes, by condensed steps or by explicit ones.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "fem/integrators/structure_linear.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {
constexpr double ringing_error = 3e-3;   // displacement by phases that are off, over the largest of the first
                                         // mode with the greatest kinetic energy
constexpr double period_error = 3.3e-4;  // of the first mode: a hundredth of its period
constexpr double longest_memory =
    100;  // 1 / omega_1: for which a phase is to be right where there is little damping
}  // namespace

/// Longest step of the midpoint rule that keeps the phases of what rings; infinite if nothing does. A mode of
/// amplitude A is off by (omega h)^2 / 12 of its phase omega t, and rings for a time m = 1 / (zeta omega_1):
/// its displacement is wrong by at most A (omega h)^2 omega m / (12 e), and never by more than 2 A.
double FemStructure::ringing_step(double t) {
  forces_.evaluate(t);
  double longest = std::numeric_limits<double>::infinity();
  if (fields_.reference_kinetic <= 1e-14 * std::abs(forces_.stored())) return longest;  // it never moved
  const LinearDynamics& l = linear_dynamics();
  const int n = body_.dofs.size;
  VecX v(n), f(n), push = VecX::Zero(n);
  gather(body_.dofs, fields_.v, v);
  gather(body_.dofs, fields_.f_ext, push);
  gather(body_.dofs, fields_.f_int, f);
  push -= f;
  const VecX& omega = l.modes.omega;
  const VecX rate = l.modes.phi.transpose() * l.mass.cwiseProduct(v),
             acceleration = l.modes.phi.transpose() * push;
  const double memory =
      std::min(longest_memory, body_.spec.damping_ratio > 0 ? 1 / body_.spec.damping_ratio : longest_memory) /
      omega[0];
  const double wrong = ringing_error * l.modes.phi.col(0).cwiseAbs().maxCoeff() *
                       std::sqrt(2 * fields_.reference_kinetic) / omega[0];
  for (int i = 0; i < omega.size(); ++i) {
    const double amplitude = std::hypot(rate[i] / omega[i], acceleration[i] / (omega[i] * omega[i])) *
                             l.modes.phi.col(i).cwiseAbs().maxCoeff();
    if (2 * amplitude <= wrong) continue;
    longest = std::min(longest, std::sqrt(12 * M_E * wrong / (amplitude * omega[i] * memory)) / omega[i]);
  }
  return longest;
}

/// By condensed steps alone; false: not now. What rubs in cracks is part of how it rings down, and explicit
/// steps follow it; so they do while cracks open and close, which are softer than K (viscosity_at_ease()).
bool FemStructure::ring_on(double t, double duration) {
  const bool chosen = condensed_by_choice();
  if (!(condensed_step(t, 1, 0) > 0) || (!chosen && !loads_hold(t, t + duration))) return false;
  const double longest = std::min(std::sqrt(12 * period_error) / lowest_frequency(), ringing_step(t));
  long steps = 1;  // a power of two: few factors serve
  while (longest * static_cast<double>(steps) < duration * (1 - 1e-12)) steps *= 2;
  const double h = duration / static_cast<double>(steps);
  if (h < (chosen ? 1.0 : least_condensed_gain) * body_.critical_step) return false;
  for (long k = 0; k < steps; ++k) {
    const double now = t + duration * (static_cast<double>(k) / static_cast<double>(steps));
    begin_condensed(now, h, false);
    if (correct_condensed(now, h, {})) continue;
    undo_condensed();
    struck(now);
    explicit_steps(now, t + duration - now);
    break;
  }
  fields_.time = t + duration;
  return true;
}

std::string FemStructure::advance_alone(double t, double duration) {
  if (!(duration > 0)) return "none";
  if (undisturbed(t, duration)) {
    fields_.time = t + duration;
    return "asleep";
  }
  const std::string& how = body_.spec.integrator;
  const bool linear = rings_in_modes();
  if (linear && linear_ && linear_->running) {
    modal_motion(t, duration);
    return "modal";
  }
  // Not before explicit steps alone have cost what the modes would: at most twice what would have been least
  // then, however long it rings on. What is not linear tries condensed steps.
  const double explicit_count = std::ceil(duration / body_.critical_step);
  const bool waited = linear ? fields_.steps_taken >= std::max(modal_try_, steps_worth(modes_))
                             : fields_.reference_kinetic == 0 || fields_.steps_taken >= modal_try_;
  const bool worth = how == "auto" && explicit_count >= 8 && waited;
  if (linear && (how == "modal" || worth)) {
    if (enter_modal(t, how == "modal")) {
      modal_motion(t, duration);
      return "modal";
    }
    put_off_modes();
  }
  if ((how == "implicit" || (!linear && (how == "modal" || worth))) && ring_on(t, duration))
    return "condensed";
  explicit_steps(t, duration);
  return "explicit";
}

void FemStructure::explicit_steps(double t, double duration) {
  const long steps = std::max(1L, static_cast<long>(std::ceil(duration / body_.critical_step * (1 - 1e-12))));
  const double h = duration / static_cast<double>(steps);
  for (long i = 0; i < steps; ++i) {
    const double now = t + duration * (static_cast<double>(i) / static_cast<double>(steps));
    predict(now, h);
    correct(now, h, {});
  }
  fields_.time = t + duration;
}

namespace {

/// Whether anything moved since the preload, which is gravity alone, by the largest kinetic energy so far.
bool has_moved(double kinetic, double stored) { return kinetic > 1e-14 * std::abs(stored); }

}  // namespace

bool FemStructure::undisturbed(double t, double duration) const {
  if (!fields_.still) return false;
  const bool moved_before = has_moved(fields_.reference_kinetic, energy_.stored_half);
  const double since = moved_before ? fields_.still_since : 0;
  if (moved_before && t - since < settling_time()) return false;
  for (const PatchLoad& load : body_.loads) {
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
  return body_.omega_1 > 0 ? M_PI / body_.omega_1 : 200 * body_.critical_step;
}

bool FemStructure::quiet() const {
  for (const PatchLoad& load : body_.loads)
    if (!load.history.empty() && fields_.time < load.history.back().first) return false;
  if (!fields_.still) return false;
  if (!has_moved(fields_.reference_kinetic, energy_.stored_half))
    return std::all_of(body_.loads.begin(), body_.loads.end(),
                       [&](const PatchLoad& load) { return load.factor(fields_.time) == 0; });
  // Kinetic energy also vanishes at a turning point: it has to stay small for half a period (or many steps,
  // if that is unknown).
  return fields_.time - fields_.still_since >= settling_time();
}

}  // namespace talus::fem
