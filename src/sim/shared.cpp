#include "sim/shared.hpp"

#include "contact/detection/detect.hpp"
#include "geometry/terrain_walls.hpp"
#include "sim/ground.hpp"

namespace talus::sim {

Shared::Shared(const scene::Scene& scene) {
  if (auto loaded = load_ground(scene))
    ground_ = std::make_shared<const geometry::Terrain>(std::move(*loaded));
}

std::shared_ptr<const contact::SurfaceIndex> Shared::index(double bottom, std::span<const Plane> planes) {
  const std::lock_guard lock(mutex_);
  auto& found = indices_[bottom];
  if (!found)
    found = std::make_shared<const contact::SurfaceIndex>(
        geometry::with_border_walls(ground_->surface, planes, bottom));
  return found;
}

}  // namespace talus::sim
