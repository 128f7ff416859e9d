/// Bad input in the description of a structure.
#pragma once
#include <string>

#include "contact/structures/structure.hpp"

namespace talus::fem {

/// Throws InputError about the key `structure.NAME.key`.
[[noreturn]] void bad(const StructureSpec& spec, const std::string& key, const std::string& value,
                      const std::string& rule, const std::string& remedy, const std::string& file = "");

}  // namespace talus::fem
