/// What the program and the raster module (a shared library that alone links GDAL) say to each other.
#pragma once
#include <string>
#include <vector>

namespace talus::geometry {

/// A raster band as read: cell centres at
///   x = transform[0] + (j + 1/2) transform[1],   y = transform[3] + (i + 1/2) transform[5]   (row i, column j, north up)
struct Raster {
  int columns = 0, rows = 0;
  double transform[6] = {0, 1, 0, 0, 0, -1};  // as GDAL's; map units
  std::vector<double> values;                 // rows x columns, row 0 first in the file; NaN where there is no data
  std::string crs;                            // "EPSG:31254", or WKT, or empty
  bool placed = true;                         // false: the file does not say where it lies, nor how large its cells are
  bool geographic = false;                    // by its CRS: longitude and latitude in degrees
  std::string error;                          // filled when a call fails
};

/// Exported by the module with C linkage. Each returns false (or -1) with `error` set when it fails.
using ReadRaster = bool (*)(const char* path, Raster* out);
using WriteRaster = bool (*)(const char* path, Raster* raster);  // .tif or .asc
/// 1 the same, 0 different, -1 not known to the library.
using SameCrs = int (*)(const char* a, const char* b);

}  // namespace talus::geometry
