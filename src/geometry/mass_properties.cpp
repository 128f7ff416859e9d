#include "geometry/mass_properties.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "geometry/mesh.hpp"

namespace talus::geometry {

double signed_volume(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& triangles) {
  if (triangles.empty()) return 0;
  // Relative to a point of the body: coordinates far from the origin would cost digits otherwise.
  Box3 box;
  for (const auto& t : triangles)
    for (int v : t) box.extend(vertices[v]);
  const Vec3 o = box.center();
  double six_v = 0;
  for (const auto& t : triangles)
    six_v += (vertices[t[0]] - o).dot((vertices[t[1]] - o).cross(vertices[t[2]] - o));
  return six_v / 6;
}

namespace {

MassProperties integrate(const std::vector<Vec3>& vertices, const std::vector<std::array<int, 3>>& triangles,
                         double density) {
  if (!(density > 0))
    throw InputError(Problem{.key = "density",
                             .value = fmt::format("{}", density),
                             .rule = "must be positive",
                             .remedy = "give the density in kg/m^3"});
  MassProperties p;
  for (const Vec3& v : vertices) p.bounds.extend(v);
  // First pass about the middle of the box, for V and c; second pass about c, so that S loses no digits.
  const auto pass = [&](const Vec3& o, double& v, Vec3& first, Mat3& second) {
    v = 0;
    first.setZero();
    second.setZero();
    for (const auto& t : triangles) {
      const Vec3 a = vertices[t[0]] - o, b = vertices[t[1]] - o, d = vertices[t[2]] - o, s = a + b + d;
      const double det = a.dot(b.cross(d));
      v += det;
      first += det * s;
      second += det * (s * s.transpose() + a * a.transpose() + b * b.transpose() + d * d.transpose());
    }
    v /= 6;
    first /= 24;
    second /= 120;
  };
  Vec3 first;
  Mat3 second;
  const Vec3 middle = p.bounds.center();
  pass(middle, p.volume, first, second);
  p.centroid = middle + first / p.volume;
  double again;
  pass(p.centroid, again, first, second);
  const Vec3 rest = first / p.volume;  // round-off of the first pass
  p.centroid += rest;
  p.mass = density * p.volume;
  p.second_moment = density * (second - p.volume * rest * rest.transpose());
  p.second_moment = 0.5 * (p.second_moment + p.second_moment.transpose()).eval();
  return p;
}

}  // namespace

MassProperties mass_properties(const std::vector<Vec3>& vertices,
                               const std::vector<std::array<int, 3>>& triangles, double density) {
  const Mesh mesh{vertices, triangles, {}, {}};
  if (auto problems = closed_mesh_problems(mesh, "", false); !problems.empty())
    throw InputError(std::move(problems));
  return integrate(vertices, triangles, density);
}

MassProperties mass_properties(const Polyhedron& block, double density) {
  return integrate(block.vertices, block.triangles, density);
}

double volume(const Polyhedron& block) { return signed_volume(block.vertices, block.triangles); }

Box3 bounding_box(const Polyhedron& block) {
  Box3 box;
  for (const Vec3& v : block.vertices) box.extend(v);
  return box;
}

Vec3 place_within(const Polyhedron& block) {
  if (block.convex) return Vec3::Zero();
  const auto& x = block.vertices;
  const auto twice_area = [&](const std::array<int, 3>& t) {
    return Vec3((x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]));
  };
  const auto largest =
      std::max_element(block.triangles.begin(), block.triangles.end(), [&](const auto& a, const auto& b) {
        return twice_area(a).squaredNorm() < twice_area(b).squaredNorm();
      });
  const Vec3 from = (x[(*largest)[0]] + x[(*largest)[1]] + x[(*largest)[2]]) / 3,
             inward = -twice_area(*largest).normalized();
  double way = std::numeric_limits<double>::infinity();
  for (auto t = block.triangles.begin(); t != block.triangles.end(); ++t) {
    const Vec3 n = twice_area(*t);
    const double along = n.dot(inward);
    if (t == largest || !(along > 0)) continue;  // it leaves through what looks that way
    const double s = n.dot(x[(*t)[0]] - from) / along;
    const Vec3 p = from + s * inward;
    bool within = s > 0;
    for (int k = 0; k < 3 && within; ++k) {
      const Vec3 &a = x[(*t)[k]], &b = x[(*t)[(k + 1) % 3]];
      within = n.dot((b - a).cross(p - a)) >= 0;
    }
    if (within) way = std::min(way, s);
  }
  return std::isfinite(way) ? Vec3(from + 0.5 * way * inward) : Vec3::Zero();
}

}  // namespace talus::geometry
