#include "scene/toml_text.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace talus::scene {
namespace {

constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

bool beyond_ascii(char c) { return static_cast<unsigned char>(c) >= 0x80; }
bool continues(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }

/// Where `at` lies, and the whole letter that begins there.
ForeignLetter letter_at(std::string_view text, std::size_t at) {
  ForeignLetter found;
  const std::string_view before = text.substr(0, at);
  found.line += static_cast<int>(std::count(before.begin(), before.end(), '\n'));
  const std::size_t newline = before.rfind('\n');
  const std::string_view row = newline == std::string_view::npos ? before : before.substr(newline + 1);
  found.column += static_cast<int>(std::count_if(row.begin(), row.end(), [](char c) { return !continues(c); }));
  std::size_t end = at + 1;
  while (end < text.size() && end < at + 4 && continues(text[end])) ++end;
  const auto lead = static_cast<unsigned char>(text[at]);
  const std::size_t length = lead < 0xc2 ? 0 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : lead < 0xf5 ? 4 : 0;
  found.letter = length == end - at ? fmt::format("'{}'", text.substr(at, length)) : fmt::format("byte 0x{:02x}", lead);
  return found;
}

/// A quote opens a text where a key or a value may begin; elsewhere the parser reads on as if it were a letter.
bool may_open(std::string_view text, std::size_t at) { return at == 0 || std::string_view(" \t\r\n=,[{.").find(text[at - 1]) != std::string_view::npos; }

/// The first byte behind the quoted text that begins at `at`, or the first letter beyond ASCII that follows a line's closing backslash in it.
std::size_t behind_quotes(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const bool several = text.substr(at, 3) == std::string(3, quote);
  const std::size_t length = several ? 3 : 1;
  for (std::size_t i = at + length; i < text.size(); ++i) {
    if (!several && text[i] == '\n') return i;                                // never closed: the parser tells
    if (text[i] == quote && (!several || text.substr(i, 3) == std::string(3, quote))) return i + length;
    if (text[i] != '\\' || quote == '\'') continue;
    const std::size_t next = text.find_first_not_of(" \t\r\n", i + 1);
    const bool line_ends = several && text.substr(i + 1, next == std::string_view::npos ? next : next - i - 1).find('\n') != std::string_view::npos;
    if (!line_ends) ++i;                                                      // an escape takes one letter
    else if (next != std::string_view::npos && beyond_ascii(text[next])) return next;
  }
  return text.size();
}

}  // namespace

std::optional<ForeignLetter> foreign_letter(std::string_view text) {
  std::size_t i = text.starts_with(byte_order_mark) ? byte_order_mark.size() : 0;
  while (i < text.size()) {
    if (beyond_ascii(text[i])) return letter_at(text, i);
    if (text[i] == '#') i = std::min(text.find('\n', i), text.size());
    else if ((text[i] == '"' || text[i] == '\'') && may_open(text, i)) i = behind_quotes(text, i);
    else ++i;
  }
  return std::nullopt;
}

}  // namespace talus::scene
