#include "geometry/free_path.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace talus::geometry {
namespace {

using Triangle = std::array<Vec3, 3>;  // across, across, along

double plan_cross(const Vec3& a, const Vec3& b) { return a.x() * b.y() - a.y() * b.x(); }

/// The least and the largest of three corners in one coordinate.
std::pair<double, double> range(const Triangle& t, int k) { return std::minmax({t[0][k], t[1][k], t[2][k]}); }

bool apart(const Triangle& a, const Triangle& b) {
  for (int k = 0; k < 2; ++k) {
    const auto [a0, a1] = range(a, k);
    const auto [b0, b1] = range(b, k);
    if (a1 < b0 || b1 < a0) return true;
  }
  return false;
}

/// Where the line through p along the direction meets the triangle; NaN beside it and where the triangle is
/// seen edge on.
double height_at(const Triangle& t, const Vec3& p) {
  const double area = plan_cross(t[1] - t[0], t[2] - t[0]);
  if (area == 0) return std::numeric_limits<double>::quiet_NaN();
  double height = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &a = t[(i + 1) % 3], &b = t[(i + 2) % 3];
    const double weight = plan_cross(a - p, b - p) / area;
    if (weight < 0) return std::numeric_limits<double>::quiet_NaN();
    height += weight * t[i].z();
  }
  return height;
}

class Way {
 public:
  explicit Way(double behind) : behind_(behind) {}
  void offer(double gap) {
    if (gap >= behind_ && gap < least_) least_ = gap;
  }
  double least() const { return least_; }

 private:
  double behind_;
  double least_ = std::numeric_limits<double>::infinity();
};

void between_edges(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1, Way& way) {
  const Vec3 a = a1 - a0, b = b1 - b0, d = b0 - a0;
  const double det = plan_cross(a, b);
  if (det == 0) return;
  const double s = plan_cross(d, b) / det, t = plan_cross(d, a) / det;
  if (s < 0 || s > 1 || t < 0 || t > 1) return;
  way.offer(b0.z() + t * b.z() - a0.z() - s * a.z());
}

void between(const Triangle& body, const Triangle& skin, Way& way) {
  for (std::size_t i = 0; i < 3; ++i) {
    way.offer(height_at(skin, body[i]) - body[i].z());
    way.offer(skin[i].z() - height_at(body, skin[i]));
    for (std::size_t j = 0; j < 3; ++j)
      between_edges(body[i], body[(i + 1) % 3], skin[j], skin[(j + 1) % 3], way);
  }
}

/// Solid angle of a closed triangulated surface seen from x over 4 pi: 1 inside, 0 outside [vanoosterom1983].
double winding(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& triangles,
               const Vec3& x) {
  double sum = 0;
  for (const auto& t : triangles) {
    const Vec3 a = vertices[static_cast<std::size_t>(t[0])] - x,
               b = vertices[static_cast<std::size_t>(t[1])] - x,
               c = vertices[static_cast<std::size_t>(t[2])] - x;
    const double na = a.norm(), nb = b.norm(), nc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), na * nb * nc + a.dot(b) * nc + b.dot(c) * na + c.dot(a) * nb);
  }
  return sum / (4 * M_PI);
}

}  // namespace

double free_path(const Polyhedron& body, const Pose& pose, const TriangleSurface& surface,
                 const Vec3& direction) {
  Mat3 frame;
  frame.row(2) = direction.transpose();
  frame.row(0) = direction.unitOrthogonal().transpose();
  frame.row(1) = direction.cross(frame.row(0).transpose()).transpose();
  std::vector<Triangle> bodies;
  Box3 across;
  for (const auto& t : body.triangles) {
    Triangle corners;
    for (std::size_t i = 0; i < 3; ++i) {
      corners[i] = frame * (pose.world(body.vertices[static_cast<std::size_t>(t[i])]) - pose.c);
      across.extend(corners[i]);
    }
    bodies.push_back(corners);
  }
  Way way(-1e-9 * body.radius);
  for (const auto& t : surface.triangles) {
    Triangle skin;
    for (std::size_t i = 0; i < 3; ++i)
      skin[i] = frame * (surface.vertices[static_cast<std::size_t>(t[i])] - pose.c);
    const auto [u0, u1] = range(skin, 0);
    const auto [v0, v1] = range(skin, 1);
    if (u1 < across.min().x() || u0 > across.max().x() || v1 < across.min().y() || v0 > across.max().y())
      continue;
    for (const Triangle& corners : bodies)
      if (!apart(corners, skin)) between(corners, skin, way);
  }
  return way.least();
}

bool one_inside_other(const Polyhedron& body, const Pose& pose, const TriangleSurface& surface) {
  std::vector<Vec3> corners;
  for (const Vec3& x : body.vertices) corners.push_back(pose.world(x));
  return winding(surface.vertices, surface.triangles, corners[0]) > 0.5 ||
         winding(corners, body.triangles, surface.vertices[0]) > 0.5;
}

bool corner_inside(const Polyhedron& body, const Pose& pose, const TriangleSurface& surface) {
  std::vector<Vec3> corners;
  Box3 of_body, of_surface;
  for (const Vec3& x : body.vertices) corners.push_back(pose.world(x)), of_body.extend(corners.back());
  for (const Vec3& x : surface.vertices) of_surface.extend(x);
  const auto inside_surface = [&](const Vec3& x) {
    return of_surface.contains(x) && winding(surface.vertices, surface.triangles, x) > 0.5;
  };
  const auto inside_body = [&](const Vec3& x) {
    return of_body.contains(x) && winding(corners, body.triangles, x) > 0.5;
  };
  return std::ranges::any_of(corners, inside_surface) || std::ranges::any_of(surface.vertices, inside_body);
}

}  // namespace talus::geometry
