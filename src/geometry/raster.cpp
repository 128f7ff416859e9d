#include "geometry/raster.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <strings.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <mutex>
#include <optional>
#include <sstream>
#include <vector>

#include "core/error.hpp"
#include "core/module.hpp"
#include "core/text_file.hpp"
#include "geometry/layers.hpp"
#include "geometry/text_cursor.hpp"

namespace talus::geometry {
namespace {

struct Functions {
  ReadRaster read = nullptr;
  WriteRaster write = nullptr;
  SameCrs same = nullptr;
  TellCrs tell = nullptr;
  PlanScale plan_scale = nullptr;
};

const Functions& module(const std::string& for_file) {
  static Functions m;
  static std::mutex lock;
  const std::lock_guard guard(lock);
  if (m.read) return m;
  const std::string remedy =
      "put it beside the program or set TALUS_MODULE_DIR; a mesh (STL, OBJ, PLY, OFF) needs no module";
  try {
    const auto symbol = [&](const char* name) {
      return module_symbol("talus_raster.so", name, "terrain", remedy);
    };
    Functions all;
    all.read = reinterpret_cast<ReadRaster>(symbol("talus_raster_read"));
    all.write = reinterpret_cast<WriteRaster>(symbol("talus_raster_write"));
    all.same = reinterpret_cast<SameCrs>(symbol("talus_raster_same_crs"));
    all.tell = reinterpret_cast<TellCrs>(symbol("talus_raster_tell_crs"));
    all.plan_scale = reinterpret_cast<PlanScale>(symbol("talus_raster_plan_scale"));
    m = all;
  } catch (const InputError& error) {
    Problem p = error.problems().front();
    p.file = for_file;
    p.rule = "rasters need a module: " + p.rule;
    throw InputError(p);
  }
  return m;
}

/// Throws InputError if rows and columns are exchanged in the header of a grid: as many values, other places.
void refuse_exchanged(const char* heights, double columns, double rows, const std::string& path) {
  std::istringstream in(heights);
  double lines = 0;
  for (std::string line; std::getline(in, line);) {
    double values = 0;
    bool blank = true;
    for (const char c : line) {
      const bool space = std::isspace(static_cast<unsigned char>(c)) != 0;
      values += blank && !space ? 1 : 0;
      blank = space;
    }
    if (values == 0) continue;
    if (values != rows) return;
    ++lines;
  }
  if (lines != columns || columns == rows) return;
  throw InputError(Problem{.file = path,
                           .key = "raster",
                           .value = fmt::format("ncols {:.0f}, nrows {:.0f}", columns, rows),
                           .rule = fmt::format("the grid has {:.0f} lines of {:.0f} values", lines, rows),
                           .remedy = "exchange ncols and nrows in its header, if its lines are right"});
}

/// Throws InputError for points in rows, separated by commas, of more numbers than the first row names, or
/// three: of "600001,200059,523,7" the reader takes 523 m.
void refuse_decimal_commas(const std::string& text, const std::string& path) {
  std::istringstream lines(text);
  std::string first, second;
  lines >> first >> second;
  const auto numbers = [](const std::string& row) {
    return row.find_first_not_of("0123456789+-.eE,") == std::string::npos ? std::ranges::count(row, ',') + 1
                                                                          : 0;
  };
  const auto columns = numbers(second), named = numbers(first) > 0 ? 3 : std::ranges::count(first, ',') + 1;
  if (columns <= named || columns < 4) return;
  throw InputError(Problem{
      .file = path,
      .key = "raster",
      .value = second,
      .rule = fmt::format("is a row of {} numbers between commas, and {} are expected: what follows a "
                          "decimal comma would be cut off",
                          columns, named),
      .remedy = "separate the columns by semicolons, or give decimal points; if they are columns, "
                "name all of them in the first row: x,y,z,class"});
}

constexpr const char* grid_of_points =
    "make a grid of its ground points first, as GeoTIFF: QGIS (point cloud conversion, export to raster), "
    "PDAL's writers.gdal, or gdal_grid -a linear for points in rows";

/// Numbers of a row of points; of a row of names nothing. Where semicolons, tabs or blanks separate them, a
/// comma is a decimal one.
std::vector<double> numbers_of(std::string row) {
  const bool commas = row.find_first_of("; \t") == std::string::npos;
  for (char& c : row) c = c == ';' || c == '\t' || (c == ',' && commas) ? ' ' : c == ',' ? '.' : c;
  std::istringstream in(row);
  return {std::istream_iterator<double>(in), {}};
}

/// Throws InputError for points in rows that are not the nodes of a grid: the library takes each for a node
/// of its row, so that rows that are staggered would be moved. Rows without names begin with x and y, those
/// with other names first are not looked at.
void refuse_points_off_grid(const std::string& text, const Raster& r, const std::string& path) {
  constexpr double most = 0.1;  // of a cell: coordinates are rounded, and so is the size of the cells
  std::istringstream lines(text);
  for (std::string row; std::getline(lines, row);) {
    const std::vector<double> p = numbers_of(row);
    if (p.size() < 3) {
      if (const auto c = row.find_first_not_of(" \t\r\""); c != std::string::npos && strchr("xX", row[c]))
        continue;
      return;
    }
    const double column = (p[0] - r.transform[0]) / r.transform[1] - 0.5,
                 line = (p[1] - r.transform[3]) / r.transform[5] - 0.5;
    const double off_x = std::abs(column - std::round(column)), off_y = std::abs(line - std::round(line));
    if (std::max(off_x, off_y) <= most) continue;
    throw InputError(Problem{
        .file = path,
        .key = "raster",
        .value = fmt::format("point x = {:.10g}, y = {:.10g}", p[0], p[1]),
        .rule = fmt::format("lies {:.3g} m beside the nodes of a grid of {:.4g} x {:.4g} m: the points "
                            "are those of no regular grid",
                            std::max(off_x * std::abs(r.transform[1]), off_y * std::abs(r.transform[5])),
                            std::abs(r.transform[1]), std::abs(r.transform[5])),
        .remedy = grid_of_points});
  }
}

/// A key of the header of an ESRI ASCII grid and its value.
struct HeaderEntry {
  std::string key, value;
};

/// The text of an ESRI ASCII grid where the library would not read the file as it is: in another encoding
/// than ASCII, or with the corner given in one direction and the centre in the other. Nothing for all else.
/// Throws InputError for what its reader lets pass: words where heights should be count as zero, values
/// beyond the last are left unread, and what follows a decimal comma is cut off. `is_grid` becomes true for
/// an ESRI ASCII grid.
std::optional<std::string> checked_ascii_grid(const std::string& path, bool& is_grid) {
  std::string bytes;
  {
    std::ifstream in(path, std::ios::binary);
    bytes.resize(24);
    in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<std::size_t>(in.gcount()));
    const std::string head = has_byte_order_mark(bytes) || bytes.find('\0') != std::string::npos
                                 ? as_utf8(bytes.substr(0, bytes.size() / 4 * 4), path)
                                 : bytes;
    const auto first = head.find_first_not_of(" \t\r\n");
    constexpr const char* keys[] = {"ncols", "nrows", "xll", "yll", "cellsize", "dx", "dy", "nodata"};
    const auto opens = [&](const char* key) {
      return first != std::string::npos && strncasecmp(head.c_str() + first, key, std::strlen(key)) == 0;
    };
    if (std::none_of(std::begin(keys), std::end(keys), opens)) {
      const bool is_text = std::all_of(head.begin(), head.end(), [](unsigned char c) {
        return std::isprint(c) != 0 || std::isspace(c) != 0;
      });
      if (!is_text) return {};
      std::string rows(4096, '\0');
      in.seekg(0).read(rows.data(), static_cast<std::streamsize>(rows.size()));
      rows.resize(static_cast<std::size_t>(in.gcount()));
      const bool as_it_is = bytes.starts_with(head);
      if (!as_it_is) rows = as_utf8(read_bytes(path), path);  // the library reads ASCII alone
      refuse_decimal_commas(rows, path);
      return as_it_is ? std::optional<std::string>() : rows;
    }
  }
  is_grid = true;
  bytes = read_bytes(path);
  std::string text = as_utf8(bytes, path);
  bool as_it_is = text == bytes && strncasecmp(text.c_str(), "ncols", 5) == 0;
  TextCursor cursor(text, path);
  if (const auto comma = text.find(','); comma != std::string::npos) {
    cursor.position(text.data() + comma);
    cursor.skip_back_to_blank();
    const char* const start = cursor.position();
    const std::string_view word = cursor.word();
    cursor.position(start);
    if (word.find('.') != std::string_view::npos || std::ranges::count(word, ',') > 1)
      cursor.fail("raster", "has commas between its numbers; this format has blanks there",
                  "replace the commas by blanks: sed 's/,/ /g'");
    cursor.fail("raster",
                "has a decimal comma; this format has decimal points, a reader would cut the number there",
                "replace the commas by points: sed 's/,/./g'");
  }
  std::vector<HeaderEntry> header;
  const auto is_letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  const auto value_of = [&](const std::string& key) -> std::optional<double> {
    for (const HeaderEntry& e : header)
      if (e.key == key) return std::strtod(e.value.c_str(), nullptr);
    return {};
  };
  const auto take = [&](const std::string& key, const std::string& value) {
    for (const HeaderEntry& e : header)
      if (e.key == key && e.value != value)
        throw InputError(Problem{.file = path,
                                 .key = "raster",
                                 .value = fmt::format("{0} {1} and {0} {2}", key, e.value, value),
                                 .rule = "the header gives both",
                                 .remedy = "keep the one that is right"});
    header.push_back({key, value});
  };
  while (!cursor.at_end() && is_letter(*cursor.position()) && strncasecmp(cursor.position(), "nan", 3) != 0) {
    const char* const at = cursor.position();
    std::string key(cursor.word());
    std::transform(key.begin(), key.end(), key.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (key == "nodata_value" || key == "nodata") {
      take("nodata_value", std::string(cursor.word()));
      as_it_is = as_it_is && key == "nodata_value";
      continue;
    }
    constexpr const char* keys[] = {"ncols",     "nrows",    "xllcorner", "yllcorner", "xllcenter",
                                    "yllcenter", "cellsize", "dx",        "dy"};
    if (std::ranges::find(keys, key) == std::end(keys)) {
      cursor.position(at);
      cursor.fail("raster", fmt::format("is no key of this format: {}, nodata_value", fmt::join(keys, ", ")),
                  "write each key and its number, without a unit, apart by a blank");
    }
    cursor.skip_space();
    const char* start = cursor.position();
    const double value = cursor.number<double>("raster");
    if (!std::isfinite(value) ||
        ((key == "ncols" || key == "nrows" || key == "cellsize" || key == "dx" || key == "dy") &&
         !(value > 0)))
      throw InputError(Problem{.file = path,
                               .key = "raster " + key,
                               .value = std::to_string(value),
                               .rule = "must be a positive number",
                               .remedy = "correct the header of the grid"});
    take(key, std::string(start, cursor.position()));
  }
  const char* heights = cursor.position();
  const double columns = value_of("ncols").value_or(0), rows = value_of("nrows").value_or(0);
  double count = 0;
  for (; !cursor.at_end(); ++count) cursor.number<double>("raster height");
  if (count != columns * rows)
    throw InputError(
        Problem{.file = path,
                .key = "raster",
                .value = fmt::format("{:.0f} values", count),
                .rule = fmt::format("has {:.0f} columns and {:.0f} rows by its header: {:.0f} values",
                                    columns, rows, columns * rows),
                .remedy = "export the grid again: it is cut short, or its header is that of another grid"});
  refuse_exchanged(heights, columns, rows, path);
  const auto dx = value_of("cellsize") ? value_of("cellsize") : value_of("dx"),
             dy = value_of("cellsize") ? value_of("cellsize") : value_of("dy");
  const auto corner_x = value_of("xllcorner"), corner_y = value_of("yllcorner"),
             centre_x = value_of("xllcenter"), centre_y = value_of("yllcenter");
  if (!dx || !dy || (!corner_x && !centre_x) || (!corner_y && !centre_y)) {
    const std::string lacks = !dx || !dy               ? "cellsize"
                              : !corner_x && !centre_x ? "xllcorner or xllcenter"
                                                       : "yllcorner or yllcenter";
    throw InputError(
        Problem{.file = path,
                .key = "raster",
                .value = lacks,
                .rule = "is missing in the header of the grid",
                .remedy = "complete the header: ncols, nrows, xllcorner, yllcorner, cellsize, NODATA_value"});
  }
  const bool two_sizes = value_of("cellsize") && (value_of("dx") || value_of("dy"));
  if ((corner_x && centre_x) || (corner_y && centre_y) || two_sizes)
    throw InputError(Problem{.file = path,
                             .key = "raster",
                             .value = two_sizes              ? "cellsize and dx, dy"
                                      : corner_x && centre_x ? "xllcorner and xllcenter"
                                                             : "yllcorner and yllcenter",
                             .rule = "the header gives both",
                             .remedy = "keep the one that is right"});
  const bool hole_first = is_letter(*heights);  // "nan", which the library takes for a key of the header
  if (as_it_is && !hole_first && corner_x.has_value() == corner_y.has_value()) return {};
  std::string out =
      fmt::format("ncols {:.0f}\nnrows {:.0f}\nxllcorner {:.17g}\nyllcorner {:.17g}\n", columns, rows,
                  corner_x ? *corner_x : *centre_x - 0.5 * *dx, corner_y ? *corner_y : *centre_y - 0.5 * *dy);
  out +=
      *dx == *dy ? fmt::format("cellsize {:.17g}\n", *dx) : fmt::format("dx {:.17g}\ndy {:.17g}\n", *dx, *dy);
  for (const HeaderEntry& e : header)
    if (e.key == "nodata_value") out += "NODATA_value " + e.value + "\n";
  if (hole_first) out += "-1.#QNAN", heights += std::strlen("nan");
  return out.append(heights, static_cast<const char*>(text.data() + text.size()));
}

/// What the .prj beside a file holds, as UTF-8; empty where there is none.
std::string projection_beside(const std::string& path) {
  const auto dot = path.find_last_of('.');
  if (dot == std::string::npos || path.find('/', dot) != std::string::npos) return {};
  for (const char* end : {".prj", ".PRJ"})
    if (const std::string prj = path.substr(0, dot) + end; access(prj.c_str(), R_OK) == 0)
      return read_text(prj);
  return {};
}

/// The unit of heights by a projection of Arc/Info, "Zunits FEET", of which the library takes no notice.
std::string heights_by(const std::string& projection) {
  std::istringstream words(projection);
  for (std::string key, value; words >> key;)
    if (strcasecmp(key.c_str(), "zunits") == 0 && words >> value)
      return strcasecmp(value.c_str(), "no") == 0 ? std::string() : value;
  return {};
}

/// Heights are in metres: over longitude and latitude every slope would be a hundred thousand times too
/// steep. Without a CRS a grid is taken for one in degrees where its coordinates are such, its cells are
/// below a centimetre, and it is higher than wide.
void refuse_degrees(const Raster& r, const std::string& path) {
  constexpr double most_cell = 0.01;
  const double dx = r.transform[1], dy = std::abs(r.transform[5]), west = r.transform[0],
               north = std::max(r.transform[3], r.transform[3] + r.rows * r.transform[5]);
  bool degrees = r.geographic;
  if (!degrees && r.crs.empty() && dx < most_cell && dy < most_cell && std::abs(west) <= 180 &&
      std::abs(west + r.columns * dx) <= 360 && std::abs(north) <= 90 &&
      std::abs(north - r.rows * dy) <= 90) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double z : r.values)
      if (std::isfinite(z)) low = std::min(low, z), high = std::max(high, z);
    degrees = high - low > std::max(r.columns * dx, r.rows * dy);
  }
  if (!degrees) return;
  throw InputError(Problem{
      .file = path,
      .key = "raster",
      .value = fmt::format("cells of {:g} x {:g}, from [{:g}, {:g}]", dx, dy, west, north),
      .rule = r.geographic
                  ? fmt::format("is in degrees of longitude and latitude ({}), and heights are in metres",
                                r.crs.size() < 40 ? r.crs : "by its coordinate system")
                  : std::string("looks like degrees of longitude and latitude, and heights are in metres"),
      .remedy = "project it to metres first: gdalwarp -s_srs EPSG:4326 -t_srs EPSG:... -r bilinear in.tif "
                "out.tif, with the national grid or the UTM zone (EPSG:25832, 25833, ...)"});
}

}  // namespace

Raster read_raster(const std::string& path) {
  if (access(path.c_str(), R_OK) != 0)
    throw InputError(
        Problem{.file = path, .key = "file", .rule = "cannot be read", .remedy = "check the path"});
  if (std::error_code error; std::filesystem::file_size(path, error) == 0 && !error)
    throw InputError(Problem{.file = path,
                             .key = "raster",
                             .rule = "is empty: a file of no bytes",
                             .remedy = "export it again, as an ESRI ASCII grid or a GeoTIFF"});
  Raster r;
  bool is_grid = false;
  const std::optional<std::string> text = checked_ascii_grid(path, is_grid);
  r.projection = projection_beside(path);
  r.grid_of_text = is_grid;
  const bool read = module(path).read(path.c_str(), text ? &*text : nullptr, &r);
  if (!r.placed)
    throw InputError(
        Problem{.file = path,
                .key = "raster",
                .value = fmt::format("{} x {} values", r.columns, r.rows),
                .rule = "is a picture without a place: it says neither where it lies nor how large its cells "
                        "are (no GeoTIFF tags, no world file .tfw beside it)",
                .remedy = "export it again with its georeference, or give it one: gdal_translate -a_srs "
                          "EPSG:... -a_ullr WEST NORTH EAST SOUTH in.tif out.tif"});
  if (!read) {
    const bool cloud = begins_with(path, "LASF");
    const bool points = cloud || r.error.find("Ungridded") != std::string::npos;
    throw InputError(
        Problem{.file = path,
                .key = "raster",
                .rule = cloud ? "is a cloud of points (LAS, LAZ), no grid" : r.error,
                .remedy = points ? grid_of_points
                                 : "give an ESRI ASCII grid or a GeoTIFF: gdal_translate in out.tif"});
  }
  if (r.transform[2] != 0 || r.transform[4] != 0)
    throw InputError(Problem{.file = path,
                             .key = "raster",
                             .rule = "is rotated against north",
                             .remedy = "warp it to a north-up grid first (gdalwarp)"});
  if (r.transform[1] <= 0 || r.transform[5] == 0)
    throw InputError(Problem{.file = path,
                             .key = "raster",
                             .rule = "has no positive cell size",
                             .remedy = "correct its georeference"});
  if (r.scale == 0 || !std::isfinite(r.scale) || !std::isfinite(r.offset))
    throw InputError(
        Problem{.file = path,
                .key = "raster",
                .value = fmt::format("scale {:g}, offset {:g}", r.scale, r.offset),
                .rule = "is what its band says that values are to be multiplied by, and added to "
                        "them: no height is left",
                .remedy = "correct it: gdal_edit.py -scale 1 -offset 0, or what they are meant to be"});
  if (is_grid && r.vertical_unit.empty()) r.vertical_unit = heights_by(r.projection);
  refuse_degrees(r, path);
  if (r.points) refuse_points_off_grid(text ? *text : read_text(path), r, path);
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
    throw InputError(Problem{.file = path,
                             .key = "raster",
                             .rule = copy.error,
                             .remedy = "check the directory and the ending (.tif or .asc)"});
}

std::string check_crs(const std::string& crs, const std::string& file, const std::string& key) {
  if (crs.empty()) return {};
  constexpr const char* example =
      "give a projected one in metres, a national grid or a UTM zone: \"EPSG:31254\", or its WKT";
  const auto refuse = [&](const std::string& rule, const std::string& remedy) {
    throw InputError(
        Problem{.file = file, .key = key, .value = crs.substr(0, 80), .rule = rule, .remedy = remedy});
  };
  Raster r;
  if (!module(file).tell(crs.c_str(), &r)) refuse("is no coordinate system that is known", example);
  if (r.geographic)
    refuse("is in degrees of longitude and latitude, and lengths of a scene are metres", example);
  if (!r.in_plan) refuse("is no system of coordinates in plan", example);
  if (std::abs(r.metres - 1) > 1e-9)
    refuse(fmt::format("is in {} of {:.8g} m, and lengths of a scene are metres",
                       r.unit.empty() ? "a unit" : r.unit, r.metres),
           example);
  return r.crs;
}

void check_lengths(const std::string& crs, const Eigen::Vector2d& place, const std::string& file,
                   const std::string& key) {
  constexpr double most = 0.02;
  double along_x = 1, along_y = 1;
  if (crs.empty() || !module(file).plan_scale(crs.c_str(), place.x(), place.y(), &along_x, &along_y) ||
      std::max(std::abs(along_x - 1), std::abs(along_y - 1)) <= most)
    return;
  throw InputError(Problem{
      .file = file,
      .key = key,
      .value = crs.substr(0, 80),
      .rule = fmt::format("lengths of this map at the terrain, [{:.10g}, {:.10g}], are {:.4g} (along x) "
                          "and {:.4g} (along y) times those on the ground",
                          place.x(), place.y(), along_x, along_y),
      .remedy = "project it to the national grid or the UTM zone there: gdalwarp -t_srs EPSG:... -r "
                "bilinear in.tif out.tif; then give site.origin and positions in that system"});
}

int same_crs(const std::string& a, const std::string& b) { return module("").same(a.c_str(), b.c_str()); }

}  // namespace talus::geometry
