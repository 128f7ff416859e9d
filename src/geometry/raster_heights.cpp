// Rasters as heights: what they say of themselves, and what their values say.
#include <fmt/format.h>
#include <strings.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

#include "core/error.hpp"
#include "geometry/raster.hpp"
#include "geometry/stated_unit.hpp"

namespace talus::geometry {
namespace {

Problem raster_warning(const std::string& path, std::string value, std::string rule, std::string remedy) {
  return {.severity = Problem::Severity::warning,
          .file = path,
          .key = "site.terrain",
          .value = std::move(value),
          .rule = std::move(rule),
          .remedy = std::move(remedy)};
}

void refuse_pictures(const Raster& r, const std::string& path) {
  if (!r.palette && !r.colours && !r.classes) return;
  throw InputError(
      Problem{.file = path,
              .key = "site.terrain",
              .value = r.palette   ? std::string("a palette")
                       : r.classes ? std::string("a list of names")
                                   : fmt::format("{} bands of colours", r.bands),
              .rule = r.palette   ? "its values are numbers of a table of colours, no heights"
                      : r.classes ? "its values stand for names of classes, no heights"
                                  : "is a picture (red, green, blue), no heights",
              .remedy = "give the elevation model itself, one band of heights, not its hillshade, photograph "
                        "or coloured map"});
}

/// Lengths of a scene are metres, and its origin and positions are given in the coordinates of the map.
void refuse_plan_units(const Raster& r, const std::string& path) {
  if (std::abs(r.metres - 1) < 1e-9) return;
  throw InputError(
      Problem{.file = path,
              .key = "site.terrain",
              .value = fmt::format("{}, of {:.8g} m", r.unit.empty() ? "a unit" : r.unit, r.metres),
              .rule = "is the unit of its coordinates in plan, and lengths of a scene are metres",
              .remedy = "project it to a system in metres, and its heights with it: gdalwarp -t_srs EPSG:... "
                        "-r bilinear in.tif out.tif; then give site.origin and positions in that system"});
}

/// Depths below a datum become heights.
void turn_depths(Raster& r, const std::string& path, std::vector<Problem>& warnings) {
  if (!r.depths) return;
  for (double& z : r.values) z = -z;
  warnings.push_back(
      raster_warning(path, "depths",
                     "its values grow downwards by its coordinate system: they were turned into "
                     "heights, times -1",
                     "give heights, if that is not what they are"));
}

/// Heights to metres by what the band says, or else the coordinate system.
void convert_heights(Raster& r, const std::string& path, std::vector<Problem>& warnings) {
  const std::string by = r.band_unit.empty() ? r.unit_by : "its band";
  const std::string unit = r.band_unit.empty() ? r.vertical_unit : r.band_unit;
  double metres = !r.band_unit.empty()    ? metres_of(r.band_unit)
                  : r.vertical_metres > 0 ? r.vertical_metres
                                          : metres_of(r.vertical_unit);
  if (unit.empty() && !(metres > 0)) {
    const double loose = metres_of(r.loose_unit);
    std::string named = loose > 0 && std::abs(loose - 1) > 1e-9 ? r.loose_unit : "";
    for (const std::string& remark : r.remarks)
      if (named.empty() && names_other_unit(remark)) named = "\"" + remark.substr(0, 100) + "\"";
    if (!named.empty())
      warnings.push_back(raster_warning(
          path, named,
          "names a unit other than metres, and not of what: coordinates and heights are taken in metres",
          "convert what is not in metres, and say so: gdal_edit.py -units m"));
    return;
  }
  if (!(metres > 0)) {
    warnings.push_back(raster_warning(path, unit,
                                      "is the unit of its values by " + by +
                                          ", and no length that is known: they are taken as "
                                          "heights in metres",
                                      "give heights in metres, and say so: gdal_edit.py -units m"));
    return;
  }
  if (!r.band_unit.empty() && r.vertical_metres > 0 && std::abs(metres - r.vertical_metres) > 1e-9)
    warnings.push_back(raster_warning(
        path, unit,
        fmt::format(
            "is the unit of heights by the band, and {} by the coordinate system: the band's is taken",
            r.vertical_unit),
        "correct the one that is wrong"));
  if (std::abs(metres - 1) < 1e-9) return;
  for (double& z : r.values) z *= metres;
  warnings.push_back(raster_warning(
      path, unit,
      fmt::format("is the unit of heights by {}: they were converted to metres, times {:.8g}", by, metres),
      "give the third number of site.origin, and positions, in metres"));
}

}  // namespace

/// Values of which programs make nodes without data.
bool stands_for_none(double stored) {
  constexpr double usual[] = {-9999, -99999, -999999, -999,  -32768, -32767, -9999.9,
                              9999,  99999,  999999,  32767, 65535,  -10000, -1e6};
  return std::any_of(std::begin(usual), std::end(usual),
                     [&](double x) { return std::abs(stored - x) <= 1e-9 * std::abs(x); });
}

std::vector<FarValue> values_far_from_others(const std::vector<double>& values) {
  std::vector<FarValue> found;
  for (const double sign : {1.0, -1.0}) {  // at the lower end, at the upper end
    const double infinity = std::numeric_limits<double>::infinity();
    double end = infinity, next = infinity, other = -infinity;
    std::size_t count = 0;
    for (const double value : values) {
      if (!std::isfinite(value)) continue;
      const double z = sign * value;
      if (z < end)
        next = end, end = z, count = 0;
      else if (z > end)
        next = std::min(next, z);
      if (z == end) ++count;
      other = std::max(other, z);
    }
    const double gap = next - end, range = other - next;
    if (!(gap > range) || !(range > 0)) continue;
    found.push_back({sign * end, count,
                     fmt::format("{} {:.4g} m {} all others, of {:.6g} to {:.6g}",
                                 count == 1 ? "lies" : "lie", gap, sign > 0 ? "below" : "above",
                                 std::min(sign * next, sign * other), std::max(sign * next, sign * other))});
  }
  return found;
}

void tell_of_missing_data(const Raster& r, const std::string& path, std::vector<Problem>& warnings) {
  for (const FarValue& far : values_far_from_others(r.values)) {
    const double stored = (far.value - r.offset) / r.scale;
    const bool usual = stands_for_none(stored);
    constexpr std::size_t least_zeros = 4;  // fewer are spikes
    if (!usual && !(far.value == 0 && far.count >= least_zeros)) continue;
    const std::string value =
                          fmt::format("{} node{} of {:g}", far.count, far.count == 1 ? "" : "s", far.value),
                      rule = far.where +
                             ": such a value stands for nodes without data, and the file does not say so",
                      remedy = fmt::format(
                          "name it: NODATA_value {0:g} in the header of an ASCII grid, "
                          "gdal_edit.py -a_nodata {0:g} for a GeoTIFF; or correct the heights",
                          stored);
    if (usual)
      throw InputError(
          Problem{.file = path, .key = "site.terrain", .value = value, .rule = rule, .remedy = remedy});
    warnings.push_back(raster_warning(path, value, rule, remedy));
  }
}

void warn_of_size(const Raster& r, const std::string& path, std::vector<Problem>& warnings) {
  constexpr double highest = highest_ground,
                   steep = 60 * M_PI / 180;  // half of the cells steeper than that are no terrain
  constexpr std::size_t least_cells = 100;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  std::vector<double> slopes;
  const auto columns = static_cast<std::size_t>(r.columns), rows = static_cast<std::size_t>(r.rows);
  const std::size_t stride = std::max<std::size_t>(1, columns * rows / 1000000);
  for (std::size_t k = 0; k < r.values.size(); ++k) {
    const double z = r.values[k];
    if (!std::isfinite(z)) continue;
    low = std::min(low, z), high = std::max(high, z);
    if (k % stride != 0 || (k + 1) % columns == 0 || k + columns >= r.values.size()) continue;
    const double sx = (r.values[k + 1] - z) / r.transform[1],
                 sy = (r.values[k + columns] - z) / r.transform[5];
    if (std::isfinite(sx) && std::isfinite(sy)) slopes.push_back(std::hypot(sx, sy));
  }
  double steepness = 0;  // of the middle one of the cells, tangent
  if (slopes.size() >= least_cells) {
    const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
    std::nth_element(slopes.begin(), middle, slopes.end());
    steepness = *middle;
  }
  const bool high_up = high > highest, too_steep = steepness > std::tan(steep);
  if (!high_up && !too_steep) return;
  const auto degrees = [](double tangent) { return std::atan(tangent) * 180 / M_PI; };
  std::string remedy = "check both, and correct the unit that the file gives";
  for (const auto& [unit, factor] :
       {std::pair{"feet", 0.3048}, {"centimetres", 0.01}, {"millimetres", 0.001}}) {
    if (high * factor > highest || steepness * factor > std::tan(steep)) continue;
    remedy = fmt::format(
        "in {} they would be {:.6g} to {:.6g} m, half of the cells steeper than {:.0f} deg: convert them, "
        "gdal_calc.py -A in.tif --calc=\"A*{:g}\" --outfile=out.tif, or correct the unit that the file gives",
        unit, low * factor, high * factor, degrees(steepness * factor), factor);
    break;
  }
  warnings.push_back(
      high_up ? raster_warning(path, fmt::format("heights of {:.6g} to {:.6g}", low, high),
                               "no ground on Earth is that high in metres", remedy)
              : raster_warning(
                    path, fmt::format("half of its cells are steeper than {:.0f} deg", degrees(steepness)),
                    "no terrain is that steep all over: heights and cells seem to be in different units",
                    remedy));
}

namespace {

/// The unit that the name of a band ends in, "elevation [ft]"; empty if it is none of length.
std::string unit_in(const std::string& name) {
  const auto open = name.find_last_of("[("), close = name.find_last_of("])");
  if (open == std::string::npos || close == std::string::npos || close < open) return {};
  const std::string unit = name.substr(open + 1, close - open - 1);
  return metres_of(unit) > 0 ? unit : std::string();
}

void warn_of_kind(const Raster& r, const std::string& path, std::vector<Problem>& warnings) {
  std::string name = r.band_name;
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* other : {"slope", "aspect", "hillshade", "shaded relief", "curvature", "roughness"})
    if (name.find(other) != std::string::npos) {
      warnings.push_back(raster_warning(path, r.band_name,
                                        "is what its band is called: its values are hardly heights",
                                        "give the elevation model itself, unless it is one"));
      break;
    }
  if (r.bands > 1)
    warnings.push_back(raster_warning(
        path,
        fmt::format("{} bands{}", r.bands, r.band_names.empty() ? "" : fmt::format(" ({})", r.band_names)),
        "the first is taken as the heights",
        "give a file of one band if it is another: gdal_translate -b 2 in.tif out.tif"));
  if (r.images > 1)
    warnings.push_back(raster_warning(
        path, fmt::format("{} images", r.images),
        "the file holds more than one, and the first is taken as the heights",
        fmt::format("give a file of one image if it is another: gdal_translate GTIFF_DIR:2:{} out.tif",
                    path.substr(path.find_last_of('/') + 1))));
  if (r.scale_z != 1)
    warnings.push_back(raster_warning(
        path, fmt::format("scale of heights of {:g}", r.scale_z),
        "is what the size of its pixels says (ModelPixelScale), and no other program goes by it: the "
        "values are taken as heights in metres",
        fmt::format("if they are to be scaled, say so in the band: gdal_edit.py -scale {:g}", r.scale_z)));
  if (r.bytes)
    warnings.push_back(raster_warning(
        path, "values of 8 bits",
        "heights of whole metres within a range of 255: a hillshade or another picture has such values",
        "give the elevation model itself, unless it is one"));
}

}  // namespace

Raster read_heights(const std::string& path, std::vector<Problem>& warnings) {
  Raster r = read_raster(path);
  refuse_pictures(r, path);
  if (r.band_unit.empty()) r.band_unit = unit_in(r.band_name);
  refuse_plan_units(r, path);
  convert_heights(r, path, warnings);
  turn_depths(r, path, warnings);
  warn_of_kind(r, path, warnings);
  return r;
}

void convert_raster(const std::string& in, const std::string& out, std::vector<Problem>& warnings) {
  Raster r = read_raster(in);
  if (r.band_unit.empty() || metres_of(r.band_unit) > 0) {
    convert_heights(r, in, warnings);
    turn_depths(r, in, warnings);
  } else {
    warnings.push_back(raster_warning(in, r.band_unit,
                                      "is the unit of its values, which " + out + " does not name",
                                      "keep the unit in mind"));
  }
  write_raster(out, r);
}

}  // namespace talus::geometry
