#include "geometry/layers.hpp"

#include <cstdio>
#include <fstream>

#include "core/error.hpp"
#include "core/module.hpp"

namespace talus::geometry {

void write_geopackage(const std::string& path, const std::string& crs, std::span<const Layer> layers) {
  static const auto write = reinterpret_cast<WriteLayers>(
      module_symbol("talus_raster.so", "talus_layers_write", path,
                    "build the target talus_raster (it needs GDAL: make setup)"));
  std::remove(path.c_str());
  std::string error;
  if (!write(path.c_str(), crs.c_str(), layers.data(), static_cast<int>(layers.size()), &error))
    throw InputError(Problem{.file = path, .key = "layers", .rule = error, .remedy = "check the directory"});
}

bool begins_with(const std::string& path, std::string_view bytes) {
  std::string head(bytes.size(), '\0');
  return std::ifstream(path, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size())) &&
         head == bytes;
}

bool is_layer_file(const std::string& path) {
  return begins_with(path, {"\0\0\x27\x0a", 4}) || begins_with(path, "SQLite format 3");
}

std::string layer_as_geojson(const std::string& path, const std::string& key) {
  static const auto read = reinterpret_cast<ReadLayers>(
      module_symbol("talus_raster.so", "talus_layers_read", key,
                    "build the target talus_raster (it needs GDAL: make setup), or give GeoJSON"));
  std::string geojson, error;
  if (!read(path.c_str(), &geojson, &error))
    throw InputError(
        Problem{.file = path,
                .key = key,
                .rule = error,
                .remedy = error.starts_with("holds several")
                              ? "export the one that is meant: ogr2ogr out.geojson in.gpkg LAYER"
                              : "export it again; the .shx and .prj of a shapefile belong beside it"});
  return geojson;
}

}  // namespace talus::geometry
