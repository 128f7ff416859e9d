#include "io/gis_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "contact/geometry/plumb.hpp"
#include "geometry/raster/raster_module.hpp"
#include "io/check_indices.hpp"
#include "io/files.hpp"
#include "io/hdf5_file.hpp"

namespace talus::io {
namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();
constexpr double most_cells = 1e8;
constexpr int ground_side = 2000;  // nodes of the grid of heights, along the longer side

/// A block's centroid at the history rows from its birth until it left the model.
struct Track {
  std::size_t block = 0, first_row = 0;
  bool left = false;
  std::vector<Vec3> at;                // scene coordinates [m]
  std::vector<double> speed, kinetic;  // [m/s], [J]
};

struct Tracks {
  explicit Tracks(const std::filesystem::path& results);
  Hdf5File file;
  std::vector<double> time;
  std::size_t blocks = 0;
  Vec3 origin = Vec3::Zero();
  std::string crs;
  std::vector<Track> moving;
  Box3 box;  // of the moving blocks' paths, scene coordinates
};

/// `rows`: those before the block left the model.
Track track_of(std::size_t block, std::size_t blocks, std::size_t rows, const std::vector<double>& position,
               const std::vector<double>& velocity, const std::vector<double>& kinetic) {
  Track t{.block = block,
          .first_row = 0,
          .left = rows < kinetic.size() / blocks,
          .at = {},
          .speed = {},
          .kinetic = {}};
  for (std::size_t r = 0; r < rows; ++r) {
    const std::size_t k = r * blocks + block;
    if (!std::isfinite(position[3 * k])) continue;
    if (t.at.empty()) t.first_row = r;
    t.at.emplace_back(position[3 * k], position[3 * k + 1], position[3 * k + 2]);
    t.speed.push_back(Vec3(velocity[3 * k], velocity[3 * k + 1], velocity[3 * k + 2]).norm());
    t.kinetic.push_back(kinetic[k]);
  }
  return t;
}

/// A dataset of `size` numbers; throws InputError if it has another number of them.
template <class T>
std::vector<T> read_sized(const Hdf5File& file, const std::string& path, std::size_t size) {
  std::vector<T> values = file.read<T>(path).values;
  if (values.size() != size)
    throw bad_file("results.h5", path, fmt::format("holds {} numbers, {} belong there", values.size(), size),
                   "use results that Talus wrote");
  return values;
}

Tracks::Tracks(const std::filesystem::path& results) : file(Hdf5File::open(results)) {
  const std::string h = "/history/blocks/";
  if (!file.exists(h + "position"))
    throw bad_file(results, h + "position", "there are no blocks in it",
                   "name the results.h5 of a run with blocks");
  time = file.read<double>("/history/time").values;
  crs = file.text_attribute("/", "crs");
  if (file.exists("/geometry/map_origin"))
    origin = Eigen::Map<const Vec3>(read_sized<double>(file, "/geometry/map_origin", 3).data());
  blocks = file.read_texts(h + "name").size();
  const std::size_t entries = time.size() * blocks;
  const auto position = read_sized<double>(file, h + "position", 3 * entries),
             velocity = read_sized<double>(file, h + "velocity", 3 * entries);
  const auto rotational = read_sized<double>(file, h + "kinetic_rotational", entries);
  auto kinetic = read_sized<double>(file, h + "kinetic_translational", entries);
  for (std::size_t k = 0; k < entries; ++k) kinetic[k] += rotational[k];
  const std::vector<double> left = file.exists(h + "left")
                                       ? read_sized<double>(file, h + "left", blocks)
                                       : std::vector<double>(blocks, missing);  // earlier versions wrote none
  for (std::size_t b = 0; b < blocks; ++b) {
    const auto end =
        std::isfinite(left[b]) ? std::upper_bound(time.begin(), time.end(), left[b]) : time.end();
    Track t = track_of(b, blocks, static_cast<std::size_t>(end - time.begin()), position, velocity, kinetic);
    if (t.at.empty() || *std::max_element(t.speed.begin(), t.speed.end()) == 0) continue;
    for (const Vec3& p : t.at) box.extend(p);
    moving.push_back(std::move(t));
  }
  if (moving.empty())
    throw bad_file(results, h + "position", "no block moved",
                   "name the results.h5 of a run in which one does");
}

/// 1, 2 or 5 times a power of ten, at most `length`.
double round_below(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(length)));
  return (length >= 5 * power ? 5 : length >= 2 * power ? 2 : 1) * power;
}

/// Calls use(point, share of the way between the rows) for points of the straight way from a to b no further
/// apart than half a cell.
template <class Use>
void along(const Vec3& a, const Vec3& b, double cell, const Use& use) {
  const int pieces = std::max(1, static_cast<int>(std::ceil((b - a).head<2>().norm() / (0.5 * cell))));
  for (int i = 0; i <= pieces; ++i) {
    const double s = static_cast<double>(i) / pieces;
    use(Vec3(a + s * (b - a)), s);
  }
}

/// Height of the terrain under a point: under an overhang that of the floor there; NaN off the terrain.
class Ground {
 public:
  explicit Ground(const Hdf5File& file) : index_(terrain_of(file)) {}
  double under(const Vec3& p) const {
    const double floor = contact::plumb_at(index_, p).floor;
    return std::isnan(floor) ? index_.height(p.x(), p.y())
                             : floor;  // of a sheet that bears from both sides faces may look down
  }

 private:
  static TriangleSurface terrain_of(const Hdf5File& file) {
    TriangleSurface s;
    const auto v = file.read<double>("/geometry/terrain/vertices").values;
    const auto t = file.read<std::int32_t>("/geometry/terrain/triangles").values;
    for (std::size_t k = 0; k + 2 < v.size(); k += 3) s.vertices.emplace_back(v[k], v[k + 1], v[k + 2]);
    check_indices(t, s.vertices.size(), "terrain triangles");
    for (std::size_t k = 0; k + 2 < t.size(); k += 3) s.triangles.push_back({t[k], t[k + 1], t[k + 2]});
    return s;
  }
  contact::SurfaceIndex index_;
};

geometry::Raster empty_map(const Tracks& tracks, double cell, const std::filesystem::path& results) {
  const Vec3 low = tracks.box.min() + tracks.origin, high = tracks.box.max() + tracks.origin;
  const double extent =
      std::max({high.x() - low.x(), high.y() - low.y(), 0.1 * tracks.box.diagonal().norm()});
  if (cell > extent)
    throw bad_file(
        results, fmt::format("@{:g}", cell),
        fmt::format("is a cell larger than all the ground that blocks went over, {:.3g} m", extent),
        "take smaller cells, or leave the size out");
  if (!(cell > 0)) cell = round_below(extent / 100);
  const double west = std::floor(low.x() / cell), east = std::floor(high.x() / cell) + 1,
               south = std::floor(low.y() / cell), north = std::floor(high.y() / cell) + 1;
  if ((east - west) * (north - south) > most_cells)
    throw bad_file(results, fmt::format("@{:g}", cell),
                   fmt::format("gives a grid of {:.3g} cells", (east - west) * (north - south)),
                   "take larger cells");
  geometry::Raster map;
  map.columns = static_cast<int>(east - west), map.rows = static_cast<int>(north - south);
  const double transform[6] = {west * cell, cell, 0, north * cell, 0, -cell};
  std::copy(std::begin(transform), std::end(transform), std::begin(map.transform));
  map.values.assign(static_cast<std::size_t>(map.columns) * static_cast<std::size_t>(map.rows), missing);
  map.crs = tracks.crs;
  return map;
}

/// Index in `map` of the cell that holds a point of the scene.
std::size_t cell_of(const geometry::Raster& map, const Tracks& tracks, const Vec3& at) {
  const double x = at.x() + tracks.origin.x() - map.transform[0],
               y = map.transform[3] - at.y() - tracks.origin.y(), cell = map.transform[1];
  const int j = std::clamp(static_cast<int>(x / cell), 0, map.columns - 1),
            i = std::clamp(static_cast<int>(y / cell), 0, map.rows - 1);
  return static_cast<std::size_t>(i) * static_cast<std::size_t>(map.columns) + static_cast<std::size_t>(j);
}

void keep_greatest(double& cell, double value) {
  if (std::isfinite(value)) cell = std::isnan(cell) ? value : std::max(cell, value);
}

void add_passages(const Tracks& tracks, const Track& t, geometry::Raster& map) {
  std::set<std::size_t> crossed;
  for (std::size_t r = 0; r < t.at.size(); ++r)
    along(t.at[r], t.at[std::min(r + 1, t.at.size() - 1)], map.transform[1],
          [&](const Vec3& p, double) { crossed.insert(cell_of(map, tracks, p)); });
  for (const std::size_t k : crossed) map.values[k] = (std::isnan(map.values[k]) ? 0 : map.values[k]) + 1;
}

}  // namespace

std::string tracks_geojson(const std::filesystem::path& results) {
  using json = nlohmann::ordered_json;
  const Tracks tracks(results);
  const auto names = tracks.file.read_texts("/history/blocks/name");
  const auto mass = read_sized<double>(tracks.file, "/history/blocks/mass", tracks.blocks),
             volume = read_sized<double>(tracks.file, "/geometry/blocks/volume", tracks.blocks);
  const auto fragment = read_sized<std::int32_t>(tracks.file, "/geometry/blocks/fragment", tracks.blocks);
  const double least = 1e-3 * tracks.box.diagonal().norm();
  json root = {{"type", "FeatureCollection"}};
  if (!tracks.crs.empty()) root["crs"] = {{"type", "name"}, {"properties", {{"name", tracks.crs}}}};
  root["features"] = json::array();
  for (const Track& t : tracks.moving) {
    json line = json::array();
    Vec3 last = Vec3::Constant(missing);
    for (std::size_t r = 0; r < t.at.size(); ++r) {
      if (r > 0 && r + 1 < t.at.size() && (t.at[r] - last).norm() < least) continue;
      last = t.at[r];
      const Vec3 p = last + tracks.origin;
      line.push_back({p.x(), p.y(), p.z()});
    }
    if (line.size() < 2) line.push_back(line.front());  // a LineString has two positions or more
    root["features"].push_back({{"type", "Feature"},
                                {"geometry", {{"type", "LineString"}, {"coordinates", std::move(line)}}},
                                {"properties",
                                 {{"name", names[t.block]},
                                  {"mass", mass[t.block]},
                                  {"volume", volume[t.block]},
                                  {"fragment", fragment[t.block] != 0},
                                  {"max_speed", *std::max_element(t.speed.begin(), t.speed.end())},
                                  {"max_kinetic", *std::max_element(t.kinetic.begin(), t.kinetic.end())},
                                  {"left", t.left},
                                  {"birth", tracks.time[t.first_row]},
                                  {"end", tracks.time[t.first_row + t.at.size() - 1]}}}});
  }
  return root.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
}

geometry::Raster results_map(const std::filesystem::path& results, const std::string& quantity, double cell) {
  const Tracks tracks(results);
  geometry::Raster map = empty_map(tracks, cell, results);
  const auto greatest = [&](const auto& value) {
    for (const Track& t : tracks.moving)
      for (std::size_t r = 0; r < t.at.size(); ++r) {
        const std::size_t next = std::min(r + 1, t.at.size() - 1);
        along(t.at[r], t.at[next], map.transform[1], [&](const Vec3& p, double s) {
          keep_greatest(map.values[cell_of(map, tracks, p)], value(t, r, next, p, s));
        });
      }
  };
  const auto between = [](const std::vector<double>& v, std::size_t r, std::size_t next, double s) {
    return v[r] + s * (v[next] - v[r]);
  };
  if (quantity == "passages")
    for (const Track& t : tracks.moving) add_passages(tracks, t, map);
  else if (quantity == "kinetic")
    greatest([&](const Track& t, std::size_t r, std::size_t next, const Vec3&, double s) {
      return between(t.kinetic, r, next, s);
    });
  else if (quantity == "speed")
    greatest([&](const Track& t, std::size_t r, std::size_t next, const Vec3&, double s) {
      return between(t.speed, r, next, s);
    });
  else if (quantity == "height") {
    if (!tracks.file.exists("/geometry/terrain/vertices"))
      throw bad_file(results, "/maps/height", "there is no terrain to measure heights from",
                     "take another map: passages, kinetic, speed, deposit");
    const Ground ground(tracks.file);
    greatest([&](const Track&, std::size_t, std::size_t, const Vec3& p, double) {
      return p.z() - ground.under(p);
    });
  } else if (quantity == "deposit") {
    const auto volume = read_sized<double>(tracks.file, "/geometry/blocks/volume", tracks.blocks);
    for (const Track& t : tracks.moving) {
      if (t.left) continue;  // it lies beyond the terrain
      double& v = map.values[cell_of(map, tracks, t.at.back())];
      v = (std::isnan(v) ? 0 : v) + volume[t.block];
    }
  } else {
    throw bad_file(results, "/maps/" + quantity, "there is no such map",
                   "take passages, kinetic, speed, height or deposit");
  }
  return map;
}

std::vector<double> heights_over_ground(const Hdf5File& file, std::span<const double> points) {
  std::vector<double> heights;
  if (!file.exists("/geometry/terrain/vertices")) return heights;
  heights.resize(points.size() / 3, missing);
  const Ground ground(file);
  for (std::size_t k = 0; k < heights.size(); ++k)
    if (const Vec3 p(points[3 * k], points[3 * k + 1], points[3 * k + 2]); p.allFinite())
      heights[k] = p.z() - ground.under(p);
  return heights;
}

}  // namespace talus::io
