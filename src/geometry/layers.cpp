#include "geometry/layers.hpp"

#include <cstdio>

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

}  // namespace talus::geometry
