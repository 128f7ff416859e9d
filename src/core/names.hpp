/// What may be the name of a block, a structure, a material, a probe: it stands in messages and becomes the
/// name of files and datasets.
#pragma once
#include <string>
#include <string_view>

namespace talus {

inline constexpr const char* name_rule =
    "a name has 1 to 100 bytes of UTF-8, without slash, backslash and control characters, and is not \".\", "
    "\"..\" or \"*\"";
inline constexpr const char* name_remedy = "choose another name: it becomes the name of files and datasets";

bool is_name(std::string_view text);

/// Whether the text holds what steers a terminal or breaks a line: U+0000 to U+001F, U+007F to U+009F.
bool has_control_characters(std::string_view text);

bool is_utf8(std::string_view text);

/// As a message may show it: control characters other than line break and tabulator as \xNN, and all beyond
/// ASCII if the text is no UTF-8.
std::string printable(std::string_view text);

/// The name of the serial-th piece that comes off a structure, from 1.
std::string fragment_name(std::string_view structure, int serial);

/// Whether a name is that of some piece of the structure, now or later.
bool is_fragment_name(std::string_view name, std::string_view structure);
/// The rule that an error states where such a name is another's.
std::string fragment_name_rule(std::string_view structure);
inline constexpr const char* fragment_name_remedy = "choose another name, or set coupling.fragments = false";

}  // namespace talus
