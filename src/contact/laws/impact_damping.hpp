/// Coefficient of restitution of a spring with a dashpot that cannot pull.
#pragma once

namespace talus::contact {

/// Restitution of a mass on a spring and a dashpot in parallel, damping ratio zeta >= 0, whose force is never
/// tensile: they part where it vanishes, at t = 2 acos(zeta) / (omega sqrt(1 - zeta^2)), so that e =
/// exp(-zeta omega t) (T. Schwager, T. Poeschel, Granular Matter 9 (2007) 465-469; derived again for the
/// test).
double restitution_of(double damping_ratio);

/// The least that a dashpot is made to give. e = 0 needs an infinite damping ratio, a hammer to whatever is
/// struck; that of 0.1 is 1.2.
inline constexpr double least_restitution = 0.1;

/// Its inverse, for e in [0, 1]; below `least_restitution` that of it.
double damping_ratio_for(double restitution);

}  // namespace talus::contact
