/// GeoPackages and shapefiles.
#pragma once
#include <span>
#include <string>

#include "geometry/raster/layers_module.hpp"

namespace talus::geometry {

/// Replaces the file. `crs`: "EPSG:31254", WKT, or empty. Throws InputError.
void write_geopackage(const std::string& path, const std::string& crs, std::span<const Layer> layers);

/// Whether a file begins as a shapefile (.shp) or a GeoPackage does.
bool is_layer_file(const std::string& bytes);

/// Text of GeoJSON with the features of a shapefile or of a GeoPackage of one layer. Throws InputError at
/// `key`.
std::string layer_as_geojson(const std::string& path, const std::string& key);

}  // namespace talus::geometry
