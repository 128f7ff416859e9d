#include "scene/view.hpp"

#include <fmt/format.h>

#include <cmath>

#include "core/assert.hpp"

namespace talus::scene {

std::optional<double> quantity_of(const Node& node, Dimension dimension, std::string& why) {
  if (node.is_number()) {
    const double value = node.as_number();
    if (std::isfinite(value)) return value;
    why = "must be finite";
    return {};
  }
  if (node.kind != Node::Kind::text) {
    why = "must be " + describe(dimension);
    return {};
  }
  std::string error;
  const auto quantity = parse_quantity(node.text, error);
  if (!quantity) {
    why = fmt::format("must be {}: {}", describe(dimension), error);
    return {};
  }
  Dimension given = quantity->dimension;
  if (dimension == dimension::angular_velocity && counts_turns(node.text)) {
    why = fmt::format("must be {}: Hz are turns a second, of 2 pi rad each", describe(dimension));
    return {};
  }
  if (dimension == dimension::angular_velocity && given.rad == 0)
    given.rad = 1;  // "2 1/s": the radian is often left out
  if (given == dimension) return quantity->value;
  constexpr double g = 9.80665;  // [m/s^2]
  const bool weight =
      dimension.kg == 1 && given == Dimension{dimension.m + 1, dimension.kg, dimension.s - 2, dimension.rad};
  why = given.none() ? fmt::format("must be {}: the unit is missing", describe(dimension))
        : weight     ? fmt::format("must be {}: this one is a weight, of {:.4g} {}", describe(dimension),
                                   quantity->value / g, unit_name(dimension))
                     : fmt::format("must be {}: this one is in {}", describe(dimension), unit_name(given));
  return {};
}

std::string how_to_add(const Key& key, const std::string& name) {
  std::string doc = key.doc;
  if (!doc.empty() && doc.back() == '.') doc.pop_back();
  // The meaning of these types says how they are written.
  const bool told = key.type == Type::friction || key.type == Type::stiffness;
  return told ? fmt::format("add {} = ...; {}", name, doc)
              : fmt::format("add {}, {}. {}", name, type_text(key), doc);
}

Vec3 vector_of(const Node& node, Dimension dimension) {
  Vec3 value = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  std::string why;
  for (std::size_t i = 0; i < node.items.size() && i < 3; ++i)
    value[static_cast<Eigen::Index>(i)] = quantity_of(node.items[i], dimension, why).value_or(0);
  return value;
}

const Key& View::key_of(const std::string& key) const {
  const Key* found = find_key(path_.empty() ? key : path_ + "." + key);
  if (!found) throw std::logic_error("no such scene key: " + path_ + "." + key);
  return *found;
}

const Node* View::get(const std::string& key) const {
  const Node* node = table_->find(key);
  return node && !node->bad ? node : nullptr;
}

Node View::fallback(const std::string& key) const {
  const Key& entry = key_of(key);
  if (entry.fallback.empty()) return {};
  return parse_toml_value(entry.type == Type::quantity ? '"' + entry.fallback + '"' : entry.fallback, {});
}

double View::number(const std::string& key) const {
  const auto given = maybe(key);
  if (given) return *given;
  std::string why;
  return quantity_of(fallback(key), key_of(key).dimension, why).value_or(0);
}

std::optional<double> View::maybe(const std::string& key) const {
  const Node* node = get(key);
  if (!node) return {};
  std::string why;
  return quantity_of(*node, key_of(key).dimension, why);
}

long View::integer(const std::string& key) const {
  if (const Node* node = get(key)) return static_cast<long>(node->integer);
  return static_cast<long>(fallback(key).integer);
}

bool View::flag(const std::string& key) const {
  const auto given = maybe_flag(key);
  return given ? *given : fallback(key).boolean;
}

std::optional<bool> View::maybe_flag(const std::string& key) const {
  const Node* node = get(key);
  return node ? std::optional(node->boolean) : std::nullopt;
}

std::string View::text(const std::string& key) const {
  if (const Node* node = get(key)) return node->text;
  return fallback(key).text;
}

Vec3 View::vector(const std::string& key) const {
  const auto given = maybe_vector(key);
  if (given) return *given;
  const Node node = fallback(key);
  return node.items.empty() ? Vec3::Zero().eval() : vector_of(node, key_of(key).dimension);
}

std::optional<Vec3> View::maybe_vector(const std::string& key) const {
  const Node* node = get(key);
  return node ? std::optional(vector_of(*node, key_of(key).dimension)) : std::nullopt;
}

std::vector<Vec3> View::vectors(const std::string& key) const {
  std::vector<Vec3> values;
  if (const Node* node = get(key))
    for (const Node& item : node->items) values.push_back(vector_of(item, key_of(key).dimension));
  return values;
}

std::vector<std::pair<double, double>> View::pairs(const std::string& key) const {
  const Node* node = get(key);
  const Node otherwise = node ? Node{} : fallback(key);
  std::vector<std::pair<double, double>> values;
  std::string why;
  for (const Node& item : (node ? node : &otherwise)->items)
    values.emplace_back(quantity_of(item.items[0], key_of(key).first, why).value_or(0),
                        quantity_of(item.items[1], key_of(key).dimension, why).value_or(0));
  return values;
}

std::vector<std::string> View::texts(const std::string& key) const {
  const Node* node = get(key);
  if (!node) return {};
  if (node->kind == Node::Kind::text) return {node->text};
  std::vector<std::string> values;
  for (const Node& item : node->items) values.push_back(item.text);
  return values;
}

std::optional<View> View::table(const std::string& key) const {
  const Node* node = get(key);
  if (!node || node->kind != Node::Kind::table) return {};
  return View(*node, path_.empty() ? key : path_ + "." + key, *problems_);
}

std::vector<View> View::tables(const std::string& key) const {
  const Node* node = get(key);
  std::vector<View> views;
  if (node && node->kind == Node::Kind::array)
    for (const Node& item : node->items)
      if (item.kind == Node::Kind::table)
        views.emplace_back(item, path_.empty() ? key : path_ + "." + key, *problems_);
  return views;
}

void View::problem(const std::string& key, std::string rule, std::string remedy,
                   Problem::Severity severity) const {
  const Node* node = table_->find(key);
  const Where& where = node ? node->where : table_->where;
  Problem problem;
  problem.severity = severity;
  problem.file = where.file;
  problem.line = where.line;
  problem.column = where.column;
  problem.key = table_->label.empty() ? key : key.empty() ? table_->label : table_->label + "." + key;
  if (node) problem.value = value_text(*node);
  problem.rule = std::move(rule);
  problem.remedy = std::move(remedy);
  problems_->push_back(std::move(problem));
}

void View::missing(const std::string& key, const std::string& why) const {
  if (has(key)) return;
  const Key& entry = key_of(key);
  problem(key, why.empty() ? "is missing" : "is missing: " + why, how_to_add(entry, key));
}

}  // namespace talus::scene
