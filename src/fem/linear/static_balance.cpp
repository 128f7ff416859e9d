#include "fem/linear/static_balance.hpp"

#include <algorithm>
#include <limits>

namespace talus::fem {

StaticBalance find_balance(int n, const std::function<double(VecX&)>& left,
                           const std::function<void(const VecX&, VecX&)>& solve,
                           const std::function<void(const VecX&)>& move) {
  constexpr double exact = 1e-12;                  // forces left over those that act
  constexpr int most_passes = 400, patience = 30;  // the latter: passes that do not halve what is left
  VecX force(n), way(n), last(n);
  double omega = 1, least = std::numeric_limits<double>::infinity();
  int fruitless = 0;
  for (int pass = 0; pass < most_passes; ++pass) {
    const double residual = left(force);
    fruitless = residual < 0.5 * least ? 0 : fruitless + 1;
    if (fruitless == 0) least = residual;
    if (residual <= exact || (fruitless > patience && residual <= balanced_enough)) return {true, pass};
    if (fruitless > patience && least > balanced_enough) return {false, pass};
    solve(force, way);
    if (pass > 0) {
      const VecX change = way - last;
      if (const double size = change.squaredNorm(); size > 0)
        omega = std::clamp(-omega * last.dot(change) / size, 0.5, 20.0);
    }
    last = way;
    move(omega * way);
  }
  return {false, most_passes};
}

}  // namespace talus::fem
