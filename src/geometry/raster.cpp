#include "geometry/raster.hpp"

#include <dlfcn.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <mutex>
#include <vector>

#include "core/error.hpp"

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

}  // namespace

Raster read_raster(const std::string& path) {
  if (access(path.c_str(), R_OK) != 0)
    throw InputError(Problem{.file = path, .key = "file", .rule = "cannot be read",
                             .remedy = "check the path, which is relative to the scene file"});
  Raster r;
  if (!module(path).read(path.c_str(), &r))
    throw InputError(Problem{.file = path, .key = "raster", .rule = r.error, .remedy = "give an ESRI ASCII grid or a GeoTIFF"});
  if (r.transform[2] != 0 || r.transform[4] != 0)
    throw InputError(Problem{.file = path, .key = "raster", .rule = "is rotated against north",
                             .remedy = "warp it to a north-up grid first (gdalwarp)"});
  if (r.transform[1] <= 0 || r.transform[5] == 0)
    throw InputError(Problem{.file = path, .key = "raster", .rule = "has no positive cell size", .remedy = "correct its georeference"});
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
