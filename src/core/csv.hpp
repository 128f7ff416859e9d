/// Names as fields of a CSV file.
#pragma once
#include <string>
#include <string_view>

namespace talus {

/// RFC 4180: a name with a comma, quote or line break stands in quotes. One that a spreadsheet would take for
/// a formula has an apostrophe before it.
inline std::string csv_field(std::string_view name) {
  constexpr std::string_view begins_a_formula = "=+-@\t\r";
  std::string text;
  if (!name.empty() && begins_a_formula.find(name.front()) != std::string_view::npos) text = "'";
  text += name;
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

}  // namespace talus
