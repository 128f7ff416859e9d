#include "io/report_data.hpp"

#include <algorithm>
#include <cmath>

namespace talus::io {
namespace {

using json = nlohmann::ordered_json;

constexpr std::size_t triangle_budget = 150'000;

std::vector<Vec3> points(const Array<double>& a) {
  std::vector<Vec3> v(a.rows());
  for (std::size_t i = 0; i < v.size(); ++i)
    v[i] = Vec3(a.values[3 * i], a.values[3 * i + 1], a.values[3 * i + 2]);
  return v;
}

Mesh within(const Mesh& mesh, const Box3& region) {
  Mesh out;
  std::vector<int> target(mesh.vertices.size(), -1);
  for (const auto& t : mesh.triangles) {
    bool in = false;
    for (const int v : t) {
      const Vec3& p = mesh.vertices[static_cast<std::size_t>(v)];
      in = in || (p.x() >= region.min().x() && p.x() <= region.max().x() && p.y() >= region.min().y() &&
                  p.y() <= region.max().y());
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

void put_points(Blob& blob, const std::string& name, const std::vector<Vec3>& v, const Vec3& origin) {
  std::vector<float> x;
  x.reserve(3 * v.size());
  for (const Vec3& p : v)
    for (int k = 0; k < 3; ++k) x.push_back(static_cast<float>(p[k] - origin[k]));
  blob.add(name, x, {v.size(), 3});
}

}  // namespace

/// Terrain, planes, the local origin, and everything that is stored relative to it.
void add_site(ReportData& d) {
  Mesh mesh;
  if (d.file.exists("/geometry/terrain/vertices")) {
    mesh.vertices = points(d.file.read<double>("/geometry/terrain/vertices"));
    const auto t = d.file.read<std::int32_t>("/geometry/terrain/triangles");
    check_indices(t.values, mesh.vertices.size(), "terrain triangles");
    for (std::size_t i = 0; i < t.rows(); ++i)
      mesh.triangles.push_back({t.values[3 * i], t.values[3 * i + 1], t.values[3 * i + 2]});
  }
  if (d.region.isEmpty())
    for (const Vec3& v : mesh.vertices) d.region.extend(v);
  if (d.region.isEmpty()) d.region.extend(Vec3::Zero());
  // What happened, with room around it.
  const double largest = d.region.sizes().maxCoeff(),
               size = largest > 0 ? largest : 4.0;  // [m]; nothing but a plane has none
  const Vec3 room(0.22 * size, 0.22 * size, 0.0);
  Box3 view(d.region.min() - room, d.region.max() + room);
  Vec3 origin = d.region.center();
  for (int k = 0; k < 3; ++k) origin[k] = std::round(origin[k]);
  d.meta["origin"] = {origin.x(), origin.y(), origin.z()};
  const auto local = [&](const Vec3& v) { return Vec3(v - origin); };
  const auto box = [&](const Box3& b) {
    const Vec3 a = local(b.min()), c = local(b.max());
    return json{a.x(), a.y(), a.z(), c.x(), c.y(), c.z()};
  };
  d.meta["region"] = box(d.region);

  std::vector<float> x(d.block_positions.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = static_cast<float>(d.block_positions[i] - origin[static_cast<Eigen::Index>(i % 3)]);
  d.blob.add("frame_position", x, {d.frames, d.names.size(), 3});
  for (const ReportData::Pending& p : d.pending) put_points(d.blob, p.key, p.nodes, origin);

  if (!mesh.triangles.empty()) {
    const Vec3 far(size, size, 0.0);
    const Mesh near = within(mesh, Box3(d.region.min() - 1.5 * far, d.region.max() + 1.5 * far));
    const Mesh shown = decimate(near.triangles.empty() ? mesh : near, view, triangle_budget);
    put_points(d.blob, "terrain_vertices", shown.vertices, origin);
    std::vector<std::uint32_t> triangles;
    for (const auto& t : shown.triangles)
      for (const int v : t) triangles.push_back(static_cast<std::uint32_t>(v));
    d.blob.add("terrain_triangles", triangles, {shown.triangles.size(), 3});
    d.meta["terrain"] = {{"triangles", mesh.triangles.size()}, {"shown", shown.triangles.size()}};
  }
  std::vector<double> planes;
  if (d.file.exists("/geometry/planes")) planes = d.file.read<double>("/geometry/planes").values;
  json list = json::array();
  for (std::size_t i = 0; i + 5 < planes.size(); i += 6) {
    const Vec3 p = local(Vec3(planes[i], planes[i + 1], planes[i + 2]));
    list.push_back({p.x(), p.y(), p.z(), planes[i + 3], planes[i + 4], planes[i + 5]});
  }
  d.meta["planes"] = list;

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
      float& z =
          r.z[static_cast<std::size_t>(j) * static_cast<std::size_t>(r.nx) + static_cast<std::size_t>(i)];
      for (std::size_t p = 0; p + 5 < planes.size(); p += 6) {
        if (planes[p + 5] < 0.05) continue;
        const double h = planes[p + 2] - (planes[p + 3] * (r.x0 + i * r.dx - planes[p]) +
                                          planes[p + 4] * (r.y0 + j * r.dy - planes[p + 1])) /
                                             planes[p + 5];
        if (!(z >= h)) z = static_cast<float>(h);
      }
    }
  for (float& z : r.z) z -= static_cast<float>(origin.z());
  d.blob.add("map_height", r.z, {static_cast<std::size_t>(r.ny), static_cast<std::size_t>(r.nx)});
  d.meta["map"] = {{"nx", r.nx}, {"ny", r.ny}, {"x0", r.x0 - origin.x()}, {"y0", r.y0 - origin.y()},
                   {"dx", r.dx}, {"dy", r.dy}};
}

}  // namespace talus::io
