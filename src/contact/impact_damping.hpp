/// Coefficient of restitution of a spring with a dashpot that cannot pull.
#pragma once

namespace talus::contact {

/// Restitution of a mass on a spring and a dashpot in parallel, damping ratio zeta >= 0, whose force is never
/// tensile: they part where it vanishes, at t = 2 acos(zeta) / (omega sqrt(1 - zeta^2)), so that e =
/// exp(-zeta omega t) (T. Schwager, T. Poeschel, Granular Matter 9 (2007) 465-469; derived again for the
/// test).
double restitution_of(double damping_ratio);

/// Its inverse, for e in [0, 1]. e = 0 needs an infinite one, a hammer to whatever is struck: below 0.1 that
/// of 0.1 is given, 1.2.
double damping_ratio_for(double restitution);

}  // namespace talus::contact
