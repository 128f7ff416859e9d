/// How many cells a round section has.
#pragma once
#include <algorithm>
#include <cmath>

namespace talus {

/// A core of side x side quadrilaterals inside `rings` rings of 4 side each.
struct RoundSection {
  int side = 2, rings = 1;

  int facets() const { return 4 * side; }
  int across() const { return side + 2 * rings; }
  double cells() const { return static_cast<double>(side) * (side + 4.0 * rings); }
};

/// Mean radius of the core over that of the section.
constexpr double core_of_round_section = 0.66;

/// Facets are no longer than `cell_size` along the arc, rings as thick to the nearest whole number; with the
/// eight facets and the one ring that a section has at least [m].
inline RoundSection round_section(double diameter, double cell_size) {
  const double most = 1e6, quarter = M_PI / 4 * diameter / cell_size,
               thickness = 0.5 * (1 - core_of_round_section) * diameter / cell_size;
  return {static_cast<int>(std::clamp(std::ceil(quarter - 1e-9), 2.0, most)),
          static_cast<int>(std::clamp(std::round(thickness), 1.0, most))};
}

}  // namespace talus
