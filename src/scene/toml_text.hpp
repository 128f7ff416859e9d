/// A look at a scene's text before the parser sees it.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace talus::scene {

/// A letter beyond ASCII where TOML 1.0 has none.
struct ForeignLetter {
  std::string letter;      ///< as it is to be shown: in marks, or as a byte where it is no UTF-8
  int line = 1;            ///< from 1
  int column = 1;          ///< from 1, in letters
};

/// The first letter beyond ASCII that stands neither in a quoted text nor in a comment, or that follows a line's closing backslash in a text of several lines.
/// The parser (toml++ 3.3) has no defined answer to some of them there, "28°" without quotes among them. A byte-order mark at the start is none.
std::optional<ForeignLetter> foreign_letter(std::string_view text);

}  // namespace talus::scene
