#include "formulas/formulas.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/reject.hpp"
#include "core/suggest.hpp"

namespace talus::formulas {
namespace {

constexpr double pi = 3.14159265358979323846, g = 9.81;
constexpr const char* unverified = "as commonly cited, unverified";

/// A number with the prefix that leaves one to three digits before the point.
std::string readable(double value, const std::string& unit) {
  if (unit == "1") return fmt::format("{:.4g}", value);
  if (unit == "rad") return fmt::format("{:.4g} deg", value * 180 / pi);
  if (unit != "N" && unit != "Pa" && unit != "J" && unit != "N/m")
    return fmt::format("{:.4g} {}", value, unit);
  for (const auto& [factor, prefix] : {std::pair{1e9, "G"}, {1e6, "M"}, {1e3, "k"}})
    if (std::abs(value) >= factor) return fmt::format("{:.4g} {}{}", value / factor, prefix, unit);
  return fmt::format("{:.4g} {}", value, unit);
}

/// Of a circle about the middle of a rectangle, the length inside it [m].
double perimeter_within(double radius, double a, double b) {
  // In a quadrant, angles from the first axis: within half of a beyond alpha, within half of b below beta.
  const double alpha = std::acos(std::min(1.0, 0.5 * a / radius)),
               beta = std::asin(std::min(1.0, 0.5 * b / radius));
  return 4 * radius * std::max(0.0, beta - alpha);
}

std::string unit_of(const InputValue& v) {
  if (v.dimension == dimension::pressure) return "Pa";
  if (v.dimension == dimension::stiffness) return "N/m";
  if (v.dimension == dimension::angle) return "rad";
  return unit_name(v.dimension);
}

}  // namespace

std::string text(const InputValue& value) { return readable(value.value, unit_of(value)); }

const char* text(Kind kind) {
  switch (kind) {
    case Kind::peak: return "peak";
    case Kind::mean: return "mean";
    case Kind::equivalent_static: return "equivalent static";
    case Kind::resistance: return "resistance";
  }
  return "";
}

Inputs::Inputs(double mass, double velocity, double diameter) {
  const auto add = [&](const char* name, const char* symbol, Dimension d, double value, const char* origin,
                       double low, double high, const char* meaning) {
    values_.push_back({name, symbol, d, value, meaning, origin, low, high});
  };
  namespace dim = dimension;
  add("mass", "m", dim::mass, mass, "given", 1e-3, 1e9, "mass of the block");
  add("velocity", "v", dim::velocity, velocity, "given", 1e-3, 1e3,
      "velocity of the block towards the surface");
  const double sphere = std::cbrt(6 * mass / (pi * 2600));
  add("diameter", "D", dim::length, diameter > 0 ? diameter : sphere,
      diameter > 0 ? "given" : "sphere of 2600 kg/m^3", 1e-3, 1e3, "diameter of the block");
  add("block_young", "E_b", dim::pressure, 30e9, "default", 1e5, 1e12, "Young's modulus of the block");
  add("block_poisson", "nu_b", dim::number, 0.25, "default", 0, 0.499, "Poisson's ratio of the block");
  add("target_young", "E_c", dim::pressure, 33.55e9, "default, C30", 1e5, 1e12,
      "Young's modulus of the structure");
  add("target_poisson", "nu_c", dim::number, 0.2, "default", 0, 0.499, "Poisson's ratio of the structure");
  add("cushion_modulus", "M_E", dim::pressure, 3.2e6, "default", 1e4, 1e10,
      "modulus of subgrade reaction of the cushion (plate test)");
  add("cushion_thickness", "e", dim::length, 0.5, "default", 0.05, 20, "thickness of the cushion");
  add("cushion_friction_angle", "phi", dim::angle, 35 * pi / 180, "default", 10 * pi / 180, 60 * pi / 180,
      "angle of internal friction of the cushion");
  add("lame_constant", "lambda", dim::pressure, 1e6, "default, sand", 1e4, 1e10,
      "Lame constant of the cushion (Japanese handbook)");
  add("contact_stiffness", "k", dim::stiffness, 0, "", 1e2, 1e14,
      "stiffness of the block, E_b A / D of a sphere's cross-section");
  add("f_ck", "f_ck", dim::pressure, 30e6, "default", 12e6, 90e6, "characteristic strength of the concrete");
  add("effective_depth", "d", dim::length, 0.45, "default", 0.02, 10, "effective depth of the slab or wall");
  add("reinforcement_ratio", "rho", dim::number, 0.005, "default", 0, 0.1,
      "mean ratio of the tension reinforcement");
  add("load_diameter", "c", dim::length, 0, "", 1e-3, 100,
      "diameter of the loaded area, half the block's diameter");
  add("width", "b", dim::length, 1000, "default, no edge in reach", 0.01, 1e4,
      "extent of the slab or wall across the blow");
  add("width_across", "b_2", dim::length, 1000, "default, no edge in reach", 0.01, 1e4,
      "the other extent across the blow");
  add("gamma_c", "gamma_c", dim::number, 1.2, "default, accidental", 1, 2, "partial factor of the concrete");
  for (const InputValue& v : values_)
    if (v.name == "mass" || v.name == "velocity" || v.name == "diameter") check(v);
  find("contact_stiffness").value = get("block_young") * pi * get("diameter") / 4;
  find("contact_stiffness").origin = "E_b A / D";
  find("load_diameter").value = 0.5 * get("diameter");
  find("load_diameter").origin = "D / 2";
}

InputValue& Inputs::find(const std::string& name) {
  std::vector<std::string> known;
  for (InputValue& v : values_) {
    if (v.name == name) return v;
    known.push_back(v.name);
  }
  const std::string near = nearest_name(name, known);
  std::string list;
  for (const auto& k : known) list += (list.empty() ? "" : ", ") + k;
  throw InputError(problem_of(name, "", "the formulas have no such input",
                              near.empty() ? "use one of " + list : "did you mean " + near + "?"));
}

double Inputs::get(const std::string& name) const { return const_cast<Inputs*>(this)->find(name).value; }

void Inputs::check(const InputValue& v) const {
  if (v.value >= v.low && v.value <= v.high) return;
  const std::string unit = unit_of(v);
  throw InputError(
      problem_of(v.name, readable(v.value, unit),
                 fmt::format("must be between {} and {}", readable(v.low, unit), readable(v.high, unit)),
                 "check the value and its unit"));
}

void Inputs::set(const std::string& name, double value, const std::string& origin) {
  InputValue& v = find(name);
  const InputValue old = v;
  v.value = value;
  v.origin = origin;
  try {
    check(v);
  } catch (...) {
    v = old;
    throw;
  }
  if ((name == "block_young" || name == "diameter") && find("contact_stiffness").origin != "given")
    find("contact_stiffness").value = get("block_young") * pi * get("diameter") / 4;
  if (name == "diameter" && find("load_diameter").origin != "given")
    find("load_diameter").value = 0.5 * value;
  if (name == "mass" && find("diameter").origin != "given") {
    const std::string origin = find("diameter").origin;
    set("diameter", std::cbrt(6 * value / (pi * 2600)));
    find("diameter").origin = origin;
  }
}

void Inputs::set(const std::string& name, const std::string& value) {
  const InputValue& v = find(name);
  std::string error;
  const auto q = parse_quantity(value, error);
  if (!q) throw InputError(problem_of(name, value, error, "expected " + describe(v.dimension)));
  // A bare number is SI, but an angle needs its unit: 35 would be read as radians.
  if (q->dimension != v.dimension && !(q->dimension.none() && v.dimension != dimension::angle))
    throw InputError(problem_of(name, value, "has the wrong unit", "expected " + describe(v.dimension)));
  set(name, q->value);
}

std::vector<Result> evaluate(const Inputs& in, bool cushion) {
  const double m = in.get("mass"), v = in.get("velocity"), radius = 0.5 * in.get("diameter");
  const double energy = 0.5 * m * v * v, height = v * v / (2 * g);
  const auto uses = [&](std::initializer_list<const char*> names) {
    std::vector<InputValue> list;
    for (const char* name : names)
      for (const InputValue& x : in.all())
        if (x.name == name) list.push_back(x);
    return list;
  };
  std::vector<Result> results;
  const auto add = [&](const char* id, const char* title, double value, Kind kind, const char* equation,
                       const char* source, const char* status, const std::string& note,
                       std::vector<InputValue> inputs) {
    results.push_back({id, title, kind == Kind::resistance ? "V_Rd" : "F", "N", value, kind, equation, source,
                       status, note, std::move(inputs)});
  };

  const auto plane = [&](const char* e, const char* nu) { return (1 - in.get(nu) * in.get(nu)) / in.get(e); };
  const double e_star = 1 / (plane("block_young", "block_poisson") + plane("target_young", "target_poisson"));
  const double k_hertz = 4.0 / 3.0 * e_star * std::sqrt(radius);
  add("hertz", "Hertz, elastic", std::pow(k_hertz, 0.4) * std::pow(2.5 * energy, 0.6), Kind::peak,
      "(4/3 E* sqrt R)^(2/5) (5/2 W)^(3/5)", "Hertz 1882; Goldsmith, Impact, 1960", "verified: closed form",
      "sphere on a half-space without crushing: an upper bound",
      uses({"mass", "velocity", "diameter", "block_young", "block_poisson", "target_young",
            "target_poisson"}));

  add("labiouse", "Labiouse et al., cushion",
      1.765 * std::pow(in.get("cushion_modulus"), 0.4) * std::pow(radius, 0.2) * std::pow(energy, 0.6),
      Kind::peak, "1.765 M_E^(2/5) R^(1/5) W^(3/5)",
      "Labiouse, Descoeudres, Montani, Struct. Eng. Int. 6(3), 1996", unverified,
      "fall on a gallery with a soil cushion", uses({"mass", "velocity", "diameter", "cushion_modulus"}));

  const double thickness = in.get("cushion_thickness"), alpha = std::sqrt(2 * radius / thickness);
  add("japan", "Japanese handbook, cushion",
      1e3 * 2.108 * std::pow(m * g / 1e3, 2.0 / 3.0) * std::pow(in.get("lame_constant") / 1e3, 0.4) *
          std::pow(height, 0.6) * alpha,
      Kind::peak, "2.108 (m g)^(2/3) lambda^(2/5) H^(3/5) alpha, in kN and m, alpha = sqrt(D/e)",
      "Japan Road Association, rockfall handbook, 2000", unverified,
      fmt::format("alpha = {:.3g} for the thickness of the cushion; below 1 it lowers the force", alpha),
      uses({"mass", "velocity", "diameter", "lame_constant", "cushion_thickness"}));

  add("switzerland", "ASTRA 12006, cushion",
      2.8 / std::sqrt(thickness) * std::pow(radius, 0.7) * std::pow(in.get("cushion_modulus"), 0.4) *
          std::tan(in.get("cushion_friction_angle")) * std::pow(energy, 0.6),
      Kind::equivalent_static, "2.8 e^(-1/2) R^(7/10) M_E^(2/5) tan(phi) W^(3/5)",
      "ASTRA 12006, Einwirkungen infolge Steinschlags, 2008", unverified,
      "to be multiplied by the construction coefficient (0.4 ductile, 1.2 brittle failure)",
      uses({"mass", "velocity", "diameter", "cushion_modulus", "cushion_thickness",
            "cushion_friction_angle"}));

  add("en1991-hard", "EN 1991-1-7, hard impact", v * std::sqrt(in.get("contact_stiffness") * m), Kind::peak,
      "v sqrt(k m)", "EN 1991-1-7:2006, annex C, eq. C.1", unverified,
      "rigid structure, the block as a rod of constant stiffness; written for vehicles and ships",
      uses({"mass", "velocity", "contact_stiffness"}));

  const double d = in.get("effective_depth"), f_ck = in.get("f_ck") / 1e6,
               rho = std::min(0.02, in.get("reinforcement_ratio")), gamma = in.get("gamma_c"),
               c = in.get("load_diameter");
  const double size = std::min(2.0, 1 + std::sqrt(0.2 / d));
  const double stress = std::max(0.18 / gamma * size * std::cbrt(100 * rho * f_ck),
                                 0.035 * std::pow(size, 1.5) * std::sqrt(f_ck));
  const double crush = 0.4 * 0.6 * (1 - f_ck / 250) * f_ck / gamma;
  const double reach = 0.5 * c + 2 * d, b = in.get("width"), b2 = in.get("width_across");
  const double u1 = perimeter_within(reach, b, b2), u0 = pi * c;
  const bool fits = 2 * reach <= std::min(b, b2), slab = fits || (std::min(b, b2) >= 5 * d && u1 > 0);
  const bool crushed = crush * u0 < stress * u1;
  std::string note =
      crushed
          ? "governed by crushing at the edge of the loaded area"
          : fmt::format("governed by the control perimeter at 2d, {:.3g} m{}; static, without rate effects",
                        u1, fits ? "" : fmt::format(" of it within the member, for a load in its middle"));
  if (!slab)
    note = fmt::format(
        "not applicable: the control perimeter at 2d, {:.3g} m across, is wider than the member ({:.3g} m), "
        "which is no slab (EN 1992-1-1 5.3.1); the shear of the member decides (V_dyn/V_Rd)",
        2 * reach, std::min(b, b2));
  add("en1992-punching", "EN 1992-1-1, punching",
      slab ? 1e6 * d * std::min(stress * u1, crush * u0) : std::numeric_limits<double>::quiet_NaN(),
      Kind::resistance,
      "min(v_Rd,c u_1, v_Rd,max u_0) d, u_1 at 2d within the member, no shear reinforcement",
      "EN 1992-1-1:2004, 6.4.4 and 6.4.5", unverified, note,
      uses({"f_ck", "effective_depth", "reinforcement_ratio", "load_diameter", "width", "width_across",
            "gamma_c"}));
  if (!cushion)
    std::erase_if(results, [](const Result& r) {
      return r.id == "labiouse" || r.id == "japan" || r.id == "switzerland";
    });
  return results;
}

std::string table(const Inputs& in, const std::vector<Result>& results) {
  std::string out = "Inputs\n";
  for (const InputValue& v : in.all())
    out += fmt::format("  {:<24}{:<9}{:>14}  {} ({})\n", v.name, v.symbol, text(v), v.meaning, v.origin);
  const double m = in.get("mass"), v = in.get("velocity");
  out += fmt::format("  {:<24}{:<9}{:>14}  m v^2 / 2\n  {:<24}{:<9}{:>14}  v^2 / (2 g)\n\nResults\n",
                     "kinetic energy", "W", readable(0.5 * m * v * v, "J"), "height of fall", "H",
                     fmt::format("{:.4g} m", v * v / (2 * g)));
  for (const Result& r : results) {
    out += fmt::format("  {:<30}{:<5}{:>12}  {}\n", r.title, r.symbol,
                       std::isfinite(r.value) ? readable(r.value, r.unit) : "-", text(r.kind));
    out += fmt::format("      {}\n      {} ({})\n      {}\n", r.equation, r.source, r.status, r.note);
  }
  return out;
}

}  // namespace talus::formulas
