#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/error.hpp"
#include "core/suggest.hpp"
#include "scene/keys.hpp"

namespace talus::scene {
namespace {

std::string quoted_list(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "\"" : ", \"") + name + "\"";
  return text;
}

std::string what(Dimension dimension) {
  const std::string text = describe(dimension);
  return text.substr(0, text.find(", e.g."));
}

std::string header(const Key& key) {
  if (key.type == Type::tables || key.type == Type::path_or_tables) return "[[" + key.path + "]]";
  return "[" + key.path + "]";
}

std::string bound(const Key& key, double value) {
  if (key.dimension == dimension::angle) return fmt::format("{:.6g} deg", value * 180 / std::numbers::pi);
  const std::string unit = key.dimension.none() ? "" : " " + unit_name(key.dimension);
  return fmt::format("{:g}{}", value, unit);
}

/// The table whose names in between are the user's own: "block.B1.size" is block.size, "block.B1" is block;
/// "block.siz" is a slip of the pen.
const Key* find_loose(const std::string& path) {
  if (const Key* exact = find_key(path)) return exact;
  std::vector<std::string> parts;
  for (std::size_t from = 0; from <= path.size();) {
    const auto dot = std::min(path.find('.', from), path.size());
    parts.push_back(path.substr(from, dot - from));
    from = dot + 1;
  }
  std::string at;
  bool may_skip = false, skipped = false;
  for (const std::string& part : parts) {
    const std::string next = at.empty() ? part : at + "." + part;
    const Key* key = find_key(next);
    if (key) {
      at = next;
      may_skip =
          key->type == Type::tables || key->type == Type::path_or_tables || key->type == Type::supports;
      skipped = false;
    } else if (may_skip) {
      may_skip = false;  // the name of one of the tables
      skipped = true;
    } else {
      return nullptr;
    }
  }
  return skipped && !nearest_name(path, all_keys()).empty() ? nullptr : find_key(at);
}

}  // namespace

const Key* key_of_path(const std::string& path) { return find_loose(path); }

std::string type_text(const Key& key) {
  const std::string quantity = what(key.dimension);
  switch (key.type) {
    case Type::boolean: return "true or false";
    case Type::integer: return "a whole number";
    case Type::quantity: return quantity;
    case Type::text: return "a text";
    case Type::choice: return "one of " + quoted_list(key.choices);
    case Type::path: return "a file, relative to the scene file";
    case Type::vector:
      return key.dimension.none() ? "three numbers [x, y, z]" : fmt::format("[x, y, z], each {}", quantity);
    case Type::plan_points: return fmt::format("a list of points [[x, y], ...], each {}", quantity);
    case Type::amount: return "a number, or a text with a unit";
    case Type::amounts: return "a list of numbers, or of texts with a unit";
    case Type::values: return "a list of values";
    case Type::quaternion: return "four numbers [w, x, y, z]";
    case Type::plan_vector: return fmt::format("[x, y] or [x, y, z], each {}", quantity);
    case Type::vectors: return fmt::format("a list of points [[x, y, z], ...], each {}", quantity);
    case Type::pair_list: return fmt::format("a list of pairs [[{}, {}], ...]", what(key.first), quantity);
    case Type::counts: return "three whole numbers [nx, ny, nz]";
    case Type::texts: return "a list of texts";
    case Type::friction: return "a coefficient, or an angle with its unit";
    case Type::stiffness:
      return key.path == "interface.shear_stiffness" ? "N/m per contact point, or Pa/m per area"
                                                     : "\"hard\", N/m per contact point, or Pa/m per area";
    case Type::joint: return "\"dip direction/dip\" in degrees, e.g. \"267/87\"";
    case Type::text_or_table: return "a name, or a table with kind and its parameter";
    case Type::path_or_tables: return "a file, or a list of tables";
    case Type::supports: return "a list of faces, mesh groups and tables";
    case Type::section:
      return fmt::format("[x, y], each {}, or one of {}", quantity, quoted_list(key.choices));
    case Type::velocity: return "[x, y, z] or a speed, in m/s";
    case Type::table: return "a table";
    case Type::tables: return "a list of tables";
    case Type::free_table: return "a table of numbers and quantities under names of one's own";
    case Type::planned: return "planned";
  }
  return {};
}

std::string range_text(const Key& key) {
  const bool low = std::isfinite(key.min), high = std::isfinite(key.max);
  if (low && high && key.min == key.max) return bound(key, key.min);
  if (low && high)
    return fmt::format("{} {} and {} {}", key.above ? "above" : "at least", bound(key, key.min),
                       key.below ? "below" : "at most", bound(key, key.max));
  if (low) return fmt::format("{} {}", key.above ? ">" : ">=", bound(key, key.min));
  if (high) return fmt::format("{} {}", key.below ? "<" : "<=", bound(key, key.max));
  return {};
}

std::string explain(const std::string& path) {
  std::string clean = path;
  std::erase_if(clean, [](char c) { return c == '[' || c == ']' || c == ' '; });
  const Key* key = find_loose(clean);
  if (!key) {
    Problem problem;
    problem.key = path;
    problem.rule = "there is no such scene key";
    std::string near = nearest_name(clean, all_keys());
    if (near.empty()) {
      // The last part alone, in any table.
      const std::string last = clean.substr(clean.rfind('.') == std::string::npos ? 0 : clean.rfind('.') + 1);
      for (const Key& k : keys())
        if (k.path.size() > last.size() &&
            k.path.compare(k.path.size() - last.size() - 1, std::string::npos, "." + last) == 0) {
          near = k.path;
          break;
        }
    }
    problem.remedy =
        near.empty() ? "talus explain --all lists the keys" : fmt::format("did you mean \"{}\"?", near);
    throw InputError(problem);
  }
  const bool table = key->type == Type::table || key->type == Type::tables;
  std::string text = (table ? header(*key) : key->path) + "\n";
  const auto line = [&](const char* name, const std::string& value) {
    if (!value.empty()) text += fmt::format("  {:<9} {}\n", name, value);
  };
  line("type", type_text(*key));
  if (!key->dimension.none()) line("unit", unit_name(key->dimension));
  line("range", range_text(*key));
  line("default", !key->fallback.empty()            ? key->fallback
                  : !key->otherwise.empty()         ? key->otherwise
                  : key->required.empty() && !table ? "none: see below"
                                                    : "");
  line("required", key->required.compare(0, 6, "always") == 0 ? "yes" : key->required);
  line("source", key->source);
  text += "\n  " + key->doc + "\n";
  const auto below = keys_below(key->path);
  if (!below.empty()) {
    text += "\n  Keys:\n";
    for (const std::string& name : below) {
      const Key* child = find_key(key->path + "." + name);
      text += fmt::format("    {:<24} {}\n", name, type_text(*child));
    }
  }
  return text;
}

std::string scene_markdown() {
  std::string text =
      "# The scene file\n\n"
      "Generated by `talus explain --all --markdown`, from the same table that checks a scene and that "
      "`talus explain KEY` prints. Do not edit.\n\n"
      "A scene is a TOML file. Numbers are SI; a text with a unit is read in that unit (\"3.84 m\", \"28 "
      "deg\", \"30 GPa\", \"2.5 t/m^3\"). "
      "x is east, y north, z up. Paths are relative to the scene file. An angle without a unit is in "
      "radians.\n\n"
      "Any key can be set on the command line: `--set simulation.step=\"1e-4 s\"`, `--set "
      "block.B1.velocity=[0,0,-5]`, `--set interface.rock/slope.friction=\"30 deg\"`.\n";
  const auto row = [&](const Key& key) {
    const std::string name =
        key.path.substr(key.path.rfind('.') == std::string::npos ? 0 : key.path.rfind('.') + 1);
    std::string type = type_text(key);
    const std::string range =
        key.type == Type::quantity || key.type == Type::integer || key.type == Type::vector ? range_text(key)
                                                                                            : "";
    if (!range.empty()) type += "; " + range;
    std::string doc = key.doc;
    if (!key.required.empty())
      doc += key.required.compare(0, 6, "always") == 0 ? std::string(" Required.")
                                                       : " Required " + key.required + ".";
    if (!key.source.empty()) doc += " Source: " + key.source + ".";
    const auto escape = [](std::string s) {
      for (std::size_t i = s.find('|'); i != std::string::npos; i = s.find('|', i + 2)) s.insert(i, "\\");
      return s;
    };
    text += fmt::format("| `{}` | {} | {} | {} |\n", name, escape(type),
                        key.fallback.empty() && key.otherwise.empty()
                            ? ""
                            : "`" + (key.fallback.empty() ? key.otherwise : key.fallback) + "`",
                        escape(doc));
  };
  const std::string head = "\n| key | type and range | default | meaning |\n|---|---|---|---|\n";
  text += "\n## Top level\n" + head;
  for (const std::string& name : keys_below(""))
    if (const Key* key = find_key(name); key->type != Type::table && key->type != Type::tables) row(*key);
  for (const Key& key : keys()) {
    const auto below = keys_below(key.path);
    if (below.empty()) continue;
    text += fmt::format("\n{} `{}`\n\n{}\n", key.path.find('.') == std::string::npos ? "##" : "###",
                        header(key), key.doc);
    text += head;
    for (const std::string& name : below) row(*find_key(key.path + "." + name));
  }
  return text;
}

}  // namespace talus::scene
