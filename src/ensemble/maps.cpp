#include "ensemble/maps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>

#include "ensemble/statistics.hpp"
#include "ensemble/store.hpp"
#include "geometry/layers.hpp"
#include "geometry/raster.hpp"
#include "io/files.hpp"

namespace talus::ensemble {

namespace fs = std::filesystem;

namespace {

constexpr double most_cells = 1e8;
constexpr std::size_t most_values =
    20000000;  // values of cells held at once: the journals are read as often as that takes
constexpr std::array class_energy{30e3, 300e3};     // [J]
constexpr std::array return_periods{30, 100, 300};  // [years]

using Cell = std::pair<std::int32_t, std::int32_t>;  // north, east

/// What went through a cell, and where its values lie.
struct Visits {
  std::size_t count = 0, first = 0, filled = 0;
};

class Maps {
 public:
  Maps(const Ensemble& ensemble, const fs::path& directory, long members)
      : ensemble_(ensemble), directory_(directory), members_(members) {}

  std::vector<std::string> write() {
    each([&](const Member& m) {
      ++finished_;
      for (const Passage& p : m.passages) ++cells_[{p.j, p.i}].count;
    });
    if (cells_.empty()) return {"no map: no member's path lies over ground"};
    for (const auto& [at, visits] : cells_) {
      south_ = std::min(south_, at.first), north_ = std::max(north_, at.first);
      west_ = std::min(west_, at.second), east_ = std::max(east_, at.second);
    }
    if ((1.0 + north_ - south_) * (1.0 + east_ - west_) > most_cells)
      return {fmt::format(
          "no map: cells of {:g} m make more than {:g} of them; take larger ones (ensemble.map_cell)",
          ensemble_.settings().map_cell, most_cells)};
    for (const char* name : {"reach", "energy_p50", "energy_p95", "height_p95", "intensity"})
      maps_[name] = empty();
    const double yearly = ensemble_.settings().releases_per_year;
    if (yearly > 0)
      for (const int t : return_periods) maps_[fmt::format("intensity_{}", t)] = empty();
    auto at = cells_.begin();
    while (at != cells_.end()) {
      auto end = at;
      std::size_t values = 0;
      for (; end != cells_.end() && (values == 0 || values + end->second.count <= most_values); ++end)
        end->second.first = values, values += end->second.count;
      fill(at, end, values);
      at = end;
    }
    fs::create_directories(directory_ / "maps");
    for (const auto& [name, map] : maps_)
      geometry::write_raster((directory_ / "maps" / (name + ".tif")).string(), map);
    for (const auto& [name, map] : maps_)
      if (name.starts_with("intensity"))
        io::write_file(directory_ / "maps" / (name + ".qml"), style(), false);
    return {};
  }

 private:
  using Place = std::map<Cell, Visits>::iterator;

  template <class Visit>
  void each(Visit visit) {
    std::vector<char> seen(static_cast<std::size_t>(members_), 0);
    each_member(directory_, ensemble_.identity(), [&](Member&& m) {
      if (m.index >= members_ || std::exchange(seen[static_cast<std::size_t>(m.index)], 1) != 0 ||
          !finished(m.status))
        return;
      visit(m);
    });
  }

  geometry::Raster empty() const {
    geometry::Raster map;
    const double cell = ensemble_.settings().map_cell;
    map.columns = east_ - west_ + 1, map.rows = north_ - south_ + 1;
    const double transform[6] = {west_ * cell, cell, 0, (north_ + 1) * cell, 0, -cell};
    std::copy(std::begin(transform), std::end(transform), std::begin(map.transform));
    map.values.assign(static_cast<std::size_t>(map.columns) * static_cast<std::size_t>(map.rows), none);
    map.crs = ensemble_.crs();
    return map;
  }

  /// The cells from `at` to `end`, of `values` values.
  void fill(Place at, Place end, std::size_t values) {
    std::vector<float> energy(values), height(values);
    each([&](const Member& m) {
      for (const Passage& p : m.passages) {
        const auto found = cells_.find({p.j, p.i});
        if (!in(found->first, at, end)) continue;
        Visits& v = found->second;
        const std::size_t k = v.first + v.filled++;
        energy[k] = p.energy, height[k] = p.height;
      }
    });
    std::vector<double> e, h;
    for (auto c = at; c != end; ++c) {
      const auto from = static_cast<std::ptrdiff_t>(c->second.first),
                 to = from + static_cast<std::ptrdiff_t>(c->second.count);
      e.assign(energy.begin() + from, energy.begin() + to),
          h.assign(height.begin() + from, height.begin() + to);
      std::sort(e.begin(), e.end()), std::sort(h.begin(), h.end());
      set("reach", c->first, static_cast<double>(e.size()) / static_cast<double>(finished_));
      set("energy_p50", c->first, percentile(e, 50));
      set("energy_p95", c->first, percentile(e, 95));
      set("height_p95", c->first, percentile(h, 95));
      set_intensity(c->first, e);
    }
  }

  bool in(const Cell& cell, Place at, Place end) const {
    return !(cell < at->first) && (end == cells_.end() || cell < end->first);
  }

  void set(const std::string& name, const Cell& cell, double value) {
    geometry::Raster& map = maps_[name];
    map.values[static_cast<std::size_t>(north_ - cell.first) * static_cast<std::size_t>(map.columns) +
               static_cast<std::size_t>(cell.second - west_)] = value;
  }

  void set_intensity(const Cell& cell, const std::vector<double>& energy) {
    const auto share_from = [&](double least) {
      return static_cast<double>(energy.end() - std::lower_bound(energy.begin(), energy.end(), least)) /
             static_cast<double>(finished_);
    };
    const double yearly = ensemble_.settings().releases_per_year;
    if (!(yearly > 0))
      return set("intensity", cell,
                 energy.back() >= class_energy[1]   ? 3
                 : energy.back() >= class_energy[0] ? 2
                                                    : 1);
    for (const int t : return_periods) {
      const double least = 1.0 / t;
      const int level = yearly * share_from(class_energy[1]) >= least   ? 3
                        : yearly * share_from(class_energy[0]) >= least ? 2
                        : yearly * share_from(0) >= least               ? 1
                                                                        : 0;
      if (level == 0) continue;
      set(fmt::format("intensity_{}", t), cell, level);
      if (t == return_periods.back()) set("intensity", cell, level);
    }
  }

  /// A style that QGIS takes by itself from beside a raster of the same name.
  static std::string style() {
    return "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n<qgis version=\"3.22\" "
           "styleCategories=\"Symbology\">\n <pipe>\n"
           "  <rasterrenderer type=\"paletted\" band=\"1\" opacity=\"0.7\" alphaBand=\"-1\" "
           "nodataColor=\"\">\n   <colorPalette>\n"
           "    <paletteEntry value=\"1\" color=\"#ffe45c\" alpha=\"255\" label=\"weak, below 30 kJ\"/>\n"
           "    <paletteEntry value=\"2\" color=\"#f08a24\" alpha=\"255\" label=\"medium, 30 to 300 kJ\"/>\n"
           "    <paletteEntry value=\"3\" color=\"#c0182b\" alpha=\"255\" label=\"strong, 300 kJ and "
           "more\"/>\n"
           "   </colorPalette>\n  </rasterrenderer>\n </pipe>\n <blendMode>0</blendMode>\n</qgis>\n";
  }

  const Ensemble& ensemble_;
  fs::path directory_;
  long members_ = 0, finished_ = 0;
  std::map<Cell, Visits> cells_;
  std::map<std::string, geometry::Raster> maps_;
  std::int32_t south_ = std::numeric_limits<std::int32_t>::max(), west_ = south_,
               north_ = std::numeric_limits<std::int32_t>::min(), east_ = north_;
};

void write_layers(const Ensemble& ensemble, const fs::path& directory, long members) {
  const Vec3& origin = ensemble.origin();
  geometry::Layer lines{
      .name = "lines", .lines = true, .number_fields = {}, .text_fields = {"name"}, .features = {}};
  for (const PlanLine& line : ensemble.lines()) {
    geometry::Layer::Feature& f = lines.features.emplace_back();
    f.texts = {line.name};
    for (const auto& part : line.parts) {
      auto& points = f.parts.emplace_back();
      for (const Eigen::Vector2d& p : part) {
        const double z = ensemble.height(p.x(), p.y());
        points.push_back({p.x() + origin.x(), p.y() + origin.y(), std::isfinite(z) ? z + origin.z() : 0.0});
      }
    }
  }
  geometry::Layer ends{.name = "end_points",
                       .lines = false,
                       .number_fields = {"member", "block", "runout", "reach_angle", "steps"},
                       .text_fields = {"status"},
                       .features = {}};
  each_member(directory, ensemble.identity(), [&](Member&& m) {
    if (m.index >= members) return;
    for (std::size_t b = 0; b < m.end.size(); ++b) {
      const Vec3 p = m.end[b] + origin;
      ends.features.push_back({.parts = {{{p.x(), p.y(), p.z()}}},
                               .numbers = {static_cast<double>(m.index), static_cast<double>(b), m.runout(b),
                                           m.reach_angle, static_cast<double>(m.steps)},
                               .texts = {status_text(m.status)}});
    }
  });
  std::sort(ends.features.begin(), ends.features.end(), [](const auto& a, const auto& b) {
    return std::pair(a.numbers[0], a.numbers[1]) < std::pair(b.numbers[0], b.numbers[1]);
  });
  geometry::write_geopackage((directory / "ensemble.gpkg").string(), ensemble.crs(), std::array{lines, ends});
}

}  // namespace

std::vector<std::string> write_maps(const Ensemble& ensemble, const fs::path& directory, long members) {
  write_layers(ensemble, directory, members);
  return Maps(ensemble, directory, members).write();
}

}  // namespace talus::ensemble
