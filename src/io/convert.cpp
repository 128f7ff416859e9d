#include "io/convert.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iterator>

#include "core/csv.hpp"
#include "io/files.hpp"
#include "io/gis_files.hpp"
#include "io/hdf5_file.hpp"

namespace talus::io {
namespace {

struct Columns {
  std::vector<std::string> names;
  std::vector<double> values;  // row-major
  std::size_t rows = 0;
  std::vector<std::string> texts;  // in place of values: words, and numbers of more digits than a double has
};

/// Names of the last axis by its length: vectors, quaternions, strains.
std::vector<std::string> components(const std::string& dataset, std::size_t n) {
  if (n == 3) return {"x", "y", "z"};
  if (n == 4 && dataset == "orientation") return {"w", "x", "y", "z"};
  if (n == 6 && dataset == "strain") return {"ex", "ey", "ez", "g_yz", "g_zx", "g_xy"};
  std::vector<std::string> names;
  for (std::size_t i = 0; i < n; ++i) names.push_back(std::to_string(i));
  return names;
}

/// Names of what one item holds: by its components, and by number along an axis before them, such as stations
/// of a member.
std::vector<std::string> parts(const std::string& dataset, const Dims& dims, std::size_t axis) {
  if (axis + 1 == dims.size()) return components(dataset, dims[axis]);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < dims[axis]; ++i)
    for (const std::string& part : parts(dataset, dims, axis + 1))
      names.push_back(fmt::format("{}.{}", i, part));
  return names;
}

std::string last_part(const std::string& path) { return path.substr(path.rfind('/') + 1); }

/// Names of the middle axis: blocks, probes.
std::vector<std::string> items(const Hdf5File& file, const std::string& group, const std::string& dataset,
                               std::size_t n) {
  const std::string names = dataset == "probe_displacement" ? group + "/probe_name" : group + "/name";
  if (file.exists(names) && file.is_text(names)) {
    std::vector<std::string> texts = file.read_texts(names);
    if (texts.size() == n) return texts;
  }
  std::vector<std::string> numbers;
  for (std::size_t i = 0; i < n; ++i) numbers.push_back(std::to_string(i));
  return numbers;
}

/// Words, and whole numbers of any size, one a row.
void add_texts(const Hdf5File& file, const std::string& path, const std::string& name, std::size_t rows,
               std::vector<Columns>& all) {
  Columns c;
  c.rows = rows;
  c.names = {name};
  if (file.is_text(path)) {
    for (const std::string& text : file.read_texts(path)) c.texts.push_back(csv_field(text));
  } else {
    for (const std::int64_t value : file.read<std::int64_t>(path).values)
      c.texts.push_back(std::to_string(value));
  }
  if (c.texts.size() == rows) all.push_back(std::move(c));
}

void add(const Hdf5File& file, const std::string& path, std::size_t rows, std::vector<Columns>& all) {
  const std::string dataset = last_part(path), group = path.substr(0, path.rfind('/'));
  const Array<double> a = file.read<double>(path);
  if (a.rows() != rows) return;  // lists beside the histories: names, masses
  Columns c;
  c.rows = rows;
  c.values = a.values;
  const std::string unit = file.text_attribute(path, "unit");
  const std::string suffix = unit.empty() || unit == "1" ? "" : " [" + unit + "]";
  const bool per_block = group == "/history/blocks" || dataset == "probe_displacement";
  if (a.dims.size() == 1)
    c.names = {dataset + suffix};
  else if (a.dims.size() == 2 && !per_block)
    for (const std::string& x : components(dataset, a.dims[1])) c.names.push_back(dataset + "." + x + suffix);
  else if (a.dims.size() == 2)
    for (const std::string& item : items(file, group, dataset, a.dims[1]))
      c.names.push_back(item + "." + dataset + suffix);
  else
    for (const std::string& item : items(file, group, dataset, a.dims[1]))
      for (const std::string& x : parts(dataset, a.dims, 2))
        c.names.push_back(item + "." + dataset + "." + x + suffix);
  all.push_back(std::move(c));
}

/// Of each centroid over the terrain: in a file of heights above the sea one does not see how high a block
/// flies.
void add_heights(const Hdf5File& file, std::size_t rows, std::vector<Columns>& all) {
  const Array<double> position = file.read<double>("/history/blocks/position");
  Columns c;
  c.rows = rows;
  c.values = heights_over_ground(file, position.values);
  if (c.values.empty() || position.rows() != rows) return;
  for (const std::string& name : items(file, "/history/blocks", "position", position.dims[1]))
    c.names.push_back(name + ".height_over_ground [m]");
  all.push_back(std::move(c));
}

}  // namespace

std::string csv_text(const std::string& results, const std::string& path) {
  const Hdf5File file = Hdf5File::open(results);
  if (!file.exists(path)) {
    std::string known;
    for (const char* g : {"/history", "/history/structures", "/lines", "/hits"})
      if (file.is_group(g))
        for (const std::string& name : file.list(g)) known += fmt::format(" {}/{}", g, name);
    for (const char* g : {"/ledger", "/members"})
      if (file.is_group(g)) known += fmt::format(" {}", g);
    throw bad_file(results, path, "there is no such history", "name one of" + known);
  }
  std::vector<Columns> all;
  const bool history = path.starts_with("/history/blocks") || path.starts_with("/history/structures") ||
                       path.starts_with("/ledger");
  std::size_t rows = 0;
  if (history && file.exists("/history/time")) {
    rows = file.dims("/history/time")[0];
    add(file, "/history/time", rows, all);
  }
  if (path == "/history" || path == "/history/structures" ||
      path == "/history/contacts") {  // groups of groups
    std::string below;
    for (const std::string& name : file.list(path))
      below += fmt::format("{}{}/{}", below.empty() ? "" : " ", path, name);
    throw bad_file(results, path, "holds several histories", "name one of " + below);
  }
  const auto length = [&](const std::string& at) { return file.dims(at).empty() ? 0 : file.dims(at)[0]; };
  // Of histories numbers alone: names and masses are lists beside them. All else is a table with words in it.
  const auto add_one = [&](const std::string& at, const std::string& name) {
    const bool words = file.is_text(at) || (file.is_integer(at) && file.dims(at).size() == 1);
    if (history && (file.is_text(at) || (path == "/history/blocks" && file.dims(at).size() == 1))) return;
    if (!words) return add(file, at, rows, all);
    const std::string unit = file.text_attribute(at, "unit");
    add_texts(file, at, unit.empty() || unit == "1" ? name : name + " [" + unit + "]", rows, all);
  };
  const std::function<void(const std::string&)> add_group = [&](const std::string& group) {
    std::vector<std::string> names = file.list(group);
    std::stable_partition(names.begin(), names.end(), [](const std::string& n) { return n == "time"; });
    for (const std::string& name : names) {
      const std::string child = group + "/" + name;
      if (file.is_group(child)) {
        if (!history) add_group(child);
        continue;
      }
      if (rows == 0) rows = length(child);
      add_one(child, name);
    }
  };
  if (file.is_group(path)) {
    add_group(path);
  } else {
    if (!history) rows = length(path);
    add_one(path, last_part(path));
  }
  if (path == "/history/blocks" && rows > 0) add_heights(file, rows, all);
  if (all.empty())
    throw bad_file(results, path, "holds no numbers by row",
                   "name a group or dataset with as many values as rows");

  fmt::memory_buffer text;
  const char* separator = "";
  for (const Columns& c : all)
    for (const std::string& name : c.names) {
      fmt::format_to(std::back_inserter(text), "{}{}", separator, csv_field(name));
      separator = ",";
    }
  text.push_back('\n');
  for (std::size_t r = 0; r < rows; ++r) {
    separator = "";
    for (const Columns& c : all) {
      const std::size_t w = c.names.size();
      for (std::size_t k = 0; k < w; ++k) {
        const double v = c.texts.empty() ? c.values[r * w + k] : 0;
        // Before birth there is no value: an empty field is what spreadsheets understand.
        if (!c.texts.empty())
          fmt::format_to(std::back_inserter(text), "{}{}", separator, c.texts[r]);
        else if (std::isnan(v))
          fmt::format_to(std::back_inserter(text), "{}", separator);
        else
          fmt::format_to(std::back_inserter(text), "{}{}", separator, v);
        separator = ",";
      }
    }
    text.push_back('\n');
  }
  return fmt::to_string(text);
}

FileAndPart file_and_part(const std::string& in) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(in, ignored)) return {in, {}};
  for (std::size_t hash = in.rfind('#'); hash != std::string::npos && hash > 0;
       hash = in.rfind('#', hash - 1))
    if (std::filesystem::is_regular_file(in.substr(0, hash), ignored))
      return {in.substr(0, hash), in.substr(hash + 1)};
  std::size_t hash = in.rfind("#/");  // no such file
  if (hash == std::string::npos) hash = in.find('#', in.rfind('/') + 1);
  if (hash == std::string::npos) return {in, {}};
  return {in.substr(0, hash), in.substr(hash + 1)};
}

void convert(const std::string& in, const std::string& out) {
  const auto [file, part] = file_and_part(in);
  const std::string path = part.value_or("/history/blocks");
  const std::string from = std::filesystem::path(file).extension().string(),
                    to = std::filesystem::path(out).extension().string();
  if (std::error_code ignored; !std::filesystem::exists(file, ignored))
    throw bad_file(file, {}, "there is no such file", "name the file that is to be converted");
  if (from != ".h5" && from != ".hdf5")
    throw bad_file(in, {}, "cannot be converted into that",
                   "convert results.h5#/path to .csv, results.h5#/history/blocks to .geojson, "
                   "results.h5#/maps/kinetic to a grid, a mesh to a mesh, a volume mesh (.msh, .inp) to the "
                   "other or to its surface, a grid (.asc, .tif) to a grid or a mesh");
  if (to != ".csv")
    throw bad_file(out, {}, fmt::format("results cannot be written as \"{}\"", to),
                   "name a .csv file; paths of blocks go to .geojson, maps (results.h5#/maps/kinetic) to "
                   ".tif or .asc, shapes (results.h5#/geometry/blocks) to a mesh");
  if (path.empty() || path[0] != '/')
    throw bad_file(in, path, "a path within the file begins with /", "write results.h5#/history/blocks");
  const std::string text =
      csv_text(file, path.size() > 1 && path.back() == '/' ? path.substr(0, path.size() - 1) : path);
  write_file(out, text);
}

}  // namespace talus::io
