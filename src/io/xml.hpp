/// Text within XML.
#pragma once
#include <string>
#include <string_view>

namespace talus::io {

/// As the content of an element or of an attribute in double quotes.
inline std::string xml_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

}  // namespace talus::io
