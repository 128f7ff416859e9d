#include "io/report_parts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <unordered_map>

#include <fmt/format.h>

#include "io/files.hpp"

namespace talus::io {

std::span<const double> RowReader::row(std::size_t k) {
  constexpr std::size_t batch_bytes = std::size_t{8} << 20;
  if (k < first_ || k >= first_ + held_.rows()) {
    const Dims dims = file_.dims(path_);
    const std::size_t left =
        !dims.empty() && k < dims[0] ? dims[0] - k : 1;  // beyond the end: the reading refuses
    held_ = file_.read_rows<double>(
        path_, k,
        std::min(left, std::max<std::size_t>(
                           1, batch_bytes / (sizeof(double) * std::max<std::size_t>(1, width_)))));
    if (held_.stride() != width_)
      throw bad_file("results.h5", path_,
                     fmt::format("has rows of {} numbers in place of {}", held_.stride(), width_),
                     "use results that Talus wrote");
    first_ = k;
  }
  return std::span(held_.values).subspan((k - first_) * width_, width_);
}

std::vector<std::size_t> pick_frames(std::span<const double> time, std::size_t budget,
                                     const Windows& windows) {
  const std::size_t n = time.size();
  std::vector<std::size_t> picked;
  budget = std::max<std::size_t>(budget, 2);
  if (n <= budget) {
    for (std::size_t i = 0; i < n; ++i) picked.push_back(i);
    return picked;
  }
  // Every row gets a weight; frames fall at equal steps of the running sum.
  const auto inside = [&](double t) {
    return std::any_of(windows.begin(), windows.end(),
                       [&](const auto& w) { return t >= w.first && t <= w.second; });
  };
  std::size_t in = 0;
  std::vector<char> flag(n);
  for (std::size_t i = 0; i < n; ++i) in += static_cast<std::size_t>(flag[i] = inside(time[i]) ? 1 : 0);
  const double weight_in =
      in > 0 && in < n ? std::max(1.0, 0.5 * static_cast<double>(n - in) / static_cast<double>(in)) : 1.0;
  double total = 0;
  for (std::size_t i = 0; i < n; ++i) total += flag[i] ? weight_in : 1.0;
  double sum = 0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto slot = static_cast<std::size_t>(sum / total * static_cast<double>(budget - 1));
    if (slot >= next || i + 1 == n) {
      picked.push_back(i);
      next = slot + 1;
    }
    sum += flag[i] ? weight_in : 1.0;
  }
  return picked;
}

std::vector<std::size_t> pick_extremes(std::size_t n, const std::vector<std::span<const double>>& series,
                                       std::size_t budget) {
  std::vector<std::size_t> picked;
  const std::size_t intervals =
      std::max<std::size_t>(8, budget / std::max<std::size_t>(1, 2 * series.size()));
  if (n <= budget || n <= 2 * intervals) {
    for (std::size_t i = 0; i < n; ++i) picked.push_back(i);
    return picked;
  }
  for (std::size_t k = 0; k < intervals; ++k) {
    const std::size_t a = k * n / intervals, b = (k + 1) * n / intervals;
    for (const auto& s : series) {
      const auto less = [](double x, double y) { return x < y; };
      picked.push_back(
          static_cast<std::size_t>(std::min_element(s.begin() + static_cast<std::ptrdiff_t>(a),
                                                    s.begin() + static_cast<std::ptrdiff_t>(b), less) -
                                   s.begin()));
      picked.push_back(
          static_cast<std::size_t>(std::max_element(s.begin() + static_cast<std::ptrdiff_t>(a),
                                                    s.begin() + static_cast<std::ptrdiff_t>(b), less) -
                                   s.begin()));
    }
  }
  picked.push_back(0);
  picked.push_back(n - 1);
  std::sort(picked.begin(), picked.end());
  picked.erase(std::unique(picked.begin(), picked.end()), picked.end());
  return picked;
}

namespace {

Mesh cluster(const Mesh& mesh, const Box3& region, double fine, double coarse) {
  struct Key {
    long x, y, z, size;
    bool operator==(const Key&) const = default;
  };
  struct Hash {
    std::size_t operator()(const Key& k) const {
      std::size_t h = static_cast<std::size_t>(k.size);
      for (const long v : {k.x, k.y, k.z})
        h = h * 0x9E3779B97F4A7C15ULL + static_cast<std::size_t>(v) + (h >> 29);
      return h;
    }
  };
  Mesh out;
  std::vector<int> target(mesh.vertices.size());
  std::vector<int> count;
  std::unordered_map<Key, int, Hash> cells;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vec3& v = mesh.vertices[i];
    const bool in = v.x() >= region.min().x() && v.x() <= region.max().x() && v.y() >= region.min().y() &&
                    v.y() <= region.max().y();
    const double h = in ? fine : coarse;
    Key key{static_cast<long>(i), 0, 0, 0};
    if (h > 0)
      key = {std::lround(std::floor(v.x() / h)), std::lround(std::floor(v.y() / h)),
             std::lround(std::floor(v.z() / h)), in ? 1 : 2};
    const auto [at, fresh] = cells.try_emplace(key, static_cast<int>(out.vertices.size()));
    if (fresh) {
      out.vertices.push_back(v);
      count.push_back(1);
    } else {
      const auto k = static_cast<std::size_t>(at->second);
      out.vertices[k] += (v - out.vertices[k]) / ++count[k];
    }
    target[i] = at->second;
  }
  for (const auto& t : mesh.triangles) {
    const std::array<int, 3> s{target[static_cast<std::size_t>(t[0])], target[static_cast<std::size_t>(t[1])],
                               target[static_cast<std::size_t>(t[2])]};
    if (s[0] != s[1] && s[1] != s[2] && s[2] != s[0]) out.triangles.push_back(s);
  }
  return out;
}

}  // namespace

Mesh decimate(const Mesh& mesh, const Box3& region, std::size_t budget) {
  if (mesh.triangles.size() <= budget) return mesh;
  Box3 all;
  for (const Vec3& v : mesh.vertices) all.extend(v);
  // Mean length of an edge in plan, from the area that a triangle covers.
  const double spacing =
      std::sqrt(2.0 * all.sizes().x() * all.sizes().y() / static_cast<double>(mesh.triangles.size()));
  double fine = 0, coarse = 2.0 * spacing;
  Mesh out = cluster(mesh, region, fine, coarse);
  while (out.triangles.size() > budget) {
    // Outside first, down to an eighth of the detail inside.
    if (coarse < 8 * std::max(fine, spacing))
      coarse *= 1.5;
    else
      fine = std::max(1.5 * fine, 1.3 * spacing);
    out = cluster(mesh, region, fine, coarse);
  }
  return out;
}

Raster rasterise(const Mesh& mesh, const Box3& region, int largest_side) {
  Raster r;
  const double lx = std::max(region.sizes().x(), 1e-6), ly = std::max(region.sizes().y(), 1e-6),
               side = std::max(lx, ly);
  r.nx = std::max(2, static_cast<int>(std::lround(largest_side * lx / side)));
  r.ny = std::max(2, static_cast<int>(std::lround(largest_side * ly / side)));
  r.x0 = region.min().x();
  r.y0 = region.min().y();
  r.dx = lx / (r.nx - 1);
  r.dy = ly / (r.ny - 1);
  r.z.assign(static_cast<std::size_t>(r.nx) * static_cast<std::size_t>(r.ny),
             std::numeric_limits<float>::quiet_NaN());
  for (const auto& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[static_cast<std::size_t>(t[0])],
               &b = mesh.vertices[static_cast<std::size_t>(t[1])],
               &c = mesh.vertices[static_cast<std::size_t>(t[2])];
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
    if (area == 0) continue;
    const auto [x_low, x_high] = std::minmax({a.x(), b.x(), c.x()});
    const auto [y_low, y_high] = std::minmax({a.y(), b.y(), c.y()});
    const int i0 = static_cast<int>(std::clamp(std::ceil((x_low - r.x0) / r.dx - 1e-9), 0.0, r.nx + 0.0)),
              i1 = static_cast<int>(std::clamp(std::floor((x_high - r.x0) / r.dx + 1e-9), -1.0, r.nx - 1.0));
    const int j0 = static_cast<int>(std::clamp(std::ceil((y_low - r.y0) / r.dy - 1e-9), 0.0, r.ny + 0.0)),
              j1 = static_cast<int>(std::clamp(std::floor((y_high - r.y0) / r.dy + 1e-9), -1.0, r.ny - 1.0));
    for (int j = j0; j <= j1; ++j)
      for (int i = i0; i <= i1; ++i) {
        const double x = r.x0 + i * r.dx, y = r.y0 + j * r.dy;
        const double u = ((b.x() - x) * (c.y() - y) - (c.x() - x) * (b.y() - y)) / area;
        const double v = ((c.x() - x) * (a.y() - y) - (a.x() - x) * (c.y() - y)) / area;
        const double w = 1 - u - v;
        if (u < -1e-9 || v < -1e-9 || w < -1e-9) continue;
        const auto z = static_cast<float>(u * a.z() + v * b.z() + w * c.z());
        float& cell =
            r.z[static_cast<std::size_t>(j) * static_cast<std::size_t>(r.nx) + static_cast<std::size_t>(i)];
        if (!(cell >= z)) cell = z;
      }
  }
  return r;
}

Skin skin(std::span<const std::int32_t> hexes) {
  // VTK order; each face outward.
  static constexpr int faces[6][4] = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                                      {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}};
  struct Face {
    std::array<int, 4> key, nodes;
    int cell;
  };
  std::vector<Face> all;
  all.reserve(hexes.size() / 8 * 6);
  for (std::size_t h = 0; 8 * h + 7 < hexes.size(); ++h)
    for (const auto& f : faces) {
      Face face{};
      for (std::size_t k = 0; k < 4; ++k) face.nodes[k] = hexes[8 * h + static_cast<std::size_t>(f[k])];
      face.key = face.nodes;
      std::sort(face.key.begin(), face.key.end());
      face.cell = static_cast<int>(h);
      all.push_back(face);
    }
  std::sort(all.begin(), all.end(),
            [](const Face& a, const Face& b) { return a.key != b.key ? a.key < b.key : a.cell < b.cell; });
  Skin s;
  for (std::size_t i = 0; i < all.size();) {
    std::size_t j = i + 1;
    while (j < all.size() && all[j].key == all[i].key) ++j;
    if (j == i + 1) {
      s.quads.push_back(all[i].nodes);
      s.cell.push_back(all[i].cell);
    }
    i = j;
  }
  return s;
}

std::string base64(std::string_view bytes) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t w = 0;
    for (std::size_t k = 0; k < 3; ++k)
      w = w << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out.push_back(i + k <= bytes.size() ? digits[w >> (18 - 6 * k) & 63] : '=');
  }
  return out;
}

}  // namespace talus::io
