#include "contact/skin/skin_near.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "contact/narrow/narrow_math.hpp"
#include "contact/tolerances.hpp"

namespace talus::contact {

SkinNear::SkinNear(const SurfaceIndex& surface, const Polyhedron& body, const Pose& pose, double reach)
    : skin(surface.impl()),
      index(surface),
      block(body),
      margin(reach),
      deepest((block.convex ? 1.9 : 0.5) * block.inradius) {
  for (const Vec3& x : block.vertices) corner.push_back(pose.world(x));
  const Mat3 cof = narrow::cofactor(pose.F);
  for (const Vec3& n : block.face_normals) normal.push_back((cof * n).normalized());
  into_.resize(3 * block.triangles.size());
  for (std::size_t k = 0; k < block.triangles.size(); ++k)
    for (std::size_t side = 0; side < 3; ++side) {
      const Vec3& a = corner[static_cast<std::size_t>(block.triangles[k][side])];
      const Vec3& b = corner[static_cast<std::size_t>(block.triangles[k][(side + 1) % 3])];
      into_[3 * k + side] =
          normal[static_cast<std::size_t>(block.triangle_face[k])].cross(b - a).normalized();
    }
  // In the world's axes, and in the block's own: a tilted slab fills little of the first. Seen along a face's
  // normal a skin triangle may leave the box by its own slope.
  const Box3 box = bounds(block, pose, margin);
  const Mat3 back = pose.F.inverse();
  Box3 own;
  for (const Vec3& x : block.vertices) own.extend(x);
  skin.tree.traverse(
      [&](const Vec3& lo, const Vec3& hi) {
        return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
      },
      [&](int t) {
        const Box3 of_triangle = skin.triangle_box(t);
        if (!of_triangle.intersects(box)) return true;
        Box3 seen;
        for (const int v : skin.surface.triangles[static_cast<std::size_t>(t)])
          seen.extend(back * (skin.surface.vertices[static_cast<std::size_t>(v)] - pose.c));
        const double about = (margin + deepest + 0.2 * of_triangle.diagonal().norm()) * back.norm();
        seen.min().array() -= about;
        seen.max().array() += about;
        if (seen.intersects(own)) triangles.push_back(t);
        return true;
      });
  std::sort(triangles.begin(), triangles.end());
  for (const int t : triangles) triangle_normal.push_back(skin.normal[static_cast<std::size_t>(t)]);
  if (!triangles.empty()) order_triangles();
}

void SkinNear::order_triangles() {
  first_.assign(static_cast<std::size_t>(block.faces()) + 1, 0);
  for (const int f : block.triangle_face) ++first_[static_cast<std::size_t>(f) + 1];
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  by_face_.resize(block.triangles.size());
  std::vector<std::size_t> at(first_.begin(), first_.end() - 1);
  for (std::size_t k = 0; k < by_face_.size(); ++k)
    by_face_[at[static_cast<std::size_t>(block.triangle_face[k])]++] = k;
}

std::span<const std::size_t> SkinNear::triangles_of(int face) const {
  const std::size_t first = first_[static_cast<std::size_t>(face)];
  return std::span(by_face_).subspan(first, first_[static_cast<std::size_t>(face) + 1] - first);
}

double SkinNear::face_area(int face) const {
  double area = 0;
  for (const std::size_t k : triangles_of(face)) {
    const auto& t = block.triangles[k];
    const Vec3 &a = corner[static_cast<std::size_t>(t[0])], &b = corner[static_cast<std::size_t>(t[1])],
               &c = corner[static_cast<std::size_t>(t[2])];
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  return area;
}

double SkinNear::inside(std::size_t triangle, const Vec3& x, int side) const {
  const Vec3& a = corner[static_cast<std::size_t>(block.triangles[triangle][static_cast<std::size_t>(side)])];
  return into_[3 * triangle + static_cast<std::size_t>(side)].dot(x - a);
}

bool SkinNear::covers(int face, const Vec3& x) const {
  const double slack = -1e-6 * block.radius;
  for (const std::size_t k : triangles_of(face)) {
    bool all = true;
    for (int side = 0; side < 3 && all; ++side) all = inside(k, x, side) >= slack;
    if (all) return true;
  }
  return false;
}

Vec3 SkinNear::barycentric(int t, const Vec3& x) const {
  const auto& v = skin.surface.triangles[static_cast<std::size_t>(t)];
  const Vec3 &a = skin.surface.vertices[static_cast<std::size_t>(v[0])],
             &b = skin.surface.vertices[static_cast<std::size_t>(v[1])],
             &c = skin.surface.vertices[static_cast<std::size_t>(v[2])];
  const Vec3 n = (b - a).cross(c - a);
  return Vec3(n.dot((b - x).cross(c - x)), n.dot((c - x).cross(a - x)), n.dot((a - x).cross(b - x))) /
         n.squaredNorm();
}

Vec3 SkinNear::on_triangle(int t, const Vec3& x) const {
  const Vec3 l = barycentric(t, x).cwiseMax(0.0);
  const auto& v = skin.surface.triangles[static_cast<std::size_t>(t)];
  Vec3 p = Vec3::Zero();
  for (int k = 0; k < 3; ++k)
    p += l[k] / l.sum() * skin.surface.vertices[static_cast<std::size_t>(v[static_cast<std::size_t>(k)])];
  return p;
}

double SkinNear::gap(int t, const Vec3& x) const {
  const auto first = static_cast<std::size_t>(skin.surface.triangles[static_cast<std::size_t>(t)][0]);
  return skin.normal[static_cast<std::size_t>(t)].dot(x - skin.surface.vertices[first]);
}

double SkinNear::distance(int t, const Vec3& x) const {
  const auto& v = skin.surface.triangles[static_cast<std::size_t>(t)];
  const auto corner = [&](std::size_t k) -> const Vec3& {
    return skin.surface.vertices[static_cast<std::size_t>(v[k])];
  };
  return (narrow::closest_on(corner(0), corner(1), corner(2), x) - x).norm();
}

bool SkinNear::outside(const Vec3& x) const {
  const double same = tolerances().same_place * block.radius;
  double least = std::numeric_limits<double>::infinity(), across = 0;
  for (const int t : triangles) {
    const double before = gap(t, x);
    if (std::abs(before) > least + same) continue;
    const double away = distance(t, x);
    if (away > least + same) continue;
    if (away < least - same || std::abs(before) > std::abs(across)) across = before;
    least = std::min(least, away);
  }
  return across > 0;
}

double SkinNear::size(int t) const {
  const auto& v = skin.surface.triangles[static_cast<std::size_t>(t)];
  return (skin.surface.vertices[static_cast<std::size_t>(v[1])] -
          skin.surface.vertices[static_cast<std::size_t>(v[0])])
      .norm();
}

}  // namespace talus::contact
