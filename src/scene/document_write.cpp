// A tree as the text of a scene file: [tables] and [[lists of tables]] of the first level, all below them in
// one line.
#include <algorithm>

#include <fmt/format.h>

#include "core/units.hpp"
#include "scene/document.hpp"

namespace talus::scene {
namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      out += std::string("\\") + c;
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      out += fmt::format("\\u{:04X}", static_cast<unsigned char>(c));
    else
      out += c;
  }
  return out + "\"";
}

std::string key_text(const std::string& key) {
  const bool bare = !key.empty() && std::all_of(key.begin(), key.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
  return bare ? key : quoted(key);
}

std::string inline_text(const Node& node) {
  switch (node.kind) {
    case Node::Kind::none: return {};
    case Node::Kind::boolean: return node.boolean ? "true" : "false";
    case Node::Kind::integer: return fmt::format("{}", node.integer);
    case Node::Kind::number: {
      const std::string text = exact_text(node.number);
      return text.find_first_not_of("-0123456789") == std::string::npos ? text + ".0" : text;
    }
    case Node::Kind::text: return quoted(node.text);
    case Node::Kind::other: return node.text;
    case Node::Kind::array: {
      std::string text = "[";
      for (const Node& item : node.items) text += (text.size() > 1 ? ", " : "") + inline_text(item);
      return text + "]";
    }
    case Node::Kind::table: {
      std::string text = "{";
      for (const Node::Entry& entry : node.entries)
        text += (text.size() > 1 ? ", " : " ") + key_text(entry.key) + " = " + inline_text(entry.value);
      return text + " }";
    }
  }
  return {};
}

bool list_of_tables(const Node& node) {
  return node.kind == Node::Kind::array && !node.items.empty() &&
         std::all_of(node.items.begin(), node.items.end(),
                     [](const Node& item) { return item.kind == Node::Kind::table; });
}

std::string lines_of(const Node& table) {
  std::string text;
  for (const Node::Entry& entry : table.entries)
    text += key_text(entry.key) + " = " + inline_text(entry.value) + "\n";
  return text;
}

}  // namespace

std::string inline_toml(const Node& value) { return inline_text(value); }

std::string toml_text(const Node& root) {
  std::string head, body;
  for (const Node::Entry& entry : root.entries) {
    const std::string name = key_text(entry.key);
    if (entry.value.kind == Node::Kind::table)
      body += fmt::format("\n[{}]\n{}", name, lines_of(entry.value));
    else if (list_of_tables(entry.value))
      for (const Node& item : entry.value.items) body += fmt::format("\n[[{}]]\n{}", name, lines_of(item));
    else
      head += fmt::format("{} = {}\n", name, inline_text(entry.value));
  }
  return head + body;
}

}  // namespace talus::scene
