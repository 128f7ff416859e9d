#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "core/names.hpp"

namespace talus {

namespace {

/// The first letter or blank of a text in Latin letters that only looks like one of them: " (\"о\" is
/// U+043E)".
std::string look_alike(std::string_view text) {
  constexpr char32_t latin_ends = 0x250, wide_blank = 0xA0, soft_hyphen = 0xAD;
  if (std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x80 && std::isalnum(c); }))
    return {};
  for (std::size_t at = 0, size = 1; at < text.size(); at += size) {
    const auto lead = static_cast<unsigned char>(text[at]);
    size = lead < 0xC0 ? 1 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
    if (size == 1 || at + size > text.size()) continue;
    char32_t c = lead & (0xFFu >> (size + 1));
    for (std::size_t k = 1; k < size; ++k) c = c << 6 | (static_cast<unsigned char>(text[at + k]) & 0x3Fu);
    if (c >= latin_ends || c == wide_blank || c == soft_hyphen)
      return fmt::format(" (\"{}\" in it is U+{:04X})", text.substr(at, size), static_cast<unsigned>(c));
  }
  return {};
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
  if (!key.empty())
    text +=
        value.empty() ? fmt::format("{}: ", key) : fmt::format("{} = {}{}: ", key, value, look_alike(value));
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
