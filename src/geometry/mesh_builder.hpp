/// Collecting the faces of a mesh file (private to the mesh readers).
#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include "geometry/mesh.hpp"
#include "geometry/text_cursor.hpp"

namespace talus::geometry {

/// Gives each distinct coordinate triple one number (open addressing; -0 counts as 0).
class VertexTable {
 public:
  explicit VertexTable(std::vector<Vec3>& vertices, std::size_t expected) : vertices_(vertices) {
    slots_.assign(std::bit_ceil(std::max<std::size_t>(16, 2 * expected)), -1);
  }
  int add(Vec3 p) {
    p.array() += 0.0;  // -0 + 0 = 0
    if (2 * (vertices_.size() + 1) > slots_.size()) grow();
    std::size_t i = hash(p) & (slots_.size() - 1);
    while (slots_[i] >= 0) {
      if (vertices_[slots_[i]] == p) return slots_[i];
      i = (i + 1) & (slots_.size() - 1);
    }
    vertices_.push_back(p);
    return slots_[i] = static_cast<int>(vertices_.size()) - 1;
  }

 private:
  static std::size_t hash(const Vec3& p) {
    std::uint64_t h = 0x9e3779b97f4a7c15ull;
    for (int k = 0; k < 3; ++k) {
      h ^= std::bit_cast<std::uint64_t>(p[k]);
      h *= 0xff51afd7ed558ccdull;
      h ^= h >> 32;
    }
    return h;
  }
  void grow() {
    slots_.assign(2 * slots_.size(), -1);
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      std::size_t i = hash(vertices_[v]) & (slots_.size() - 1);
      while (slots_[i] >= 0) i = (i + 1) & (slots_.size() - 1);
      slots_[i] = static_cast<int>(v);
    }
  }
  std::vector<Vec3>& vertices_;
  std::vector<int> slots_;
};

inline constexpr double farthest = 1e9;  // coordinate of a vertex [m]: beyond, it is no number of metres

inline void check_vertices(const std::vector<Vec3>& points, const std::string& name) {
  for (std::size_t i = 0; i < points.size(); ++i)
    if (const Vec3& p = points[i]; !(p.array().abs() <= farthest).all())
      throw InputError(
          Problem{.file = name,
                  .key = fmt::format("mesh vertex {}", i),
                  .value = fmt::format("({:g}, {:g}, {:g})", p.x(), p.y(), p.z()),
                  .rule = fmt::format("coordinates must be finite numbers, of at most {:g} m", farthest),
                  .remedy = "export the file again"});
}

/// Collects faces as a file lists them, then shares identical vertices and drops those that no face uses.
struct Builder {
  std::string name;
  std::vector<Vec3> points;
  Mesh mesh;  // triangles index `points` until finish()
  int group = 0;
  bool grouped = false;

  void face(const std::vector<int>& loop, TextCursor* cursor) {
    if (loop.size() < 3) {
      if (cursor) cursor->fail("face", "needs three vertices or more");
      throw InputError(Problem{.file = name, .key = "face", .rule = "needs three vertices or more"});
    }
    if (loop.size() == 3) {
      push({loop[0], loop[1], loop[2]});
      return;
    }
    Vec3 normal = Vec3::Zero();  // Newell's: right for concave loops too
    for (std::size_t i = 0; i < loop.size(); ++i)
      normal +=
          (points[loop[i]] - points[loop[0]]).cross(points[loop[(i + 1) % loop.size()]] - points[loop[0]]);
    const auto triangles = triangulate_polygon(points, {loop}, normal);
    if (triangles.empty()) {
      const std::string rule = "polygon crosses itself or has no area";
      if (cursor) cursor->fail("face", rule, "split the polygon into triangles");
      throw InputError(Problem{.file = name,
                               .key = fmt::format("mesh face {}", mesh.triangles.size()),
                               .rule = rule,
                               .remedy = "split the polygon into triangles"});
    }
    for (const auto& t : triangles) push(t);
  }
  void push(const std::array<int, 3>& t) {
    mesh.triangles.push_back(t);
    if (grouped) mesh.group.push_back(group);
  }
  void start_group(const std::string& group_name) {
    if (!grouped) {
      grouped = true;
      mesh.group.assign(mesh.triangles.size(), 0);
      if (!mesh.triangles.empty()) mesh.group_names.push_back("");
    }
    const auto found = std::find(mesh.group_names.begin(), mesh.group_names.end(), group_name);
    group = static_cast<int>(found - mesh.group_names.begin());
    if (found == mesh.group_names.end()) mesh.group_names.push_back(group_name);
  }
  Mesh finish() {
    if (mesh.triangles.empty())
      throw InputError(
          Problem{.file = name, .key = "mesh", .rule = "has no faces", .remedy = "give a surface mesh"});
    check_vertices(points, name);
    std::vector<int> number(points.size(), -1);
    VertexTable table(mesh.vertices, points.size());
    for (auto& t : mesh.triangles)
      for (int& v : t) {
        if (number[v] < 0) number[v] = table.add(points[v]);
        v = number[v];
      }
    return std::move(mesh);
  }
};

/// ParaView's unstructured grid in text form: triangles, quadrilaterals and polygons; the cell data "block"
/// are the groups.
Mesh read_vtu(const std::string& text, const std::string& name);

}  // namespace talus::geometry
