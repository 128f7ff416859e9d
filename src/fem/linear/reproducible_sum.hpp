/// Sums that have the same bits in any order, hence on any number of ranks.
///
///   s = sum_i q_1(t_i) + sum_i q_2(t_i - q_1(t_i))
///   q_k: rounding to multiples of a unit so large that sums of count numbers are exact [demmel2013]
///
/// The error is that of one rounding to the second unit, count 2^-53 of the first one, which is count 2^-53
/// of the largest term.
#pragma once
#include <algorithm>
#include <cmath>

#include "fem/discretisation/partition.hpp"

namespace talus::fem {

/// Of term(i) over the numbers i of nodal fields (nodes x 4) at these nodes, of which all ranks together have
/// at most `count`. `partition`: null on one process.
template <class Term>
double reproducible_sum(const std::vector<NodeRange>& nodes, double count, Partition* partition,
                        const Term& term) {
  const auto each = [&](auto&& use) {
    for (const auto& [first, last] : nodes)
      for (std::size_t i = 4 * static_cast<std::size_t>(first); i < 4 * static_cast<std::size_t>(last); ++i)
        use(term(i));
  };
  double most = 0;
  each([&](double t) { most = std::max(most, std::abs(t)); });
  if (partition != nullptr) most = partition->largest(most);
  if (most == 0) return 0;
  const int bits = std::max(3, std::ilogb(count) + 1);
  const double unit = std::ldexp(1.0, std::ilogb(most) + 1 + bits - 53), finer = std::ldexp(unit, bits - 53);
  const double snap = 0x1.8p52 * unit,
               snap_finer =
                   0x1.8p52 * finer;  // what is added to these and taken off again is a multiple of the unit
  double sums[2] = {};
  each([&](double t) {
    const double q = (t + snap) - snap;
    sums[0] += q;
    sums[1] += ((t - q) + snap_finer) - snap_finer;
  });
  if (partition != nullptr) partition->sum(sums);
  return sums[0] + sums[1];
}

}  // namespace talus::fem
