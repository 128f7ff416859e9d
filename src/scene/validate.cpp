#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/names.hpp"
#include "core/suggest.hpp"
#include "scene/view.hpp"

namespace talus::scene {

/// Beyond these no scene makes sense, and squares and cubes of what is computed from them leave the range of
/// numbers.
double largest(Dimension d) {
  using namespace dimension;
  const std::pair<Dimension, double> table[] = {
      {length, 1e9},  {time, 1e9},      {mass, 1e15},        {density, 1e13},
      {volume, 1e15}, {velocity, 1e5},  {acceleration, 1e6}, {angular_velocity, 1e6},
      {angle, 1e6},   {pressure, 1e18}, {force, 1e18},       {fracture_energy, 1e12}};
  for (const auto& [dimension, value] : table)
    if (dimension == d) return value;
  return 1e30;
}

namespace {

constexpr double largest_friction = 1e6;

class Validator {
 public:
  explicit Validator(std::vector<Problem>& problems) : problems_(problems) {}

  void one(Node& node, const Key& key) { value(node, key); }

  void table(Node& node, const std::string& path) {
    std::vector<Node::Entry> meant;  // keys that misspelt ones stand for: given, and reported as unreadable
    leave_lists_of_misspelt(node, path);
    for (Node::Entry& entry : node.entries) {
      if (entry.value.bad) continue;
      const std::string below = path.empty() ? entry.key : path + "." + entry.key;
      entry.value.label = node.label.empty() ? entry.key : node.label + "." + entry.key;
      if (const Key* key = find_key(below))
        value(entry.value, *key);
      else
        unknown(entry, node, path, meant);
    }
    for (Node::Entry& entry : meant) node.entries.push_back(std::move(entry));
    for (const std::string& name : keys_below(path)) {
      const Key* key = find_key(path.empty() ? name : path + "." + name);
      if (key->required.compare(0, 6, "always") != 0 || node.find(name)) continue;
      Problem problem = at(node, "is missing", how_to_add(*key, name));
      problem.key = node.label.empty() ? name : node.label + "." + name;
      problem.value.clear();
      problems_.push_back(std::move(problem));
    }
  }

 private:
  static std::string joined(const std::string& path, const std::string& key) {
    return path.empty() ? key : path + "." + key;
  }

  /// Below a misspelt [[structures]] its [[structure.rebar]] make a table of what should be a list: the cause
  /// is reported once, by the misspelt key.
  static void leave_lists_of_misspelt(Node& table, const std::string& path) {
    for (const Node::Entry& entry : table.entries) {
      if (find_key(joined(path, entry.key)) || entry.value.kind != Node::Kind::array) continue;
      const std::string near = nearest_name(entry.key, keys_below(path));
      const Key* key = near.empty() ? nullptr : find_key(joined(path, near));
      Node* below = near.empty() ? nullptr : table.find(near);
      if (key && key->type == Type::tables && below && below->kind == Node::Kind::table) below->bad = true;
    }
  }

  Problem at(const Node& node, std::string rule, std::string remedy) const {
    Problem problem;
    problem.file = node.where.file;
    problem.line = node.where.line;
    problem.column = node.where.column;
    problem.key = node.label;
    problem.value = value_text(node);
    problem.rule = std::move(rule);
    problem.remedy = std::move(remedy);
    return problem;
  }

  void report(Node& node, std::string rule, std::string remedy) {
    node.bad = true;
    problems_.push_back(at(node, std::move(rule), std::move(remedy)));
  }

  void unknown(Node::Entry& entry, const Node& table, const std::string& path,
               std::vector<Node::Entry>& meant) {
    entry.value.bad = true;
    Problem problem = at(entry.value, "unknown key", "");
    problem.line = entry.where.line;
    problem.column = entry.where.column;
    const std::vector<std::string> here = keys_below(path);
    const std::string near = nearest_name(entry.key, here);
    const Node* there = near.empty() ? nullptr : table.find(near);
    if (const auto [other, remedy] = by_another_name(entry.value, joined(path, entry.key)); !remedy.empty()) {
      problem.remedy = remedy;
      if (!table.find(other)) {
        meant.push_back(entry);
        meant.back().key = other;
      }
    } else if (!near.empty() && !there) {
      problem.remedy = fmt::format("did you mean \"{}\"?", near);
      meant.push_back(entry);
      meant.back().key = near;
    } else if (const std::string other = elsewhere(entry.key, path); !other.empty()) {
      problem.remedy = fmt::format("\"{}\" belongs in {}", entry.key, other);
    } else if (there && there->bad && there->kind == Node::Kind::table && !there->entries.empty()) {
      problem.remedy = fmt::format("did you mean [[{0}]], to which [[{0}.{1}]] below it belongs?",
                                   joined(path, near), there->entries.front().key);
    } else if (there) {
      problem.remedy = fmt::format("did you mean \"{}\", which is there already?", near);
    } else {
      std::string list;
      for (const std::string& name : here) list += (list.empty() ? "" : ", ") + name;
      problem.remedy = fmt::format("the keys here are {}", list.empty() ? "none" : list);
    }
    problems_.push_back(std::move(problem));
  }

  /// The key that says what `path` says in other programs and norms, and how to write it here; empty: none.
  static std::pair<std::string, std::string> by_another_name(const Node& value, const std::string& path) {
    std::string why;
    if (path == "material.f_ck" || path == "material.fck") {
      const auto f_ck = quantity_of(value, dimension::pressure, why);
      return {"f_cm", f_ck ? fmt::format("the mean strength is wanted, f_cm = f_ck + 8 MPa: write f_cm = "
                                         "\"{:.6g} MPa\"",
                                         1e-6 * *f_ck + 8)
                           : "the mean strength is wanted: give f_cm = f_ck + 8 MPa"};
    }
    if (path == "structure.rebar.grade") {
      const auto digits = value.text.find_first_of("0123456789");
      const auto number =
          digits == std::string::npos
              ? std::string()
              : value.text.substr(digits, value.text.find_first_not_of("0123456789", digits) - digits);
      return {"yield", number.empty() ? "give the yield stress, yield = \"500 MPa\""
                                      : fmt::format("give the yield stress: yield = \"{} MPa\"", number)};
    }
    return {};
  }

  /// The tables that have a key of this very name, "[a] or [b]"; empty if none or many have.
  static std::string elsewhere(const std::string& name, const std::string& path) {
    constexpr std::size_t many = 4;
    std::vector<std::string> tables;
    for (const Key& key : keys()) {
      const auto dot = key.path.rfind('.');
      if (dot == std::string::npos || key.path.substr(dot + 1) != name) continue;
      if (key.path.substr(0, dot) != path) tables.push_back("[" + key.path.substr(0, dot) + "]");
    }
    if (tables.size() > many) tables.resize(1);
    return fmt::format("{}", fmt::join(tables, " or "));
  }

  bool quantity(Node& node, const Key& key, Dimension dimension, Node& owner) {
    std::string why;
    const auto value = quantity_of(node, dimension, why);
    if (!value) {
      report(owner, why, "see talus explain " + key.path);
      return false;
    }
    if (const double most = largest(dimension); std::abs(*value) > most) {
      const std::string unit = dimension.none() ? "" : " " + unit_name(dimension);
      report(owner, fmt::format("must not exceed {:g}{}", most, unit), "check the number and its unit");
      return false;
    }
    return range(*value, key, owner);
  }

  bool range(double value, const Key& key, Node& owner) {
    const bool low = key.above ? value <= key.min : value < key.min;
    const bool high = key.below ? value >= key.max : value > key.max;
    if (!low && !high) return true;
    std::string remedy = "give a value in this range";
    if (low && key.dimension == dimension::pressure && owner.is_number() && value > 0 &&
        1e6 * value >= key.min && 1e6 * value <= key.max)
      remedy = fmt::format("a bare number is in Pa: did you mean \"{:g} MPa\"?", value);
    if (const auto prefix = owner.text.find(" mPa");
        low && owner.kind == Node::Kind::text && prefix != std::string::npos && 1e9 * value >= key.min)
      remedy = fmt::format("m is milli, M mega: did you mean \"{}\"?",
                           std::string(owner.text).replace(prefix, 4, " MPa"));
    constexpr double least_in_mm = 4;  // what is less is hardly given in millimetres
    if (high && key.dimension == dimension::length && owner.is_number() && value >= least_in_mm &&
        1e-3 * value >= key.min && 1e-3 * value <= key.max)
      remedy = fmt::format("a bare number is in m: did you mean \"{:g} mm\"?", value);
    if (high && (key.dimension == dimension::angle) && owner.is_number())
      remedy = "a bare number is in radians: write it with its unit, e.g. \"29 deg\"";
    report(owner, fmt::format("must be {}", range_text(key)), remedy);
    return false;
  }

  bool list(Node& node, const Key& key, std::size_t least, std::size_t most) {
    if (node.kind == Node::Kind::array && node.items.size() >= least && node.items.size() <= most)
      return true;
    report(node,
           fmt::format("must be {}, not {}", type_text(key),
                       node.kind == Node::Kind::array ? fmt::format("a list of {}", node.items.size())
                                                      : kind_name(node)),
           "see talus explain " + key.path);
    return false;
  }

  void vector(Node& node, const Key& key, std::size_t least, std::size_t most, Node& owner) {
    if (node.kind != Node::Kind::array || node.items.size() < least || node.items.size() > most) {
      const bool commas = node.kind == Node::Kind::array && node.items.size() > most &&
                          node.items.size() <= 2 * most &&
                          std::all_of(node.items.begin(), node.items.end(),
                                      [](const Node& item) { return item.kind == Node::Kind::integer; });
      report(owner, fmt::format("must be {}", type_text(key)),
             commas
                 ? fmt::format("these are {} numbers: commas separate them; decimals have a point, as in 1.5",
                               node.items.size())
                 : "see talus explain " + key.path);
      return;
    }
    for (Node& item : node.items)
      if (!quantity(item, key, key.dimension, owner)) return;
  }

  /// A quantity of any dimension.
  bool amount(Node& node, const Key& key, Node& owner) {
    std::string error;
    if (node.is_number() && std::isfinite(node.as_number())) return true;
    if (node.kind == Node::Kind::text && parse_quantity(node.text, error)) return true;
    report(owner, fmt::format("must be {}{}{}", type_text(key), error.empty() ? "" : ": ", error),
           "see talus explain " + key.path);
    return false;
  }

  void choice(Node& node, const Key& key) {
    if (std::find(key.choices.begin(), key.choices.end(), node.text) != key.choices.end()) return;
    std::string list;
    for (const std::string& name : key.choices) list += (list.empty() ? "" : ", ") + name;
    const std::string near = nearest_name(node.text, key.choices);
    report(node, fmt::format("must be one of {}", list),
           near.empty() ? "choose one of these" : fmt::format("did you mean \"{}\"?", near));
  }

  void value(Node& node, const Key& key) {
    const auto expect = [&](Node::Kind kind) {
      if (node.kind == kind) return true;
      report(node, fmt::format("must be {}, not {}", type_text(key), kind_name(node)),
             "see talus explain " + key.path);
      return false;
    };
    switch (key.type) {
      case Type::boolean: expect(Node::Kind::boolean); return;
      case Type::integer:
        if (expect(Node::Kind::integer)) range(static_cast<double>(node.integer), key, node);
        return;
      case Type::quantity: quantity(node, key, key.dimension, node); return;
      case Type::text:
        // A path that is written down for later is what it is.
        if (expect(Node::Kind::text) && !key.path.starts_with("resolved.") &&
            has_control_characters(node.text))
          report(node, "must be one line without control characters",
                 "remove line breaks and escape sequences");
        else if (key.path.ends_with(".name") && (node.text.starts_with(' ') || node.text.ends_with(' ')))
          report(node, "must not begin or end with a blank",
                 "remove it: names are compared letter by letter");
        return;
      case Type::path:
        if (!expect(Node::Kind::text)) return;
        if (node.text.empty())
          report(node, "must not be empty", "name a file, relative to the scene file");
        else if (node.text.find('\0') != std::string::npos)
          report(node, "must not contain a zero byte", "name a file");
        return;
      case Type::choice:
        if (expect(Node::Kind::text)) choice(node, key);
        return;
      case Type::vector: vector(node, key, 3, 3, node); return;
      case Type::quaternion: vector(node, key, 4, 4, node); return;
      case Type::plan_vector: vector(node, key, 2, 3, node); return;
      case Type::vectors:
        if (!list(node, key, 0, 10000000)) return;
        for (Node& item : node.items) {
          vector(item, key, 3, 3, node);
          if (node.bad) return;
        }
        return;
      case Type::plan_points:
        if (!list(node, key, 2, 1000000)) return;
        for (Node& item : node.items) {
          vector(item, key, 2, 2, node);
          if (node.bad) return;
        }
        return;
      case Type::amount: amount(node, key, node); return;
      case Type::amounts:
        if (!list(node, key, 2, 3)) return;
        for (Node& item : node.items)
          if (!amount(item, key, node)) return;
        return;
      case Type::values: list(node, key, 1, 1000000); return;
      case Type::pair_list:
        if (!list(node, key, 1, 10000000)) return;
        for (Node& item : node.items) {
          if (item.kind != Node::Kind::array || item.items.size() != 2) {
            report(node, fmt::format("must be {}", type_text(key)), "see talus explain " + key.path);
            return;
          }
          Key bare;  // the range holds for the second column
          bare.path = key.path;
          if (!quantity(item.items[0], bare, key.first, node) ||
              !quantity(item.items[1], key, key.dimension, node))
            return;
        }
        return;
      case Type::counts:
        if (!list(node, key, 3, 3)) return;
        for (Node& item : node.items) {
          if (item.kind != Node::Kind::integer) {
            report(node, fmt::format("must be {}", type_text(key)), "see talus explain " + key.path);
            return;
          }
          if (!range(static_cast<double>(item.integer), key, node)) return;
        }
        return;
      case Type::texts:
        if (node.kind == Node::Kind::text) return;
        if (!list(node, key, 0, 1000000)) return;
        for (const Node& item : node.items)
          if (item.kind != Node::Kind::text) {
            report(node, fmt::format("must be {}", type_text(key)), "see talus explain " + key.path);
            return;
          }
        return;
      case Type::friction: friction(node); return;
      case Type::stiffness: stiffness(node, key); return;
      case Type::joint: joint(node); return;
      case Type::velocity:
        if (node.kind == Node::Kind::array)
          vector(node, key, 3, 3, node);
        else if (quantity(node, key, key.dimension, node)) {
          std::string why;
          if (*quantity_of(node, key.dimension, why) <= 0)
            report(node, "a speed must be > 0",
                   "give its direction by angle and direction, or give a vector");
        }
        return;
      case Type::section:
        if (node.kind == Node::Kind::text)
          choice(node, key);
        else
          vector(node, key, 2, 2, node);
        return;
      case Type::text_or_table:
        if (node.kind == Node::Kind::text)
          choice_or_table(node, key);
        else if (expect(Node::Kind::table))
          table(node, key.path);
        return;
      case Type::path_or_tables:
        if (node.kind == Node::Kind::text) {
          if (node.text.empty()) report(node, "must not be empty", "name a file, relative to the scene file");
        } else
          tables(node, key);
        return;
      case Type::supports:
        if (node.kind == Node::Kind::text || !list(node, key, 0, 100000)) {
          if (!node.bad) report(node, "must be a list", fmt::format("write [{}]", value_text(node)));
          return;
        }
        for (std::size_t i = 0; i < node.items.size(); ++i) {
          Node& item = node.items[i];
          item.label = fmt::format("{}.{}", node.label, i);
          if (item.kind == Node::Kind::table)
            table(item, key.path);
          else if (item.kind != Node::Kind::text)
            report(item, "must be a face such as \"-z\", a mesh group, or a table",
                   "see talus explain structure.support");
        }
        return;
      case Type::table:
        if (expect(Node::Kind::table)) table(node, key.path);
        return;
      case Type::tables: tables(node, key); return;
      case Type::free_table:
        if (!expect(Node::Kind::table)) return;
        for (Node::Entry& entry : node.entries) {
          entry.value.label = node.label + "." + entry.key;
          std::string error;
          if (entry.value.is_number() && std::isfinite(entry.value.as_number())) continue;
          if (entry.value.kind == Node::Kind::text && parse_quantity(entry.value.text, error)) continue;
          report(entry.value,
                 "must be a number or a quantity such as \"3.5 m\"" + (error.empty() ? "" : ": " + error),
                 "see talus explain " + key.path);
        }
        return;
      case Type::planned:
        report(node, "is planned, not yet there", "remove it; nothing of it would be computed");
        return;
    }
  }

  void choice_or_table(Node& node, const Key& key) {
    const Key* kind = find_key(key.path + ".kind");
    const auto& all = kind->choices;
    if (std::find(key.choices.begin(), key.choices.end(), node.text) != key.choices.end()) return;
    if (std::find(all.begin(), all.end(), node.text) != all.end())
      report(node, fmt::format("\"{}\" needs its parameter", node.text),
             node.text == "hertz"      ? "write { kind = \"hertz\", radius = \"1 m\" }"
             : node.text == "crushing" ? "write { kind = \"crushing\", pressure = \"10 MPa\" }"
                                       : "write { kind = \"table\", file = \"law.csv\" }");
    else
      choice(node, *kind);
  }

  void tables(Node& node, const Key& key) {
    const auto dot = key.path.rfind('.');
    const std::string name = dot == std::string::npos ? key.path : key.path.substr(dot + 1);
    if (node.kind == Node::Kind::table) {
      report(node, "must be a list of tables", fmt::format("write [[{}]] with two brackets", key.path));
      return;
    }
    if (node.kind != Node::Kind::array) {
      report(node, fmt::format("must be a list of tables, not {}", kind_name(node)),
             fmt::format("write [[{}]]", key.path));
      return;
    }
    const std::string base = node.label;
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      Node& item = node.items[i];
      item.label = fmt::format("{}.{}", base, i);
      if (item.kind != Node::Kind::table) {
        report(item, fmt::format("must be a table, not {}", kind_name(item)),
               fmt::format("write [[{}]]", key.path));
        continue;
      }
      if (const Node* label = item.find("name");
          label && label->kind == Node::Kind::text && !label->text.empty())
        item.label = base + "." + label->text;
      if (const Node* between = item.find("between"); between && between->items.size() == 2)
        item.label = fmt::format("{}.{}/{}", base, between->items[0].text, between->items[1].text);
      table(item, key.path);
    }
  }

  void coefficient(Node& node, double value, const std::string& remedy) {
    if (!std::isfinite(value) || value < 0)
      report(node, "must be a coefficient >= 0 or an angle", remedy);
    else if (value > largest_friction)
      report(node, fmt::format("must not exceed {:g}", largest_friction), remedy);
  }

  void friction(Node& node) {
    const std::string remedy =
        "write an angle with its unit, \"28 deg\", or the coefficient as a bare number, 0.53";
    if (node.is_number()) return coefficient(node, node.as_number(), remedy);
    std::string error;
    const auto given = node.kind == Node::Kind::text ? parse_quantity(node.text, error) : std::nullopt;
    if (!given)
      report(node, "must be a coefficient >= 0 or an angle" + (error.empty() ? "" : ": " + error), remedy);
    else if (given->dimension == dimension::angle) {
      if (!(given->value >= 0 && given->value < 1.5707963267948966))
        report(node, "a friction angle must be at least 0 and below 90 deg", remedy);
    } else if (!given->dimension.none())
      report(node,
             fmt::format("must be a coefficient >= 0 or an angle: this one is in {}",
                         unit_name(given->dimension)),
             remedy);
    else
      coefficient(node, given->value, remedy);
  }

  void stiffness(Node& node, const Key& key) {
    const std::string remedy = "write \"hard\", \"30 GN/m\" (per contact point) or \"20 GPa/m\" (per area)";
    if (node.kind == Node::Kind::text && node.text == "hard") {
      if (key.path == "interface.shear_stiffness")
        report(node, "only normal_stiffness can be \"hard\"",
               "leave shear_stiffness out: hard contact has none");
      return;
    }
    double value = 0;
    if (node.is_number())
      value = node.as_number();
    else {
      std::string error;
      const auto given = node.kind == Node::Kind::text ? parse_quantity(node.text, error) : std::nullopt;
      if (!given)
        return report(node, "must be \"hard\", N/m or Pa/m" + (error.empty() ? "" : ": " + error), remedy);
      if (given->dimension != dimension::stiffness && given->dimension != dimension::stiffness_per_area)
        return report(
            node,
            fmt::format("must be \"hard\", N/m or Pa/m: this one is in {}", unit_name(given->dimension)),
            remedy);
      value = given->value;
    }
    if (!std::isfinite(value) || value <= 0) report(node, "must be > 0", remedy);
  }

  void joint(Node& node) {
    const std::string remedy = "write \"dip direction/dip\" in degrees, e.g. \"267/87\"";
    const auto slash = node.kind == Node::Kind::text ? node.text.find('/') : std::string::npos;
    if (slash == std::string::npos) return report(node, "must be \"dip direction/dip\"", remedy);
    std::string error;
    const auto direction = parse_quantity(node.text.substr(0, slash), error);
    const auto dip = parse_quantity(node.text.substr(slash + 1), error);
    if (!direction || !dip || !direction->dimension.none() || !dip->dimension.none())
      return report(node, "must be two numbers, dip direction/dip", remedy);
    if (direction->value < -360 || direction->value > 360)
      return report(node, "the dip direction must be 0 to 360 degrees", remedy);
    if (dip->value < 0 || dip->value > 90)
      return report(node, "the dip must be 0 to 90 degrees",
                    "a dip beyond 90 is a plane that dips the other way: turn the dip direction by 180 and "
                    "take 180 - dip");
  }

  std::vector<Problem>& problems_;
};

}  // namespace

std::string fault_of(Node value, const Key& key) {
  std::vector<Problem> problems;
  value.label = key.path;
  Validator(problems).one(value, key);
  return problems.empty() ? std::string() : problems.front().rule;
}

void validate(Node& root, std::vector<Problem>& problems) {
  if (root.bad) return;
  Validator(problems).table(root, "");
}

}  // namespace talus::scene
