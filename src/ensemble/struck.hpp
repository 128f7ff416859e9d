/// Which member of a structure (pier, span, column) a hit is on.
#pragma once
#include <vector>

#include "contact/structures/structure.hpp"

namespace talus::ensemble {

/// The member that is nearest to the point, a prism about its axis; -1 without members.
int struck_by(const Vec3& point, const std::vector<talus::Member>& members);

}  // namespace talus::ensemble
