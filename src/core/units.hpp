/// Physical quantities as text: "3.84 m", "28 deg", "2.5 t/m^3", "30 GN/m".
///
///   value in SI = number x 10^n x factor
///
/// The powers of ten of the prefixes are added to the decimal exponent before the text becomes a double, so
/// "44.8 g" is the double nearest to 0.0448, and not 44.8 x 0.001.
///
/// symbol   meaning                                   unit
/// m, kg, s exponents of the base units               1
/// rad      exponent of the plane angle, kept apart   1
///          so that a friction angle is no number
#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace talus {

struct Dimension {
  int m = 0, kg = 0, s = 0, rad = 0;
  bool operator==(const Dimension&) const = default;
  bool none() const { return *this == Dimension{}; }
};

namespace dimension {
inline constexpr Dimension number{};
inline constexpr Dimension length{1, 0, 0, 0};
inline constexpr Dimension area{2, 0, 0, 0};
inline constexpr Dimension volume{3, 0, 0, 0};
inline constexpr Dimension time{0, 0, 1, 0};
inline constexpr Dimension mass{0, 1, 0, 0};
inline constexpr Dimension angle{0, 0, 0, 1};
inline constexpr Dimension velocity{1, 0, -1, 0};
inline constexpr Dimension acceleration{1, 0, -2, 0};
inline constexpr Dimension angular_velocity{0, 0, -1, 1};
inline constexpr Dimension density{-3, 1, 0, 0};
inline constexpr Dimension pressure{-1, 1, -2, 0};
inline constexpr Dimension force{1, 1, -2, 0};
inline constexpr Dimension rate{0, 0, -1, 0};
inline constexpr Dimension mass_rate{0, 1, -1, 0};
inline constexpr Dimension stiffness{0, 1, -2, 0};            // N/m
inline constexpr Dimension stiffness_per_area{-2, 1, -2, 0};  // Pa/m
inline constexpr Dimension fracture_energy{0, 1, -2, 0};      // N/m
inline constexpr Dimension per_length{-1, 0, 0, 0};
}  // namespace dimension

struct Quantity {
  double value = 0;  // SI
  Dimension dimension;
};

/// True for "1,000": a comma that may as well set thousands apart as be a decimal one. "0,125" has a decimal
/// one.
bool groups_digits(std::string_view text);

/// Reads a number with an optional unit. On failure returns nothing and says why in `error` (a clause without
/// a full stop, such as `unknown unit "metre"`).
std::optional<Quantity> parse_quantity(std::string_view text, std::string& error);

/// True where a unit is in Hz: as an angular velocity it counts turns, and 1/s radians.
bool counts_turns(std::string_view text);

/// "m/s^2", "Pa", "1": the SI unit a dimension is written with.
std::string unit_name(Dimension dimension);

/// What a quantity of this dimension is called and how it is written: `a length in m, e.g. 3.84 or "3.84 m"
/// or "25 mm"`.
std::string describe(Dimension dimension);

/// Shortest text that reads back to the same double.
std::string exact_text(double value);

}  // namespace talus
