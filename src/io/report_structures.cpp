#include "io/report_data.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace talus::io {
namespace {

using json = nlohmann::ordered_json;

constexpr std::size_t structure_budget = 4'000'000;  // bytes, all frames of all structures

/// Reinforcement: segments and places at the first frame, then displacement since and size of the strain.
template <class Path>
json bars(ReportData& d, const std::string& key, const Path& path, const std::vector<std::size_t>& picked,
          const std::vector<double>& time, float displacement_max) {
  const auto segments = d.file.read<std::int32_t>(path(picked[0], "bars"));
  const auto first = d.file.read<float>(path(picked[0], "bar_points"));
  std::vector<Vec3> at(first.rows());
  for (std::size_t i = 0; i < at.size(); ++i)
    at[i] = Vec3(first.values[3 * i], first.values[3 * i + 1], first.values[3 * i + 2]);
  check_indices(segments.values, at.size(), "bars");
  d.blob.add(key + "_segments", std::vector<std::uint32_t>(segments.values.begin(), segments.values.end()),
             {segments.rows(), 2});
  d.pending.push_back({key + "_nodes", std::move(at)});
  // Colours reach to the 95th of a hundred pieces, in the instant where that is greatest: a few pieces at
  // open cracks are stretched a hundred times as far.
  float strain_max = 0, strain_greatest = 0;
  for (const std::size_t k : picked) {
    std::vector<float> sizes;
    for (const float e : d.file.read<float>(path(k, "bar_strain")).values)
      if (std::isfinite(e)) sizes.push_back(std::abs(e));
    if (sizes.empty()) continue;
    const auto at95 =
        sizes.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(sizes.size() - 1) + 0.5);
    std::nth_element(sizes.begin(), at95, sizes.end());
    strain_max = std::max(strain_max, *at95);
    strain_greatest = std::max(strain_greatest, *std::max_element(at95, sizes.end()));
  }
  strain_max = std::min(strain_greatest, std::max(strain_max, 0.01F * strain_greatest));
  // Bars follow the cells, so that their displacement keeps to the cells' own scale, twice over since it
  // counts from the first frame.
  const float unit = 2 * displacement_max / 32767;
  json frames = json::array();
  for (const std::size_t k : picked) {
    const auto points = d.file.read<float>(path(k, "bar_points"));
    if (points.values.size() != first.values.size()) break;
    std::vector<std::int16_t> moved;
    for (std::size_t i = 0; i < points.values.size(); ++i)
      moved.push_back(unit > 0 ? static_cast<std::int16_t>(std::lround(std::clamp(
                                     (points.values[i] - first.values[i]) / unit, -32767.0F, 32767.0F)))
                               : std::int16_t{0});
    std::vector<std::uint16_t> strain;
    for (const float e : d.file.read<float>(path(k, "bar_strain")).values)
      strain.push_back(
          strain_max > 0 && std::isfinite(e)
              ? static_cast<std::uint16_t>(std::lround(65535.0F * std::min(1.0F, std::abs(e) / strain_max)))
              : std::uint16_t{0});
    const std::string data = fmt::format("{}_{}", key, frames.size());
    d.blob.add(data + "_displacement", moved, {moved.size()});
    d.blob.add(data + "_strain", strain, {strain.size()});
    frames.push_back({{"time", time[k]}, {"data", data}});
  }
  return {{"key", key},
          {"unit", unit},
          {"strain_max", strain_max},
          {"strain_greatest", strain_greatest},
          {"frames", frames}};
}

/// One structure: its surface in epochs of one topology, and frames of values on it, all on one scale.
class StructureFrames {
 public:
  StructureFrames(ReportData& d, std::size_t index, const std::string& name, const std::vector<double>& time)
      : d_(d), index_(index), name_(name), time_(time) {}

  json gather(std::size_t budget) {
    const bool with_bars = !time_.empty() && d_.file.exists(path(0, "bar_strain"));
    const std::vector<std::size_t> picked = pick(with_bars ? budget / 2 : budget, skin_bytes());
    const std::vector<std::size_t> of_bars =
        with_bars ? pick(budget / 2, bar_bytes()) : std::vector<std::size_t>{};
    for (const std::size_t k : picked) extend_ranges(k);
    for (const std::size_t k : of_bars) extend_ranges(k);
    for (const std::size_t k : picked)
      if (d_.file.exists(path(k, "hexes"))) add(k);
    json item = {{"name", name_},
                 {"epochs", epochs_},
                 {"frames", frames_},
                 {"displacement_max", displacement_max_},
                 {"stress_max", stress_max_},
                 {"crack_max", crack_max_}};
    if (!of_bars.empty())
      item["bars"] = bars(
          d_, fmt::format("structure_{}_bars", index_),
          [&](std::size_t k, const char* what) { return path(k, what); }, of_bars, time_, displacement_max_);
    return item;
  }

 private:
  struct Values {
    std::vector<std::int16_t> displacement;
    std::vector<std::uint8_t> damage;
    std::vector<std::uint16_t> stress, crack;
    bool operator==(const Values&) const = default;
  };

  std::string path(std::size_t frame, const char* what) const {
    return fmt::format("/fields/{:06}/structures/{}/{}", frame, safe_name(name_), what);
  }

  /// How much a frame takes decides how many there may be; most of them around impacts and while cells are
  /// lost.
  std::vector<std::size_t> pick(std::size_t budget, std::size_t bytes) const {
    if (time_.empty()) return {};
    Windows windows = d_.windows;
    const std::size_t last = time_.size() - 1;
    std::size_t from = 0, to = last;
    while (from < last && cells(from + 1) == cells(0)) ++from;
    while (to > from && cells(to - 1) == cells(last)) --to;
    if (to > from) windows.emplace_back(time_[from], time_[to]);
    return pick_frames(time_, std::clamp<std::size_t>(budget / std::max<std::size_t>(1, bytes), 2, 800),
                       windows);
  }

  std::size_t cells(std::size_t k) const {
    return d_.file.exists(path(k, "hexes")) ? d_.file.dims(path(k, "hexes"))[0] : 0;
  }

  /// Of a frame of the surface, in the mean: what has lost cells takes less.
  std::size_t skin_bytes() const {
    if (time_.empty() || cells(0) == 0) return 0;
    double sum = 0;
    for (std::size_t k = 0; k < time_.size(); ++k) sum += static_cast<double>(cells(k));
    const double whole =
        9.0 * static_cast<double>(skin(d_.file.read<std::int32_t>(path(0, "hexes")).values).quads.size());
    return static_cast<std::size_t>(whole * sum /
                                    (static_cast<double>(time_.size()) * static_cast<double>(cells(0))));
  }

  std::size_t bar_bytes() const {
    return d_.file.dims(path(0, "bar_points"))[0] * 6 + d_.file.dims(path(0, "bars"))[0] * 2;
  }

  void extend_ranges(std::size_t k) {
    const auto extend = [&](const char* what, float& most) {
      if (!d_.file.exists(path(k, what))) return;
      for (const float v : d_.file.read<float>(path(k, what)).values)
        if (std::isfinite(v)) most = std::max(most, std::abs(v));
    };
    extend("stress_von_mises", stress_max_);
    extend("crack_width", crack_max_);
    extend("displacement", displacement_max_);
  }

  void add(std::size_t k) {
    auto hexes = d_.file.read<std::int32_t>(path(k, "hexes")).values;
    const bool fresh = epochs_.empty() || hexes != hexes_;
    if (fresh) new_epoch(k, std::move(hexes));
    Values now = values(k);
    if (fresh || !(now == before_)) {
      const std::string key = fmt::format("structure_{}_frame_{}", index_, ++stored_);
      d_.blob.add(key + "_displacement", now.displacement, {now.displacement.size()});
      d_.blob.add(key + "_damage", now.damage, {now.damage.size()});
      d_.blob.add(key + "_stress", now.stress, {now.stress.size()});
      if (!now.crack.empty()) d_.blob.add(key + "_crack", now.crack, {now.crack.size()});
      before_ = std::move(now);
    }
    frames_.push_back({{"time", time_[k]},
                       {"epoch", epochs_.size() - 1},
                       {"data", fmt::format("structure_{}_frame_{}", index_, stored_)}});
  }

  void new_epoch(std::size_t k, std::vector<std::int32_t> hexes) {
    hexes_ = std::move(hexes);
    check_indices(hexes_, d_.file.dims(path(k, "nodes"))[0], "hexes");
    outer_ = skin(hexes_);
    used_.clear();
    std::map<int, int> local;
    std::vector<std::uint32_t> quads;
    for (const auto& q : outer_.quads)
      for (const int node : q) {
        const auto [at, fresh] = local.try_emplace(node, static_cast<int>(used_.size()));
        if (fresh) used_.push_back(node);
        quads.push_back(static_cast<std::uint32_t>(at->second));
      }
    const auto nodes = d_.file.read<double>(path(k, "nodes"));
    std::vector<Vec3> places;
    for (const int node : used_)
      places.push_back(Eigen::Map<const Vec3>(&nodes.values[3 * static_cast<std::size_t>(node)]));
    for (const Vec3& p : places) d_.region.extend(p);
    const std::string key = fmt::format("structure_{}_epoch_{}", index_, epochs_.size());
    d_.blob.add(key + "_quads", quads, {outer_.quads.size(), 4});
    d_.pending.push_back({key + "_nodes", std::move(places)});
    epochs_.push_back(key);
  }

  Values values(std::size_t k) const {
    Values now;
    if (d_.file.exists(path(k, "displacement"))) {
      const auto moved = d_.file.read<float>(path(k, "displacement"));
      check_indices(used_, moved.rows(), "displacement");
      for (const int node : used_)
        for (std::size_t c = 0; c < 3; ++c) {
          const float v = moved.values[3 * static_cast<std::size_t>(node) + c];
          now.displacement.push_back(
              displacement_max_ > 0 && std::isfinite(v)
                  ? static_cast<std::int16_t>(std::lround(32767.0 * v / displacement_max_))
                  : std::int16_t{0});
        }
    }
    if (d_.file.exists(path(k, "damage_tension"))) now.damage = damage(k);
    now.stress = scaled(k, "stress_von_mises", stress_max_);
    if (crack_max_ > 0) now.crack = scaled(k, "crack_width", crack_max_);
    return now;
  }

  /// The greater of both damages, of the cell behind each quadrilateral.
  std::vector<std::uint8_t> damage(std::size_t k) const {
    const auto tension = d_.file.read<float>(path(k, "damage_tension"));
    const auto compression = d_.file.exists(path(k, "damage_compression"))
                                 ? d_.file.read<float>(path(k, "damage_compression"))
                                 : Array<float>{};
    check_indices(outer_.cell,
                  compression.values.empty() ? tension.values.size()
                                             : std::min(tension.values.size(), compression.values.size()),
                  "damage");
    std::vector<std::uint8_t> out;
    for (const int c : outer_.cell) {
      float v = tension.values[static_cast<std::size_t>(c)];
      if (!compression.values.empty()) v = std::max(v, compression.values[static_cast<std::size_t>(c)]);
      out.push_back(static_cast<std::uint8_t>(std::lround(255 * std::clamp(v, 0.0F, 1.0F))));
    }
    return out;
  }

  std::vector<std::uint16_t> scaled(std::size_t k, const char* what, float top) const {
    std::vector<std::uint16_t> out;
    if (!d_.file.exists(path(k, what))) return out;
    const auto v = d_.file.read<float>(path(k, what));
    check_indices(outer_.cell, v.values.size(), what);
    for (const int c : outer_.cell) {
      const float x = v.values[static_cast<std::size_t>(c)];
      out.push_back(top > 0 && std::isfinite(x)
                        ? static_cast<std::uint16_t>(std::lround(65535.0 * std::clamp(x / top, 0.0F, 1.0F)))
                        : std::uint16_t{0});
    }
    return out;
  }

  ReportData& d_;
  std::size_t index_;
  const std::string& name_;
  const std::vector<double>& time_;
  json epochs_ = json::array(), frames_ = json::array();
  std::vector<std::int32_t> hexes_;
  Skin outer_;
  std::vector<int> used_;  // nodes of the surface
  Values before_;
  int stored_ = -1;
  float stress_max_ = 0, displacement_max_ = 0, crack_max_ = 0;
};

}  // namespace

void add_structures(ReportData& d) {
  const std::vector<std::string> names = d.file.exists("/geometry/structures/name")
                                             ? d.file.read_texts("/geometry/structures/name")
                                             : std::vector<std::string>{};
  const std::vector<double> time =
      d.file.exists("/fields/time") ? d.file.read<double>("/fields/time").values : std::vector<double>{};
  json list = json::array();
  for (std::size_t s = 0; s < names.size(); ++s)
    list.push_back(StructureFrames(d, s, names[s], time).gather(structure_budget / names.size()));
  d.meta["structures"] = list;
}

}  // namespace talus::io
