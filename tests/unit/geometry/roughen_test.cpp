// Roughness below the mesh, zones by parts of a mesh, and the axis that points up.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include "contact/geometry/plumb.hpp"
#include "core/error.hpp"
#include "geometry/terrain.hpp"

namespace talus::geometry {
namespace {

struct GroundFile {
  GroundFile(const std::string& name, const std::string& text)
      : path((std::filesystem::temp_directory_path() /
              ("talus_rough_" + std::to_string(::getpid()) + "_" + name))
                 .string()) {
    std::ofstream(path) << text;
  }
  ~GroundFile() { std::filesystem::remove(path); }
  std::string path;
};

/// A level square of 2 n x 2 n quads of 5 m; the western half of material 1, the eastern of 0.
TriangleSurface halves(int n) {
  TriangleSurface s;
  for (int j = 0; j <= 2 * n; ++j)
    for (int i = 0; i <= 2 * n; ++i) s.vertices.emplace_back(5.0 * (i - n), 5.0 * j, 0.0);
  const auto at = [&](int i, int j) { return j * (2 * n + 1) + i; };
  for (int j = 0; j < 2 * n; ++j)
    for (int i = 0; i < 2 * n; ++i) {
      s.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      s.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
      s.material.insert(s.material.end(), 2, i < n ? 1 : 0);
    }
  return s;
}

TEST(Roughen, MoreTrianglesThanThereMayBeAreRefusedBeforeTheyAreMade) {
  for (const double length : {1e-3, 1e-300}) {
    TriangleSurface s = halves(10);
    const Roughness rough{.material = 1, .amplitude = 0.3, .length = length, .seed = 4};
    EXPECT_THROW(roughen(s, std::span(&rough, 1), Vec3::Zero()), InputError);
    EXPECT_EQ(s.triangles.size(), halves(10).triangles.size());
  }
}

TEST(Roughen, HasItsMeanAndDeviationAndLeavesSmoothFacesAlone) {
  TriangleSurface s = halves(10);
  const Roughness rough{.material = 1, .amplitude = 0.3, .length = 2, .seed = 4};
  roughen(s, std::span(&rough, 1), Vec3::Zero());
  double sum = 0, squares = 0, longest = 0;
  int n = 0;
  std::map<std::pair<int, int>, int> edges;
  for (std::size_t t = 0; t < s.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = s.triangles[t][static_cast<std::size_t>(k)],
                b = s.triangles[t][static_cast<std::size_t>((k + 1) % 3)];
      ++edges[std::minmax(a, b)];
      const Vec3 &p = s.vertices[static_cast<std::size_t>(a)], &q = s.vertices[static_cast<std::size_t>(b)];
      if (s.material[t] == 1)
        longest = std::max(longest, (p - q).head<2>().norm());
      else
        EXPECT_EQ(p.z(), 0);
    }
  for (const auto& [edge, faces] : edges) EXPECT_LE(faces, 2);
  for (const Vec3& v : s.vertices) {
    if (v.x() > -1) continue;
    sum += v.z(), squares += v.z() * v.z(), ++n;
  }
  EXPECT_LE(longest, rough.length / 3 * (1 + 1e-9));
  EXPECT_NEAR(
      sum / n, 0,
      0.03);  // of 25 x 50 lattice cells: 0.3 / sqrt(1250) = 0.008, the better part of four deviations
  EXPECT_NEAR(std::sqrt(squares / n) / rough.amplitude, 1, 0.08);
  // The area in plan is that of before: no gap, no fold.
  double area = 0;
  for (const auto& t : s.triangles) {
    const auto p = [&](int k) {
      return Eigen::Vector2d(s.vertices[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])].head<2>());
    };
    const Eigen::Vector2d u = p(1) - p(0), v = p(2) - p(0);
    EXPECT_GT(u.x() * v.y() - u.y() * v.x(), 0);
    area += 0.5 * (u.x() * v.y() - u.y() * v.x());
  }
  EXPECT_NEAR(area, 100.0 * 100.0, 1e-6);
}

TEST(Roughen, GoesByMapCoordinatesAndSeed) {
  TriangleSurface s = halves(2), moved = s;
  for (Vec3& v : moved.vertices) v.x() += 10;
  const Roughness rough{.material = 1, .amplitude = 0.3, .length = 2, .seed = 4};
  roughen(s, std::span(&rough, 1), Vec3(100, 0, 0));
  roughen(moved, std::span(&rough, 1), Vec3(90, 0, 0));
  ASSERT_EQ(s.vertices.size(), moved.vertices.size());
  for (std::size_t k = 0; k < s.vertices.size(); ++k)
    EXPECT_NEAR(s.vertices[k].z(), moved.vertices[k].z(), 1e-9);
  EXPECT_NE(rough_height(4, 0.3, 0.4), rough_height(5, 0.3, 0.4));
}

TEST(Parts, SolidsGroupsAndFilesAreZones) {
  const auto facet = [](double x) {
    const std::string a = std::to_string(x), b = std::to_string(x + 1);
    return "facet normal 0 0 1\nouter loop\nvertex " + a + " 0 0\nvertex " + b + " 0 0\nvertex " + b +
           " 1 0\nendloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex " + a + " 0 0\nvertex " + b +
           " 1 0\nvertex " + a + " 1 0\nendloop\nendfacet\n";
  };
  const GroundFile stl("two.stl", "solid hard\n" + facet(0) + "endsolid hard\nsolid soft ground\n" +
                                      facet(1) + "endsolid soft ground\n");
  TerrainOptions o;
  o.material_areas = {{.polygon_file = {},
                       .raster_file = {},
                       .value = 0,
                       .material = 3,
                       .part = "soft ground",
                       .mesh_file = {}}};
  const Terrain t = load_terrain(stl.path, o);
  const auto area_of = [](const Terrain& terrain, int material, bool east) {
    int n = 0;
    for (std::size_t k = 0; k < terrain.surface.triangles.size(); ++k) {
      double x = 0;
      for (const int v : terrain.surface.triangles[k])
        x += terrain.surface.vertices[static_cast<std::size_t>(v)].x() / 3;
      n += terrain.surface.material[k] == material && (x > 1) == east;
    }
    return n;
  };
  EXPECT_EQ(area_of(t, 3, true), 2);
  EXPECT_EQ(area_of(t, 0, false), 2);
  o.material_areas[0].part = "sand";
  EXPECT_THROW(load_terrain(stl.path, o), InputError);
  const GroundFile obj(
      "two.obj",
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\ng hard\nf 1 2 3 4\ng soft\nf 2 5 6 3\n");
  o.material_areas[0].part = "soft";
  EXPECT_EQ(area_of(load_terrain(obj.path, o), 3, true), 2);
  const GroundFile west("west.stl", "solid a\n" + facet(0) + "endsolid a\n"),
      east("east.stl", "solid b\n" + facet(1) + "endsolid b\n");
  o.material_areas[0].part.clear();
  o.material_areas[0].mesh_file = east.path;
  for (const bool whole : {true, false}) {
    if (!whole)
      o.material_areas.push_back({.polygon_file = {},
                                  .raster_file = {},
                                  .value = 0,
                                  .material = 0,
                                  .part = {},
                                  .mesh_file = west.path});
    const Terrain joined = load_terrain(whole ? west.path : "", o);
    EXPECT_EQ(area_of(joined, 3, true), 2);
    EXPECT_EQ(area_of(joined, 0, false), 2);
    EXPECT_EQ(joined.surface.vertices.size(), 6u);  // the seam is one
  }
}

TEST(Parts, ASheetThatIsTurnedHasNoMoreHolesThanItHad) {
  TriangleSurface s = halves(3);
  for (auto& t : s.triangles) std::swap(t[1], t[2]);  // faces down
  const Terrain whole = make_terrain(s.vertices, s.triangles, {}, "whole");
  for (const Problem& p : whole.warnings) EXPECT_EQ(p.value.find("hole"), std::string::npos) << p.value;
  s.triangles.erase(s.triangles.begin() + 14, s.triangles.begin() + 16);  // a quad within
  const Terrain open = make_terrain(s.vertices, s.triangles, {}, "open");
  EXPECT_EQ(std::count_if(open.warnings.begin(), open.warnings.end(),
                          [](const Problem& p) { return p.value == "1 hole"; }),
            1);
}

TEST(Parts, AWallStandsInTheGroundOfAGrid) {
  // Ground that rises from 0 to 10 m to the north; a wall up to 12 m, whose foot lies in the ground.
  std::string grid = "ncols 21\nnrows 21\nxllcorner 999\nyllcorner -1\ncellsize 2\n";
  for (int i = 0; i < 21; ++i)
    for (int j = 0; j < 21; ++j) grid += std::to_string(10 - 0.5 * i) + (j < 20 ? " " : "\n");
  const GroundFile asc("grid.asc", grid);
  const GroundFile wall(
      "wall.obj",
      "v 1005 5 -5\nv 1030 5 -5\nv 1030 8 -5\nv 1005 8 -5\nv 1005 6 12\nv 1030 6 12\nv 1030 7 "
      "12\nv 1005 7 12\n"
      "f 4 3 2 1\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 4 1 5 8\nf 5 6 7 8\n");
  TerrainOptions o;
  o.origin = Vec3(1000, 0, 0);
  o.material_areas = {
      {.polygon_file = {}, .raster_file = {}, .value = 0, .material = 3, .part = {}, .mesh_file = wall.path}};
  const Terrain t = load_terrain(asc.path, o);
  EXPECT_EQ(t.surface.triangles.size(), 800u + 12 - 2);  // its foot is left out
  EXPECT_EQ(std::count(t.surface.material.begin(), t.surface.material.end(), 3), 10);
  for (const Problem& p : t.warnings) EXPECT_EQ(p.rule.find("no part"), std::string::npos) << p.rule;
  const contact::SurfaceIndex index(t.surface);
  EXPECT_NEAR(contact::plumb_at(index, Vec3(20, 6.5, 50)).floor, 12, 1e-9);
  EXPECT_TRUE(contact::plumb_at(index, Vec3(20, 6.5, 8)).solid);
  EXPECT_TRUE(contact::plumb_at(index, Vec3(20, 6.5, -8)).solid);
  EXPECT_NEAR(contact::plumb_at(index, Vec3(20, 20, 50)).floor, 5, 1e-9);
  EXPECT_FALSE(contact::plumb_at(index, Vec3(20, 20, 5.5)).solid);
}

TEST(Parts, AnotherAxisPointsUp) {
  // A step of 2 m at x = 1 in a file whose y points up.
  const GroundFile file("up.obj",
                        "v 0 0 0\nv 1 0 0\nv 1 0 -4\nv 0 0 -4\nv 2 2 0\nv 2 2 -4\nf 1 2 3 4\nf 2 5 6 3\n");
  TerrainOptions o;
  o.up = 'y';
  const Terrain t = load_terrain(file.path, o);
  Box3 box;
  for (const Vec3& v : t.surface.vertices) box.extend(v);
  EXPECT_EQ(box.min(), Vec3(0, 0, 0));
  EXPECT_EQ(box.max(), Vec3(2, 4, 2));
}

}  // namespace
}  // namespace talus::geometry
