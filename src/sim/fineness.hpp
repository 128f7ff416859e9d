/// How many cells lie across the smallest section of a structure that may be damaged.
///
/// Bending and shear of a member show in its cells from about three across on; where and how much it is
/// damaged wants six to eight (docs/guide/choosing.md).
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "contact/structures/structure.hpp"
#include "core/error.hpp"

namespace talus::sim {

struct Fineness {
  double section = 0;  // least extent across a column or pier, or of a box; a hollow one's wall [m]
  int cells = 0;       // across it, where they are finest
};

/// Nothing for a mesh file, whose sections are not known.
std::optional<Fineness> fineness(const StructureSpec& spec);
/// A warning where damage is asked of fewer than 3 cells across.
std::vector<Problem> fineness_problems(const StructureSpec& spec);
/// A line of the plan where damage is asked of fewer than 6; empty otherwise, and where it is warned of.
std::string fineness_line(const StructureSpec& spec);
/// A line of the plan about the facets of a round section, and that a blow wants 24 where there are fewer;
/// empty for another.
std::string round_line(const StructureSpec& spec);

}  // namespace talus::sim
