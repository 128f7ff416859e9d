#include "geometry/terrain_walls.hpp"

#include <algorithm>
#include <array>
#include <tuple>
#include <vector>

#include "contact/detect.hpp"

namespace talus::geometry {
namespace {

/// A side that only one triangle has, which lies left of a -> b seen from above.
struct BorderSide {
  int a, b, triangle;
};

std::vector<BorderSide> border_of(const TriangleSurface& s) {
  struct Side {
    int low, high;
    BorderSide side;
  };
  std::vector<Side> sides;
  sides.reserve(3 * s.triangles.size());
  for (std::size_t t = 0; t < s.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = s.triangles[t][k], b = s.triangles[t][(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), {a, b, static_cast<int>(t)}});
    }
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) { return std::tie(x.low, x.high, x.side.triangle) < std::tie(y.low, y.high, y.side.triangle); });
  std::vector<BorderSide> border;
  for (std::size_t i = 0, j = 0; i < sides.size(); i = j) {
    for (j = i + 1; j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high;) ++j;
    if (j == i + 1) border.push_back(sides[i].side);
  }
  return border;
}

/// The triangles along the border: what may go on beyond a side of it has its own border there.
TriangleSurface beside(const TriangleSurface& s, const std::vector<BorderSide>& border) {
  std::vector<int> triangles;
  for (const BorderSide& side : border) triangles.push_back(side.triangle);
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  TriangleSurface out;
  for (const int t : triangles) {
    const int first = static_cast<int>(out.vertices.size());
    for (const int v : s.triangles[static_cast<std::size_t>(t)]) out.vertices.push_back(s.vertices[static_cast<std::size_t>(v)]);
    out.triangles.push_back({first, first + 1, first + 2});
  }
  return out;
}

}  // namespace

TriangleSurface with_border_walls(TriangleSurface surface, std::span<const Plane> planes, double bottom) {
  if (surface.two_sided) return surface;
  std::vector<BorderSide> border = border_of(surface);
  if (border.empty()) return surface;
  constexpr double nearly = 1e-6;   // of a side's length: beside it, and level with it
  const contact::SurfaceIndex strip(beside(surface, border));
  std::erase_if(border, [&](const BorderSide& side) {
    const Vec3 &a = surface.vertices[static_cast<std::size_t>(side.a)], &b = surface.vertices[static_cast<std::size_t>(side.b)], along = b - a;
    const Vec3 outward = Vec3(along.y(), -along.x(), 0);
    if (outward.norm() < nearly * along.norm()) return true;   // it is vertical: no wall has an area there
    const Vec3 x = 0.5 * (a + b) + nearly * outward;
    const double level = x.z() - nearly * along.norm();
    const auto higher = [&](const Plane& p) { return p.normal.dot(Vec3(x.x(), x.y(), level) - p.point) < 0; };
    return strip.height(x.x(), x.y()) > level || std::any_of(planes.begin(), planes.end(), higher);
  });

  std::vector<int> leaving(surface.vertices.size(), 0), foot(surface.vertices.size(), -1);
  for (const BorderSide& side : border) ++leaving[static_cast<std::size_t>(side.a)];
  const auto below = [&](int v) {
    const auto k = static_cast<std::size_t>(v);
    if (foot[k] >= 0) return foot[k];
    const int added = static_cast<int>(surface.vertices.size());
    if (leaving[k] <= 1) foot[k] = added;   // where borders meet in a point each wall has its own
    const Vec3 top = surface.vertices[k];
    surface.vertices.emplace_back(top.x(), top.y(), bottom);
    return added;
  };
  const bool by_triangle = !surface.material.empty();
  for (const BorderSide& side : border) {
    const int a = below(side.a), b = below(side.b);
    surface.triangles.push_back({side.b, side.a, a});
    surface.triangles.push_back({side.b, a, b});
    if (by_triangle) surface.material.insert(surface.material.end(), 2, surface.material[static_cast<std::size_t>(side.triangle)]);
  }
  return surface;
}

}  // namespace talus::geometry
