// What a mesh file says of itself, and what its coordinates say, is heeded, refused or warned of.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "geometry/mesh.hpp"
#include "geometry/stated_unit.hpp"
#include "geometry/terrain.hpp"

using namespace talus;
using namespace talus::geometry;

namespace {

struct MeshFile {
  MeshFile(const std::string& name, const std::string& text)
      : path((std::filesystem::temp_directory_path() /
              ("talus_mesh_says_" + std::to_string(::getpid()) + "_" + name))
                 .string()) {
    std::ofstream(path, std::ios::binary) << text;
  }
  ~MeshFile() { std::filesystem::remove(path); }
  std::string path;
};

/// A slope of n x n nodes, 5 m apart, as the text of an OBJ file.
template <class Place>
std::string slope_obj(Place place, const std::string& head = "") {
  constexpr int n = 12;
  std::string text = head;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const Vec3 x = place(i, j);
      text += "v " + std::to_string(x.x()) + " " + std::to_string(x.y()) + " " + std::to_string(x.z()) + "\n";
    }
  for (int j = 0; j + 1 < n; ++j)
    for (int i = 0; i + 1 < n; ++i) {
      const int a = n * j + i + 1;
      text += "f " + std::to_string(a) + " " + std::to_string(a + 1) + " " + std::to_string(a + n + 1) + " " +
              std::to_string(a + n) + "\n";
    }
  return text;
}

Vec3 on_slope(int i, int j) { return {5.0 * i, 5.0 * j, 500 + 1.6 * j + 0.4 * (i % 3)}; }

std::string warnings_of(const std::string& text) {
  const MeshFile file("slope.obj", text);
  std::string all;
  for (const Problem& p : load_terrain(file.path).warnings) all += p.str() + "\n";
  return all;
}

std::string refusal_of(const std::string& text) {
  try {
    warnings_of(text);
  } catch (const InputError& e) { return e.what(); }
  return {};
}

}  // namespace

TEST(MeshSays, NumbersEndAtBlanks) {
  for (const char* point : {"100.000.0 0 50", "1 2e3.5 3", "1 2 3m", "0 0-1 5"}) {
    EXPECT_THROW(read_mesh_text("v " + std::string(point) + "\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "t.obj"),
                 InputError)
        << point;
    EXPECT_THROW(read_mesh_text("OFF\n3 1 0\n" + std::string(point) + "\n1 0 0\n0 1 0\n3 0 1 2\n", "t.off"),
                 InputError)
        << point;
  }
  EXPECT_THROW(read_mesh_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3.5\n", "t.obj"), InputError);
  EXPECT_NO_THROW(read_mesh_text("v 0 0 0#a\nv 1 0 0\nv 0 1 0\nf 1/2/3 2//4 3\n", "t.obj"));
}

// The header of a binary STL may begin with "solid": a file of which the size is not that of its triangles is
// no text without faces.
TEST(MeshSays, ABinaryStlThatIsNotWholeIsSaidToBeNone) {
  std::string stl = "solid made by a program";
  stl.resize(80, ' ');
  stl += std::string("\1\0\0\0", 4) + std::string(50, '\0');
  try {
    read_mesh_text(stl + "\n", "t.stl");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(e.problems()[0].rule.find("nor a whole binary STL"), std::string::npos) << e.what();
  }
}

TEST(MeshSays, CoordinatesAreNumbersOfMetres) {
  for (const char* x : {"1e200", "1e100", "-2e9", "nan", "inf"}) {
    const std::string vertices = "v 0 0 0\nv " + std::string(x) + " 0 0\nv 0 1 0\n";
    try {
      read_mesh_text(vertices + "f 1 2 3\n", "t.obj");
      ADD_FAILURE() << x;
    } catch (const InputError& e) {
      ASSERT_EQ(e.problems().size(), 1u) << x;
      EXPECT_EQ(e.problems()[0].key, "mesh vertex 1") << x;
      EXPECT_NE(e.problems()[0].rule.find("at most 1e+09 m"), std::string::npos) << x;
    }
  }
}

TEST(MeshSays, NothingStandsBehindWhatTheHeaderCounts) {
  const std::string points = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n", two = "3 0 1 2\n3 0 2 3\n";
  const auto off = [&](const std::string& counts, const std::string& faces) {
    return read_mesh_text("OFF\n" + counts + "\n" + points + faces, "t.off").triangles.size();
  };
  EXPECT_THROW(off("4 1 0", two), InputError);
  EXPECT_EQ(off("4 2 0", two + "# the end\n\n"), 2u);
  const auto ply = [&](const std::string& format, int faces, const std::string& data) {
    return read_mesh_text("ply\nformat " + format +
                              " 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
                              "z\nelement face " +
                              std::to_string(faces) +
                              "\nproperty list uchar int vertex_indices\nend_header\n" + data,
                          "t.ply")
        .triangles.size();
  };
  EXPECT_THROW(ply("ascii", 1, points + two), InputError);
  EXPECT_EQ(ply("ascii", 2, points + two), 2u);
  std::string bytes;
  for (const float x : {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0})
    bytes.append(reinterpret_cast<const char*>(&x), 4);
  for (const auto& face : {std::array{0, 1, 2}, std::array{0, 2, 3}})
    bytes += '\3', bytes.append(reinterpret_cast<const char*>(face.data()), 12);
  EXPECT_THROW(ply("binary_little_endian", 1, bytes), InputError);
  EXPECT_EQ(ply("binary_little_endian", 2, bytes), 2u);
}

TEST(MeshSays, ADecimalCommaIsRefusedWhereverItStands) {
  for (const char* name : {"t.obj", "t.off", "t.ply"})
    for (const char* point : {"1 2 3,5", "1 2,5 3", "1,5 2 3"}) {
      const std::string p(point),
          text =
              std::strcmp(name, "t.obj") == 0 ? "v " + p + "\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
              : std::strcmp(name, "t.off") == 0
                  ? "OFF\n3 1 0\n" + p + "\n1 0 0\n0 1 0\n3 0 1 2\n"
                  : "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty "
                    "double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" +
                        p + "\n1 0 0\n0 1 0\n3 0 1 2\n";
      try {
        read_mesh_text(text, name);
        ADD_FAILURE() << name << ": " << point;
      } catch (const InputError& e) {
        EXPECT_NE(e.problems()[0].str().find("decimal comma"), std::string::npos) << e.what();
      }
    }
  // Corners of faces with their textures, and colours after a vertex, are no such thing.
  EXPECT_EQ(
      read_mesh_text("v 1 2 3 0.5 0.5 0.5\nv 1 0 0\nv 0 1 0\nf 1/1 2//2 3/1/1\n", "t.obj").triangles.size(),
      1u);
}

TEST(MeshSays, AUnitThatTheHeadOfAFileNamesIsFound) {
  const auto unit = [](const std::string& name, const std::string& text) {
    const MeshFile file(name, text);
    return stated_unit(file.path).name;
  };
  EXPECT_EQ(unit("a.obj", "# by a CAD program\n# Units: feet\nv 0 0 0\n"), "feet");
  EXPECT_EQ(unit("a.obj", "# File units = millimeters\nv 0 0 0\n"), "millimeters");
  EXPECT_EQ(unit("a.ply", "ply\nformat ascii 1.0\ncomment unit mm\nelement vertex 0\nend_header\n"), "mm");
  EXPECT_EQ(unit("a.off", "OFF\n# units are cm\n0 0 0\n"), "cm");
  EXPECT_EQ(unit("a.stl", std::string("Exported UNITS=ft").append(100, ' ')), "ft");
  EXPECT_EQ(unit("a.stl", "solid block units=in\nendsolid\n"), "in");
  for (const char* head :
       {"# units: m\n", "# 12 units of rock\n", "# Units: none\n", "v 0 0 0\n# units: mm\n", ""})
    EXPECT_EQ(unit("b.obj", head), "") << head;
  EXPECT_NEAR(stated_unit(MeshFile("c.obj", "# units: ft\n").path).metres, 0.3048, 1e-15);
}

TEST(MeshSays, TerrainWhoseFileNamesAnotherUnitIsWarnedOf) {
  EXPECT_EQ(warnings_of(slope_obj(on_slope)), "");
  EXPECT_NE(
      warnings_of(slope_obj(on_slope, "# units: ft\n")).find("is the unit that the head of the file names"),
      std::string::npos);
}

TEST(MeshSays, VerticesWithoutDataAreRefused) {
  const auto with = [](double z) {
    return slope_obj([=](int i, int j) {
      Vec3 x = on_slope(i, j);
      if (i == 4 && j == 5) x.z() = z;
      return x;
    });
  };
  EXPECT_NE(refusal_of(with(-9999)).find("stands for"), std::string::npos) << refusal_of(with(-9999));
  EXPECT_NE(refusal_of(with(-32768)).find("stands for"), std::string::npos);
  EXPECT_EQ(refusal_of(with(495)), "");
}

TEST(MeshSays, HeightsBeyondAnyTerrainAreWarnedOf) {
  const std::string high = slope_obj([](int i, int j) { return Vec3(on_slope(i, j) * 30); });
  EXPECT_NE(warnings_of(high).find("no ground on Earth is that high in metres"), std::string::npos)
      << warnings_of(high);
}

TEST(MeshSays, TerrainWhoseYAxisPointsUpIsWarnedOf) {
  const auto turned = [](int i, int j) {
    const Vec3 x = on_slope(i, j);
    return Vec3(x.x(), x.z(), -x.y());
  };
  const std::string text = slope_obj(turned);
  EXPECT_NE(warnings_of(text).find("site.up"), std::string::npos) << warnings_of(text);
  const MeshFile file("up.obj", text);
  TerrainOptions o;
  o.up = 'y';
  EXPECT_TRUE(load_terrain(file.path, o).warnings.empty());
  // A wall of rock as wide as high stands upright, too, but not as level ground lies.
  const auto wall = [](int i, int j) {
    return Vec3(5.0 * i, 40.0 * std::sin(0.5 * i) + 0.5 * j, 500 + 5.0 * j);
  };
  EXPECT_EQ(warnings_of(slope_obj(wall)).find("site.up"), std::string::npos) << warnings_of(slope_obj(wall));
}

TEST(MeshSays, AWallOnAGridThatIsRoundedIsWarnedOf) {
  std::string text = "ncols 12\nnrows 12\nxllcorner 600000\nyllcorner 5200000\ncellsize 5\n";
  for (int k = 0; k < 144; ++k) text += "500 ";
  const MeshFile grid("grid.asc", text);
  std::string stl(80, ' ');
  const auto put = [&](const auto& x) { stl.append(reinterpret_cast<const char*>(&x), sizeof x); };
  const int cube[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                           {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  put(std::uint32_t{12});
  for (const auto& t : cube) {
    for (int k = 0; k < 3; ++k) put(0.0F);
    for (const int v : t) {
      put(static_cast<float>(600020 + 1.3 * (v & 1)));
      put(static_cast<float>(5200020.2 + 20 * (v >> 1 & 1)));
      put(static_cast<float>(498 + 6 * (v >> 2)));
    }
    put(std::uint16_t{0});
  }
  const MeshFile wall("wall.stl", stl);
  TerrainOptions o;
  o.origin = Vec3(600000, 5200000, 500);
  TerrainOptions::MaterialArea area;
  area.mesh_file = wall.path;
  o.material_areas.push_back(area);
  std::string all;
  for (const Problem& p : load_terrain(grid.path, o).warnings) all += p.str() + "\n";
  EXPECT_NE(all.find("wall.stl"), std::string::npos) << all;
  EXPECT_NE(all.find("single precision"), std::string::npos) << all;
}
