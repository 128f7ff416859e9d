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

/// Brings velocities from the last half step to the time of the displacements.
void FemStructure::synchronise(double t) {
  if (fields_.h_last == 0) return;
  forces_.evaluate(t);
  const double half = 0.5 * fields_.h_last;
  std::array<double, 2> powers{};  // a . f of its own, and v . f_int by the velocities that come here
  for (const auto& [first, last] : body_.own)
    for (int i = 4 * first; i < 4 * last; ++i) {
      fields_.v_hat[i] =
          fields_.v[i] + half * (body_.inverse_mass[i] * (fields_.f_ext[i] - fields_.f_int[i]) -
                                 body_.alpha * (body_.inverse_mass[i] > 0 ? fields_.v[i] : 0.0));
      powers[1] += fields_.f_int[i] * fields_.v[i];
    }
  // What presses goes on pressing: a node in balance with it would be kicked by half a step of the reaction.
  const double pressed = half / (fields_.contact_step > 0 ? fields_.contact_step : 1.0);
  for (const int n : fields_.struck)
    if (body_.own_node(n))
      for (int i = 4 * n; i < 4 * n + 3; ++i)
        fields_.v_hat[i] += pressed * body_.inverse_mass[i] * fields_.contact_impulse[i];
  powers[0] = power_of_own_forces(half);
  body_.sum(powers);
  energy_.lengthen(0, powers[0], (powers[1] - energy_.power) / fields_.h_last);
  for (const auto& [first, last] : body_.own)
    std::copy(fields_.v_hat.begin() + 4L * first, fields_.v_hat.begin() + 4L * last,
              fields_.v.begin() + 4L * first);
  fields_.h_last = 0;
  ++fields_.revision;
}

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

}  // namespace talus::fem
