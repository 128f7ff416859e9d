/// Where a structure's feet are against the ground under them.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "contact/structures/structure.hpp"
#include "core/error.hpp"

namespace talus::sim {

/// Height of terrain or planes at the place of a point [m]; NaN where there is none.
using GroundHeight = std::function<double(const Vec3& at)>;

/// Warnings for columns, boxes held at their lower side, and viaducts whose feet hang above the ground, lie
/// deep below it, or have none under them. A foot hangs from 2 % of the height on (at least 0.1 m) above the
/// highest ground under its section, and is buried from a quarter of the height on (at least 3 m) below the
/// lowest.
std::vector<Problem> footing_problems(const StructureSpec& spec, std::span<const Member> members,
                                      const GroundHeight& ground);

/// Errors for a structure whose place or deck level, given in map coordinates, would be right in those of the
/// scene: beside the terrain as written, on it less `origin` (site.origin). Found before cells are made: a
/// deck at its map height stands on piers of a kilometre.
std::vector<Problem> map_coordinate_problems(const StructureSpec& spec, const Vec3& origin,
                                             const TriangleSurface& terrain);

}  // namespace talus::sim
