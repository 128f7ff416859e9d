/// What a mesh says of itself as terrain, and what its coordinates say.
#pragma once
#include <string>
#include <vector>

#include "core/error.hpp"
#include "geometry/mesh.hpp"
#include "geometry/terrain.hpp"

namespace talus::geometry {

/// Warnings of a mesh whose file names another unit than metres, whose coordinates are rounded, which is
/// higher than any ground, or stands as terrain does whose y axis points up. `mesh`: z up, map coordinates.
/// `key`: of the scene. Throws InputError where vertices have a height that stands for none (-9999) and lie
/// farther from all others than these span. Vertices that the crop leaves out do not count.
std::vector<Problem> mesh_terrain_problems(const Mesh& mesh, const std::string& path, const std::string& key,
                                           const TerrainOptions& options);

}  // namespace talus::geometry
