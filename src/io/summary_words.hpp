/// Numbers as the sentences of a summary have them.
#pragma once
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "core/types.hpp"

namespace talus::io {

/// A number with a unit prefix, for sentences: 2.31e6 N -> "2.31 MN".
inline std::string engineering(double value, const char* unit) {
  const double a = std::abs(value);
  const char* prefix = "";
  double scale = 1;
  if (a >= 1e9)
    prefix = "G", scale = 1e9;
  else if (a >= 1e6)
    prefix = "M", scale = 1e6;
  else if (a >= 1e3)
    prefix = "k", scale = 1e3;
  else if (a > 0 && a < 1e-3)
    prefix = "u", scale = 1e-6;
  else if (a > 0 && a < 1)
    prefix = "m", scale = 1e-3;
  return fmt::format("{:.3g} {}{}", value / scale, prefix, unit);
}

/// "397 m", "12.3 m", "112 mm": lengths as a headline has them.
inline std::string length(double metres) {
  return std::abs(metres) >= 100 ? fmt::format("{:.0f} m", metres) : engineering(metres, "m");
}

/// "12.3 m/s", "0.062 m/s".
inline std::string speed_text(double speed) {
  return speed < 1 ? fmt::format("{:.2g} m/s", speed) : fmt::format("{:.1f} m/s", speed);
}

inline double horizontal(const Vec3& v) { return std::hypot(v.x(), v.y()); }

}  // namespace talus::io
