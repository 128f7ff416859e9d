/// GeoPackages and shapefiles.
#pragma once
#include <span>
#include <string>
#include <string_view>

#include "geometry/raster/layers_module.hpp"

namespace talus::geometry {

/// Replaces the file. `crs`: "EPSG:31254", WKT, or empty. Throws InputError.
void write_geopackage(const std::string& path, const std::string& crs, std::span<const Layer> layers);

/// Whether a file begins with these bytes; no more of it is read.
bool begins_with(const std::string& path, std::string_view bytes);

/// Whether a file begins as a shapefile (.shp) or a GeoPackage does.
bool is_layer_file(const std::string& path);

/// Text of GeoJSON with the features of a shapefile or of a GeoPackage of one layer. Throws InputError at
/// `key`.
std::string layer_as_geojson(const std::string& path, const std::string& key);

}  // namespace talus::geometry
