#include "geometry/mesh.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

using namespace talus;
using namespace talus::geometry;

namespace {

Mesh unit_box() {
  std::vector<Vec3> p;
  for (int i = 0; i < 8; ++i) p.emplace_back(i & 1, i >> 1 & 1, i >> 2 & 1);
  return convex_hull(p);
}

std::string temporary(const std::string& name) {
  return (std::filesystem::temp_directory_path() / ("talus_mesh_" + std::to_string(::getpid()) + "_" + name))
      .string();
}

void expect_problem(const std::string& text, const std::string& name, const std::string& part, int line = 0) {
  try {
    read_mesh_text(text, name);
    FAIL() << "accepted: " << text;
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find(part), std::string::npos) << e.what();
    EXPECT_EQ(e.problems()[0].file, name);
    if (line) { EXPECT_EQ(e.problems()[0].line, line) << e.what(); }
  }
}

}  // namespace

class MeshFormats : public testing::TestWithParam<const char*> {};

TEST_P(MeshFormats, WhatIsWrittenIsReadAgain) {
  const Mesh box = unit_box();
  const std::string path = temporary(std::string("round.") + GetParam());
  write_mesh(path, box);
  const Mesh again = read_closed_mesh(path);
  EXPECT_EQ(again.vertices.size(), 8u);
  EXPECT_EQ(again.triangles.size(), 12u);
  EXPECT_NEAR(signed_volume(again.vertices, again.triangles), 1, 1e-12);
  std::filesystem::remove(path);
}
INSTANTIATE_TEST_SUITE_P(All, MeshFormats, testing::Values("obj", "stl", "ply", "off"));

TEST(Mesh, TextStlSharesItsCorners) {
  const std::string text =
      "solid a\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1e0 0 0\n  vertex 0 1 0\n "
      "endloop\nendfacet\n"
      "facet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 "
      "-0\nendloop\nendfacet\nendsolid a\n";
  const Mesh m = read_mesh_text(text, "a.stl");
  EXPECT_EQ(m.vertices.size(), 4u);
  EXPECT_EQ(m.triangles.size(), 2u);
  std::string upper = "\n  " + text;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  EXPECT_EQ(read_mesh_text(upper, "a.stl").vertices, m.vertices);
  EXPECT_EQ(read_mesh_text(upper, "a.stl").triangles, m.triangles);
}

TEST(Mesh, ObjGroupsPolygonsAndNegativeIndices) {
  // An L-shaped (concave) hexagon: five of its ear triangles would be wrong if it were cut as a fan from any
  // corner.
  const std::string text =
      "# comment\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\ng ell\nf 1/1/1 2//1 3 4 5 6\n"
      "v 5 0 0\nv 6 0 0\nv 5 1 0\no other\nf -3 -2 -1\n";
  const Mesh m = read_mesh_text(text, "a.obj");
  ASSERT_EQ(m.triangles.size(), 5u);
  EXPECT_EQ(m.group_names, (std::vector<std::string>{"ell", "other"}));
  EXPECT_EQ(m.group, (std::vector<int>{0, 0, 0, 0, 1}));
  double area = 0;
  for (int t = 0; t < 4; ++t) {
    const auto& c = m.triangles[t];
    const double a = (m.vertices[c[1]] - m.vertices[c[0]]).cross(m.vertices[c[2]] - m.vertices[c[0]]).z() / 2;
    EXPECT_GT(a, 0);
    area += a;
  }
  EXPECT_NEAR(area, 3, 1e-14);
}

TEST(Mesh, LinesOfObjFilesGoOnBehindABackslash) {
  const std::string head = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  const Mesh whole = read_mesh_text(head + "f 1 2 3 4\n", "a.obj");
  for (const char* end : {"\\\n", "\\\r\n"})
    EXPECT_EQ(read_mesh_text(head + "f 1 2 " + end + "3 4\n", "a.obj").triangles, whole.triangles);
}

TEST(Mesh, BinaryPlyOfBothByteOrders) {
  for (const bool big : {false, true}) {
    std::string text =
        std::string("ply\nformat binary_") + (big ? "big" : "little") +
        "_endian 1.0\ncomment x\nelement vertex 3\nproperty float x\nproperty float y\nproperty double z\n"
        "element face 1\nproperty list uint8 int32 vertex_index\nend_header\n";
    const auto put = [&](auto x) {
      char b[sizeof x];
      std::memcpy(b, &x, sizeof x);
      if (big) std::reverse(b, b + sizeof x);
      text.append(b, sizeof x);
    };
    for (int i = 0; i < 3; ++i) put(i == 1 ? 1.0f : 0.0f), put(i == 2 ? 1.0f : 0.0f), put(0.25);
    put(std::uint8_t{3});
    for (std::int32_t i = 0; i < 3; ++i) put(i);
    const Mesh m = read_mesh_text(text, "a.ply");
    ASSERT_EQ(m.vertices.size(), 3u);
    EXPECT_EQ(m.vertices[1], Vec3(1, 0, 0.25));
    expect_problem(text.substr(0, text.size() - 2), "a.ply", "shorter");
  }
}

TEST(Mesh, BadFilesAreNamedWithTheirLine) {
  expect_problem("v 0 0 0\nv 1 0 zero\n", "a.obj", "must be a number", 2);
  expect_problem("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "a.obj", "1..3", 4);
  expect_problem("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "a.off", "0..2", 6);
  expect_problem("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n", "a.stl",
                 "three vertices", 6);
  expect_problem("rubbish", "a.stl", "neither text");
  expect_problem("", "a.obj", "no faces");
  expect_problem("x", "a.step", "not a mesh format");
  EXPECT_THROW(read_mesh("/nowhere/at/all.obj"), InputError);
}

TEST(Mesh, EachDefectIsToldByItsName) {
  const auto rules = [](const Mesh& m) {
    std::string all;
    for (const Problem& p : closed_mesh_problems(m, "rock.obj")) {
      EXPECT_EQ(p.file, "rock.obj");
      all += p.rule + "\n";
    }
    return all;
  };
  EXPECT_EQ(rules(unit_box()), "");

  Mesh open = unit_box();
  open.triangles.pop_back();
  EXPECT_NE(rules(open).find("open"), std::string::npos);

  Mesh turned = unit_box();
  std::swap(turned.triangles[3][0], turned.triangles[3][1]);
  EXPECT_NE(rules(turned).find("badly oriented"), std::string::npos);

  Mesh wall = unit_box();
  wall.triangles.push_back(wall.triangles[0]);
  EXPECT_NE(rules(wall).find("non-manifold"), std::string::npos);

  Mesh inside_out = unit_box();
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  EXPECT_NE(rules(inside_out).find("look inward"), std::string::npos);

  // A corner pulled through the opposite edge: of negative volume, but not inside out.
  Mesh tangle = unit_box();
  for (Vec3& x : tangle.vertices)
    if (x == Vec3(1, 1, 1)) x = Vec3(-3, -3, 0.5);
  EXPECT_LT(signed_volume(tangle.vertices, tangle.triangles), 0);
  EXPECT_NE(rules(tangle).find("self-intersecting"), std::string::npos);
  EXPECT_EQ(rules(tangle).find("look inward"), std::string::npos);

  Mesh sheet = unit_box();
  for (Vec3& v : sheet.vertices) v.z() = 0.5 * v.x();
  EXPECT_FALSE(rules(sheet).empty());

  // A box whose top corner is pushed through its bottom: closed, oriented, positive volume, but crossing.
  Mesh crossing = unit_box();
  for (Vec3& v : crossing.vertices)
    if (v == Vec3(1, 1, 1)) v.z() = -0.4;
  EXPECT_NE(rules(crossing).find("self-intersecting"), std::string::npos);

  // Two cubes that overlap, in one file.
  Mesh two = unit_box();
  const Mesh other = unit_box();
  for (const Vec3& v : other.vertices) two.vertices.push_back(v + Vec3(0.5, 0.4, 0.3));
  for (auto t : other.triangles) two.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  EXPECT_NE(rules(two).find("self-intersecting"), std::string::npos);
}

TEST(Mesh, RepairClosesOrientsAndWeldsButOnlyWhenAsked) {
  Mesh broken;
  const Mesh box = unit_box();
  for (const auto& t : box.triangles) {  // unshared corners, off by rounding; one face missing; one turned
    const int base = static_cast<int>(broken.vertices.size());
    for (int v : t) broken.vertices.push_back(box.vertices[v] * (1 + 1e-13 * base));
    broken.triangles.push_back({base, base + 1, base + 2});
  }
  broken.triangles.pop_back();
  std::swap(broken.triangles[0][0], broken.triangles[0][1]);
  EXPECT_FALSE(closed_mesh_problems(broken, "").empty());
  RepairReport report;
  const Mesh fixed = repair(broken, report);
  EXPECT_TRUE(report.remaining.empty()) << report.remaining[0].str();
  EXPECT_GE(report.vertices_welded, 25);
  EXPECT_EQ(report.holes_filled, 1);
  EXPECT_NEAR(signed_volume(fixed.vertices, fixed.triangles), 1, 1e-9);
}

/// Whatever is given: what encloses nothing or cannot be made a surface is reported, not died of.
TEST(Mesh, RepairReportsWhatItCannotMend) {
  Mesh one;
  one.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.triangles = {{0, 1, 2}};
  RepairReport report;
  EXPECT_NO_THROW(repair(one, report));
  EXPECT_FALSE(report.remaining.empty());
  std::uint64_t x = 1;
  const auto random = [&](int n) {
    x = x * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<int>((x >> 33) % static_cast<std::uint64_t>(n));
  };
  for (int k = 0; k < 200; ++k) {
    Mesh soup;
    for (int v = 0; v < 10; ++v) soup.vertices.emplace_back(random(3), random(3), random(3));
    for (int t = random(25); t >= 0; --t) soup.triangles.push_back({random(10), random(10), random(10)});
    EXPECT_NO_THROW(repair(soup, report)) << k;
  }
}

TEST(Triangulation, PolygonWithTwoHoles) {
  std::vector<Vec3> v;
  const auto square = [&](double x, double y, double s, bool ccw) {
    const int b = static_cast<int>(v.size());
    v.emplace_back(x, y, 3), v.emplace_back(x + s, y, 3), v.emplace_back(x + s, y + s, 3),
        v.emplace_back(x, y + s, 3);
    return ccw ? std::vector<int>{b, b + 1, b + 2, b + 3} : std::vector<int>{b, b + 3, b + 2, b + 1};
  };
  const auto outer = square(0, 0, 10, true), hole1 = square(2, 2, 2, false), hole2 = square(6, 2, 2, false);
  const auto t = triangulate_polygon(v, {outer, hole1, hole2}, Vec3::UnitZ());
  ASSERT_EQ(t.size(), 4u + 4 + 4 + 2 * 2 - 2);
  double area = 0;
  for (const auto& c : t) {
    const double a = (v[c[1]] - v[c[0]]).cross(v[c[2]] - v[c[0]]).z() / 2;
    EXPECT_GT(a, 0);
    area += a;
  }
  EXPECT_NEAR(area, 100 - 8, 1e-12);
}
