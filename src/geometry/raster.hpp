/// Rasters (ESRI ASCII grid, GeoTIFF and all else that GDAL reads) through a module loaded on first use: GDAL
/// brings some hundred shared libraries, which a run without a raster must not pay for.
///
/// The module `talus_raster.so` is looked for in $TALUS_MODULE_DIR, then beside the executable, then in the
/// executable's ../lib/talus.
#pragma once
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/types.hpp"
#include "geometry/raster/raster_module.hpp"

namespace talus::geometry {

/// Throws InputError naming the file. Rotated rasters are refused; rows are returned north first.
Raster read_raster(const std::string& path);

/// The same for heights. Those whose band or coordinate system gives another unit of length than metres are
/// converted, with a warning; pictures, palettes, classes and grids whose plan is not in metres are refused.
/// Warns of what is hardly heights: bytes, several bands or images, a band called slope.
Raster read_heights(const std::string& path, std::vector<Problem>& warnings);

/// Another grid of the same values. A grid that is written names no unit: heights in another one than metres
/// are converted, and depths turned, as for terrain, with a warning; a unit of another kind is lost, with a
/// warning.
void convert_raster(const std::string& in, const std::string& out, std::vector<Problem>& warnings);

inline constexpr double highest_ground = 8849;  ///< Mount Everest [m]

/// A value at one end of all that lies farther from the others than these span.
struct FarValue {
  double value;
  std::size_t count;  ///< how often
  std::string where;  ///< "lies 1.05e+04 m below all others, of 500 to 540"
};
std::vector<FarValue> values_far_from_others(const std::vector<double>& values);

/// Values that programs write where there are no data.
bool stands_for_none(double stored);

/// Refuses nodes of a value that programs write where there are no data (-9999, 32767, ...) if it lies
/// farther from all others than these span and the file does not name it NODATA; warns of zeros by the same
/// measure.
void tell_of_missing_data(const Raster& heights, const std::string& path, std::vector<Problem>& warnings);

/// Warns of heights and slopes that no terrain has in metres: above Mount Everest, half of the cells steeper
/// than 60 degrees.
void warn_of_size(const Raster& heights, const std::string& path, std::vector<Problem>& warnings);

/// Writes .tif (GeoTIFF) or .asc (ESRI ASCII grid); NaN becomes NODATA.
void write_raster(const std::string& path, const Raster& raster);

/// Throws InputError at `key` of `file` for what is no coordinate system that the library knows, and for one
/// whose coordinates in plan are no metres. An empty text is none, and good. Returns its short name,
/// "EPSG:25832".
std::string check_crs(const std::string& crs, const std::string& file, const std::string& key);

/// Throws InputError at `key` of `file` for a coordinate system whose lengths in plan at a place differ by
/// more than 2 % from those on the ground: slopes and distances would be wrong by as much. National grids
/// keep within 0.2 %; Web Mercator has 1 / cos(latitude).
void check_lengths(const std::string& crs, const Eigen::Vector2d& place, const std::string& file,
                   const std::string& key);

/// 1 the same system, 0 different, -1 if either is not known.
int same_crs(const std::string& a, const std::string& b);

}  // namespace talus::geometry
