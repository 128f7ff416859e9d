#include "fem/integrators/integrators.hpp"

#include <algorithm>
#include <cmath>

namespace talus::fem {

std::string Integrators::advance_alone(double t, double duration) {
  if (!(duration > 0)) return "none";
  if (undisturbed(t, duration)) {
    fields_.time = t + duration;
    return "asleep";
  }
  if (modal.running()) {
    modal.advance(t, duration);
    return "modal";
  }
  // Not before explicit steps alone have cost as much as what saves them; what is not linear tries condensed
  // steps.
  constexpr double least_steps = 100;
  const std::string& how = body_.spec.integrator;
  const bool linear = modal.possible();
  const double explicit_count = std::ceil(duration / body_.critical_step);
  const bool waited =
      linear ? modal.due() : fields_.reference_kinetic == 0 || fields_.steps_taken >= least_steps;
  const bool worth = how == "auto" && explicit_count >= 8 && waited;
  if (linear && (how == "modal" || worth) && modal.enter(t, how == "modal")) {
    modal.advance(t, duration);
    return "modal";
  }
  if ((how == "implicit" || (!linear && (how == "modal" || worth))) && condensed.advance(t, duration))
    return "condensed";
  leapfrog.advance(t, duration);
  return "explicit";
}

bool Integrators::undisturbed(double t, double duration) const {
  if (!fields_.still) return false;
  const bool moved_before = fields_.has_moved(energy_.stored_half);
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

double Integrators::settling_time() const {
  if (factors.possible()) return M_PI / factors.lowest_frequency();
  return body_.omega_1 > 0 ? M_PI / body_.omega_1 : 200 * body_.critical_step;
}

bool Integrators::quiet() const {
  for (const PatchLoad& load : body_.loads)
    if (!load.history.empty() && fields_.time < load.history.back().first) return false;
  if (!fields_.still) return false;
  if (!fields_.has_moved(energy_.stored_half))
    return std::all_of(body_.loads.begin(), body_.loads.end(),
                       [&](const PatchLoad& load) { return load.factor(fields_.time) == 0; });
  // Kinetic energy also vanishes at a turning point: it has to stay small for half a period (or many steps,
  // if that is unknown).
  return fields_.time - fields_.still_since >= settling_time();
}

}  // namespace talus::fem
