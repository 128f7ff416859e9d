/// Typed reading of a validated tree. Dimension and default come from the key table, so what `talus explain`
/// prints is what is used. Anything that validate() has already reported reads as its default.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/types.hpp"
#include "scene/document.hpp"
#include "scene/keys.hpp"

namespace talus::scene {

/// SI value of a number or a text with a unit. On failure says in `why` what is wrong.
std::optional<double> quantity_of(const Node& node, Dimension dimension, std::string& why);

/// What a quantity of this dimension must not exceed, in SI: beyond, no scene makes sense.
double largest(Dimension dimension);

/// Checks every value of the tree against the key table: unknown keys, types, dimensions, ranges, choices,
/// and keys that are always required. Reports all problems, and marks the nodes as bad.
void validate(Node& root, std::vector<Problem>& problems);
/// The rule of the key table that a value breaks; empty: none.
std::string fault_of(Node value, const Key& key);

class View {
 public:
  View(const Node& table, std::string path, std::vector<Problem>& problems)
      : table_(&table), path_(std::move(path)), problems_(&problems) {}

  bool has(const std::string& key) const { return table_->find(key) != nullptr; }  // good or bad
  const Node* get(const std::string& key) const;  // present and good, else null
  const Node& node() const { return *table_; }
  const std::string& label() const { return table_->label; }

  double number(const std::string& key) const;                // 0 if absent and without default
  std::optional<double> maybe(const std::string& key) const;  // absent: nothing, whatever the default
  long integer(const std::string& key) const;
  bool flag(const std::string& key) const;
  std::optional<bool> maybe_flag(const std::string& key) const;
  std::string text(const std::string& key) const;  // also choice and path (as given)
  Vec3 vector(const std::string& key) const;
  std::optional<Vec3> maybe_vector(const std::string& key) const;
  std::vector<Vec3> vectors(const std::string& key) const;
  std::vector<std::pair<double, double>> pairs(const std::string& key) const;
  std::vector<std::string> texts(const std::string& key) const;
  std::optional<View> table(const std::string& key) const;
  std::vector<View> tables(const std::string& key) const;

  /// A table that stands elsewhere in the tree, with the keys of `path`.
  View below(const Node& table, const std::string& path) const { return View(table, path, *problems_); }

  /// Reports a problem at a key of this table (or at the table itself, if the key is not there).
  void problem(const std::string& key, std::string rule, std::string remedy,
               Problem::Severity severity = Problem::Severity::error) const;
  /// Reports a key that is needed here; does nothing if it is there but bad.
  void missing(const std::string& key, const std::string& why = "") const;

  const Key& key_of(const std::string& key) const;

 private:
  Node fallback(const std::string& key) const;
  const Node* table_;
  std::string path_;
  std::vector<Problem>* problems_;
};

/// What to do about a key that is missing: its name, how it is written, what it means.
std::string how_to_add(const Key& key, const std::string& name);

/// Position of a plan vector with the height left out: NaN.
Vec3 vector_of(const Node& node, Dimension dimension);

}  // namespace talus::scene
