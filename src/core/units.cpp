#include "core/units.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace talus {
namespace {

struct Unit {
  std::string_view name;
  int ten;        // power of ten
  double factor;  // what no power of ten can say
  Dimension dimension;
  bool prefixes;
};

constexpr double pi = std::numbers::pi;
constexpr std::array<Unit, 24> units{{
    {"m", 0, 1, {1, 0, 0, 0}, true},
    {"g", -3, 1, {0, 1, 0, 0}, true},
    {"t", 3, 1, {0, 1, 0, 0}, true},
    {"s", 0, 1, {0, 0, 1, 0}, true},
    {"min", 0, 60, {0, 0, 1, 0}, false},
    {"h", 0, 3600, {0, 0, 1, 0}, false},
    {"rad", 0, 1, {0, 0, 0, 1}, true},
    {"deg", 0, pi / 180, {0, 0, 0, 1}, false},
    {"\u00b0", 0, pi / 180, {0, 0, 0, 1}, false},
    {"gon", 0, pi / 200, {0, 0, 0, 1}, false},
    {"N", 0, 1, {1, 1, -2, 0}, true},
    {"kgf", 0, 9.80665, {1, 1, -2, 0}, false},
    {"Pa", 0, 1, {-1, 1, -2, 0}, true},
    {"bar", 5, 1, {-1, 1, -2, 0}, true},
    {"J", 0, 1, {2, 1, -2, 0}, true},
    {"W", 0, 1, {2, 1, -3, 0}, true},
    {"Hz", 0, 1, {0, 0, -1, 0}, true},
    {"rpm", 0, pi / 30, {0, 0, -1, 1}, false},
    {"l", -3, 1, {3, 0, 0, 0}, false},
    {"L", -3, 1, {3, 0, 0, 0}, false},
    {"ha", 4, 1, {2, 0, 0, 0}, false},
    {"%", -2, 1, {0, 0, 0, 0}, false},
    {"1", 0, 1, {0, 0, 0, 0}, false},
    {"-", 0, 1, {0, 0, 0, 0}, false},
}};

constexpr std::array<std::pair<std::string_view, int>, 11> prefixes{{{"G", 9},
                                                                     {"M", 6},
                                                                     {"k", 3},
                                                                     {"h", 2},
                                                                     {"d", -1},
                                                                     {"c", -2},
                                                                     {"m", -3},
                                                                     {"u", -6},
                                                                     {"\u00b5", -6},
                                                                     {"\u03bc", -6},
                                                                     {"n", -9}}};

bool find_unit(std::string_view text, Unit& found) {
  for (const Unit& unit : units)
    if (unit.name == text) {
      found = unit;
      return true;
    }
  for (const auto& [prefix, ten] : prefixes) {
    if (text.size() <= prefix.size() || text.substr(0, prefix.size()) != prefix) continue;
    for (const Unit& unit : units)
      if (unit.prefixes && unit.name == text.substr(prefix.size())) {
        found = unit;
        found.ten += ten;
        return true;
      }
  }
  return false;
}

/// What a unit that is not known is written as.
std::string unknown_unit(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 22> strangers{
      {{"ft", "1 ft = 0.3048 m"},       {"feet", "1 ft = 0.3048 m"},
       {"in", "1 in = 25.4 mm"},        {"inch", "1 in = 25.4 mm"},
       {"yd", "1 yd = 0.9144 m"},       {"mile", "1 mile = 1609.344 m"},
       {"mph", "1 mph = 0.44704 m/s"},  {"lb", "1 lb = 0.45359237 kg"},
       {"lbs", "1 lb = 0.45359237 kg"}, {"psi", "1 psi = 6894.757 Pa"},
       {"ksi", "1 ksi = 6.894757 MPa"}, {"grad", "write \"deg\" (degrees) or \"gon\""},
       {"degree", "write \"deg\""},     {"degrees", "write \"deg\""},
       {"sec", "write \"s\""},          {"hr", "write \"h\""},
       {"metre", "write \"m\""},        {"meter", "write \"m\""},
       {"meters", "write \"m\""},       {"ton", "write \"t\""},
       {"tonnes", "write \"t\""},       {"kmh", "write \"km/h\""}}};
  for (const auto& [stranger, what] : strangers)
    if (stranger == name) return fmt::format("unknown unit \"{}\": {}", name, what);
  std::string known;
  for (const Unit& unit : units)
    if (unit.name != "1" && unit.name != "-") known += (known.empty() ? "" : " ") + std::string(unit.name);
  return fmt::format(
      "unknown unit \"{}\"; known are {}, with the prefixes G M k h d c m u n, joined as in \"t/m^3\"", name,
      known);
}

bool is_space(char c) { return c == ' ' || c == '\t'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Reads "^-2", "^2", "2", or a superscript after a unit name; 1 if there is none.
bool read_exponent(std::string_view text, std::size_t& i, int& exponent) {
  exponent = 1;
  if (text.substr(i, 2) == "\u00b2") {
    exponent = 2;
    i += 2;
    return true;
  }
  if (text.substr(i, 2) == "\u00b3") {
    exponent = 3;
    i += 2;
    return true;
  }
  const bool caret = i < text.size() && text[i] == '^';
  const bool stars = text.substr(i, 2) == "**";
  if (caret) ++i;
  if (stars) i += 2;
  if (!caret && !stars && !(i < text.size() && is_digit(text[i]))) return true;
  const char* first = text.data() + i;
  const char* last = text.data() + text.size();
  const auto [end, status] = std::from_chars(first, last, exponent);
  if (status != std::errc{} || exponent == 0 || std::abs(exponent) > 9) return false;
  i += static_cast<std::size_t>(end - first);
  return true;
}

/// Length of the name of a unit at the start of the text.
std::size_t name_length(std::string_view text) {
  constexpr std::string_view ends = " \t/*.^0123456789";
  std::size_t i = text.starts_with('1') || text.starts_with('-') || text.starts_with('%') ? 1 : 0;
  if (i > 0) return i;
  while (i < text.size() && ends.find(text[i]) == std::string_view::npos && text.substr(i, 2) != "\u00b2" &&
         text.substr(i, 2) != "\u00b3" && text.substr(i, 2) != "\u00b7")
    ++i;
  return i;
}

/// A product of units: its power of ten, the factor that no power of ten can say, its dimension.
struct Product {
  int ten = 0;
  double factor = 1;
  Dimension dimension;

  void take(const Unit& unit, int exponent) {
    ten += unit.ten * exponent;
    if (unit.factor != 1) factor *= std::pow(unit.factor, exponent);
    dimension.m += unit.dimension.m * exponent;
    dimension.kg += unit.dimension.kg * exponent;
    dimension.s += unit.dimension.s * exponent;
    dimension.rad += unit.dimension.rad * exponent;
  }
};

/// Reads what stands behind a number: " m/s^2", " N*s", "%". A 1 stands alone or is divided ("1/m"), a -
/// stands alone behind a blank; all other digits and signs there are those of a second number.
bool parse_product(std::string_view text, Product& product, std::string& error) {
  int sense = 1;  // -1 for the factor after a '/'
  bool expect_unit = false;
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (is_space(c)) {
      ++i;
      continue;
    }
    if (c == '/' || c == '*' || c == '.' || text.substr(i, 2) == "\u00b7") {
      if (expect_unit || (i == 0 && c != '/')) {
        error = fmt::format("a unit is missing in \"{}\"", text);
        return false;
      }
      sense = c == '/' ? -1 : 1;
      expect_unit = true;
      i += c == '/' || c == '*' || c == '.' ? 1 : 2;
      continue;
    }
    const std::string_view name = text.substr(i, name_length(text.substr(i)));
    const std::string_view behind = text.substr(i + name.size());
    const auto next = behind.find_first_not_of(" \t");
    const bool alone = next == std::string_view::npos && text.find_first_not_of(" \t") == i;
    const bool second = name == "1"   ? !(alone || (next != std::string_view::npos && behind[next] == '/'))
                        : name == "-" ? !(alone && i > 0)
                                      : is_digit(c);
    if (second) {
      error = fmt::format("goes on with \"{}\" where a unit or nothing is expected", text.substr(i));
      return false;
    }
    Unit unit{};
    if (name.empty() || !find_unit(name, unit)) {
      error = unknown_unit(name.empty() ? text.substr(i) : name);
      return false;
    }
    i += name.size();
    int exponent = 1;
    if (!read_exponent(text, i, exponent)) {
      error = fmt::format("the exponent of \"{}\" is no whole number from -9 to 9", name);
      return false;
    }
    product.take(unit, exponent * sense);
    sense = 1;
    expect_unit = false;
  }
  if (expect_unit) error = fmt::format("a unit is missing at the end of \"{}\"", text);
  return !expect_unit;
}

/// The number with its decimal exponent moved, nearest double; nothing if that is too large or too small.
std::optional<double> shifted(std::string mantissa, int ten) {
  int exponent = 0;
  if (const auto e = mantissa.find_first_of("eE"); e != std::string::npos) {
    const char* from = mantissa.data() + e + 1;
    if (*from == '+') ++from;
    std::from_chars(from, mantissa.data() + mantissa.size(), exponent);
    mantissa.resize(e);
  }
  const std::string text = fmt::format("{}e{}", mantissa, exponent + ten);
  double value = 0;
  if (std::from_chars(text.data(), text.data() + text.size(), value).ec != std::errc{}) return {};
  return value;
}

}  // namespace

bool groups_digits(std::string_view text) {
  const auto comma = text.find(',');
  if (comma == std::string_view::npos) return false;
  const std::string_view after = text.substr(comma + 1);
  const auto digits = std::min(after.find_first_not_of("0123456789"), after.size());
  const auto first = text.find_first_of("0123456789");
  return digits == 3 && first < comma && text[first] != '0' && comma - first <= 3;
}

std::optional<Quantity> parse_quantity(std::string_view text, std::string& error) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const std::size_t sign = !text.empty() && text.front() == '-' ? 1 : 0;
  if (text.size() <= sign || !(is_digit(text[sign]) || text[sign] == '.')) {
    error = "does not start with a number";
    return {};
  }
  constexpr std::string_view out_of_range = "the number is too large or too small";
  double value = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc{}) {
    error = status == std::errc::result_out_of_range ? out_of_range : "does not start with a number";
    return {};
  }
  const std::string number(text.data(), end);
  const std::string_view rest = text.substr(number.size());
  if (rest.size() > 1 && rest[0] == ',' && is_digit(rest[1])) {
    std::string with_point(text);
    with_point[number.size()] = '.';
    error = fmt::format("has a decimal comma: write \"{}\"", with_point);
    if (groups_digits(text)) {
      std::string joined(text);
      joined.erase(number.size(), 1);
      error = fmt::format("has a comma: write \"{}\" or \"{}\", as it is meant", joined, with_point);
    }
    return {};
  }
  Product unit;
  if (!parse_product(rest, unit, error)) return {};
  const std::optional<double> moved = unit.ten == 0 ? value : shifted(number, unit.ten);
  Quantity result{moved && unit.factor != 1 ? *moved * unit.factor : moved.value_or(HUGE_VAL),
                  unit.dimension};
  if (!std::isfinite(result.value)) {
    error = out_of_range;
    return {};
  }
  return result;
}

bool counts_turns(std::string_view text) { return text.find("Hz") != std::string_view::npos; }

namespace {
struct Named {
  Dimension dimension;
  std::string_view unit, what, example;
};
// Fracture energy and contact stiffness share N/m; the key's own text tells them apart.
constexpr std::array<Named, 17> named{{
    {dimension::number, "1", "a number", "0.4"},
    {dimension::length, "m", "a length", "3.84 or \"3.84 m\" or \"25 mm\""},
    {dimension::area, "m^2", "an area", "0.5 or \"0.5 m^2\""},
    {dimension::volume, "m^3", "a volume", "115 or \"115 m^3\""},
    {dimension::time, "s", "a time", "1e-3 or \"1 ms\""},
    {dimension::mass, "kg", "a mass", "0.0448 or \"44.8 g\" or \"2.5 t\""},
    {dimension::angle, "rad", "an angle", "\"28 deg\" or \"0.5 rad\""},
    {dimension::velocity, "m/s", "a velocity", "25 or \"25 m/s\" or \"90 km/h\""},
    {dimension::acceleration, "m/s^2", "an acceleration", "9.81 or \"9.81 m/s^2\""},
    {dimension::angular_velocity, "rad/s", "an angular velocity", "2 or \"2 rad/s\" or \"90 deg/s\""},
    {dimension::density, "kg/m^3", "a density", "2500 or \"2.5 t/m^3\""},
    {dimension::pressure, "Pa", "a stress or modulus", "3e9 or \"30 GPa\" or \"2.5 MPa\""},
    {dimension::force, "N", "a force", "1e6 or \"1 MN\""},
    {dimension::stiffness, "N/m", "a force per length", "3e10 or \"30 GN/m\""},
    {dimension::stiffness_per_area, "Pa/m", "a stress per length", "\"20 GPa/m\""},
    {dimension::per_length, "1/m", "a number per length", "0.1 or \"0.1 1/m\""},
    {Dimension{0, 0, -1, 0}, "1/s", "a frequency", "5 or \"5 Hz\""},
}};

void append_power(std::string& text, std::string_view base, int power) {
  if (power == 0) return;
  if (!text.empty()) text += ' ';
  text += base;
  if (power != 1) text += fmt::format("^{}", power);
}
}  // namespace

std::string unit_name(Dimension dimension) {
  for (const Named& entry : named)
    if (entry.dimension == dimension) return std::string(entry.unit);
  std::string text;
  append_power(text, "kg", dimension.kg);
  append_power(text, "m", dimension.m);
  append_power(text, "s", dimension.s);
  append_power(text, "rad", dimension.rad);
  return text;
}

std::string describe(Dimension dimension) {
  for (const Named& entry : named)
    if (entry.dimension == dimension)
      return dimension.none() ? fmt::format("{}, e.g. {}", entry.what, entry.example)
                              : fmt::format("{} in {}, e.g. {}", entry.what, entry.unit, entry.example);
  return "a quantity in " + unit_name(dimension);
}

std::string exact_text(double value) { return fmt::format("{}", value); }

}  // namespace talus
