/// Lowest eigenvalue of K x = lambda M x by locally optimal conjugate gradients [knyazev2001], for systems
/// too large to factor:
///
///   w = T (K x - lambda M x),   next x: least Rayleigh quotient in the span of x, w and the last step p
#pragma once
#include <functional>
#include <span>

#include "core/types.hpp"

namespace talus::fem {

using LinearMap = std::function<void(const VecX&, VecX&)>;

/// `stiffness(x, y)`: y = K x; `inverse(r, w)`: w = T r, about K^-1 r, need not be linear. M is diagonal, `x`
/// the first guess, `tolerance` that of lambda, relative. Throws NumericalFailure if 100 steps do not reach
/// it. `sum`: adds up what several processes have of the vectors, numbers in place; null: one has them all.
double lowest_eigenvalue(const VecX& mass, const LinearMap& stiffness, const LinearMap& inverse, VecX x,
                         double tolerance, const std::function<void(std::span<double>)>& sum = {});

}  // namespace talus::fem
