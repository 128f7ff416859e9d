/// Points in messages.
#pragma once
#include <fmt/format.h>

#include <cmath>
#include <string>

#include "core/types.hpp"

namespace talus {

/// "[x, y, z]" to the millimetre [m], whatever the size of the coordinates: a place 2 km from the origin is
/// one place, and not all within 10 m of it.
inline std::string place_text(const Vec3& x) {
  const auto millimetres = [](double c) { return std::round(1e3 * c) / 1e3 + 0.0; };
  return fmt::format("[{:.12g}, {:.12g}, {:.12g}]", millimetres(x.x()), millimetres(x.y()),
                     millimetres(x.z()));
}

}  // namespace talus
