/// The scene of `talus impact`: a structure alone, and the one block of [impact] on its way to it.
///
///   the block's centroid moves on the line through the impact point along the velocity; it starts where
///   `impact.clearance` is left to its first contact with the structure on that line
#pragma once
#include "scene/scene.hpp"

namespace talus::app {

/// `scene`: read for Purpose::impact, with an [impact]. Warns of a block that passes the structure by; throws
/// InputError for one that flies away from it, and for a ground that no law of contact covers.
scene::Scene impact_scene(scene::Scene scene);

/// The blow of such a scene in a line: mass, size, speed, energy, and where the block starts.
std::string impact_line(const scene::Scene& impact_scene);

}  // namespace talus::app
