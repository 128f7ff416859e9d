/// What worlds of variants of one scene have in common: the terrain, its search tree, the surfaces of rigid
/// structures. Read once, never changed after.
#pragma once
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "coupling/environment.hpp"
#include "geometry/terrain.hpp"
#include "scene/scene.hpp"

namespace talus::sim {

class Shared {
 public:
  /// Reads the terrain if there is one. Throws InputError.
  explicit Shared(const scene::Scene& scene);
  Shared() = default;  // nothing in common but structures

  const std::shared_ptr<const geometry::Terrain>& ground() const { return ground_; }
  /// The terrain with walls down to z = `bottom` [m] at its borders, made at the first call. From any thread.
  std::shared_ptr<const contact::SurfaceIndex> index(double bottom, std::span<const Plane> planes);

  bool keeps_structures = true;                     // false: they differ from world to world
  std::vector<coupling::StructurePart> structures;  // of scheme "rigid", filled by the first world

 private:
  std::shared_ptr<const geometry::Terrain> ground_;
  std::map<double, std::shared_ptr<const contact::SurfaceIndex>> indices_;  // by bottom
  std::mutex mutex_;
};

}  // namespace talus::sim
