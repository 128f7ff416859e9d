/// What the program and the raster module (a shared library that alone links GDAL) say to each other.
#pragma once
#include <string>
#include <vector>

namespace talus::geometry {

/// A raster band as read: cell centres at
///   x = transform[0] + (j + 1/2) transform[1],   y = transform[3] + (i + 1/2) transform[5]
///   row i, column j, north up
struct Raster {
  int columns = 0, rows = 0;
  double transform[6] = {0, 1, 0, 0, 0, -1};  // as GDAL's; map units
  std::vector<double> values;  // rows x columns, row 0 first in the file; NaN where there is no data
  std::string crs;             // "EPSG:31254", or WKT, or empty
  bool placed = true;          // false: the file does not say where it lies, nor how large its cells are
  bool geographic = false;     // by its CRS: longitude and latitude in degrees
  bool in_plan = true;         // by its CRS: not heights alone, nor from the centre of the Earth
  double metres = 1;           // length of the CRS's unit in plan [m]; 1 where there is no CRS
  std::string unit;            // its name
  double vertical_metres = 0;  // length of the unit of heights by the CRS [m]; 0: it does not say
  std::string vertical_unit;
  std::string band_unit;         // of the values by the band; empty: it does not say
  bool depths = false;           // by the CRS its values grow downwards
  double scale = 1, offset = 0;  // of the band, applied: value = scale stored + offset
  std::string projection;        // given: text of the .prj beside the file
  bool grid_of_text = false;     // given: the file is an ESRI ASCII grid, whose system is in its .prj alone
  std::string unit_by = "its coordinate system";  // what gives vertical_unit
  std::string loose_unit;            // by the metadata, which do not say whether of plan or of heights
  std::vector<std::string> remarks;  // texts of the metadata, of the band, and the name of the system
  std::string band_name;             // description of the first band
  std::string band_names;            // of all that have one, joined by commas
  int images = 1;                    // in the file; the first is read
  double scale_z = 1;                // third size of a pixel by the file's tag, where nothing was made of it
  bool classes = false;              // the values stand for names, such as kinds of ground
  bool palette = false,
       colours =
           false;  // the values are numbers of a table of colours; the first band is a colour of a picture
  bool bytes = false;   // values of 8 bits without scale
  int bands = 1;        // besides alpha
  bool points = false;  // points in rows (XYZ)
  std::string error;    // filled when a call fails
};

/// Exported by the module with C linkage. Each returns false (or -1) with `error` set when it fails.
/// Values are as meant: scale and offset of the band applied. `text`: what the file holds, where it is not to
/// be read as it is; null otherwise.
using ReadRaster = bool (*)(const char* path, const std::string* text, Raster* out);
using WriteRaster = bool (*)(const char* path, Raster* raster);  // .tif or .asc
/// 1 the same, 0 different, -1 not known to the library.
using SameCrs = int (*)(const char* a, const char* b);
/// What is said of a coordinate system of this name, or WKT; false: it is none.
using TellCrs = bool (*)(const char* crs, Raster* out);
/// Length in plan over that on the ellipsoid, along the map's axes at a place; false where that is not known.
using PlanScale = bool (*)(const char* crs, double x, double y, double* along_x, double* along_y);

}  // namespace talus::geometry
