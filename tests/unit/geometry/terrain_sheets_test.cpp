#include "geometry/terrain_sheets.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "contact/geometry/plumb.hpp"
#include "geometry/precision.hpp"
#include "geometry/terrain.hpp"

using namespace talus;
using namespace talus::geometry;

namespace {

using Triangles = std::vector<std::array<int, 3>>;

/// A plateau at z = 10, a wall that leans out by 1 m in 10 over x = 0, and a floor at z = 0.
struct Cliff {
  std::vector<Vec3> vertices{{-10, -10, 10}, {-10, 10, 10}, {1, -10, 10}, {1, 10, 10},
                             {0, -10, 0},    {0, 10, 0},    {30, -10, 0}, {30, 10, 0}};
  Triangles triangles{{0, 2, 3}, {0, 3, 1}, {2, 4, 5}, {2, 5, 3}, {4, 6, 7}, {4, 7, 5}};
};

Triangles turned(Triangles triangles, unsigned seed) {
  std::mt19937 random(seed);
  for (auto& t : triangles)
    if (seed == 0 || random() % 2) std::swap(t[1], t[2]);
  return triangles;
}

Vec3 area_vector(const std::vector<Vec3>& v, const std::array<int, 3>& t) {
  return (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]);
}

bool warned_of(const std::vector<Problem>& warnings, const std::string& part) {
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const Problem& p) { return p.rule.find(part) != std::string::npos; });
}

}  // namespace

TEST(TerrainSheets, OverhangingFacesKeepTheirSide) {
  Cliff c;
  const Triangles given = c.triangles;
  EXPECT_TRUE(orient_sheets(c.vertices, c.triangles, "cliff.obj").empty());
  EXPECT_EQ(c.triangles, given);
  const Terrain terrain = make_terrain(c.vertices, c.triangles, {}, "cliff.obj");
  const Vec3 wall = area_vector(terrain.surface.vertices, terrain.surface.triangles[2]);
  EXPECT_GT(wall.x(), 0);
  EXPECT_LT(wall.z(), 0);
}

TEST(TerrainSheets, WindingInTheFileDoesNotMatter) {
  const Cliff c;
  for (unsigned seed = 0; seed < 20; ++seed) {  // 0: the whole sheet upside down
    Triangles t = turned(c.triangles, seed);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < t.size(); ++k) kept += t[k] == c.triangles[k];
    const auto warnings = orient_sheets(c.vertices, t, "cliff.obj");
    EXPECT_EQ(t, c.triangles) << seed;
    EXPECT_EQ(warned_of(warnings, "wound against their neighbours"), kept > 0 && kept < t.size()) << seed;
  }
}

TEST(TerrainSheets, EachSheetIsTurnedByItself) {
  Cliff c;
  const Triangles given = c.triangles;
  std::vector<Vec3> vertices = c.vertices;
  Triangles triangles = c.triangles;
  for (const Vec3& v : c.vertices) vertices.push_back(v + Vec3(100, 0, 0));
  for (const auto& t : turned(c.triangles, 0)) triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  const auto warnings = orient_sheets(vertices, triangles, "two.obj");
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].value, "2 pieces");
  for (std::size_t k = 0; k < given.size(); ++k) {
    EXPECT_EQ(triangles[k], given[k]);
    EXPECT_EQ(triangles[k + 6], (std::array<int, 3>{given[k][0] + 8, given[k][1] + 8, given[k][2] + 8}));
  }
}

/// No plan area tells the side of an upright wall: its winding in the file does, of most of its area.
TEST(TerrainSheets, AnUprightSheetKeepsTheWindingOfMostOfItsArea) {
  const std::vector<Vec3> v{{0, 0, 0}, {0, 5, 0}, {0, 5, 8}, {0, 0, 8}, {0, 9, 0}};
  const Triangles east{{0, 1, 2}, {0, 2, 3}, {1, 4, 2}};  // 20, 20 and 16 m^2
  for (const int flipped : {-1, 0, 1, 2}) {
    Triangles t = east;
    if (flipped >= 0) std::swap(t[flipped][1], t[flipped][2]);
    const auto warnings = orient_sheets(v, t, "wall.stl");
    EXPECT_EQ(t, east);
    EXPECT_TRUE(warned_of(warnings, "they face [1, 0, 0]"))
        << (warnings.empty() ? "none" : warnings[0].str());
  }
  Triangles west = turned(east, 0);
  const Triangles given = west;
  EXPECT_TRUE(warned_of(orient_sheets(v, west, "wall.stl"), "they face [-1, 0, 0]"));
  EXPECT_EQ(west, given);
}

TEST(TerrainSheets, AClosedSurfaceFacesOutward) {
  const std::vector<Vec3> v{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Triangles outward{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  for (unsigned seed = 0; seed < 8; ++seed) {
    Triangles t = turned(outward, seed);
    orient_sheets(v, t, "rock.stl");
    EXPECT_EQ(t, outward) << seed;
  }
}

TEST(TerrainSheets, AMoebiusStripIsNamedWithItsPlace) {
  constexpr int n = 24;
  std::vector<Vec3> v;
  Triangles t;
  for (int i = 0; i < n; ++i) {
    const double a = 2 * M_PI * i / n;
    const Vec3 out(std::cos(a), std::sin(a), 0),
        across = std::cos(a / 2) * out + std::sin(a / 2) * Vec3::UnitZ();
    v.push_back(10 * out - across);
    v.push_back(10 * out + across);
  }
  for (int i = 0; i < n; ++i) {
    const int a = 2 * i, b = 2 * i + 1, c = i + 1 < n ? 2 * i + 2 : 1, d = i + 1 < n ? 2 * i + 3 : 0;
    t.push_back({a, c, d});
    t.push_back({a, d, b});
  }
  const auto warnings = orient_sheets(v, t, "strip.obj", Vec3(1000, 2000, 0));
  ASSERT_TRUE(warned_of(warnings, "Moebius"));
  EXPECT_NE(warnings.back().value.find("an edge at [9"), std::string::npos)
      << warnings.back().value;  // map coordinates
}

TEST(TerrainSheets, EdgesOfMoreThanTwoFacesConnectNothing) {
  // A level sheet with a flap below it: the edge in the middle has three faces, and each half is a sheet of
  // its own.
  const std::vector<Vec3> v{{-1, 0, 0}, {0, 0, 0}, {0, 1, 0},    {-1, 1, 0},
                            {1, 0, 0},  {1, 1, 0}, {0.2, 0, -1}, {0.2, 1, -1}};
  Triangles t{{0, 1, 2}, {0, 2, 3}, {1, 2, 4}, {4, 2, 5}, {1, 2, 6}, {6, 2, 7}};
  const auto warnings = orient_sheets(v, t, "flap.obj");
  EXPECT_TRUE(warned_of(warnings, "more than two faces meet there"))
      << (warnings.empty() ? "none" : warnings[0].str());
  for (const auto& f : t) EXPECT_GT(area_vector(v, f).z(), 0);
}

TEST(TerrainSheets, RepeatedFacesAreLeftOut) {
  Cliff c;
  const Triangles given = c.triangles;
  c.triangles.push_back({4, 2, 5});
  EXPECT_TRUE(warned_of(orient_sheets(c.vertices, c.triangles, "cliff.obj"), "repeats"));
  EXPECT_EQ(c.triangles, given);
}

TEST(TerrainSheets, TheCropChangesNoSide) {
  // Of the wall and a strip of the floor more plan area would face down than up.
  const Cliff c;
  TerrainOptions o;
  o.crop = Box3(Vec3(0.2, -10, 0), Vec3(0.9, 10, 0));
  const Terrain t = make_terrain(c.vertices, c.triangles, o, "cliff.obj");
  EXPECT_LT(area_vector(t.surface.vertices, t.surface.triangles[2]).z(), 0);
}

TEST(TerrainSheets, DecimationKeepsOverhangs) {
  std::vector<Vec3> v;
  Triangles t;
  // The cliff in rows of 1 m across, the floor in columns of 1 m.
  std::vector<std::pair<double, double>> profile{{-10, 10}, {1, 10}, {0, 0}};
  for (int i = 1; i <= 30; ++i) profile.emplace_back(i, 0);
  for (const auto& [x, z] : profile)
    for (int j = 0; j <= 20; ++j) v.emplace_back(x, j, z);
  for (int i = 0; i + 1 < static_cast<int>(profile.size()); ++i)
    for (int j = 0; j < 20; ++j) {
      const int a = 21 * i + j, b = a + 21;
      t.push_back({a, b, b + 1});
      t.push_back({a, b + 1, a + 1});
    }
  TerrainOptions o;
  o.decimation_error = 0.01;
  const Terrain terrain = make_terrain(v, t, o, "cliff.obj");
  EXPECT_LT(terrain.surface.triangles.size(), t.size() / 2);
  double wall = 0;
  for (const auto& f : terrain.surface.triangles)
    if (const Vec3 n = area_vector(terrain.surface.vertices, f); n.z() < -1e-9) wall += 0.5 * n.norm();
  EXPECT_NEAR(wall, 20 * std::sqrt(101.0), 1e-9);
}

TEST(TerrainSheets, GroundIsTheFloorUnderAnOverhang) {
  const Cliff c;
  TriangleSurface s;
  s.vertices = c.vertices;
  s.triangles = c.triangles;
  const contact::SurfaceIndex index(s);
  const contact::Plumb under = contact::plumb_at(index, {0.5, 1, 2}),
                       in = contact::plumb_at(index, {0.5, 1, 8}),
                       behind = contact::plumb_at(index, {-5, 1, 4}),
                       above = contact::plumb_at(index, {0.5, 1, 12});
  EXPECT_FALSE(under.solid);
  EXPECT_NEAR(under.floor, 0, 1e-12);
  EXPECT_NEAR(under.above, 5, 1e-12);
  EXPECT_GE(under.triangle, 4);
  EXPECT_TRUE(in.solid);
  EXPECT_NEAR(in.floor, 10, 1e-12);
  EXPECT_TRUE(behind.solid);
  EXPECT_FALSE(above.solid);
  EXPECT_NEAR(above.floor, 10, 1e-12);
  EXPECT_NEAR(index.height(0.5, 1), 10, 1e-12);
  EXPECT_TRUE(std::isnan(contact::plumb_at(index, {50, 1, 2}).floor));
}

TEST(TerrainSheets, LoosePiecesAndHolesAreNamed) {
  std::vector<Vec3> v;
  Triangles t;
  for (int j = 0; j <= 6; ++j)
    for (int i = 0; i <= 6; ++i) v.emplace_back(i, j, 0);
  for (int j = 0; j < 6; ++j)
    for (int i = 0; i < 6; ++i) {
      if (i == 2 && j == 3) continue;
      const int a = 7 * j + i;
      t.push_back({a, a + 1, a + 8});
      t.push_back({a, a + 8, a + 7});
    }
  const int first = static_cast<int>(v.size());
  v.insert(v.end(), {Vec3(3, 3, 20), Vec3(4, 3, 20), Vec3(3, 4, 20)});
  t.push_back({first, first + 1, first + 2});
  Triangles same = t;
  const auto warnings = orient_sheets(v, t, "scan.obj", Vec3(1000, 0, 0));
  EXPECT_TRUE(warned_of(warnings, "1 face at [1003, 3, 20]"));
  EXPECT_TRUE(warned_of(warnings, "faces are missing within the terrain"));
  EXPECT_TRUE(orient_sheets(v, same, "scan.obj", Vec3::Zero(), Box3(Vec3(0, 0, 0), Vec3(1, 1, 0)))
                  .empty());  // all that lies outside of the crop
}

TEST(TerrainSheets, SinglePrecisionInMapCoordinatesIsNamed) {
  const auto sheet = [](double east, double cell, bool floats) {
    std::pair<std::vector<Vec3>, Triangles> m;
    for (int j = 0; j <= 5; ++j)
      for (int i = 0; i <= 5; ++i) {
        Vec3 x(east + cell * i + 0.137 * ((i * j) % 3), 5200000 + cell * j + 0.211 * ((i + j) % 4),
               500 + 0.3 * i);
        if (floats) x = x.cast<float>().cast<double>();
        m.first.push_back(x);
      }
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 5; ++i) {
        const int a = 6 * j + i;
        m.second.push_back({a, a + 1, a + 7});
        m.second.push_back({a, a + 7, a + 6});
      }
    return m;
  };
  const auto [v, t] = sheet(600000, 5, true);
  const auto found = rounding_warning(v, t, "map.stl");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].rule.find("single precision"), std::string::npos);
  EXPECT_NE(found[0].value.find("steps of 0.5 m"), std::string::npos) << found[0].value;
  const auto exact = sheet(600000, 5, false);
  EXPECT_TRUE(rounding_warning(exact.first, exact.second, "map.obj").empty());
  EXPECT_EQ(rounding_warning(v, t, "map.ply").size(), 1u);  // of numbers that a PLY file holds as float
  auto cut = exact.first;  // six digits: nodes that come to lie on each other
  for (Vec3& x : cut)
    x.z() += 0.1 * (x.y() - 5200000), x.y() = 10 * std::round(x.y() / 10), x.x() = std::round(x.x());
  EXPECT_EQ(rounding_warning(cut, exact.second, "map.obj").size(), 1u);
  auto halves = exact.first;  // numbers that were round before are not rounded by what holds them
  for (Vec3& x : halves) x = (2 * x).array().round() / 2;
  EXPECT_TRUE(rounding_warning(halves, exact.second, "map.obj").empty());
  const auto wide = sheet(600000, 500, true);  // half a metre is nothing to faces of 500 m
  EXPECT_TRUE(rounding_warning(wide.first, wide.second, "map.stl").empty());
}
