#include "core/error.hpp"

#include <fmt/format.h>

namespace talus {

namespace {

/// What a file says must not steer a terminal: control characters as \xNN.
std::string printable(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if ((code < 0x20 && c != '\n' && c != '\t') || code == 0x7f) out += fmt::format("\\x{:02x}", code);
    else out += c;
  }
  return out;
}

}  // namespace

std::string Problem::str() const {
  std::string where;
  if (!file.empty()) {
    where = file;
    if (line > 0) where += fmt::format(":{}", line);
    if (column > 0) where += fmt::format(":{}", column);
    where += ": ";
  }
  std::string text = where + (severity == Severity::error ? "error: " : "warning: ");
  if (!key.empty()) text += value.empty() ? fmt::format("{}: ", key) : fmt::format("{} = {}: ", key, value);
  text += rule;
  if (!remedy.empty()) text += "; " + remedy;
  return printable(text);
}

namespace {
std::string join(const std::vector<Problem>& problems) {
  std::string text;
  for (const Problem& p : problems) text += (text.empty() ? "" : "\n") + p.str();
  return text;
}
}  // namespace

InputError::InputError(std::vector<Problem> problems)
    : std::runtime_error(join(problems)), problems_(std::move(problems)) {}

}  // namespace talus
