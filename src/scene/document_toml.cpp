#include <fmt/format.h>

#include <sstream>
#include <stdexcept>

// The parser asserts, in a few places, what damaged text can break: there it must refuse the text, not end the program.
namespace {
[[noreturn]] void refuse_text() { throw std::runtime_error("the text cannot be understood"); }
}  // namespace
#undef NDEBUG   // with it, the conditions would become promises to the compiler
#define TOML_EXCEPTIONS 1
#define TOML_ASSERT(condition) (static_cast<bool>(condition) ? static_cast<void>(0) : refuse_text())
#include <toml++/toml.h>

#include "scene/document.hpp"
#include "scene/toml_text.hpp"

namespace talus::scene {
namespace {

Where place(const toml::source_region& source, const std::string& file) {
  return {file, static_cast<int>(source.begin.line), static_cast<int>(source.begin.column)};
}

Node convert(const toml::node& node, const std::string& file) {
  Node out;
  out.where = place(node.source(), file);
  if (const auto* table = node.as_table()) {
    out.kind = Node::Kind::table;
    for (const auto& [key, value] : *table)
      out.entries.push_back({std::string(key.str()), place(key.source(), file), convert(value, file)});
  } else if (const auto* array = node.as_array()) {
    out.kind = Node::Kind::array;
    for (const auto& value : *array) out.items.push_back(convert(value, file));
  } else if (const auto* text = node.as_string()) {
    out.kind = Node::Kind::text;
    out.text = text->get();
  } else if (const auto* integer = node.as_integer()) {
    out.kind = Node::Kind::integer;
    out.integer = integer->get();
  } else if (const auto* number = node.as_floating_point()) {
    out.kind = Node::Kind::number;
    out.number = number->get();
  } else if (const auto* boolean = node.as_boolean()) {
    out.kind = Node::Kind::boolean;
    out.boolean = boolean->get();
  } else {
    out.kind = Node::Kind::other;
    std::ostringstream stream;
    node.visit([&](const auto& n) { stream << n; });
    out.text = stream.str();
  }
  return out;
}

}  // namespace

Node parse_toml(const std::string& text, const std::string& file, std::vector<Problem>& problems) {
  Problem problem;
  problem.file = file;
  problem.line = problem.column = 1;
  if (const auto foreign = foreign_letter(text)) {
    problem.line = foreign->line;
    problem.column = foreign->column;
    problem.rule = fmt::format("not TOML: {} stands outside quotes", foreign->letter);
    problem.remedy = "put what contains it in quotes, a unit as in \"28 deg\"; the rest of the file was not read";
  } else {
    try {
      return convert(toml::parse(text, file), file);
    } catch (const toml::parse_error& error) {
      problem.line = static_cast<int>(error.source().begin.line);
      problem.column = static_cast<int>(error.source().begin.column);
      problem.rule = fmt::format("not TOML: {}", error.description());
      problem.remedy = "correct the syntax here; the rest of the file was not read";
    } catch (const std::runtime_error& error) {
      problem.rule = fmt::format("not TOML: {}", error.what());
      problem.remedy = "look for a key or a bracket that is damaged";
    }
  }
  problems.push_back(std::move(problem));
  Node empty;
  empty.kind = Node::Kind::table;
  empty.bad = true;
  return empty;
}

Node parse_toml_value(const std::string& text, const std::string& file) {
  Node node;
  try {
    if (foreign_letter(text)) throw std::runtime_error("a letter beyond ASCII");
    const toml::table table = toml::parse("value = " + text, file);
    if (table.size() == 1 && table.contains("value")) {
      node = convert(*table.get("value"), file);
      node.where = {file, 0, 0};
      return node;
    }
  } catch (const std::runtime_error&) {
    // The shell takes the quotes away: 1e-4 s is meant as a text.
  }
  node = {};
  node.kind = Node::Kind::text;
  node.text = text;
  node.where = {file, 0, 0};
  return node;
}

}  // namespace talus::scene
