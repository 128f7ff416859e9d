/// Points and lines with attributes, and what the raster module (which alone links GDAL) writes and reads of
/// such.
#pragma once
#include <array>
#include <string>
#include <vector>

namespace talus::geometry {

/// A layer of points (parts of one point) or lines, map coordinates.
struct Layer {
  struct Feature {
    std::vector<std::vector<std::array<double, 3>>> parts;
    std::vector<double> numbers;     // in the order of number_fields; NaN becomes null
    std::vector<std::string> texts;  // in the order of text_fields
  };
  std::string name;
  bool lines = false;
  std::vector<std::string> number_fields, text_fields;
  std::vector<Feature> features;
};

/// Exported by the module with C linkage as talus_layers_write. False with `error` set when it fails.
using WriteLayers = bool (*)(const char* path, const char* crs, const Layer* layers, int count,
                             std::string* error);

/// Exported as talus_layers_read: the features of an ESRI shapefile or a GeoPackage as text of GeoJSON, each
/// with a member "crs" that names its layer's coordinate system, as a code or in WKT. Arcs become chords.
/// False with `error` set for a file that cannot be read, and for several layers with features.
using ReadLayers = bool (*)(const char* path, std::string* geojson, std::string* error);

}  // namespace talus::geometry
