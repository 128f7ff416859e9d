#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "geometry/mesh.hpp"

namespace talus::geometry {

Box3 Mesh::bounds() const {
  Box3 box;
  for (const Vec3& v : vertices) box.extend(v);
  return box;
}

namespace {

std::string point(const Vec3& p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x(), p.y(), p.z()); }

struct HalfEdge {
  std::uint64_t key;  // unordered pair of vertices
  bool forward;       // from the lower to the higher vertex
  int triangle;
};

constexpr int most_reported = 8;  // of one kind; the rest is counted

}  // namespace

std::vector<Problem> closed_mesh_problems(const Mesh& mesh, const std::string& file, bool check_crossings) {
  std::vector<Problem> problems;
  const auto& v = mesh.vertices;
  if (mesh.triangles.empty()) {
    problems.push_back(
        {.file = file, .key = "mesh", .rule = "has no faces", .remedy = "give a closed surface"});
    return problems;
  }
  for (std::size_t i = 0; i < v.size(); ++i)
    if (!v[i].allFinite()) {
      problems.push_back({.file = file,
                          .key = fmt::format("mesh vertex {}", i),
                          .value = point(v[i]),
                          .rule = "coordinates must be finite",
                          .remedy = "correct the file"});
      return problems;
    }
  const double size = mesh.bounds().diagonal().norm();

  // Triangles of no area: their normal, and with it the contact, is undefined.
  int count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const double area = 0.5 * (v[b] - v[a]).cross(v[c] - v[a]).norm();
    if (a == b || b == c || c == a || area <= 1e-15 * size * size) {
      if (++count <= most_reported)
        problems.push_back({.file = file,
                            .key = fmt::format("mesh face {}", t),
                            .value = point((v[a] + v[b] + v[c]) / 3),
                            .rule = "triangle of no area",
                            .remedy = "remove it, or run `talus convert --repair IN OUT`"});
    }
  }
  if (count > most_reported)
    problems.push_back({.file = file,
                        .key = "mesh",
                        .value = fmt::format("{}", count),
                        .rule = "triangles of no area in all"});

  std::vector<HalfEdge> half;
  half.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const auto a = static_cast<std::uint64_t>(mesh.triangles[t][k]);
      const auto b = static_cast<std::uint64_t>(mesh.triangles[t][(k + 1) % 3]);
      half.push_back({std::min(a, b) << 32 | std::max(a, b), a < b, static_cast<int>(t)});
    }
  std::sort(half.begin(), half.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return a.key != b.key ? a.key < b.key : a.triangle < b.triangle;
  });
  int open = 0, multiple = 0, turned = 0;
  for (std::size_t i = 0; i < half.size();) {
    std::size_t j = i;
    int forward = 0;
    while (j < half.size() && half[j].key == half[i].key) forward += half[j++].forward;
    const int n = static_cast<int>(j - i), a = static_cast<int>(half[i].key >> 32),
              b = static_cast<int>(half[i].key & 0xffffffffu);
    const auto key = [&] { return fmt::format("mesh edge {}-{}", a, b); };  // reported for few edges
    const auto where = [&] { return point(v[a]) + " to " + point(v[b]); };
    if (n == 1) {
      if (++open <= most_reported)
        problems.push_back({.file = file,
                            .key = key(),
                            .value = where(),
                            .rule = fmt::format("open: only face {} uses this edge", half[i].triangle),
                            .remedy = "close the surface, or run `talus convert --repair IN OUT`"});
    } else if (n > 2) {
      if (++multiple <= most_reported)
        problems.push_back(
            {.file = file,
             .key = key(),
             .value = where(),
             .rule = fmt::format("non-manifold: {} faces meet here, faces {} and {} among them", n,
                                 half[i].triangle, half[i + 1].triangle),
             .remedy = "separate the parts that touch along this edge, or remove inner walls"});
    } else if (forward != 1) {
      if (++turned <= most_reported)
        problems.push_back(
            {.file = file,
             .key = key(),
             .value = where(),
             .rule = fmt::format("badly oriented: faces {} and {} run along it in the same direction",
                                 half[i].triangle, half[i + 1].triangle),
             .remedy = "turn one of the faces, or run `talus convert --repair IN OUT`"});
    }
    i = j;
  }
  if (open > most_reported)
    problems.push_back(
        {.file = file, .key = "mesh", .value = fmt::format("{}", open), .rule = "open edges in all"});
  if (multiple > most_reported)
    problems.push_back({.file = file,
                        .key = "mesh",
                        .value = fmt::format("{}", multiple),
                        .rule = "non-manifold edges in all"});
  if (turned > most_reported)
    problems.push_back({.file = file,
                        .key = "mesh",
                        .value = fmt::format("{}", turned),
                        .rule = "badly oriented edges in all"});
  if (!problems.empty()) return problems;  // volume and crossings mean nothing for an open surface

  const double volume = signed_volume(v, mesh.triangles), box = mesh.bounds().volume();
  if (!(std::abs(volume) > 1e-12 * std::max(box, 1e-300)) || size == 0) {
    problems.push_back({.file = file,
                        .key = "mesh face 0",
                        .value = fmt::format("volume {:.3g} m^3", volume),
                        .rule = fmt::format("encloses no volume (bounding box {:.3g} m^3)", box),
                        .remedy = "give a body, not a sheet"});
  }
  const auto pairs =
      check_crossings && problems.empty() ? self_intersections(mesh) : std::vector<std::pair<int, int>>{};
  if (volume < 0 && problems.empty() && pairs.empty()) {  // which way the faces of a tangle look is nowhere
    problems.push_back({.file = file,
                        .key = "mesh face 0",
                        .value = fmt::format("volume {:.6g} m^3", volume),
                        .rule = "badly oriented: all faces look inward",
                        .remedy = "turn the surface inside out, or run `talus convert --repair IN OUT`"});
  }
  for (std::size_t i = 0; i < pairs.size() && i < most_reported; ++i) {
    const auto& t = mesh.triangles[pairs[i].first];
    problems.push_back({.file = file,
                        .key = fmt::format("mesh face {}", pairs[i].first),
                        .value = point((v[t[0]] + v[t[1]] + v[t[2]]) / 3),
                        .rule = fmt::format("self-intersecting: crosses face {}", pairs[i].second),
                        .remedy = "untangle the surface in the program that made it"});
  }
  if (pairs.size() > most_reported)
    problems.push_back({.file = file,
                        .key = "mesh",
                        .value = fmt::format("{}", pairs.size()),
                        .rule = "crossing pairs of faces in all"});
  return problems;
}

int body_count(const Mesh& mesh) {
  std::vector<int> root(mesh.vertices.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const auto& t : mesh.triangles)
    for (const int v : t) root[find(v)] = find(t[0]);
  std::vector<double> six_volumes(mesh.vertices.size(), 0.0);
  for (const auto& t : mesh.triangles)
    six_volumes[find(t[0])] += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
  return static_cast<int>(
      std::count_if(six_volumes.begin(), six_volumes.end(), [](double v) { return v > 0; }));
}

Mesh read_closed_mesh(const std::string& path) {
  Mesh mesh = read_mesh(path);
  if (auto problems = closed_mesh_problems(mesh, path); !problems.empty())
    throw InputError(std::move(problems));
  return mesh;
}

int weld(Mesh& mesh, double tolerance) {
  const int n = static_cast<int>(mesh.vertices.size());
  std::vector<int> order(n), to(n);
  std::iota(order.begin(), order.end(), 0);
  const auto& v = mesh.vertices;
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    for (int k = 0; k < 3; ++k)
      if (v[a][k] != v[b][k]) return v[a][k] < v[b][k];
    return a < b;
  });
  std::iota(to.begin(), to.end(), 0);
  // Sweep along x: a vertex joins the lowest-numbered vertex within the tolerance that has not itself joined
  // another.
  for (int i = 0; i < n; ++i) {
    const int a = order[i];
    if (to[a] != a) continue;
    for (int j = i + 1; j < n && v[order[j]].x() - v[a].x() <= tolerance; ++j) {
      const int b = order[j];
      if (tolerance == 0 && v[b] != v[a]) break;  // sorted: identical points are neighbours
      if (to[b] == b && (v[b] - v[a]).norm() <= tolerance) to[b] = a;
    }
  }
  std::vector<int> number(n, -1);
  std::vector<Vec3> kept;
  for (int i = 0; i < n; ++i)
    if (to[i] == i) {
      number[i] = static_cast<int>(kept.size());
      kept.push_back(v[i]);
    }
  const int removed = n - static_cast<int>(kept.size());
  std::size_t out = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<int, 3> c;
    for (int k = 0; k < 3; ++k) c[k] = number[to[mesh.triangles[t][k]]];
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    mesh.triangles[out] = c;
    if (!mesh.group.empty()) mesh.group[out] = mesh.group[t];
    ++out;
  }
  mesh.triangles.resize(out);
  if (!mesh.group.empty()) mesh.group.resize(out);
  mesh.vertices = std::move(kept);
  return removed;
}

}  // namespace talus::geometry
