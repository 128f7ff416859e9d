#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "scene/document.hpp"

namespace talus::scene {
namespace {

constexpr int depth_limit = 64;

Node convert(const nlohmann::json& value, const std::string& file, int depth) {
  Node out;
  out.where.file = file;
  if (depth > depth_limit) {
    out.kind = Node::Kind::other;
    out.text = "nested too deeply";
  } else if (value.is_object()) {
    out.kind = Node::Kind::table;
    for (const auto& [key, item] : value.items())
      out.entries.push_back({key, out.where, convert(item, file, depth + 1)});
  } else if (value.is_array()) {
    out.kind = Node::Kind::array;
    for (const auto& item : value) out.items.push_back(convert(item, file, depth + 1));
  } else if (value.is_string()) {
    out.kind = Node::Kind::text;
    out.text = value.get<std::string>();
  } else if (value.is_number_float() || value.is_number_unsigned()) {
    // An unsigned value beyond the signed range is no count of anything: as a double it fails the range
    // checks.
    if (value.is_number_unsigned() && value.get<std::uint64_t>() <= 0x7fffffffffffffffULL) {
      out.kind = Node::Kind::integer;
      out.integer = value.get<std::int64_t>();
    } else {
      out.kind = Node::Kind::number;
      out.number = value.get<double>();
    }
  } else if (value.is_number_integer()) {
    out.kind = Node::Kind::integer;
    out.integer = value.get<std::int64_t>();
  } else if (value.is_boolean()) {
    out.kind = Node::Kind::boolean;
    out.boolean = value.get<bool>();
  } else {
    out.kind = Node::Kind::other;
    out.text = "null";
  }
  return out;
}

}  // namespace

Node parse_json(const std::string& text, const std::string& file, std::vector<Problem>& problems) {
  Node empty;
  empty.kind = Node::Kind::table;
  empty.bad = true;
  Problem problem;
  problem.file = file;
  problem.remedy = "give a scene.toml, or the scene.resolved.json that a run wrote";
  try {
    Node root = convert(nlohmann::json::parse(text), file, 0);
    if (root.kind == Node::Kind::table) return root;
    problem.rule = "not a scene: the file is JSON but no object";
  } catch (const nlohmann::json::parse_error& error) {
    problem.line = 1;
    for (std::size_t i = 0; i + 1 < error.byte && i < text.size(); ++i) {
      ++problem.column;
      if (text[i] == '\n') {
        ++problem.line;
        problem.column = 0;
      }
    }
    ++problem.column;
    std::string why = error.what();
    if (const auto colon = why.find(": "); colon != std::string::npos) why = why.substr(colon + 2);
    problem.rule = "not JSON: " + why;
  } catch (const nlohmann::json::exception& error) {  // a number beyond what a double holds
    const std::string why = error.what();
    problem.line = 1;
    problem.rule = "not JSON: " + why.substr(std::min(why.find("] ") + 2, why.size()));
  }
  problems.push_back(problem);
  return empty;
}

}  // namespace talus::scene
