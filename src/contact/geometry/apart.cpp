#include "contact/geometry/apart.hpp"

#include <algorithm>
#include <limits>

#include "contact/geometry/surface_index.hpp"
#include "contact/narrow/narrow_gjk.hpp"

namespace talus::contact {
namespace {

/// Largest n . x over the body.
double support(const Polyhedron& p, const Pose& pose, const Vec3& n) {
  const Vec3 m = pose.F.transpose() * n;
  double most = -std::numeric_limits<double>::infinity();
  for (const Vec3& x : p.vertices) most = std::max(most, m.dot(x));
  return n.dot(pose.c) + most;
}

/// Outward normals of the faces, world.
std::vector<Vec3> normals(const Polyhedron& p, const Pose& pose) {
  const Mat3 turn = pose.F.inverse().transpose();
  std::vector<Vec3> n;
  for (const Vec3& of : p.face_normals) n.push_back((turn * of).normalized());
  return n;
}

}  // namespace

bool apart(const Polyhedron& A, const Pose& a, const Polyhedron& B, const Pose& b, double gap) {
  const Vec3 between = b.c - a.c;
  // Half of all pairs part along the line of centres: they need not be posed.
  if (const double distance = between.norm(); distance > 0)
    if (const Vec3 n = between / distance; - support(B, b, -n) - support(A, a, n) > gap) return true;
  thread_local narrow::Hull of_a, of_b;
  of_a.set(A, Vec3::Zero(), a.F);
  of_b.set(B, between, b.F);
  return narrow::gjk(of_a, of_b, between, gap).beyond;
}

bool apart(const SurfaceIndex& index, const Polyhedron& B, const Pose& b, double gap) {
  const SurfaceIndex::Impl& s = index.impl();
  const Box3 box = bounds(B, b, gap);
  std::vector<std::pair<Vec3, double>> planes;  // unit normal, and how far off its plane lies [m]
  bool clear = true;
  s.tree.traverse(
      [&](const Vec3& lo, const Vec3& hi) {
        return (lo.array() <= box.max().array()).all() && (hi.array() >= box.min().array()).all();
      },
      [&](int t) {
        if (!s.triangle_box(t).intersects(box)) return true;
        if (planes.empty())
          for (const Vec3& n : normals(B, b)) planes.emplace_back(n, support(B, b, n) + gap);
        const auto& v = s.surface.triangles[static_cast<std::size_t>(t)];
        const auto off = [&](const std::pair<Vec3, double>& p) {
          return std::all_of(v.begin(), v.end(), [&](int i) {
            return p.first.dot(s.surface.vertices[static_cast<std::size_t>(i)]) > p.second;
          });
        };
        clear = std::any_of(planes.begin(), planes.end(), off);
        return clear;
      });
  return clear;
}

}  // namespace talus::contact
