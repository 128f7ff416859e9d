#include "contact/geometry/surface_index.hpp"

#include <fmt/format.h>

#include <limits>
#include <numeric>

#include "contact/geometry/large_pages.hpp"
#include "contact/tolerances.hpp"
#include "core/disjoint_sets.hpp"
#include "core/error.hpp"

namespace talus::contact {
void SurfaceIndex::Impl::compute_normals() {
  normal.resize(surface.triangles.size());
  for (int t = 0; t < static_cast<int>(normal.size()); ++t) compute_normal(t);
}

void SurfaceIndex::Impl::compute_normal(int t) {
  const auto& v = surface.triangles[t];
  const Vec3& a = surface.vertices[v[0]];
  const Vec3 n = (surface.vertices[v[1]] - a).cross(surface.vertices[v[2]] - a);
  const double l = n.norm();
  normal[t] = l > 0 ? Vec3(n / l) : Vec3(Vec3::Zero());
}

void SurfaceIndex::Impl::adopt(const TriangleSurface& from) {
  surface = from;
  const auto& T = surface.triangles;
  const int vertices = static_cast<int>(surface.vertices.size());
  for (std::size_t t = 0; t < T.size(); ++t)
    for (const int v : T[t])
      if (v < 0 || v >= vertices) {
        Problem p;
        p.key = fmt::format("surface triangle {}", t);
        p.value = fmt::format("vertex {}", v);
        p.rule = fmt::format("vertex numbers must lie in 0..{}", vertices - 1);
        p.remedy = "correct the triangle";
        throw InputError(std::move(p));
      }
  compute_normals();
  connect();
  tree.build(
      static_cast<int>(T.size()), [&](int t) { return triangle_box(t); }, fans() ? 4 : 1);
}

/// Triangles at each vertex, and opposite half-edges through those at the start vertex; a side shared by
/// three or more counts as a rim.
void SurfaceIndex::Impl::connect() {
  std::vector<int> all(surface.triangles.size());
  std::iota(all.begin(), all.end(), 0);
  connect(all);
}

void SurfaceIndex::Impl::connect(const std::vector<int>& triangles) {
  const auto& T = surface.triangles;
  vertex_offset.assign(surface.vertices.size() + 1, 0);
  for (const int t : triangles)
    for (const int v : T[t]) ++vertex_offset[v + 1];
  std::partial_sum(vertex_offset.begin(), vertex_offset.end(), vertex_offset.begin());
  vertex_triangle.resize(3 * triangles.size());
  struct Sides {
    int triangle, to, from;
  };  // of a triangle at a vertex: where its side from there ends, and where the one to there starts
  std::vector<Sides> at_vertex(3 * triangles.size());
  std::vector<int> at(vertex_offset.begin(), vertex_offset.end() - 1);
  for (const int t : triangles)
    for (int k = 0; k < 3; ++k) {
      const int i = at[T[t][k]]++;
      vertex_triangle[i] = t;
      at_vertex[i] = {t, T[t][(k + 1) % 3], T[t][(k + 2) % 3]};
    }
  twin.assign(3 * T.size(), -1);
  for (const int t : triangles)
    for (int k = 0; k < 3; ++k) {
      const int a = T[t][k], b = T[t][(k + 1) % 3];
      int found = -1, uses = 0;
      for (int i = vertex_offset[a]; i < vertex_offset[a + 1]; ++i) {
        const Sides& s = at_vertex[i];
        if (s.from == b) found = s.triangle, ++uses;
        if (s.to == b && s.triangle != t) ++uses;
      }
      if (uses != 1 || found < 0) continue;
      const auto& u = T[found];
      twin[3 * t + k] = 3 * found + (u[0] == b ? 0 : u[1] == b ? 1 : 2);
    }
}

/// Faces of a surface that moves: quadrilaterals, or its triangles.
void SurfaceIndex::Impl::group_faces() {
  group = surface.parent_face;
  if (group.size() == surface.triangles.size()) return;
  group.resize(surface.triangles.size());
  std::iota(group.begin(), group.end(), 0);
}

/// Coplanar neighbours are one face.
void SurfaceIndex::Impl::group_coplanar() {
  DisjointSets faces(static_cast<int>(surface.triangles.size()));
  for (int h = 0; h < static_cast<int>(twin.size()); ++h) {
    const int w = twin[h];
    if (w < h) continue;
    const Vec3 &n = normal[h / 3], &m = normal[w / 3];
    if (n.dot(m) > 0 && n.cross(m).norm() < tolerances().true_edge) faces.join(h / 3, w / 3);
  }
  group.resize(surface.triangles.size());
  for (std::size_t t = 0; t < group.size(); ++t) group[t] = faces.root(static_cast<int>(t));
}

SurfaceIndex::SurfaceIndex(const TriangleSurface& surface) : impl_(std::make_unique<Impl>()) {
  Impl& s = *impl_;
  const std::size_t count = surface.triangles.size();
  reserve_on_large_pages(s.surface.vertices, surface.vertices.size());
  reserve_on_large_pages(s.surface.triangles, count);
  reserve_on_large_pages(s.normal, count);
  reserve_on_large_pages(s.twin, 3 * count);
  reserve_on_large_pages(s.vertex_offset, surface.vertices.size() + 1);
  reserve_on_large_pages(s.vertex_triangle, 3 * count);
  reserve_on_large_pages(s.group, count);
  s.adopt(surface);
  s.group_coplanar();
}

SurfaceIndex::~SurfaceIndex() = default;
SurfaceIndex::SurfaceIndex(SurfaceIndex&&) noexcept = default;

void SurfaceIndex::refit(const TriangleSurface& surface) {
  Impl& s = *impl_;
  if (s.focus) {
    s.follow(surface);
    return;
  }
  if (surface.triangles.size() != s.surface.triangles.size() ||
      surface.vertices.size() != s.surface.vertices.size() || surface.revision != s.surface.revision) {
    s.adopt(surface);
  } else {
    s.surface.vertices = surface.vertices;
    s.surface.velocities = surface.velocities;
    s.compute_normals();
    s.tree.refit([&](int t) { return s.triangle_box(t); });
  }
  s.group_faces();
}

const TriangleSurface& SurfaceIndex::surface() const { return impl_->surface; }
Box3 SurfaceIndex::bounds() const { return impl_->focus ? impl_->focus->all.bounds() : impl_->tree.bounds(); }

bool SurfaceIndex::overlaps(const Box3& box) const {
  const Impl& s = *impl_;
  return !s.tree.traverse(
      [&](const Vec3& lo, const Vec3& hi) {
        return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
      },
      [&](int t) { return !s.triangle_box(t).intersects(box); });
}

bool SurfaceIndex::between_materials(int triangle, const Vec3& x) const {
  const Impl& s = *impl_;
  const auto& material = s.surface.material;
  if (material.empty()) return false;
  const double same = tolerances().same_place * bounds().sizes().norm();
  const auto& v = s.surface.triangles[static_cast<std::size_t>(triangle)];
  const auto other = [&](int t) {
    return material[static_cast<std::size_t>(t)] != material[static_cast<std::size_t>(triangle)];
  };
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &a = s.surface.vertices[v[i]], &b = s.surface.vertices[v[(i + 1) % 3]];
    const int across = s.twin[3 * static_cast<std::size_t>(triangle) + i];
    if (across >= 0 && other(across / 3) && (b - a).cross(x - a).norm() <= same * (b - a).norm()) return true;
    if ((x - a).norm() > same) continue;
    for (int k = s.vertex_offset[v[i]]; k < s.vertex_offset[v[i] + 1]; ++k)
      if (other(s.vertex_triangle[k])) return true;
  }
  return false;
}

int SurfaceIndex::triangle_at(const Vec3& x, const Vec3& n, const Vec3& inwards) const {
  const Impl& s = *impl_;
  const auto distance = [&](int t, const Vec3& from) {
    const auto& v = s.surface.triangles[static_cast<std::size_t>(t)];
    const Vec3 &a = s.surface.vertices[v[0]], &b = s.surface.vertices[v[1]], &c = s.surface.vertices[v[2]];
    const Vec3 normal = (b - a).cross(c - a);
    Vec3 l(normal.dot((b - from).cross(c - from)), normal.dot((c - from).cross(a - from)),
           normal.dot((a - from).cross(b - from)));
    l = (l / normal.squaredNorm()).cwiseMax(0.0);
    l /= l.sum();
    return (l[0] * a + l[1] * b + l[2] * c - from).norm();
  };
  int best = -1;
  double nearest = std::numeric_limits<double>::infinity(), off = nearest;
  double most = -1, size = 1e-3 * bounds().sizes().norm();
  const double same = tolerances().same_place * bounds().sizes().norm();
  const Vec3 along = inwards - inwards.dot(n) * n, beside = x + std::sqrt(same * size) * along.normalized();
  for (int attempt = 0; attempt < 60 && best < 0; ++attempt, size *= 2) {
    const Box3 box(x.array() - size, x.array() + size);
    s.tree.traverse(
        [&](const Vec3& lo, const Vec3& hi) {
          return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
        },
        [&](int t) {
          if (!s.triangle_box(t).intersects(box)) return true;
          const double d = distance(t, x), facing = n.dot(s.normal[static_cast<std::size_t>(t)]),
                       aside = distance(t, beside);
          const bool as_near = d <= nearest + same,
                     faces_as_well = as_near && facing >= most - tolerances().same_normal;
          if (d < nearest - same || (as_near && facing > most + tolerances().same_normal) ||
              (faces_as_well && aside < off - same) || (faces_as_well && aside <= off + same && t < best))
            nearest = d, most = facing, off = aside, best = t;
          return true;
        });
  }
  return best;
}

}  // namespace talus::contact
