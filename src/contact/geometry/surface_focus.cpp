// A large skin of which little is near any block: only that follows each sub-step.
#include <algorithm>
#include <utility>

#include "contact/geometry/surface_index.hpp"

namespace talus::contact {

void SurfaceIndex::focus(const TriangleSurface& surface, std::vector<Box3> boxes) {
  Impl& s = *impl_;
  if (!s.fans()) return;
  if (!s.focus) {
    s.focus = std::make_unique<Impl::Focus>();
    std::swap(s.focus->all, s.tree);
  }
  s.focus->boxes = std::move(boxes);
  s.focus->chosen = false;
  s.follow(surface);
}

void SurfaceIndex::unfocus(const TriangleSurface& surface) {
  Impl& s = *impl_;
  if (!s.focus) return;
  std::swap(s.focus->all, s.tree);
  const bool new_topology = s.focus->new_topology;
  s.focus.reset();
  if (!new_topology) return refit(surface);
  s.adopt(surface);
  s.group_faces();
}

void SurfaceIndex::Impl::follow(const TriangleSurface& from) {
  Focus& f = *focus;
  const bool changed = from.revision != surface.revision;
  if (!changed && f.chosen) {
    for (const int v : f.vertices)
      surface.vertices[v] = from.vertices[v], surface.velocities[v] = from.velocities[v];
    for (const int t : f.triangles) compute_normal(t);
    tree.refit([&](int t) { return triangle_box(t); });
    return;
  }
  if (changed) {
    surface = from;
    group_faces();
    f.new_topology = true;
  } else {
    surface.vertices = from.vertices;
    surface.velocities = from.velocities;
  }
  choose();
  f.chosen = true;
  normal.resize(surface.triangles.size());
  for (const int t : f.triangles) compute_normal(t);
  if (f.new_topology) connect(f.triangles);
  tree.build(
      std::span<const int>(f.triangles), [&](int t) { return triangle_box(t); }, 4);
}

/// The faces whose box meets one of the boxes, and two rings of faces around them.
void SurfaceIndex::Impl::choose() {
  const auto& T = surface.triangles;
  const std::size_t faces = T.size() / 4;
  BoxTree near;
  near.build(static_cast<int>(focus->boxes.size()),
             [&](int i) { return focus->boxes[static_cast<std::size_t>(i)]; });
  std::vector<char> chosen(faces, 0), marked(surface.vertices.size(), 0);
  for (std::size_t q = 0; q < faces; ++q) {
    Box3 box;
    for (int k = 0; k < 4; ++k) box.extend(surface.vertices[T[4 * q + k][0]]);
    chosen[q] =
        near.traverse(
            [&](const Vec3& lo, const Vec3& hi) {
              return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
            },
            [&](int i) { return !focus->boxes[static_cast<std::size_t>(i)].intersects(box); })
            ? 0
            : 1;
  }
  for (int ring = 0; ring < 2; ++ring) {
    for (std::size_t q = 0; q < faces; ++q)
      for (int k = 0; chosen[q] && k < 4; ++k) marked[T[4 * q + k][0]] = 1;
    for (std::size_t q = 0; q < faces; ++q)
      for (int k = 0; !chosen[q] && k < 4; ++k) chosen[q] = marked[T[4 * q + k][0]];
  }
  focus->triangles.clear();
  focus->vertices.clear();
  std::fill(marked.begin(), marked.end(), 0);
  for (std::size_t q = 0; q < faces; ++q) {
    if (!chosen[q]) continue;
    for (int k = 0; k < 4; ++k) {
      const int t = static_cast<int>(4 * q) + k;
      focus->triangles.push_back(t);
      for (const int v : T[t]) marked[v] = 1;
    }
  }
  for (std::size_t v = 0; v < marked.size(); ++v)
    if (marked[v]) focus->vertices.push_back(static_cast<int>(v));
}

}  // namespace talus::contact
