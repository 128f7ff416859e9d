#include "geometry/shape.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>

#include "core/error.hpp"
#include "geometry/mass_properties.hpp"
#include "geometry/mesh.hpp"

using namespace talus;
using namespace talus::geometry;

TEST(Shape, VolumesHaveTheirClosedForms) {
  const double g = std::numbers::phi;
  struct Case {
    const char* kind;
    Vec3 size;
    double volume;
    int faces;
  };
  // Full extents of the regular solids of edge 1: icosahedron phi, dodecahedron phi^2.
  const std::vector<Case> cases = {
      {"box", {4, 5, 5.75}, 115, 6},
      {"tetrahedron", {1, 1, 1}, 1.0 / 3, 4},
      {"icosahedron", Vec3::Constant(g), 5 * (3 + std::sqrt(5)) / 12, 20},
      {"dodecahedron", Vec3::Constant(g * g), (15 + 7 * std::sqrt(5)) / 4, 12},
      {"EOTA111", {1, 1.5, 2}, 17.0 / 24 * 3, 26},
      {"EOTA221", {2, 2, 1}, 17.0 / 24 * 4, 26},
  };
  for (const Case& c : cases) {
    ShapeSpec s;
    s.kind = c.kind;
    s.size = c.size;
    const Shape shape = make_shape_with_shift(s);
    EXPECT_NEAR(shape.volume, c.volume, 1e-12 * c.volume) << c.kind;
    EXPECT_EQ(shape.body.faces(), c.faces) << c.kind;
    EXPECT_TRUE(shape.body.convex) << c.kind;
    EXPECT_NEAR((bounding_box(shape.body).sizes() - c.size).norm(), 0, 1e-12) << c.kind;
    EXPECT_NEAR(mass_properties(shape.body, 1).centroid.norm(), 0, 1e-14) << c.kind;
    const int euler = static_cast<int>(shape.body.vertices.size()) -
                      static_cast<int>(shape.body.edges.size()) + shape.body.faces();
    EXPECT_EQ(euler, 2) << c.kind;
  }
}

TEST(Shape, SphereOfLongitudesAndLatitudes) {
  for (int n = 4; n <= 7; ++n) {
    ShapeSpec s;
    s.kind = "sphere";
    s.longitudes = s.latitudes = n;
    s.diameter = 3;
    const Shape shape = make_shape_with_shift(s);
    EXPECT_EQ(static_cast<int>(shape.body.vertices.size()), n * n + 2);
    EXPECT_EQ(shape.body.faces(), n * (n + 1));
    EXPECT_NEAR(shape.body.radius, 1.5, 1e-12);
  }
}

TEST(Shape, VolumeOrMassScales) {
  ShapeSpec s;
  s.kind = "EOTA221";
  s.mass = 800;
  s.density = 2700;
  const Shape shape = make_shape_with_shift(s);
  EXPECT_NEAR(mass_properties(shape.body, 2700).mass, 800, 1e-9);
  const Vec3 size = bounding_box(shape.body).sizes();
  EXPECT_NEAR(size.x() / size.z(), 2, 1e-12);
  s.volume = 1;
  EXPECT_THROW(make_shape(s), InputError);
}

TEST(Shape, RandomRocksRepeatAndMeetTheirVolume) {
  for (const char* kind : {"random-convex", "random-concave"})
    for (unsigned seed = 0; seed < 10; ++seed) {
      ShapeSpec s;
      s.kind = kind;
      s.seed = seed;
      s.volume = 2.5;
      s.aspect = {3, 2, 1};
      const Shape a = make_shape_with_shift(s), b = make_shape_with_shift(s);
      EXPECT_EQ(a.body.vertices, b.body.vertices);
      EXPECT_NEAR(a.volume, 2.5, 1e-10);
      const Vec3 size = bounding_box(a.body).sizes();
      EXPECT_NEAR(size.x() / size.z(), 3, 1e-9);
      EXPECT_EQ(a.body.convex, std::string(kind) == "random-convex") << kind << seed;
      Mesh mesh{a.body.vertices, a.body.triangles, {}, {}};
      EXPECT_TRUE(closed_mesh_problems(mesh, "").empty());
    }
}

TEST(Shape, FileKeepsItsWorldCoordinatesThroughTheShift) {
  const Mesh box = convex_hull({{10, 20, 30}, {12, 20, 30}, {10, 23, 30}, {10, 20, 34}});
  const std::string path =
      (std::filesystem::temp_directory_path() / ("talus_shape_" + std::to_string(::getpid()) + ".obj"))
          .string();
  write_mesh(path, box);
  ShapeSpec s;
  s.kind = "file";
  s.file = path;
  const Shape shape = make_shape_with_shift(s);
  EXPECT_NEAR((shape.shift - Vec3(10.5, 20.75, 31)).norm(), 0, 1e-12);
  Box3 bounds = bounding_box(shape.body);
  EXPECT_NEAR((bounds.min() + shape.shift - Vec3(10, 20, 30)).norm(), 0, 1e-12);
  std::filesystem::remove(path);
}

TEST(Shape, BadInputNamesTheField) {
  const auto key = [](const ShapeSpec& s) {
    try {
      make_shape(s);
    } catch (const InputError& e) { return e.problems()[0].key; }
    return std::string("accepted");
  };
  ShapeSpec s;
  EXPECT_EQ(key(s), "size");
  s.size = {1, -1, 1};
  EXPECT_EQ(key(s), "size");
  s.kind = "boxx";
  EXPECT_EQ(key(s), "shape");
  s.kind = "convex";
  s.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  EXPECT_EQ(key(s), "vertices");
  s = {};
  s.mass = 10;
  EXPECT_EQ(key(s), "density");
}
