#include "contact/geometry/apart.hpp"

#include <algorithm>
#include <limits>

#include "contact/geometry/surface_index.hpp"

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

bool behind(const Polyhedron& A, const Pose& a, const Polyhedron& B, const Pose& b, double gap) {
  for (const Vec3& n : normals(A, a))
    if (-support(B, b, -n) - support(A, a, n) > gap) return true;
  return false;
}

}  // namespace

bool apart(const Polyhedron& A, const Pose& a, const Polyhedron& B, const Pose& b, double gap) {
  const Vec3 line = b.c - a.c;
  if (const double distance = line.norm(); distance > 0)
    if (const Vec3 n = line / distance; - support(B, b, -n) - support(A, a, n) > gap) return true;
  return behind(A, a, B, b, gap) || behind(B, b, A, a, gap);
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
