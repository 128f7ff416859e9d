/// The nearest of a list of known names to one that is not known: Levenshtein distance with transposed
/// neighbours counted once (optimal string alignment), letters compared without case.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace talus {

/// Number of insertions, deletions, substitutions and swaps of neighbours that turn a into b.
int edit_distance(std::string_view a, std::string_view b);

/// The nearest name, or an empty text if none is near (more than a third of the letters, and more than one,
/// differ). The first of equals wins.
std::string nearest_name(std::string_view wrong, const std::vector<std::string>& known);

}  // namespace talus
