/// GeoPackage files of points and lines.
#pragma once
#include <span>
#include <string>

#include "geometry/raster/layers_module.hpp"

namespace talus::geometry {

/// Replaces the file. `crs`: "EPSG:31254", WKT, or empty. Throws InputError.
void write_geopackage(const std::string& path, const std::string& crs, std::span<const Layer> layers);

}  // namespace talus::geometry
