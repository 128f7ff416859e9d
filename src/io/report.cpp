#include "io/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "io/files.hpp"
#include "io/recorder.hpp"
#include "io/report_parts.hpp"

// The page as one HTML file, put into the program by the assembler.
extern "C" {
extern const char talus_report_page[];
extern const char talus_report_page_end[];
}
__asm__(
    ".section .rodata\n"
    ".global talus_report_page\n"
    "talus_report_page:\n"
    ".incbin \"" TALUS_REPORT_PAGE "\"\n"
    ".global talus_report_page_end\n"
    "talus_report_page_end:\n"
    ".byte 0\n"
    ".previous\n");

namespace fs = std::filesystem;

namespace talus::io {
namespace {

using json = nlohmann::ordered_json;  // the order of the summary is the order of the page

constexpr std::size_t pose_budget = 6'000'000;        // bytes, before base64
constexpr std::size_t structure_budget = 4'000'000;   // bytes, all frames of all structures
constexpr std::size_t triangle_budget = 150'000;      // terrain
constexpr double filter_cutoff = 300;                 // Hz: channel class 180 of SAE J211

std::vector<Vec3> points(const Array<double>& a) {
  std::vector<Vec3> v(a.rows());
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = Vec3(a.values[3 * i], a.values[3 * i + 1], a.values[3 * i + 2]);
  return v;
}

/// Every stride-th number, from the given one on.
std::vector<double> column(const Array<double>& a, std::size_t stride, std::size_t first) {
  std::vector<double> v(a.rows());
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = a.values[i * stride + first];
  return v;
}

/// results.h5 may come from anywhere: what is used as an index is checked first.
template <class T>
void check_indices(const std::vector<T>& values, std::size_t limit, const char* what) {
  for (const T v : values)
    if (v < 0 || static_cast<std::size_t>(v) >= limit) throw bad_file("results.h5", what, fmt::format("index {} of {}", v, limit), "use results that Talus wrote");
}

class Report {
 public:
  explicit Report(const fs::path& directory)
      : file_(Hdf5File::open(directory / "results.h5")), summary_(json::parse(read_file(directory / "summary.json"))) {}

  std::string page() {
    time_ = file_.read<double>("/history/time").values;
    names_ = file_.read_texts("/history/blocks/name");
    meta_["summary"] = summary_;
    for (const auto& m : summary_.value("impacts", json::array())) {
      const double a = m.value("start", 0.0), b = m.value("end", 0.0);
      windows_.emplace_back(a - 0.1, b + 0.4);
    }
    poses();
    structures();
    site();
    shapes();
    ledger();
    structure_histories();
    impacts();
    json arrays = blob_.index();
    meta_["arrays"] = std::move(arrays);
    const std::string data = base64(blob_.bytes());
    return fill({talus_report_page, static_cast<std::size_t>(talus_report_page_end - talus_report_page)}, data);
  }

 private:
  std::string fill(std::string_view page, const std::string& data) const {
    // "<" cannot end the script element that holds the JSON.
    std::string text;
    for (const char c : meta_.dump(-1, ' ', false, json::error_handler_t::replace)) c == '<' ? text += "\\u003c" : text += c;
    std::string title;
    for (const char c : summary_.value("title", std::string("Results"))) {
      if (c == '<') title += "&lt;";
      else if (c == '&') title += "&amp;";
      else title += c;
    }
    std::string out;
    out.reserve(page.size() + data.size() + text.size());
    const std::map<std::string_view, const std::string*> slots = {{"%%TALUS_TITLE%%", &title}, {"%%TALUS_META%%", &text}, {"%%TALUS_DATA%%", &data}};
    std::size_t at = 0;
    while (at < page.size()) {
      const std::size_t mark = page.find("%%TALUS_", at);
      out += page.substr(at, mark - at);
      if (mark == std::string_view::npos) break;
      const std::size_t end = page.find("%%", mark + 2);
      const auto slot = slots.find(page.substr(mark, end == std::string_view::npos ? 0 : end + 2 - mark));
      if (slot == slots.end()) {
        out += page.substr(mark, 2);
        at = mark + 2;
      } else {
        out += *slot->second;
        at = end + 2;
      }
    }
    return out;
  }

  void poses() {
    const std::size_t nb = names_.size(), nt = time_.size();
    const std::size_t each = 12 + 8 + 4 + 4;
    const std::size_t budget = std::clamp<std::size_t>(pose_budget / std::max<std::size_t>(1, each * nb), 2, 3000);
    const std::vector<std::size_t> frames = nt == 0 ? std::vector<std::size_t>{} : pick_frames(time_, budget, windows_);
    std::vector<double> time;
    std::vector<float> speed, kinetic;
    std::vector<double> position;
    std::vector<std::int16_t> orientation;
    for (const std::size_t k : frames) {
      time.push_back(time_[k]);
      if (nb == 0) continue;
      const auto x = file_.read_rows<double>("/history/blocks/position", k, 1), q = file_.read_rows<double>("/history/blocks/orientation", k, 1);
      const auto v = file_.read_rows<double>("/history/blocks/velocity", k, 1);
      const auto e1 = file_.read_rows<double>("/history/blocks/kinetic_translational", k, 1), e2 = file_.read_rows<double>("/history/blocks/kinetic_rotational", k, 1);
      position.insert(position.end(), x.values.begin(), x.values.end());
      for (const double c : q.values) orientation.push_back(std::isfinite(c) ? static_cast<std::int16_t>(std::lround(32767 * std::clamp(c, -1.0, 1.0))) : std::int16_t{0});
      for (std::size_t b = 0; b < nb; ++b) {
        speed.push_back(static_cast<float>(std::hypot(v.values[3 * b], v.values[3 * b + 1], v.values[3 * b + 2])));
        kinetic.push_back(static_cast<float>(e1.values[b] + e2.values[b]));
      }
    }
    for (std::size_t i = 0; i + 2 < position.size(); i += 3)
      if (std::isfinite(position[i])) region_.extend(Vec3(position[i], position[i + 1], position[i + 2]));
    block_positions_ = std::move(position);
    blob_.add("frame_time", time, {time.size()});
    blob_.add("frame_orientation", orientation, {time.size(), nb, 4});
    blob_.add("frame_speed", speed, {time.size(), nb});
    blob_.add("frame_kinetic", kinetic, {time.size(), nb});
    frames_ = time.size();
  }

  void structures() {
    json list = json::array();
    const std::vector<std::string> names = file_.exists("/geometry/structures/name") ? file_.read_texts("/geometry/structures/name") : std::vector<std::string>{};
    const std::vector<double> time = file_.exists("/fields/time") ? file_.read<double>("/fields/time").values : std::vector<double>{};
    for (std::size_t s = 0; s < names.size(); ++s) {
      json item = {{"name", names[s]}};
      json epochs = json::array(), frames = json::array();
      std::vector<std::int32_t> hexes;
      Skin outer;
      std::vector<int> used;  // nodes of the skin
      const std::string group = "/structures/" + safe_name(names[s]);
      const auto path = [&](std::size_t k, const char* name) { return fmt::format("/fields/{:06}{}/{}", k, group, name); };
      // How much a frame takes decides how many there may be.
      std::size_t bytes = 1;
      if (!time.empty() && file_.exists(path(0, "hexes"))) {
        const auto h = file_.read<std::int32_t>(path(0, "hexes"));
        const Skin k = skin(h.values);
        bytes = k.quads.size() * 6 + k.quads.size() * 3;
        if (file_.exists(path(0, "bar_points"))) bytes += file_.dims(path(0, "bar_points"))[0] * 6 + file_.dims(path(0, "bars"))[0] * 2;
      }
      const std::size_t budget = std::clamp<std::size_t>(structure_budget / names.size() / std::max<std::size_t>(1, bytes), 2, 800);
      float stress_max = 0, displacement_max = 0, crack_max = 0;
      struct Kept {
        std::vector<std::int16_t> displacement;
        std::vector<std::uint8_t> damage;
        std::vector<std::uint16_t> stress, crack;
        bool operator==(const Kept&) const = default;
      } before;
      const std::vector<std::size_t> picked = time.empty() ? std::vector<std::size_t>{} : pick_frames(time, budget, windows_);
      // Ranges first: all frames share one scale.
      for (const std::size_t k : picked) {
        if (file_.exists(path(k, "stress_von_mises")))
          for (const float v : file_.read<float>(path(k, "stress_von_mises")).values)
            if (std::isfinite(v)) stress_max = std::max(stress_max, v);
        if (file_.exists(path(k, "crack_width")))
          for (const float v : file_.read<float>(path(k, "crack_width")).values)
            if (std::isfinite(v)) crack_max = std::max(crack_max, v);
        if (file_.exists(path(k, "displacement")))
          for (const float v : file_.read<float>(path(k, "displacement")).values)
            if (std::isfinite(v)) displacement_max = std::max(displacement_max, std::abs(v));
      }
      int stored = -1;
      for (const std::size_t k : picked) {
        if (!file_.exists(path(k, "hexes"))) continue;
        const auto h = file_.read<std::int32_t>(path(k, "hexes"));
        if (epochs.empty() || h.values != hexes) {
          hexes = h.values;
          check_indices(hexes, file_.dims(path(k, "nodes"))[0], "hexes");
          outer = skin(hexes);
          used.clear();
          std::map<int, int> local;
          std::vector<std::uint32_t> quads;
          for (const auto& q : outer.quads)
            for (const int node : q) {
              const auto [at, fresh] = local.try_emplace(node, static_cast<int>(used.size()));
              if (fresh) used.push_back(node);
              quads.push_back(static_cast<std::uint32_t>(at->second));
            }
          const auto nodes = file_.read<double>(path(k, "nodes"));
          std::vector<Vec3> skin_nodes;
          for (const int node : used) skin_nodes.emplace_back(nodes.values[3 * static_cast<std::size_t>(node)], nodes.values[3 * static_cast<std::size_t>(node) + 1], nodes.values[3 * static_cast<std::size_t>(node) + 2]);
          for (const Vec3& p : skin_nodes) region_.extend(p);
          const std::string key = fmt::format("structure_{}_epoch_{}", s, epochs.size());
          blob_.add(key + "_quads", quads, {outer.quads.size(), 4});
          pending_.push_back({key + "_nodes", std::move(skin_nodes)});
          epochs.push_back(key);
        }
        Kept now;
        if (file_.exists(path(k, "displacement"))) {
          const auto d = file_.read<float>(path(k, "displacement"));
          check_indices(used, d.rows(), "displacement");
          for (const int node : used)
            for (std::size_t c = 0; c < 3; ++c) {
              const float v = d.values[3 * static_cast<std::size_t>(node) + c];
              now.displacement.push_back(displacement_max > 0 && std::isfinite(v) ? static_cast<std::int16_t>(std::lround(32767.0 * v / displacement_max)) : std::int16_t{0});
            }
        }
        const bool tension = file_.exists(path(k, "damage_tension"));
        if (tension) {
          const auto dt = file_.read<float>(path(k, "damage_tension"));
          const auto dc = file_.exists(path(k, "damage_compression")) ? file_.read<float>(path(k, "damage_compression")) : Array<float>{};
          check_indices(outer.cell, dc.values.empty() ? dt.values.size() : std::min(dt.values.size(), dc.values.size()), "damage");
          for (const int c : outer.cell) {
            float v = dt.values[static_cast<std::size_t>(c)];
            if (!dc.values.empty()) v = std::max(v, dc.values[static_cast<std::size_t>(c)]);
            now.damage.push_back(static_cast<std::uint8_t>(std::lround(255 * std::clamp(v, 0.0F, 1.0F))));
          }
        }
        const auto scaled = [&](const char* name, float top, std::vector<std::uint16_t>& out) {
          if (!file_.exists(path(k, name))) return;
          const auto v = file_.read<float>(path(k, name));
          check_indices(outer.cell, v.values.size(), name);
          for (const int c : outer.cell) {
            const float x = v.values[static_cast<std::size_t>(c)];
            out.push_back(top > 0 && std::isfinite(x) ? static_cast<std::uint16_t>(std::lround(65535.0 * x / top)) : std::uint16_t{0});
          }
        };
        scaled("stress_von_mises", stress_max, now.stress);
        if (crack_max > 0) scaled("crack_width", crack_max, now.crack);
        if (stored < 0 || !(now == before) || frames.back()["epoch"] != epochs.size() - 1) {
          ++stored;
          const std::string key = fmt::format("structure_{}_frame_{}", s, stored);
          blob_.add(key + "_displacement", now.displacement, {now.displacement.size()});
          blob_.add(key + "_damage", now.damage, {now.damage.size()});
          blob_.add(key + "_stress", now.stress, {now.stress.size()});
          if (!now.crack.empty()) blob_.add(key + "_crack", now.crack, {now.crack.size()});
          before = std::move(now);
        }
        frames.push_back({{"time", time[k]}, {"epoch", epochs.size() - 1}, {"data", fmt::format("structure_{}_frame_{}", s, stored)}});
      }
      item["epochs"] = epochs;
      item["frames"] = frames;
      item["displacement_max"] = displacement_max;
      item["stress_max"] = stress_max;
      item["crack_max"] = crack_max;
      if (!picked.empty() && file_.exists(path(picked[0], "bar_strain"))) item["bars"] = bars(fmt::format("structure_{}_bars", s), path, picked, time, displacement_max);
      list.push_back(item);
    }
    meta_["structures"] = list;
  }

  /// Reinforcement: segments and places at the first frame, then displacement since and size of the strain.
  template <class Path>
  json bars(const std::string& key, const Path& path, const std::vector<std::size_t>& picked, const std::vector<double>& time, float displacement_max) {
    const auto segments = file_.read<std::int32_t>(path(picked[0], "bars"));
    const auto first = file_.read<float>(path(picked[0], "bar_points"));
    std::vector<Vec3> at(first.rows());
    for (std::size_t i = 0; i < at.size(); ++i) at[i] = Vec3(first.values[3 * i], first.values[3 * i + 1], first.values[3 * i + 2]);
    check_indices(segments.values, at.size(), "bars");
    blob_.add(key + "_segments", std::vector<std::uint32_t>(segments.values.begin(), segments.values.end()), {segments.rows(), 2});
    pending_.push_back({key + "_nodes", std::move(at)});
    float strain_max = 0;
    for (const std::size_t k : picked)
      for (const float e : file_.read<float>(path(k, "bar_strain")).values)
        if (std::isfinite(e)) strain_max = std::max(strain_max, std::abs(e));
    // Bars follow the cells, so that their displacement keeps to the cells' own scale, twice over since it counts from the first frame.
    const float unit = 2 * displacement_max / 32767;
    json frames = json::array();
    for (const std::size_t k : picked) {
      const auto points = file_.read<float>(path(k, "bar_points"));
      if (points.values.size() != first.values.size()) break;
      std::vector<std::int16_t> moved;
      for (std::size_t i = 0; i < points.values.size(); ++i)
        moved.push_back(unit > 0 ? static_cast<std::int16_t>(std::lround(std::clamp((points.values[i] - first.values[i]) / unit, -32767.0F, 32767.0F))) : std::int16_t{0});
      std::vector<std::uint16_t> strain;
      for (const float e : file_.read<float>(path(k, "bar_strain")).values)
        strain.push_back(strain_max > 0 && std::isfinite(e) ? static_cast<std::uint16_t>(std::lround(65535.0F * std::abs(e) / strain_max)) : std::uint16_t{0});
      const std::string data = fmt::format("{}_{}", key, frames.size());
      blob_.add(data + "_displacement", moved, {moved.size()});
      blob_.add(data + "_strain", strain, {strain.size()});
      frames.push_back({{"time", time[k]}, {"data", data}});
    }
    return {{"key", key}, {"unit", unit}, {"strain_max", strain_max}, {"frames", frames}};
  }

  /// Terrain, planes, the local origin, and everything that is stored relative to it.
  void site() {
    Mesh mesh;
    if (file_.exists("/geometry/terrain/vertices")) {
      mesh.vertices = points(file_.read<double>("/geometry/terrain/vertices"));
      const auto t = file_.read<std::int32_t>("/geometry/terrain/triangles");
      check_indices(t.values, mesh.vertices.size(), "terrain triangles");
      for (std::size_t i = 0; i < t.rows(); ++i) mesh.triangles.push_back({t.values[3 * i], t.values[3 * i + 1], t.values[3 * i + 2]});
    }
    if (region_.isEmpty())
      for (const Vec3& v : mesh.vertices) region_.extend(v);
    if (region_.isEmpty()) region_.extend(Vec3::Zero());
    // What happened, with room around it.
    const double size = std::max(4.0, std::max(region_.sizes().x(), region_.sizes().y()));
    const Vec3 room(0.22 * size, 0.22 * size, 0.0);
    Box3 view(region_.min() - room, region_.max() + room);
    Vec3 origin = region_.center();
    for (int k = 0; k < 3; ++k) origin[k] = std::round(origin[k]);
    meta_["origin"] = {origin.x(), origin.y(), origin.z()};
    const auto local = [&](const Vec3& v) { return Vec3(v - origin); };
    const auto box = [&](const Box3& b) {
      const Vec3 a = local(b.min()), c = local(b.max());
      return json{a.x(), a.y(), a.z(), c.x(), c.y(), c.z()};
    };
    meta_["region"] = box(region_);

    std::vector<float> x(block_positions_.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<float>(block_positions_[i] - origin[static_cast<Eigen::Index>(i % 3)]);
    blob_.add("frame_position", x, {frames_, names_.size(), 3});
    for (const Pending& p : pending_) put_points(p.key, p.nodes, origin);

    if (!mesh.triangles.empty()) {
      const Vec3 far(size, size, 0.0);
      const Mesh near = within(mesh, Box3(region_.min() - 1.5 * far, region_.max() + 1.5 * far));
      const Mesh shown = decimate(near.triangles.empty() ? mesh : near, view, triangle_budget);
      put_points("terrain_vertices", shown.vertices, origin);
      std::vector<std::uint32_t> triangles;
      for (const auto& t : shown.triangles)
        for (const int v : t) triangles.push_back(static_cast<std::uint32_t>(v));
      blob_.add("terrain_triangles", triangles, {shown.triangles.size(), 3});
      meta_["terrain"] = {{"triangles", mesh.triangles.size()}, {"shown", shown.triangles.size()}};
    }
    std::vector<double> planes;
    if (file_.exists("/geometry/planes")) planes = file_.read<double>("/geometry/planes").values;
    json list = json::array();
    for (std::size_t i = 0; i + 5 < planes.size(); i += 6) {
      const Vec3 p = local(Vec3(planes[i], planes[i + 1], planes[i + 2]));
      list.push_back({p.x(), p.y(), p.z(), planes[i + 3], planes[i + 4], planes[i + 5]});
    }
    meta_["planes"] = list;

    // A square-ish map, so that a straight fall line does not give a ribbon.
    const double least = 0.5 * std::max(view.sizes().x(), view.sizes().y());
    for (int k = 0; k < 2; ++k) {
      const double lack = 0.5 * (least - view.sizes()[k]);
      if (lack > 0) {
        view.min()[k] -= lack;
        view.max()[k] += lack;
      }
    }
    Raster r = rasterise(mesh, view, 360);
    for (int j = 0; j < r.ny; ++j)
      for (int i = 0; i < r.nx; ++i) {
        float& z = r.z[static_cast<std::size_t>(j) * static_cast<std::size_t>(r.nx) + static_cast<std::size_t>(i)];
        for (std::size_t p = 0; p + 5 < planes.size(); p += 6) {
          if (planes[p + 5] < 0.05) continue;
          const double h = planes[p + 2] - (planes[p + 3] * (r.x0 + i * r.dx - planes[p]) + planes[p + 4] * (r.y0 + j * r.dy - planes[p + 1])) / planes[p + 5];
          if (!(z >= h)) z = static_cast<float>(h);
        }
      }
    for (float& z : r.z) z -= static_cast<float>(origin.z());
    blob_.add("map_height", r.z, {static_cast<std::size_t>(r.ny), static_cast<std::size_t>(r.nx)});
    meta_["map"] = {{"nx", r.nx}, {"ny", r.ny}, {"x0", r.x0 - origin.x()}, {"y0", r.y0 - origin.y()}, {"dx", r.dx}, {"dy", r.dy}};
  }

  static Mesh within(const Mesh& mesh, const Box3& region) {
    Mesh out;
    std::vector<int> target(mesh.vertices.size(), -1);
    for (const auto& t : mesh.triangles) {
      bool in = false;
      for (const int v : t) {
        const Vec3& p = mesh.vertices[static_cast<std::size_t>(v)];
        in = in || (p.x() >= region.min().x() && p.x() <= region.max().x() && p.y() >= region.min().y() && p.y() <= region.max().y());
      }
      if (!in) continue;
      std::array<int, 3> s{};
      for (std::size_t k = 0; k < 3; ++k) {
        int& at = target[static_cast<std::size_t>(t[k])];
        if (at < 0) {
          at = static_cast<int>(out.vertices.size());
          out.vertices.push_back(mesh.vertices[static_cast<std::size_t>(t[k])]);
        }
        s[k] = at;
      }
      out.triangles.push_back(s);
    }
    return out;
  }

  void put_points(const std::string& name, const std::vector<Vec3>& v, const Vec3& origin) {
    std::vector<float> x;
    x.reserve(3 * v.size());
    for (const Vec3& p : v)
      for (int k = 0; k < 3; ++k) x.push_back(static_cast<float>(p[k] - origin[k]));
    blob_.add(name, x, {v.size(), 3});
  }

  void shapes() {
    const std::string g = "/geometry/blocks/";
    const auto v = file_.read<double>(g + "vertices");
    const auto t = file_.read<std::int32_t>(g + "triangles");
    const auto narrow = [&](const char* name) {
      const auto a = file_.read<std::int64_t>(g + name);
      blob_.add(std::string("block_") + name, std::vector<std::uint32_t>(a.values.begin(), a.values.end()), {a.values.size()});
    };
    blob_.add("block_vertices", std::vector<float>(v.values.begin(), v.values.end()), {v.rows(), 3});
    blob_.add("block_triangles", std::vector<std::uint32_t>(t.values.begin(), t.values.end()), {t.rows(), 3});
    narrow("vertex_offset");
    narrow("triangle_offset");
  }

  /// A group of curves over one time axis.
  void curves(const std::string& key, const std::string& title, const std::string& unit, const std::vector<double>& time,
              const std::vector<std::pair<std::string, std::vector<double>>>& series, std::size_t budget, json extra = json::object()) {
    std::vector<std::span<const double>> spans;
    for (const auto& s : series) spans.emplace_back(s.second);
    const std::vector<std::size_t> picked = pick_extremes(time.size(), spans, budget);
    std::vector<double> t;
    for (const std::size_t i : picked) t.push_back(time[i]);
    blob_.add(key + "_time", t, {t.size()});
    json item = {{"key", key}, {"title", title}, {"unit", unit}, {"series", json::array()}};
    for (std::size_t k = 0; k < series.size(); ++k) {
      std::vector<float> y;
      for (const std::size_t i : picked) y.push_back(static_cast<float>(series[k].second[i]));
      blob_.add(fmt::format("{}_{}", key, k), y, {y.size()});
      item["series"].push_back(series[k].first);
    }
    item.update(extra);
    meta_["curves"].push_back(item);
  }

  void ledger() {
    meta_["curves"] = json::array();
    const auto read = [&](const char* name) { return file_.read<double>(std::string("/ledger/") + name).values; };
    if (time_.empty()) return;
    std::vector<double> potential = read("potential");
    const double lowest = *std::min_element(potential.begin(), potential.end());
    for (double& p : potential) p -= lowest;  // only differences mean something, and the plot stays readable
    curves("energy", "Energy and where it went", "J", time_,
           {{"kinetic", read("kinetic")}, {"potential (above its lowest)", potential}, {"strain", read("strain")}, {"contact", read("contact")},
            {"friction", read("friction_work")}, {"damping", read("damping_work")}, {"damage", read("damage_work")}, {"algorithmic", read("algorithmic")}, {"external work", read("external_work")}},
           6000, {{"group", "energy"}});
    curves("residual", "Energy ledger residual", "J", time_, {{"residual", read("residual")}}, 3000, {{"group", "energy"}});
    const auto p = file_.read<double>("/ledger/linear_momentum");
    curves("momentum", "Linear momentum", "N s", time_, {{"x", column(p, 3, 0)}, {"y", column(p, 3, 1)}, {"z", column(p, 3, 2)}}, 3000, {{"group", "energy"}});
  }

  void structure_histories() {
    if (!file_.is_group("/history/structures")) return;
    const std::vector<std::string> names = file_.read_texts("/geometry/structures/name");
    for (std::size_t s = 0; s < names.size(); ++s) {
      const std::string p = "/history/structures/" + safe_name(names[s]) + "/", key = fmt::format("structure_{}", s);
      const json extra = {{"group", "structure"}, {"structure", names[s]}};
      const auto force = file_.read<double>(p + "base_force"), moment = file_.read<double>(p + "base_moment"), probe = file_.read<double>(p + "probe_displacement");
      curves(key + "_force", names[s] + ": base force", "N", time_, {{"x", column(force, 3, 0)}, {"y", column(force, 3, 1)}, {"z", column(force, 3, 2)}}, 5000, extra);
      curves(key + "_moment", names[s] + ": base moment", "N m", time_, {{"x", column(moment, 3, 0)}, {"y", column(moment, 3, 1)}, {"z", column(moment, 3, 2)}}, 5000, extra);
      const std::vector<std::string> probes = file_.read_texts(p + "probe_name");
      for (std::size_t k = 0; k < probes.size(); ++k)
        curves(fmt::format("{}_probe_{}", key, k), fmt::format("{}: displacement of {}", names[s], probes[k]), "m", time_,
               {{"x", column(probe, 3 * probes.size(), 3 * k)}, {"y", column(probe, 3 * probes.size(), 3 * k + 1)}, {"z", column(probe, 3 * probes.size(), 3 * k + 2)}}, 5000, extra);
      member_histories(p + "members/", names[s], key, extra);
      const std::vector<double> damage = file_.read<double>(p + "damage_max").values, volume = file_.read<double>(p + "damaged_volume").values;
      if (!damage.empty() && *std::max_element(damage.begin(), damage.end()) > 0) {
        curves(key + "_damage", names[s] + ": greatest damage", "1", time_, {{"damage", damage}}, 3000, extra);
        curves(key + "_volume", names[s] + ": volume with damage above one half", "m^3", time_, {{"volume", volume}}, 3000, extra);
      }
    }
  }

  /// Shear and moment of each member: the resultant at base, mid-height and top.
  void member_histories(const std::string& p, const std::string& structure, const std::string& key, const json& extra) {
    if (!file_.exists(p + "name")) return;
    const std::vector<std::string> names = file_.read_texts(p + "name");
    const auto shear = file_.read<double>(p + "shear"), moment = file_.read<double>(p + "moment");
    const std::size_t stations = shear.dims[2], width = names.size() * stations * 2;
    const auto resultant = [&](const Array<double>& a, std::size_t member, std::size_t station) {
      const std::size_t at = 2 * (member * stations + station);
      std::vector<double> x = column(a, width, at);
      const std::vector<double> y = column(a, width, at + 1);
      for (std::size_t k = 0; k < x.size(); ++k) x[k] = std::hypot(x[k], y[k]);
      return x;
    };
    for (std::size_t m = 0; m < names.size(); ++m) {
      const auto plot = [&](const Array<double>& a, const char* what, const char* title, const char* unit) {
        curves(fmt::format("{}_member_{}_{}", key, m, what), fmt::format("{}, {}: {}", structure, names[m], title), unit, time_,
               {{"base", resultant(a, m, 0)}, {"mid-height", resultant(a, m, stations / 2)}, {"top", resultant(a, m, stations - 1)}}, 3000, extra);
      };
      plot(shear, "shear", "shear force", "N");
      plot(moment, "moment", "bending moment", "N m");
    }
  }

  /// Force against time at each impact: the sum over contacts per coupled step, raw and filtered.
  void impacts() {
    const std::string g = "/history/contacts/structure/";
    const json list = summary_.value("impacts", json::array());
    if (list.empty() || !file_.exists(g + "time")) return;
    const auto time = file_.read<double>(g + "time").values, dt = file_.read<double>(g + "dt").values;
    const auto force = file_.read<double>(g + "force");
    const auto block = file_.read<std::int64_t>(g + "block").values, structure = file_.read<std::int64_t>(g + "structure").values;
    const std::vector<std::string> structures = file_.read_texts("/geometry/structures/name");
    check_indices(block, names_.size(), "block of a contact");
    check_indices(structure, structures.size(), "structure of a contact");
    // The strongest impacts; the table lists them all, those of less than a hundredth of the greatest energy too.
    double most = 0;
    for (const json& m : list) most = std::max(most, m.value("kinetic", 0.0));
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < list.size(); ++i)
      if (list[i].value("kinetic", 0.0) >= 0.01 * most) order.push_back(i);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return list[a].value("peak_force", 0.0) > list[b].value("peak_force", 0.0); });
    if (order.size() > 12) order.resize(12);
    std::sort(order.begin(), order.end());
    for (const std::size_t i : order) {
      const json& m = list[i];
      const double start = m["start"], end = m["end"];
      std::vector<double> t, step;
      std::vector<Vec3> f;
      for (std::size_t k = 0; k < time.size(); ++k) {
        if (time[k] <= start - 1e-12 || time[k] > end + 1e-12) continue;
        if (names_[static_cast<std::size_t>(block[k])] != m["block"] || structures[static_cast<std::size_t>(structure[k])] != m["structure"]) continue;
        if (t.empty() || time[k] != t.back()) {
          t.push_back(time[k]);
          step.push_back(dt[k]);
          f.emplace_back(Vec3::Zero());
        }
        f.back() += Vec3(force.values[3 * k], force.values[3 * k + 1], force.values[3 * k + 2]);
      }
      if (t.empty()) continue;
      // Equal steps over the contact and a margin; steps without a row carried no force.
      std::vector<double> sorted = step;
      std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
      const double margin = std::max(0.25 * (end - start), 0.005);
      const double h = std::max(sorted[sorted.size() / 2], (end - start + 2 * margin) / 40000);
      const auto n = static_cast<std::size_t>(std::ceil((end - start + 2 * margin) / h));
      std::vector<double> x(n), raw(n, 0.0);
      for (std::size_t k = 0; k < n; ++k) x[k] = start - margin + (static_cast<double>(k) + 0.5) * h;
      for (std::size_t k = 0; k < t.size(); ++k) {
        // The mean over each step goes to the samples whose middle lies within; at least one.
        const double a = t[k] - step[k], b = t[k];
        auto first = static_cast<std::ptrdiff_t>(std::ceil((a - x[0]) / h - 1e-9)), last = static_cast<std::ptrdiff_t>(std::ceil((b - x[0]) / h - 1e-9));
        last = std::max(last, first + 1);
        for (std::ptrdiff_t j = std::max<std::ptrdiff_t>(first, 0); j < std::min<std::ptrdiff_t>(last, static_cast<std::ptrdiff_t>(n)); ++j)
          raw[static_cast<std::size_t>(j)] = std::max(raw[static_cast<std::size_t>(j)], f[k].norm());
      }
      std::vector<double> filtered = low_pass(raw, h, filter_cutoff);
      const double peak = *std::max_element(filtered.begin(), filtered.end());
      curves(fmt::format("impact_{}", i), fmt::format("Contact force: {} on {}, {:.3f} s", m["block"].get<std::string>(), m["structure"].get<std::string>(), start), "N", x,
             {{"raw, mean per step", raw}, {fmt::format("low-pass {:.0f} Hz", filter_cutoff), filtered}}, 6000,
             {{"group", "impact"}, {"impact", i}, {"structure", m["structure"]}, {"block", m["block"]}, {"filtered_peak", peak}});
    }
  }

  struct Pending {
    std::string key;
    std::vector<Vec3> nodes;
  };
  Hdf5File file_;
  json summary_;
  json meta_ = json::object();
  Blob blob_;
  std::vector<double> time_;
  std::vector<std::string> names_;
  Windows windows_;
  Box3 region_;
  std::vector<double> block_positions_;
  std::size_t frames_ = 0;
  std::vector<Pending> pending_;
};

}  // namespace

fs::path write_report(const fs::path& directory) {
  std::error_code error;
  if (fs::exists(directory / "journal.bin", error) && !fs::exists(directory / "summary.json", error)) recover(directory);
  if (!fs::exists(directory / "results.h5", error) || !fs::exists(directory / "summary.json", error))
    throw bad_file(directory, {}, "holds no results (results.h5 and summary.json)", "name the output directory of a run");
  Report report(directory);
  const fs::path path = directory / "report.html";
  write_file(path, report.page());
  return path;
}

}  // namespace talus::io
