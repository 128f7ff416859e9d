#include "geometry/raster.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <strings.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <mutex>
#include <vector>

#include "core/error.hpp"
#include "geometry/text_cursor.hpp"

namespace talus::geometry {
namespace {

struct Module {
  ReadRaster read = nullptr;
  WriteRaster write = nullptr;
  SameCrs same = nullptr;
};

const Module& module(const std::string& for_file) {
  static Module m;
  static std::mutex lock;
  const std::lock_guard guard(lock);
  if (m.read) return m;
  std::vector<std::string> places;
  if (const char* dir = std::getenv("TALUS_MODULE_DIR")) places.push_back(std::string(dir) + "/talus_raster.so");
  char exe[4096];
  if (const auto n = readlink("/proc/self/exe", exe, sizeof exe - 1); n > 0) {
    std::string dir(exe, static_cast<std::size_t>(n));
    dir.resize(dir.find_last_of('/'));
    places.push_back(dir + "/talus_raster.so");
    places.push_back(dir + "/../lib/talus/talus_raster.so");
  }
  std::string why;
  for (const std::string& place : places) {
    if (access(place.c_str(), R_OK) != 0) continue;
    if (void* handle = dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL)) {
      m.read = reinterpret_cast<ReadRaster>(dlsym(handle, "talus_raster_read"));
      m.write = reinterpret_cast<WriteRaster>(dlsym(handle, "talus_raster_write"));
      m.same = reinterpret_cast<SameCrs>(dlsym(handle, "talus_raster_same_crs"));
      if (m.read && m.write && m.same) return m;
      m = {};
      why = place + " lacks a function";
    } else {
      why = dlerror();
    }
  }
  throw InputError(Problem{.file = for_file, .key = "terrain", .value = why,
                           .rule = "rasters need the module talus_raster.so, which was not found or did not load",
                           .remedy = "put it beside the program or set TALUS_MODULE_DIR; a mesh (STL, OBJ, PLY, OFF) needs no module"});
}

/// What the library's reader of ESRI ASCII grids lets pass: words where heights should be count as zero, values beyond the last are left
/// unread, and what follows a decimal comma is cut off.
void check_ascii_grid(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text(5, ' ');
  if (!in.read(text.data(), 5) || strncasecmp(text.data(), "ncols", 5) != 0) return;
  in.seekg(0, std::ios::end);
  text.resize(static_cast<std::size_t>(in.tellg()));
  in.seekg(0);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  TextCursor cursor(text, path);
  if (const auto comma = text.find(','); comma != std::string::npos) {
    cursor.position(text.data() + comma);
    cursor.skip_back_to_blank();
    cursor.fail("raster", "has a decimal comma; this format has decimal points, a reader would cut the number there", "replace the commas by points: sed 's/,/./g'");
  }
  double columns = 0, rows = 0;
  const auto is_letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  while (!cursor.at_end() && is_letter(*cursor.position()) && strncasecmp(cursor.position(), "nan", 3) != 0) {
    std::string key(cursor.word());
    std::transform(key.begin(), key.end(), key.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (key == "nodata_value") {
      cursor.word();
      continue;
    }
    const double value = cursor.number<double>("raster");
    if (key == "ncols") columns = value;
    if (key == "nrows") rows = value;
    if (!std::isfinite(value) || ((key == "ncols" || key == "nrows" || key == "cellsize") && !(value > 0)))
      throw InputError(Problem{.file = path, .key = "raster " + key, .value = std::to_string(value), .rule = "must be a positive number", .remedy = "correct the header of the grid"});
  }
  double count = 0;
  for (; !cursor.at_end(); ++count) cursor.number<double>("raster height");
  if (count != columns * rows)
    throw InputError(Problem{.file = path, .key = "raster", .value = fmt::format("{:.0f} values", count),
                             .rule = fmt::format("has {:.0f} columns and {:.0f} rows by its header: {:.0f} values", columns, rows, columns * rows),
                             .remedy = "export the grid again: it is cut short, or its header is that of another grid"});
}

/// Heights are in metres: over longitude and latitude every slope would be a hundred thousand times too steep. Without a CRS a grid is taken for one in degrees
/// where its coordinates are such, its cells are below a centimetre, and it is higher than wide.
void refuse_degrees(const Raster& r, const std::string& path) {
  constexpr double most_cell = 0.01;
  const double dx = r.transform[1], dy = std::abs(r.transform[5]), west = r.transform[0], north = std::max(r.transform[3], r.transform[3] + r.rows * r.transform[5]);
  bool degrees = r.geographic;
  if (!degrees && r.crs.empty() && dx < most_cell && dy < most_cell && std::abs(west) <= 180 && std::abs(west + r.columns * dx) <= 360 && std::abs(north) <= 90 && std::abs(north - r.rows * dy) <= 90) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double z : r.values)
      if (std::isfinite(z)) low = std::min(low, z), high = std::max(high, z);
    degrees = high - low > std::max(r.columns * dx, r.rows * dy);
  }
  if (!degrees) return;
  throw InputError(Problem{.file = path, .key = "raster", .value = fmt::format("cells of {:g} x {:g}, from [{:g}, {:g}]", dx, dy, west, north),
                           .rule = r.geographic ? fmt::format("is in degrees of longitude and latitude ({}), and heights are in metres", r.crs.size() < 40 ? r.crs : "by its coordinate system")
                                                : std::string("looks like degrees of longitude and latitude, and heights are in metres"),
                           .remedy = "project it to metres first: gdalwarp -s_srs EPSG:4326 -t_srs EPSG:... -r bilinear in.tif out.tif, with the national grid or the UTM zone (EPSG:25832, 25833, ...)"});
}

}  // namespace

Raster read_raster(const std::string& path) {
  if (access(path.c_str(), R_OK) != 0)
    throw InputError(Problem{.file = path, .key = "file", .rule = "cannot be read",
                             .remedy = "check the path, which is relative to the scene file"});
  check_ascii_grid(path);
  Raster r;
  const bool read = module(path).read(path.c_str(), &r);
  if (!r.placed)
    throw InputError(Problem{.file = path, .key = "raster", .value = fmt::format("{} x {} values", r.columns, r.rows),
                             .rule = "is a picture without a place: it says neither where it lies nor how large its cells are (no GeoTIFF tags, no world file .tfw beside it)",
                             .remedy = "export it again with its georeference, or give it one: gdal_translate -a_srs EPSG:... -a_ullr WEST NORTH EAST SOUTH in.tif out.tif"});
  if (!read)
    throw InputError(Problem{.file = path, .key = "raster", .rule = r.error, .remedy = "give an ESRI ASCII grid or a GeoTIFF"});
  if (r.transform[2] != 0 || r.transform[4] != 0)
    throw InputError(Problem{.file = path, .key = "raster", .rule = "is rotated against north",
                             .remedy = "warp it to a north-up grid first (gdalwarp)"});
  if (r.transform[1] <= 0 || r.transform[5] == 0)
    throw InputError(Problem{.file = path, .key = "raster", .rule = "has no positive cell size", .remedy = "correct its georeference"});
  refuse_degrees(r, path);
  if (r.transform[5] > 0) {  // south first: turn it over
    for (int i = 0; i < r.rows / 2; ++i)
      for (int j = 0; j < r.columns; ++j)
        std::swap(r.values[static_cast<std::size_t>(i) * r.columns + j],
                  r.values[static_cast<std::size_t>(r.rows - 1 - i) * r.columns + j]);
    r.transform[3] += r.rows * r.transform[5];
    r.transform[5] = -r.transform[5];
  }
  return r;
}

void write_raster(const std::string& path, const Raster& raster) {
  Raster copy = raster;
  if (!module(path).write(path.c_str(), &copy))
    throw InputError(Problem{.file = path, .key = "raster", .rule = copy.error, .remedy = "check the directory and the ending (.tif or .asc)"});
}

int same_crs(const std::string& a, const std::string& b) { return module("").same(a.c_str(), b.c_str()); }

}  // namespace talus::geometry
