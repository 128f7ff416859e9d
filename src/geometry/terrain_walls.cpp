#include "geometry/terrain_walls.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include "contact/geometry/plumb.hpp"
#include "geometry/mesh.hpp"

namespace talus::geometry {
namespace {

/// A side that only one triangle has, which lies left of a -> b seen from its outer side.
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
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
    return std::tie(x.low, x.high, x.side.triangle) < std::tie(y.low, y.high, y.side.triangle);
  });
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
    for (const int v : s.triangles[static_cast<std::size_t>(t)])
      out.vertices.push_back(s.vertices[static_cast<std::size_t>(v)]);
    out.triangles.push_back({first, first + 1, first + 2});
  }
  return out;
}

/// Faces that overhang.
std::vector<int> undersides_of(const TriangleSurface& s) {
  std::vector<int> out;
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    const auto& c = s.triangles[t];
    const Vec3 &a = s.vertices[static_cast<std::size_t>(c[0])],
               &b = s.vertices[static_cast<std::size_t>(c[1])],
               &d = s.vertices[static_cast<std::size_t>(c[2])];
    if ((b - a).cross(d - a).z() < 0) out.push_back(static_cast<int>(t));
  }
  return out;
}

/// Whether the rock behind a border side goes on below it: behind a face that faces up always, of one that
/// overhangs or stands upright at its lower edge alone.
bool goes_on_below(const TriangleSurface& s, const BorderSide& side) {
  constexpr double upright = 1e-6, lower = 0.1;  // sines
  const auto& c = s.triangles[static_cast<std::size_t>(side.triangle)];
  const Vec3& a = s.vertices[static_cast<std::size_t>(c[0])];
  const Vec3 n =
      (s.vertices[static_cast<std::size_t>(c[1])] - a).cross(s.vertices[static_cast<std::size_t>(c[2])] - a);
  if (n.z() > upright * n.norm()) return true;
  const Vec3 out =
      (s.vertices[static_cast<std::size_t>(side.b)] - s.vertices[static_cast<std::size_t>(side.a)]).cross(n);
  return out.z() < -lower * out.norm();
}

/// A point of a wall's lower edge: its place along the border side, from 0 at a to 1 at b, and its height;
/// -infinity: the bottom.
struct WallPoint {
  double s, z;
  bool operator==(const WallPoint&) const = default;
};

/// Where undersides lie below a border side the rock is no deeper than they are. The lower edge of its wall
/// from a to b; empty: all of it lies at the bottom.
std::vector<WallPoint> lower_edge(const TriangleSurface& surface, const std::vector<int>& undersides,
                                  const BorderSide& side, double nearly) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const Vec3 &a = surface.vertices[static_cast<std::size_t>(side.a)],
             &b = surface.vertices[static_cast<std::size_t>(side.b)];
  const Vec3 flat(b.x() - a.x(), b.y() - a.y(), 0), inward = Vec3(-flat.y(), flat.x(), 0);
  const double length_sq = flat.squaredNorm();
  // What the vertical plane just inside the border cuts of the undersides.
  std::vector<std::pair<WallPoint, WallPoint>> cuts;
  for (const int t : undersides) {
    if (t == side.triangle) continue;
    double place[3], off[3], z[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& x =
          surface.vertices[static_cast<std::size_t>(surface.triangles[static_cast<std::size_t>(t)][k])];
      place[k] = (x - a).dot(flat) / length_sq;
      off[k] = (x - a).dot(inward) / length_sq - nearly;
      z[k] = x.z();
    }
    if (std::max({place[0], place[1], place[2]}) <= 0 || std::min({place[0], place[1], place[2]}) >= 1)
      continue;
    std::vector<WallPoint> ends;
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3;
      if ((off[k] < 0) == (off[l] < 0)) continue;
      const double f = off[k] / (off[k] - off[l]);
      ends.push_back({place[k] + f * (place[l] - place[k]), z[k] + f * (z[l] - z[k])});
    }
    if (ends.size() == 2 && std::abs(ends[0].s - ends[1].s) > nearly) {
      if (ends[0].s > ends[1].s) std::swap(ends[0], ends[1]);
      cuts.emplace_back(ends[0], ends[1]);
    }
  }
  const auto top = [&](double s) { return a.z() + s * (b.z() - a.z()); };
  const auto at = [](const auto& cut, double s) {
    return cut.first.z + (s - cut.first.s) / (cut.second.s - cut.first.s) * (cut.second.z - cut.first.z);
  };
  std::vector<double> breaks{0, 1};
  for (const auto& cut : cuts)
    for (const double s : {cut.first.s, cut.second.s})
      if (s > 10 * nearly && s < 1 - 10 * nearly) breaks.push_back(s);
  std::sort(breaks.begin(), breaks.end());
  std::vector<WallPoint> edge;
  bool any = false;
  for (std::size_t i = 0; i + 1 < breaks.size(); ++i) {
    const double s0 = breaks[i], s1 = breaks[i + 1], middle = 0.5 * (s0 + s1);
    if (s1 - s0 < 10 * nearly) continue;
    const std::pair<WallPoint, WallPoint>* highest = nullptr;
    for (const auto& cut : cuts)
      if (cut.first.s < middle && middle < cut.second.s && at(cut, middle) < top(middle) &&
          (!highest || at(cut, middle) > at(*highest, middle)))
        highest = &cut;
    any = any || highest;
    for (const double s : {s0, s1}) {
      const WallPoint p{s, highest ? std::min(at(*highest, s), top(s)) : -infinity};
      if (edge.empty() || edge.back() != p) edge.push_back(p);
    }
  }
  return any ? edge : std::vector<WallPoint>{};
}

/// The wall between a border side and its lower edge. Points of that edge at one of the first `vertices` of
/// the surface are that vertex.
void add_wall(TriangleSurface& surface, const BorderSide& side, const std::vector<WallPoint>& lower,
              std::size_t vertices, double bottom) {
  const Vec3 a = surface.vertices[static_cast<std::size_t>(side.a)],
             b = surface.vertices[static_cast<std::size_t>(side.b)];
  const double same = 1e-4 * (b - a).norm();
  std::vector<int> loop{side.b, side.a};
  for (const WallPoint& p : lower) {
    const Vec3 flat = a + p.s * (b - a), x(flat.x(), flat.y(), std::max(p.z, bottom));
    int v = -1;
    for (std::size_t k = 0; k < vertices && v < 0; ++k)
      if ((surface.vertices[k] - x).squaredNorm() < same * same) v = static_cast<int>(k);
    if (v < 0) {
      v = static_cast<int>(surface.vertices.size());
      surface.vertices.push_back(x);
    }
    if (v != loop.back() && v != loop.front()) loop.push_back(v);
  }
  if (loop.size() < 3) return;
  const Vec3 outward = Vec3(b.y() - a.y(), a.x() - b.x(), 0).normalized();
  for (const auto& t : triangulate_polygon(surface.vertices, {loop}, outward)) surface.triangles.push_back(t);
}

}  // namespace

TriangleSurface with_border_walls(TriangleSurface surface, std::span<const Plane> planes, double bottom) {
  if (surface.two_sided) return surface;
  std::vector<BorderSide> border = border_of(surface);
  if (border.empty()) return surface;
  constexpr double nearly = 1e-6;  // of a side's length: beside it, and level with it
  const std::vector<int> undersides = undersides_of(surface);
  const contact::SurfaceIndex ground(undersides.empty() ? beside(surface, border) : surface);
  std::erase_if(border, [&](const BorderSide& side) {
    const Vec3 &a = surface.vertices[static_cast<std::size_t>(side.a)],
               &b = surface.vertices[static_cast<std::size_t>(side.b)], along = b - a;
    const Vec3 outward = Vec3(along.y(), -along.x(), 0);
    if (outward.norm() < nearly * along.norm()) return true;  // it is vertical: no wall has an area there
    if (!goes_on_below(surface, side)) return true;
    const Vec3 x = 0.5 * (a + b) + nearly * outward;
    const double level = x.z() - nearly * along.norm();
    const auto higher = [&](const Plane& p) { return p.normal.dot(Vec3(x.x(), x.y(), level) - p.point) < 0; };
    return contact::plumb_at(ground, {x.x(), x.y(), level}).solid ||
           std::any_of(planes.begin(), planes.end(), higher);
  });

  std::vector<int> leaving(surface.vertices.size(), 0), foot(surface.vertices.size(), -1);
  for (const BorderSide& side : border) ++leaving[static_cast<std::size_t>(side.a)];
  const auto below = [&](int v) {
    const auto k = static_cast<std::size_t>(v);
    if (foot[k] >= 0) return foot[k];
    const int added = static_cast<int>(surface.vertices.size());
    if (leaving[k] <= 1) foot[k] = added;  // where borders meet in a point each wall has its own
    const Vec3 top = surface.vertices[k];
    surface.vertices.emplace_back(top.x(), top.y(), bottom);
    return added;
  };
  const bool by_triangle = !surface.material.empty();
  const std::size_t vertices = surface.vertices.size();
  for (const BorderSide& side : border) {
    const std::size_t first = surface.triangles.size();
    if (const std::vector<WallPoint> lower = lower_edge(surface, undersides, side, nearly); lower.empty()) {
      const int a = below(side.a), b = below(side.b);
      surface.triangles.push_back({side.b, side.a, a});
      surface.triangles.push_back({side.b, a, b});
    } else {
      add_wall(surface, side, lower, vertices, bottom);
    }
    if (by_triangle)
      surface.material.insert(surface.material.end(), surface.triangles.size() - first,
                              surface.material[static_cast<std::size_t>(side.triangle)]);
  }
  return surface;
}

}  // namespace talus::geometry
