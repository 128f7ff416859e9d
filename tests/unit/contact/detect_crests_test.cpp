// Blocks on crests of the ground, beside the crests' corners.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "contact/geometry/surface_index.hpp"
#include "local_contacts.hpp"

namespace talus::contact::testing {
namespace {

/// A box on a level crest, one side of it beside a corner of the crest: however near that is, and however
/// deep it has sunk, it is held upwards by what it has sunk.
TEST(SurfaceContact, ABoxOnACrestIsHeldHoweverNearTheCrestsCorner) {
  TriangleSurface
      s;  // a roof along x, with a corner of its crest at the origin, off to the side a little beyond
  s.vertices = {{-4, 0, 0},  {0, 0, 0},   {4, 0.7, 0}, {-4, -3, -2}, {0, -3, -2.5},
                {4, -3, -2}, {-4, 3, -2}, {0, 3, -2},  {4, 4, -2.2}};
  s.triangles = {{3, 4, 1}, {3, 1, 0}, {4, 5, 2}, {4, 2, 1}, {0, 1, 7}, {0, 7, 6}, {1, 2, 8}, {1, 8, 7}};
  const SurfaceIndex index(s);
  const Polyhedron& block = cube;
  for (const double depth : {1e-9, 6e-9, 1e-7, 1e-5, 1e-3})
    for (const double off : {0.0, 1e-12, 1e-10, 3e-10, 6e-10, 1e-9, 2e-9, 5e-9, 1e-8, 1e-6, 1e-4, 1e-2,
                             -1e-12, -1e-10, -1e-9, -2e-9, -1e-8, -1e-6, -1e-4})
      for (const double side : {1.0, -1.0})
        for (const double turn : {0.0, 0.3, 0.7}) {
          // Its side at x = off, out to where the crest goes on.
          const Mat3 R = Eigen::AngleAxisd(side > 0 ? turn : M_PI + turn, Vec3::UnitZ()).toRotationMatrix();
          const Vec3 centre = R * Vec3(0.5 + off, 0.1, 0) + Vec3(0, 0, 0.5 - depth);
          std::vector<ContactPoint> points;
          surface_block(index, block, {centre, R}, 1e-2, points);
          const bool held = std::ranges::any_of(points, [&](const ContactPoint& p) {
            return p.normal.z() > 0.99 && p.point_a.norm() < 0.05 &&
                   std::abs(p.gap + depth) < 1e-2 * depth + 1e-12;
          });
          EXPECT_TRUE(held) << "depth " << depth << ", beside " << off << ", side " << side << ", turn "
                            << turn;
        }
}

/// A sphere of n x 2 n faces whose corners lie in and out by `rough`.
Polyhedron rough_sphere(int n, double rough, std::mt19937& rng) {
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<Vec3> x{Vec3(0, 0, 1)};
  for (int i = 1; i < n; ++i)
    for (int k = 0; k < 2 * n; ++k) {
      const double polar = std::numbers::pi * i / n, azimuth = std::numbers::pi * (k + 0.5 * i) / n;
      x.push_back((1 + rough * u(rng)) * Vec3(std::sin(polar) * std::cos(azimuth),
                                              std::sin(polar) * std::sin(azimuth), std::cos(polar)));
    }
  x.push_back(Vec3(0, 0, -1));
  Triangles faces;
  const auto at = [n](int i, int k) { return 1 + 2 * n * (i - 1) + k % (2 * n); };
  for (int k = 0; k < 2 * n; ++k) {
    faces.push_back({0, at(1, k), at(1, k + 1)});
    faces.push_back({static_cast<int>(x.size()) - 1, at(n - 1, k + 1), at(n - 1, k)});
    for (int i = 1; i + 1 < n; ++i) {
      faces.push_back({at(i, k), at(i + 1, k), at(i, k + 1)});
      faces.push_back({at(i, k + 1), at(i + 1, k), at(i + 1, k + 1)});
    }
  }
  return make_polyhedron(x, faces);
}

TEST(SurfaceContact, NothingOfAScanOnARoofIsMissedThatIsWithinTheMargin) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> u(-1, 1);
  const Polyhedron scan = rough_sphere(20, 0.05, rng);
  std::size_t corners = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const double slope = 0.6 * u(rng);  // a roof, or a valley
    TriangleSurface roof;
    roof.vertices = {{-3, -9, -3 * slope}, {0, -9, 0}, {3, -9, -3 * slope},
                     {-3, 9, -3 * slope},  {0, 9, 0},  {3, 9, -3 * slope}};
    roof.triangles = {{0, 1, 3}, {1, 4, 3}, {1, 2, 4}, {2, 5, 4}};
    const SurfaceIndex index(roof);
    const Vec3 normals[] = {Vec3(-slope, 0, 1).normalized(), Vec3(slope, 0, 1).normalized()};
    const auto ahead = [&](const Vec3& x) { return normals[x.x() > 0 ? 1 : 0].dot(x); };
    const Mat3 R = random_rotation(rng);
    Vec3 c(0.8 * u(rng), u(rng), 0);
    for (int pass = 0; pass < 40; ++pass) {  // until it touches with a corner
      double least = 9;
      for (const Vec3& x : scan.vertices) least = std::min(least, ahead(c + R * x));
      c.z() -= least;
    }
    const double margin = 0.02 + 0.02 * u(rng);
    std::set<int> found, expected;
    for (const ContactPoint& p : on(index, scan, {c + Vec3(0, 0, 1e-6), R}, margin))
      if (form_of(p.key) == Form::face_vertex) found.insert(features_of(p.key).second);
    for (int v = 0; v < static_cast<int>(scan.vertices.size()); ++v) {
      const Vec3 x = c + Vec3(0, 0, 1e-6) + R * scan.vertices[v];
      bool hangs = true;  // no edge falls from it
      for (int i = scan.vertex_edge_offset[v]; i < scan.vertex_edge_offset[v + 1]; ++i) {
        const auto& e = scan.edges[scan.vertex_edges[i]];
        const Vec3 other = R * (scan.vertices[e.v0 == v ? e.v1 : e.v0] - scan.vertices[v]);
        hangs = hangs && normals[x.x() > 0 ? 1 : 0].dot(other) > 1e-6;
      }
      if (hangs && std::abs(x.x()) > 0.05 && ahead(x) < 0.99 * margin) expected.insert(v);
    }
    corners += expected.size();
    EXPECT_TRUE(std::includes(found.begin(), found.end(), expected.begin(), expected.end())) << trial;
  }
  EXPECT_GT(corners, 60u);
}

}  // namespace
}  // namespace talus::contact::testing
