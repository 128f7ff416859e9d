#include "core/error.hpp"

#include <fmt/format.h>

#include "core/names.hpp"

namespace talus {

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
