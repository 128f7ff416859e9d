#include "core/names.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace talus {
namespace {

constexpr std::size_t longest = 100;  // [bytes]
constexpr std::string_view fragment_mark = ".fragment";

unsigned char at(std::string_view text, std::size_t i) { return static_cast<unsigned char>(text[i]); }

/// Bytes of the control character that begins at i; 0: there is none.
std::size_t control_bytes(std::string_view text, std::size_t i) {
  const unsigned char c = at(text, i);
  if (c < 0x20 || c == 0x7f) return 1;
  return c == 0xc2 && i + 1 < text.size() && at(text, i + 1) < 0xa0 ? 2 : 0;  // U+0080 to U+009F
}

/// Bytes of the letter that begins at i, by its first byte; 0: no letter begins so.
std::size_t letter_bytes(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first < 0xe0) return 2;
  if (first >= 0xe0 && first < 0xf0) return 3;
  return first >= 0xf0 && first < 0xf5 ? 4 : 0;
}

/// Too short a form of another letter, half of a pair, or beyond U+10FFFF, by the first two bytes.
bool is_no_letter(unsigned char first, unsigned char second) {
  return (first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f) ||
         (first == 0xf0 && second < 0x90) || (first == 0xf4 && second > 0x8f);
}

}  // namespace

bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t n = letter_bytes(at(text, i));
    if (n == 0 || i + n > text.size()) return false;
    for (std::size_t k = 1; k < n; ++k)
      if ((at(text, i + k) & 0xc0) != 0x80) return false;
    if (n > 2 && is_no_letter(at(text, i), at(text, i + 1))) return false;
    i += n;
  }
  return true;
}

bool has_control_characters(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i)
    if (control_bytes(text, i) > 0) return true;
  return false;
}

std::string printable(std::string_view text) {
  const bool letters = is_utf8(text);
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const bool breaks = text[i] == '\n' || text[i] == '\t';
    const std::size_t control = breaks                            ? 0
                                : !letters && at(text, i) >= 0x80 ? 1
                                                                  : control_bytes(text, i),
                      end = i + std::max<std::size_t>(control, 1);
    for (; i < end; ++i) out += control > 0 ? fmt::format("\\x{:02x}", at(text, i)) : std::string(1, text[i]);
  }
  return out;
}

bool is_name(std::string_view text) {
  if (text.empty() || text.size() > longest || text == "." || text == ".." || text == "*") return false;
  return text.find_first_of("/\\") == std::string_view::npos && !has_control_characters(text) &&
         is_utf8(text);
}

std::string fragment_name(std::string_view structure, int serial) {
  return fmt::format("{}{}{}", structure, fragment_mark, serial);
}

bool is_fragment_name(std::string_view name, std::string_view structure) {
  if (!name.starts_with(structure) || !name.substr(structure.size()).starts_with(fragment_mark)) return false;
  const std::string_view serial = name.substr(structure.size() + fragment_mark.size());
  return !serial.empty() &&
         std::all_of(serial.begin(), serial.end(), [](char c) { return c >= '0' && c <= '9'; });
}

std::string fragment_name_rule(std::string_view structure) {
  return fmt::format("is a name that pieces of structure {} get when they come off", structure);
}

}  // namespace talus
