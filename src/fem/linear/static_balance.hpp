/// Static balance of a structure whose forces are not linear, f_int(u) = f, by Newton's method with the
/// stiffness K of the undamaged one:
///
///   u += omega K^-1 (f - f_int(u)),     omega by Aitken's rule on the corrections [irons1969]
///
/// K is no softer than the tangent, so that the iteration converges where the balance is stable.
#pragma once
#include <functional>

#include "core/types.hpp"

namespace talus::fem {

constexpr double balanced_enough = 1e-8;  // forces left over those that act, where it comes no nearer

struct StaticBalance {
  bool found = false;
  int passes = 0;
};

/// `left(r)`: writes f - f_int(u) [N] and returns its norm over that of f; `solve(r, d)`: d = K^-1 r;
/// `move(d)`: u += d [m]. Vectors of `n` free degrees of freedom.
StaticBalance find_balance(int n, const std::function<double(VecX&)>& left,
                           const std::function<void(const VecX&, VecX&)>& solve,
                           const std::function<void(const VecX&)>& move);

}  // namespace talus::fem
