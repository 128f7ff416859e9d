#include "contact/laws/impact_damping.hpp"
#include "core/bisect.hpp"

#include <algorithm>
#include <cmath>

namespace talus::contact {

double restitution_of(double zeta) {
  const double s = (1 - zeta) * (1 + zeta);
  if (s == 0) return std::exp(-2.0);
  const double phase = s > 0 ? std::acos(zeta) / std::sqrt(s) : std::acosh(zeta) / std::sqrt(-s);
  return std::exp(-2 * zeta * phase);
}

double damping_ratio_for(double restitution) {
  const double e = std::clamp(restitution, least_restitution, 1.0);
  return bisect(0, 10, [&](double zeta) { return restitution_of(zeta) > e; }).first;  // it falls
}

}  // namespace talus::contact
