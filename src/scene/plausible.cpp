#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scene/reading.hpp"

namespace talus::scene {
namespace {

constexpr double least_density = 100, most_density = 20000;  // [kg/m^3] foam to tungsten
constexpr auto warning = Problem::Severity::warning;

/// Motions and turns that no falling rock has: rocks were seen to reach some 60 m/s and 50 rad/s.
constexpr double fastest = 150, wildest = 150;  // [m/s], [rad/s]

/// A unit that a bare number may have been meant in.
struct LeftOut {
  double size;
  const char* name;
};
constexpr LeftOut kilopascals{1e3, "kPa"}, megapascals{1e6, "MPa"}, gigapascals{1e9, "GPa"},
    kilonewtons_a_metre{1e3, "kN/m"};
/// A stress or modulus far below what the key can mean is one in kPa, MPa or GPa, written without its unit.
struct Usual {
  const char* key;
  double least, most;          // what is beyond is hardly meant
  const char* what;            // it is not
  std::vector<LeftOut> units;  // of which one was probably left out, the smallest first
};
const Usual of_material[] = {
    {"young", 1e5, 2e12, "the modulus of no rock, concrete, steel or soil", {gigapascals}},
    {"tensile_strength", 1e4, 1e9, "the tensile strength of no rock or concrete", {megapascals}},
    {"fracture_energy", 1, 1e5, "the fracture energy of no rock or concrete", {kilonewtons_a_metre}},
};
const Usual of_interface[] = {
    {"cohesion", 1e3, 1e9, "next to nothing", {kilopascals, megapascals}},
    {"tension", 1e3, 1e9, "next to nothing", {kilopascals, megapascals}},
    {"restitution_half_speed", 0.01, fastest, "a speed that no rock strikes with", {}},
};
const Usual of_vegetation[] = {
    {"height", 0.05, 100, "the height of no plant", {}},
};
const Usual of_contact_law[] = {
    {"pressure", 1e3, 1e10, "the strength of no ground or cushion", {megapascals}},
};
const Usual of_joint_set[] = {
    {"cohesion", 1e3, 1e9, "next to nothing", {kilopascals, megapascals}},
    {"tension", 1e3, 1e9, "next to nothing", {kilopascals, megapascals}},
};
const Usual of_bonds[] = {
    {"bond_tension", 1e3, 1e9, "next to nothing", {kilopascals, megapascals}},
    {"bond_shear", 1e3, 1e9, "next to nothing", {kilopascals, megapascals}},
};
const Usual of_rebar[] = {
    {"yield", 1e8, 3e9, "the yield stress of no reinforcement", {megapascals}},
    {"prestress", 1e6, 3e9, "no prestress of a bar", {megapascals}},
};

template <std::size_t N>
void warn_of_unusual(const View& view, const Usual (&list)[N]) {
  for (const Usual& u : list) {
    const auto value = view.maybe(u.key);
    if (!value || !(*value > 0) || (*value >= u.least && *value <= u.most)) continue;
    const Dimension d = view.key_of(u.key).dimension;
    const auto unit = std::ranges::find_if(u.units, [&](const LeftOut& of) {
      return *value < u.least && *value * of.size >= u.least && *value * of.size <= u.most;
    });
    const bool bare = view.get(u.key)->is_number() && unit != u.units.end();
    view.problem(u.key, fmt::format("{:.4g} {} is {}", *value, unit_name(d), u.what),
                 bare ? fmt::format("a bare number is in {}: did you mean \"{:g} {}\"?", unit_name(d), *value,
                                    unit->name)
                      : std::string("check the number and its unit"),
                 warning);
  }
}

/// Least side of the section that stirrups go round, and length of the member [m]; 0: not known.
std::pair<double, double> section_and_length(const StructureSpec& spec) {
  const auto measure = [&](const char* name, double otherwise) {
    for (const auto& [key, value] : spec.parameters)
      if (key == name) return value;
    return otherwise;
  };
  if (spec.kind == "column") return {std::min(spec.size.x(), spec.size.y()), spec.size.z()};
  if (spec.kind == "viaduct")
    return {std::min(measure("pier_width", 1.5), measure("pier_depth", 1.5)), measure("pier_height", 10)};
  if (spec.kind == "box") return {spec.size.minCoeff(), spec.size.maxCoeff()};
  return {0, 0};
}

void warn_of_unusual_bars(const View& rule, const StructureSpec& spec) {
  warn_of_unusual(rule, of_rebar);
  const auto [side, length] = section_and_length(spec);
  if (!(side > 0) || !(length > 0) || rule.text("part") != "pier") return;
  if (const auto spacing = rule.maybe("spacing"); spacing && rule.text("kind") == "stirrups") {
    if (*spacing >= length)
      rule.problem("spacing",
                   fmt::format("is longer than the member ({:.4g} m): it would have no stirrups", length),
                   "check the unit: stirrups stand some 0.1 to 0.4 m apart");
    else if (*spacing > side)
      rule.problem("spacing",
                   fmt::format("is wider than the section's least side ({:.4g} m): such stirrups hold no bar "
                               "and carry no shear",
                               side),
                   "check the unit: stirrups stand some 0.1 to 0.4 m apart", warning);
  }
  constexpr double least_cover = 0.005;  // [m]
  const auto cover = rule.maybe("cover");
  if (cover && 2 * *cover >= side)
    rule.problem("cover", fmt::format("leaves no room for bars in the section, of {:.4g} m", side),
                 rule.get("cover")->is_number()
                     ? fmt::format("a bare number is in m: did you mean \"{:g} mm\"?", *cover)
                     : std::string("check the unit: concrete outside of bars is some 30 to 100 mm"));
  else if (cover && *cover < least_cover)
    rule.problem("cover", fmt::format("{:.3g} mm is next to no concrete outside of the bars", 1e3 * *cover),
                 "check the unit: it is some 30 to 100 mm", warning);
  else if (cover && *cover > 0.25 * side)
    rule.problem(
        "cover",
        fmt::format("puts the bars deep within the section, of {:.4g} m: in bending they do little", side),
        "check the unit: concrete outside of bars is some 30 to 100 mm", warning);
}

/// Measures of structures beyond anything that is built: a number of millimetres or centimetres that was read
/// as metres.
struct Built {
  const char* key;
  double most;  // beyond it nothing is built [m]
  const char* what;
};
constexpr Built of_structure[] = {
    {"height", 1000, "no column is that high"},
    {"section", 100, "no column is that thick"},
    {"section_size", 100, "no column is that thick"},
    {"diameter", 100, "no column is that thick"},
    {"wall_thickness", 20, "no wall of a hollow pier is that thick"},
    {"size", 3000, "no structure is that large"},
    {"pier_height", 1000, "no pier is that high"},
    {"pier_width", 100, "no pier is that wide"},
    {"pier_depth", 100, "no pier is that thick"},
    {"pier_diameter", 100, "no pier is that thick"},
    {"pier_spacing", 300, "no piers of one bent stand that far apart"},
    {"span_length", 3000, "no bridge spans that far"},
    {"cap_height", 100, "no cap beam is that deep"},
    {"cap_width", 100, "no cap beam is that wide"},
    {"cap_length", 300, "no cap beam is that long"},
    {"deck_width", 200, "no deck is that wide"},
    {"deck_depth", 100, "no deck is that deep"},
    {"slab_thickness", 20, "no deck slab is that thick"},
    {"bottom_slab", 20, "no deck slab is that thick"},
    {"girder_width", 50, "no girder is that wide"},
    {"bearing_height", 20, "no bearing is that high"},
    {"bearing_seat", 50, "no seat is that long"},
};

void refuse_what_nobody_builds(const View& view, const StructureSpec& spec) {
  for (const Built& b : of_structure) {
    const Node* node = view.get(b.key);
    if (!node) continue;
    std::vector<double> values;
    bool bare = true;
    std::string why;
    const auto take = [&](const Node& item) {
      if (const auto v = quantity_of(item, dimension::length, why)) values.push_back(*v);
      bare = bare && item.is_number();
    };
    if (node->kind == Node::Kind::array)
      for (const Node& item : node->items) take(item);
    else
      take(*node);
    const double most = values.empty() ? 0 : *std::max_element(values.begin(), values.end());
    if (!(most > b.most)) continue;
    view.problem(b.key, fmt::format("{}: {:.6g} m", b.what, most),
                 bare ? fmt::format("a bare number is in m: did you mean \"{:g} mm\"?", most)
                      : std::string("check the number and its unit"));
  }
  if ((spec.kind == "box" || spec.kind == "column") && spec.cell_size > spec.size.maxCoeff() &&
      spec.size.minCoeff() > 0 && view.get("cell_size"))
    view.problem("cell_size",
                 fmt::format("is larger than the structure, of {:.4g} x {:.4g} x {:.4g} m", spec.size.x(),
                             spec.size.y(), spec.size.z()),
                 view.get("cell_size")->is_number()
                     ? fmt::format("a bare number is in m: did you mean \"{:g} mm\"?", spec.cell_size)
                     : std::string("check its unit; some four to eight cells across the smallest section"),
                 warning);
}

/// Longitudinal bars lie within the stirrups where both have one cover; with less of it they run through
/// them.
void warn_of_bars_through_stirrups(const std::vector<View>& rules) {
  for (const View& bars : rules)
    for (const View& ties : rules) {
      if (bars.text("kind") != "longitudinal" || ties.text("kind") != "stirrups" ||
          bars.text("part") != ties.text("part"))
        continue;
      const auto inner = bars.maybe("cover"), outer = ties.maybe("cover");
      if (!inner || !outer || *inner > *outer - 1e-6) continue;
      bars.problem(
          "cover",
          fmt::format("is less than that of the stirrups, {:.4g} m: the bars would run through them", *outer),
          "give both the same: cover is the concrete outside of the stirrups", warning);
      break;
    }
}

/// Calls `look` for every value of the tree that is right by the table of keys.
template <class Look>
void for_each_value(const Node& table, const std::string& path, const Look& look) {
  for (const Node::Entry& entry : table.entries) {
    const std::string below = path.empty() ? entry.key : path + "." + entry.key;
    const Node& node = entry.value;
    if (const Key* key = find_key(below); key && !node.bad) look(*key, node);
    if (node.kind == Node::Kind::table) for_each_value(node, below, look);
    for (const Node& item : node.items)
      if (item.kind == Node::Kind::table) for_each_value(item, below, look);
  }
}

void warn_of_value(const Reading& in, const Node& node, std::string rule, std::string remedy) {
  Problem p;
  p.severity = warning;
  p.file = node.where.file, p.line = node.where.line, p.column = node.where.column;
  p.key = node.label;
  p.value = value_text(node);
  p.rule = std::move(rule);
  p.remedy = std::move(remedy);
  in.problems.push_back(std::move(p));
}

/// Angles without a unit: a whole number is hardly one of radians; of others the plan states the degrees.
void warn_of_bare_angle(const Reading& in, const Key& key, const Node& node) {
  if (key.type != Type::quantity || key.dimension != dimension::angle || !node.is_number() ||
      node.as_number() == 0)
    return;
  const double degrees = node.as_number() * 180 / std::numbers::pi;
  if (node.kind == Node::Kind::number)
    in.scene.notes.push_back(
        fmt::format("{} = {}, a bare number in radians: {:.4g} deg.", node.label, value_text(node), degrees));
  if (node.kind == Node::Kind::integer)
    warn_of_value(in, node, fmt::format("a bare number is in radians: this is {:.4g} deg", degrees),
                  fmt::format("write \"{} deg\", or \"{} rad\" if it is meant", node.integer, node.integer));
}

/// Friction beyond any of rock, soil or concrete: an angle without its unit, or a slip of the number.
void warn_of_steep_friction(const Reading& in, const Key& key, const Node& node) {
  constexpr double steepest = 70;  // [deg]
  if (key.type != Type::friction) return;
  const double coefficient = friction_coefficient(node),
               degrees = std::atan(coefficient) * 180 / std::numbers::pi;
  if (degrees <= steepest) return;
  std::string error;
  const auto quantity = node.is_number() ? std::nullopt : parse_quantity(node.text, error);
  if (quantity && quantity->dimension == dimension::angle)
    warn_of_value(in, node, fmt::format("{:.4g} deg is beyond the friction of any rock or soil", degrees),
                  "check the number and its unit");
  else
    warn_of_value(in, node,
                  fmt::format("a number without a unit is the coefficient, and this one is unusually large: "
                              "an angle of {:.3g} deg",
                              degrees),
                  coefficient < 90
                      ? fmt::format("if it is an angle, write \"{:g} deg\"", coefficient)
                      : std::string("write an angle with its unit, \"28 deg\", or the coefficient"));
}

/// Size of a vector in SI units, where the key is given and can be read (else it has been reported).
std::optional<double> size_of(const View& view, const char* key, const Dimension& d) {
  const Node* node = view.get(key);
  if (!node || node->kind != Node::Kind::array) return {};
  double square = 0;
  std::string why;
  for (const Node& item : node->items)
    if (const auto v = quantity_of(item, d, why))
      square += *v * *v;
    else
      return {};
  return std::sqrt(square);
}

bool all_bare(const View& view, const char* key) {
  const Node* node = view.get(key);
  return std::all_of(node->items.begin(), node->items.end(),
                     [](const Node& item) { return item.is_number(); });
}

void warn_of_unusual_speed(const View& view, const char* key, const Vec3& velocity) {
  if (const double v = velocity.norm(); v > fastest)
    view.problem(key, fmt::format("{:.4g} m/s is faster than rocks fall", v),
                 "check the unit: a bare number is in m/s", warning);
}

void warn_of_unusual_spin(const View& view, const char* key, const Vec3& spin) {
  if (const double w = spin.norm(); w > wildest)
    view.problem(key, fmt::format("{:.4g} rad/s is faster than rocks turn", w),
                 "check the unit: a bare number is in rad/s", warning);
}

void warn_of_unusual_turn(const View& block) {
  if (const auto given = block.table("orientation"))
    if (const auto angle = size_of(*given, "rotation_vector", dimension::angle);
        angle && *angle > 2 * std::numbers::pi * (1 + 1e-9))
      given->problem("rotation_vector", fmt::format("turns by {:.4g} rad, more than once about", *angle),
                     all_bare(*given, "rotation_vector")
                         ? "bare numbers are in rad: write each with its unit, \"30 deg\""
                         : "check the unit",
                     warning);
}

/// The greatest traction over the load's time.
void warn_of_unusual_load(const View& view, const StructureSpec::Load& load) {
  constexpr double least = 1e3;  // [Pa] that of a tenth of a metre of water
  double factor = 0;
  for (const auto& [time, value] : load.history) factor = std::max(factor, std::abs(value));
  if (const double most = factor * load.traction.norm(); most > 0 && most < least)
    view.problem("traction", fmt::format("{:.4g} Pa at most is next to nothing", most),
                 "check its unit: bare numbers are in Pa", warning);
}

/// Time and gravity of a fall: seconds to minutes, on the earth.
void warn_of_unusual_simulation(const View& view, const Simulation& s) {
  constexpr double longest = 3600, far = 0.1;  // [s], [m] that a block falls in a step
  const double g = s.gravity.norm();
  if (view.get("gravity") && g > 0 && s.gravity.z() >= 0)
    view.problem("gravity", s.gravity.z() > 0 ? "points upwards" : "points sideways",
                 "z is up: write [0, 0, -9.81]", warning);
  if (view.get("gravity") && g > 0 && (g < 1 || g > 30))
    view.problem("gravity", fmt::format("{:.4g} m/s^2 is not that of the earth, 9.81 m/s^2", g),
                 "check the number and its unit", warning);
  if (s.step && 0.5 * g * *s.step * *s.step > far)
    view.problem(
        "step",
        fmt::format("a block falls {:.3g} m in one such step: it passes what it should strike",
                    0.5 * g * *s.step * *s.step),
        "check its unit; blocks of a metre take steps of some 1e-3 to 1e-4 s, or give accuracy in its place",
        warning);
  if (s.duration > longest)
    view.problem("duration", fmt::format("is {:.3g} h: rocks fall for seconds to minutes", s.duration / 3600),
                 "check its unit; until = \"rest\" ends the run when all has come to rest", warning);
}

/// Names that differ by case only are different names here, and the same to a reader and to many file
/// systems.
void warn_of_like_names(const View& root, const char* kind) {
  std::vector<std::pair<std::string, const View*>> lower;
  const std::vector<View> views = root.tables(kind);
  for (const View& view : views) {
    if (!view.get("name")) continue;
    std::string name = view.text("name");
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    lower.emplace_back(std::move(name), &view);
  }
  std::stable_sort(lower.begin(), lower.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 1; i < lower.size(); ++i)
    if (const std::string first = lower[i - 1].second->text("name");
        lower[i].first == lower[i - 1].first && first != lower[i].second->text("name"))
      lower[i].second->problem("name",
                               fmt::format("differs from \"{}\" by case only: they are two {}s", first, kind),
                               "rename one, or write both alike if one is meant", warning);
}

}  // namespace

void warn_of_the_implausible(const Reading& in, const View& root) {
  for (const View& view : root.tables("material")) {
    if (const auto density = view.maybe("density");
        density && *density > 0 && (*density < least_density || *density > most_density))
      view.problem("density", fmt::format("{:.4g} kg/m^3 is no rock, concrete or steel", *density),
                   "check the unit: rock is about 2.6 t/m^3, or 2600 kg/m^3", warning);
    warn_of_unusual(view, of_material);
  }
  for (const View& view : root.tables("interface")) {
    warn_of_unusual(view, of_interface);
    if (const auto law = view.table("contact_law")) warn_of_unusual(*law, of_contact_law);
    if (const auto plants = view.table("vegetation")) warn_of_unusual(*plants, of_vegetation);
  }
  if (const auto mass = root.table("rock_mass")) {
    for (const View& view : mass->tables("joint_set"))
      warn_of_unusual(view, of_joint_set), warn_of_unusual(view, of_bonds);
    for (const View& view : mass->tables("joint")) warn_of_unusual(view, of_bonds);
  }
  const std::vector<View> structures = root.tables("structure");
  for (std::size_t i = 0; i < structures.size() && i < in.scene.structures.size(); ++i) {
    refuse_what_nobody_builds(structures[i], in.scene.structures[i]);
    warn_of_bars_through_stirrups(structures[i].tables("rebar"));
    if (const auto ratio = structures[i].maybe("damping_ratio"); ratio && *ratio > 0.2 && *ratio < 1)
      structures[i].problem(
          "damping_ratio", fmt::format("{:.3g} % of critical damping has no concrete or steel", 100 * *ratio),
          "write 0.02 for 2 %; concrete has some 1 to 5 %", warning);
    for (const View& rule : structures[i].tables("rebar")) warn_of_unusual_bars(rule, in.scene.structures[i]);
    const std::vector<View> loads = structures[i].tables("load");
    for (std::size_t k = 0; k < loads.size() && k < in.scene.structures[i].loads.size(); ++k)
      warn_of_unusual_load(loads[k], in.scene.structures[i].loads[k]);
  }
  for (const char* kind : {"material", "block", "structure", "line"}) warn_of_like_names(root, kind);
  for_each_value(root.node(), "", [&, resolved = root.has("resolved")](const Key& key, const Node& node) {
    if (!resolved) warn_of_bare_angle(in, key, node);  // the program writes radians
    warn_of_steep_friction(in, key, node);
  });
  if (const auto simulation = root.table("simulation"))
    warn_of_unusual_simulation(*simulation, in.scene.simulation);
  for (const View& view : root.tables("block")) {
    warn_of_unusual_speed(view, "velocity", view.vector("velocity"));
    warn_of_unusual_spin(view, "spin", view.vector("spin"));
    warn_of_unusual_turn(view);
  }
  if (const auto impact = root.table("impact"); impact && in.scene.impact) {
    const Impact& i = *in.scene.impact;
    const char* file = i.trajectory.empty() ? nullptr : "trajectories";
    warn_of_unusual_speed(*impact, file ? file : "velocity", i.velocity);
    warn_of_unusual_spin(*impact, file && !impact->has("spin") ? file : "spin", i.spin);
    warn_of_unusual_turn(*impact);
  }
}

}  // namespace talus::scene
