/// A scene file as a tree of values that know where they stand. TOML and scene.resolved.json both become one
/// of these; the parsers' own types stay in document_toml.cpp and document_json.cpp.
#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"

namespace talus::scene {

struct Where {
  std::string file;
  int line = 0, column = 0;  // 1-based; 0 if unknown
};

struct Node {
  enum class Kind { none, boolean, integer, number, text, array, table, other };
  struct Entry;
  Kind kind = Kind::none;
  bool boolean = false;
  std::int64_t integer = 0;
  double number = 0;
  std::string text;            // Kind::text, and the source text of Kind::other (dates)
  std::vector<Node> items;     // Kind::array
  std::vector<Entry> entries;  // Kind::table
  Where where;
  std::string label;  // dotted key as the user would say it, "block.B1.size"; set by validate()
  bool bad = false;   // validate() has reported it: nothing reads it any more

  const Node* find(const std::string& key) const;
  Node* find(const std::string& key);
  bool is_number() const { return kind == Kind::integer || kind == Kind::number; }
  double as_number() const { return kind == Kind::integer ? static_cast<double>(integer) : number; }
};

struct Node::Entry {
  std::string key;
  Where where;  // of the key
  Node value;
};

/// "a whole number", "a text", "a table"...: for messages.
std::string kind_name(const Node& node);
/// The value as it stands in a scene file, cut to about 60 characters.
std::string value_text(const Node& node);

/// Parses TOML. A syntax error is one problem with its place, and the result is empty (`bad`); a decimal
/// comma is one, too, and is read as a point.
Node parse_toml(const std::string& text, const std::string& file, std::vector<Problem>& problems);
/// The value of `--set KEY=VALUE`: a TOML value, or, if it is none, the text itself.
Node parse_toml_value(const std::string& text, const std::string& file);
Node parse_json(const std::string& text, const std::string& file, std::vector<Problem>& problems);

/// The tree as the text of a scene file.
std::string toml_text(const Node& root);
/// A value in one line, tables in braces.
std::string inline_toml(const Node& value);

/// Puts `value` at a dotted key. A part after an array of tables is the `name` of one of them, or its place
/// (0 is the first); an interface is named by its two materials, "rock/slope".
void set_value(Node& root, const std::string& key, const std::string& value, std::vector<Problem>& problems);

/// A dotted key with places in lists for the names, so that all ways to name a value are one text, and the
/// value; null where it is not there. The key itself where it names nothing of a list.
struct KeyPlace {
  std::string key;
  const Node* value = nullptr;
};
KeyPlace place_of_key(const Node& root, const std::string& key);

}  // namespace talus::scene
