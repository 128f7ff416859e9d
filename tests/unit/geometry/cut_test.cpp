#include "geometry/cut.hpp"

#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#include "geometry/block_output.hpp"
#include "geometry/mass_properties.hpp"
#include "geometry/mesh.hpp"
#include "geometry/random.hpp"

using namespace talus;
using namespace talus::geometry;

namespace {

constexpr double deg = std::numbers::pi / 180;

CutSpec box_spec(const Vec3& size) {
  CutSpec s;
  s.box = Box3(Vec3::Zero(), size);
  return s;
}

CutJointSet joint_set(const std::string& name, double dip_direction, double dip, double spacing) {
  CutJointSet s;
  s.name = name;
  s.dip_direction = dip_direction * deg;
  s.dip = dip * deg;
  s.spacing = spacing;
  return s;
}

/// What must hold for any cutting: volume, closed surfaces, Euler's number, and the same area on both sides
/// of joints.
void expect_invariants(const CutResult& r, const std::string& what) {
  double sum = 0;
  std::map<std::pair<int, int>, double> on_faces, on_interfaces;
  for (int b = 0; b < static_cast<int>(r.blocks.size()); ++b) {
    const Polyhedron& p = r.blocks[b].body;
    sum += r.blocks[b].volume;
    ASSERT_GT(r.blocks[b].volume, 0) << what;
    std::map<std::pair<int, int>, int> half;
    for (const auto& t : p.triangles)
      for (int k = 0; k < 3; ++k) ++half[{t[k], t[(k + 1) % 3]}];
    for (const auto& [e, count] : half) {
      ASSERT_EQ(count, 1) << what;
      ASSERT_TRUE(half.count({e.second, e.first})) << what << ": block " << b << " is open";
    }
    const int euler = static_cast<int>(p.vertices.size()) - static_cast<int>(p.triangles.size()) / 2;
    if (p.convex) { ASSERT_EQ(euler, 2) << what; }
    ASSERT_EQ(euler % 2, 0) << what;
    ASSERT_EQ(static_cast<int>(p.face_joint_set.size()), p.faces());
    for (std::size_t t = 0; t < p.triangles.size(); ++t) {
      const auto& c = p.triangles[t];
      const double area =
          0.5 * (p.vertices[c[1]] - p.vertices[c[0]]).cross(p.vertices[c[2]] - p.vertices[c[0]]).norm();
      const int joint = p.face_joint_set[p.triangle_face[t]];
      if (joint >= 0) on_faces[{b, joint}] += area;
    }
  }
  EXPECT_NEAR(sum, r.region_volume, 1e-12 * r.region_volume) << what;
  for (const CutInterface& i : r.interfaces) {
    ASSERT_LT(i.a, i.b);
    ASSERT_GT(i.area, 0);
    on_interfaces[{i.a, i.joint}] += i.area;
    on_interfaces[{i.b, i.joint}] += i.area;
    // The normal points from a to b.
    EXPECT_LE(i.bonded_area, i.area * (1 + 1e-12)) << what;
  }
  const double area_scale = std::pow(r.region_volume, 2.0 / 3);
  for (const auto& [key, area] : on_faces)
    EXPECT_NEAR(area, on_interfaces[key], 1e-9 * area_scale)
        << what << " block " << key.first << " joint " << key.second;
}

int convex_count(const CutResult& r) {
  int n = 0;
  for (const auto& b : r.blocks) n += b.body.convex;
  return n;
}

struct TemporaryMesh {
  TemporaryMesh(const std::string& name, const Mesh& mesh)
      : path((std::filesystem::temp_directory_path() /
              ("talus_cut_" + std::to_string(::getpid()) + "_" + name + ".ply"))
                 .string()) {
    write_mesh(path, mesh);
  }
  ~TemporaryMesh() { std::filesystem::remove(path); }
  std::string path;
};

/// An L-shaped prism: two by two in plan without the upper right quarter, one high.
Mesh ell() {
  Mesh m;
  const std::vector<Eigen::Vector2d> p = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
  const int n = static_cast<int>(p.size());
  std::vector<int> bottom, top;
  for (int z = 0; z < 2; ++z)
    for (const auto& q : p) m.vertices.emplace_back(q.x(), q.y(), z);
  for (int k = 0; k < n; ++k) top.push_back(n + k), bottom.insert(bottom.begin(), k);
  for (const auto& t : triangulate_polygon(m.vertices, {top}, Vec3::UnitZ())) m.triangles.push_back(t);
  for (const auto& t : triangulate_polygon(m.vertices, {bottom}, -Vec3::UnitZ())) m.triangles.push_back(t);
  for (int k = 0; k < n; ++k) {
    const int l = (k + 1) % n;
    m.triangles.push_back({k, l, n + l});
    m.triangles.push_back({k, n + l, n + k});
  }
  return m;
}

}  // namespace

TEST(Cut, NormalFollowsDipDirectionAndDip) {
  // Dipping 30 degrees to the east: the upward normal leans east.
  EXPECT_NEAR((joint_normal(90 * deg, 30 * deg) - Vec3(0.5, 0, std::sqrt(3) / 2)).norm(), 0, 1e-15);
  EXPECT_NEAR((joint_normal(0, 90 * deg) - Vec3(0, 1, 0)).norm(), 0, 1e-15);
}

TEST(Cut, OrthogonalSetsGiveBricks) {
  CutSpec s = box_spec({4, 3, 2});
  s.joint_sets = {joint_set("x", 90, 90, 1), joint_set("y", 0, 90, 1), joint_set("z", 0, 0, 1)};
  for (auto& set : s.joint_sets) set.origin = Vec3::Zero();
  const CutResult r = cut(s);
  ASSERT_EQ(r.blocks.size(), 24u);
  expect_invariants(r, "bricks");
  for (const auto& b : r.blocks) {
    EXPECT_NEAR(b.volume, 1, 1e-12);
    EXPECT_EQ(b.body.vertices.size(), 8u);
    EXPECT_EQ(b.body.faces(), 6);
    EXPECT_TRUE(b.body.convex);
  }
  EXPECT_EQ(r.interfaces.size(), 3u * 3 * 2 + 4 * 2 * 2 + 4 * 3 * 1);
  for (const auto& i : r.interfaces)
    EXPECT_GT(i.normal.dot(r.blocks[i.b].centroid - r.blocks[i.a].centroid), 0);
  EXPECT_EQ(r.joint_names, (std::vector<std::string>{"x", "y", "z"}));
}

TEST(Cut, TheJointSetOfEachFaceIsKnown) {
  CutSpec s = box_spec({2, 2, 2});
  s.joint_sets = {joint_set("level", 0, 0, 10)};
  s.joints.push_back({.name = "steep", .dip_direction = 90 * deg, .dip = 90 * deg, .through = Vec3(1, 1, 1)});
  const CutResult r = cut(s);
  ASSERT_EQ(r.blocks.size(), 4u);
  for (const auto& b : r.blocks) {
    std::map<int, int> count;
    for (int f = 0; f < b.body.faces(); ++f) {
      ++count[b.body.face_joint_set[f]];
      const int joint = b.body.face_joint_set[f];
      if (joint >= 0) { EXPECT_NEAR(std::abs(b.body.face_normals[f][joint == 0 ? 2 : 0]), 1, 1e-12); }
    }
    EXPECT_EQ(count, (std::map<int, int>{{-1, 4}, {0, 1}, {1, 1}}));
  }
}

TEST(Cut, ConcaveRegionWithoutJointsIsOneBlock) {
  const TemporaryMesh mesh("ell", ell());
  CutSpec s;
  s.region = mesh.path;
  const CutResult r = cut(s);
  ASSERT_EQ(r.blocks.size(), 1u);
  expect_invariants(r, "ell");
  EXPECT_NEAR(r.blocks[0].volume, 3, 1e-12);
  EXPECT_FALSE(r.blocks[0].body.convex);
  EXPECT_EQ(r.blocks[0].body.vertices.size(), 12u);  // the division leaves no trace
  EXPECT_EQ(r.blocks[0].body.faces(), 8);
}

TEST(Cut, ConcaveRegionCutByALevelJoint) {
  const TemporaryMesh mesh("ell2", ell());
  CutSpec s;
  s.region = mesh.path;
  s.joints.push_back({.name = "level", .through = Vec3(0, 0, 0.4)});
  const CutResult r = cut(s);
  ASSERT_EQ(r.blocks.size(), 2u);
  expect_invariants(r, "ell cut");
  EXPECT_NEAR(r.blocks[0].volume, 1.2, 1e-12);
  ASSERT_EQ(r.interfaces.size(), 1u);
  EXPECT_NEAR(r.interfaces[0].area, 3, 1e-12);
}

TEST(Cut, RockRegionOfManyFaces) {
  Mesh rock;
  {  // a dented ball of 80 triangles
    const double g = std::numbers::phi;
    Mesh ball = convex_hull({{0, 1, g},
                             {0, -1, g},
                             {0, 1, -g},
                             {0, -1, -g},
                             {1, g, 0},
                             {-1, g, 0},
                             {1, -g, 0},
                             {-1, -g, 0},
                             {g, 0, 1},
                             {-g, 0, 1},
                             {g, 0, -1},
                             {-g, 0, -1}});
    rock.vertices = ball.vertices;
    std::map<std::pair<int, int>, int> middle;
    Random random(5);
    const auto mid = [&](int a, int b) {
      const auto key = std::minmax(a, b);
      const auto it = middle.find(key);
      if (it != middle.end()) return it->second;
      rock.vertices.push_back((ball.vertices[a] + ball.vertices[b]) / 2 * random.uniform(0.8, 1.3));
      return middle[key] = static_cast<int>(rock.vertices.size()) - 1;
    };
    for (const auto& [a, b, c] : ball.triangles) {
      const int ab = mid(a, b), bc = mid(b, c), ca = mid(c, a);
      for (const auto& t :
           {std::array{a, ab, ca}, std::array{b, bc, ab}, std::array{c, ca, bc}, std::array{ab, bc, ca}})
        rock.triangles.push_back(t);
    }
  }
  const TemporaryMesh mesh("rock", rock);
  CutSpec s;
  s.region = mesh.path;
  EXPECT_EQ(cut(s).blocks.size(), 1u);
  expect_invariants(cut(s), "rock");
  s.joint_sets = {joint_set("a", 40, 60, 0.8), joint_set("b", 200, 35, 0.9)};
  const CutResult r = cut(s);
  EXPECT_GT(r.blocks.size(), 8u);
  expect_invariants(r, "rock cut");
}

TEST(Cut, DiscThatEndsInRockSeparatesNothingUnlessBonded) {
  CutSpec s = box_spec({2, 2, 2});
  s.joints.push_back({.name = "disc", .through = Vec3(1, 1, 1), .radius = 0.5});
  const CutResult whole = cut(s);
  ASSERT_EQ(whole.blocks.size(), 1u);
  expect_invariants(whole, "disc");
  EXPECT_EQ(whole.blocks[0].body.vertices.size(), 8u);
  s.joints[0].bond_tension = 1e6;
  s.joints[0].bond_shear = 2e6;
  const CutResult bonded = cut(s);
  ASSERT_EQ(bonded.blocks.size(), 2u);
  expect_invariants(bonded, "disc, bonded");
  ASSERT_EQ(bonded.interfaces.size(), 1u);
  EXPECT_NEAR(bonded.interfaces[0].area, 4, 1e-12);
  EXPECT_NEAR(bonded.interfaces[0].bonded_area, 4 - std::numbers::pi * 0.25, 1e-12);
  EXPECT_NEAR((bonded.interfaces[0].bond_centroid - Vec3(1, 1, 1)).norm(), 0, 1e-12);
  EXPECT_EQ(bonded.interfaces[0].tension, 1e6);
}

TEST(Cut, DiscBeyondTheRegionCutsItInTwoHoweverItDips) {
  for (const double dip_direction : {0., 30., 222.})
    for (const double dip : {0., 17., 60., 90.}) {
      CutSpec s = box_spec(Vec3(10, 10, 10));
      s.joints.push_back({.name = "disc",
                          .dip_direction = dip_direction * deg,
                          .dip = dip * deg,
                          .through = Vec3(5, 5, 5),
                          .radius = 9});
      const CutResult r = cut(s);
      ASSERT_EQ(r.blocks.size(), 2u) << dip_direction << "/" << dip;
      EXPECT_NEAR(r.blocks[0].volume, 500, 1e-9) << dip_direction << "/" << dip;
      expect_invariants(r, "disc");
    }
}

TEST(Cut, BoundedJointsThatCloseCutABlockOut) {
  // Two rectangles: a level one under the corner x > 1, z > 1, and a steep one behind it. The rest is one
  // L-shaped block.
  CutSpec s = box_spec({2, 2, 2});
  s.joints.push_back(
      {.name = "level", .through = Vec3(1, 1, 1), .polygon = {{1, -1, 1}, {3, -1, 1}, {3, 3, 1}, {1, 3, 1}}});
  s.joints.push_back({.name = "steep",
                      .dip_direction = 90 * deg,
                      .dip = 90 * deg,
                      .through = Vec3(1, 1, 1),
                      .polygon = {{1, -1, 1}, {1, 3, 1}, {1, 3, 3}, {1, -1, 3}}});
  const CutResult r = cut(s);
  ASSERT_EQ(r.blocks.size(), 2u);
  expect_invariants(r, "corner");
  EXPECT_NEAR(r.blocks[0].volume, 6, 1e-12);
  EXPECT_EQ(r.blocks[0].body.faces(), 8);
  EXPECT_FALSE(r.blocks[0].body.convex);
  EXPECT_NEAR(r.blocks[1].volume, 2, 1e-12);
}

TEST(Cut, ConcavePolygonOfAJoint) {
  CutSpec s = box_spec({2, 2, 2});
  CutJoint j{.name = "ell", .through = Vec3(1, 1, 1)};
  j.polygon = {{0.2, 0.2, 1}, {1.8, 0.2, 1}, {1.8, 1, 1}, {1, 1, 1}, {1, 1.8, 1}, {0.2, 1.8, 1}};
  j.bond_tension = 1;
  s.joints.push_back(j);
  const CutResult r = cut(s);
  ASSERT_EQ(r.interfaces.size(), 1u);
  EXPECT_NEAR(r.interfaces[0].bonded_area, 4 - (1.6 * 1.6 - 0.8 * 0.8), 1e-12);
  expect_invariants(r, "concave polygon");
}

TEST(Cut, SliversJoinTheirNeighbourAndMassIsKept) {
  CutSpec s = box_spec({4, 2, 2});
  s.joints.push_back({.name = "a", .dip_direction = 90 * deg, .dip = 90 * deg, .through = Vec3(2, 1, 1)});
  s.joints.push_back({.name = "b", .dip_direction = 90 * deg, .dip = 88 * deg, .through = Vec3(2, 1, 1)});
  EXPECT_EQ(cut(s).blocks.size(), 4u);
  s.least_volume = 0.5;
  const CutResult r = cut(s);
  EXPECT_EQ(r.blocks.size(), 2u);
  EXPECT_EQ(r.merged, 2);
  expect_invariants(r, "slivers");
  EXPECT_TRUE(r.warnings.empty());  // merging is what least_volume asks for
}

TEST(Cut, PlanesThroughCornersAndAlongFacesAreDecidedOnce) {
  // Degenerate on purpose: joints in the faces of the box, through its edges and corners, off by 1e-12.
  for (const double off : {0.0, 1e-12, -1e-12}) {
    CutSpec s = box_spec({1, 1, 1});
    s.joint_sets = {joint_set("x", 90, 90, 0.5), joint_set("diagonal", 90, 45, std::sqrt(0.5)),
                    joint_set("other", 270, 45, std::sqrt(0.5))};
    for (auto& set : s.joint_sets) set.origin = Vec3(off, 0, 0);
    const CutResult r = cut(s);
    EXPECT_EQ(r.blocks.size(), 6u) << off;
    expect_invariants(r, "degenerate " + std::to_string(off));
    for (const auto& b : r.blocks) EXPECT_GT(b.volume, 0.1) << off;
  }
}

TEST(Cut, PersistenceIsTheChanceOfACut) {
  CutSpec s = box_spec({40, 40, 2});
  s.joint_sets = {joint_set("x", 90, 90, 1), joint_set("y", 0, 90, 40)};
  s.joint_sets[0].persistence = 0.5;
  const CutResult r = cut(s);
  expect_invariants(r, "persistence");
  // Two rows of 40: each of the 39 crossings is cut with chance 1/2.
  EXPECT_GT(r.blocks.size(), 25u);
  EXPECT_LT(r.blocks.size(), 60u);
  s.joint_sets[0].bond_tension = 1e5;
  const CutResult bonded = cut(s);
  expect_invariants(bonded, "persistence, bonded");
  EXPECT_EQ(bonded.blocks.size(), 80u);
  double bridge = 0, all = 0;
  for (const auto& i : bonded.interfaces)
    if (i.joint == 0) bridge += i.bonded_area, all += i.area;
  EXPECT_NEAR(bridge / all, 0.5, 0.2);
}

TEST(Cut, PersistenceIsOfFacesBetweenBlocksInAnyOrderOfSets) {
  // 400 faces of one plane: the open part has a standard deviation of 0.023. Drawn as the set cuts, all of
  // them were one face if it was listed first.
  for (const int place : {0, 1, 2}) {
    CutSpec s = box_spec({20, 20, 2});
    s.joint_sets = {joint_set("x", 90, 90, 1), joint_set("y", 0, 90, 1)};
    CutJointSet level = joint_set("level", 0, 0, 2);
    level.persistence = 0.3;
    for (const double strength : {0.0, 1e5}) {
      level.bond_shear = strength;
      CutSpec with = s;
      with.joint_sets.insert(with.joint_sets.begin() + place, level);
      const CutResult r = cut(with);
      expect_invariants(r, "order of sets");
      double open = 0;
      for (const auto& i : r.interfaces)
        if (i.joint == place) open += i.area - i.bonded_area;
      EXPECT_NEAR(open / 400, 0.3, 0.1) << place << " " << strength;
    }
  }
}

TEST(Cut, SpacingDistributionsHaveTheirMean) {
  for (const char* kind : {"exponential", "normal", "lognormal"}) {
    CutSpec s = box_spec({1, 1, 4000});
    CutJointSet set = joint_set("level", 0, 0, 2);
    set.spacing_distribution = kind;
    set.spacing_deviation = 0.6;
    s.joint_sets = {set};
    const CutResult r = cut(s);
    EXPECT_NEAR(static_cast<double>(r.blocks.size()), 2000, kind == std::string("exponential") ? 150 : 50)
        << kind;
    expect_invariants(r, kind);
  }
}

TEST(Cut, SameSeedSameBits) {
  CutSpec s = box_spec({10, 10, 10});
  s.joint_sets = {joint_set("a", 30, 60, 2.1), joint_set("b", 150, 70, 2.7), joint_set("c", 270, 20, 3.3)};
  for (auto& set : s.joint_sets)
    set.fisher = 80, set.spacing_distribution = "lognormal", set.spacing_deviation = 0.5,
    set.persistence = 0.8;
  const CutResult a = cut(s), b = cut(s);
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (std::size_t k = 0; k < a.blocks.size(); ++k) {
    EXPECT_EQ(a.blocks[k].body.vertices, b.blocks[k].body.vertices);
    EXPECT_EQ(a.blocks[k].body.triangles, b.blocks[k].body.triangles);
  }
  expect_invariants(a, "fisher");
  s.joint_sets[0].seed = 2;
  EXPECT_NE(cut(s).blocks.size(), 0u);
  EXPECT_NE(cut(s).blocks[0].volume, a.blocks[0].volume);
}

TEST(Cut, K4580JointSets) {
  CutSpec s = box_spec({20, 15, 12});
  s.joint_sets = {joint_set("J1", 267, 87, 3.84), joint_set("J2", 92, 88, 2.17)};
  s.joints.push_back({.name = "J3", .dip_direction = 2 * deg, .dip = 29 * deg, .through = Vec3(10, 7.5, 5)});
  s.joints.push_back({.name = "J4", .dip_direction = 3 * deg, .dip = 89 * deg, .through = Vec3(10, 7.5, 5)});
  s.least_volume = 0.5;
  const CutResult r = cut(s);
  expect_invariants(r, "K4580");
  EXPECT_GT(r.blocks.size(), 30u);
  for (const auto& b : r.blocks) EXPECT_GE(b.volume, 0.5);
  RecordProperty("blocks", static_cast<int>(r.blocks.size()));
  RecordProperty("convex", convex_count(r));
}

TEST(Cut, TenThousandBlocks) {
  CutSpec s = box_spec({44, 44, 44});
  s.joint_sets = {joint_set("a", 100, 80, 2.05), joint_set("b", 10, 75, 2.05), joint_set("c", 190, 12, 2.05)};
  const CutResult r = cut(s);
  EXPECT_GT(r.blocks.size(), 10000u);
  double sum = 0;
  for (const auto& b : r.blocks) sum += b.volume;
  EXPECT_NEAR(sum, r.region_volume, 1e-12 * r.region_volume);
}

TEST(Cut, BadInputIsTold) {
  const auto keys = [](const CutSpec& s) {
    std::string all;
    try {
      cut(s);
    } catch (const InputError& e) {
      for (const Problem& p : e.problems()) all += p.key + ";";
    }
    return all;
  };
  EXPECT_NE(keys({}), "");
  CutSpec s = box_spec({1, 1, 1});
  s.joint_sets = {joint_set("a", 10, 95, 1), joint_set("b", 10, 20, 0)};
  EXPECT_EQ(keys(s), "rock_mass.joint_set.a.orientation;rock_mass.joint_set.b.spacing;");
  s = box_spec({1, 1, 1});
  s.joint_sets = {joint_set("a", 10, 45, 1e-7)};
  EXPECT_EQ(keys(s), "rock_mass.joint_set.a.spacing;");
  s = box_spec({1, 1, 1});
  s.joint_sets = {joint_set("a", 267, 87, 1), joint_set("b", 92, 88, 1)};
  const auto warnings = cut_problems(s);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].severity, Problem::Severity::warning);
  Mesh open = ell();
  open.triangles.pop_back();
  const TemporaryMesh mesh("open", open);
  s = {};
  s.region = mesh.path;
  EXPECT_NE(keys(s).find("mesh edge"), std::string::npos);
}

// Of a box of 1 x 2 x 3 m the extent across joints is that along their normal: millimetres are told.
TEST(Cut, ASpacingBeyondTheRegionIsWarnedOf) {
  const auto keys = [](double dip_direction, double dip, double spacing) {
    CutSpec s = box_spec({1, 2, 3});
    s.joint_sets = {joint_set("a", dip_direction, dip, spacing)};
    std::string all;
    for (const Problem& p : cut(s).warnings) all += p.key + ";";
    return all;
  };
  for (const Vec3& at : {Vec3(90, 90, 1), Vec3(0, 90, 2), Vec3(0, 0, 3)}) {
    const double dip_direction = at[0], dip = at[1], width = at[2];
    EXPECT_EQ(keys(dip_direction, dip, 0.99 * width), "") << width;
    EXPECT_EQ(keys(dip_direction, dip, 1.01 * width), "rock_mass.joint_set.a.spacing;") << width;
  }
}

TEST(Cut, RegionsThatAreNoVolumeAreRefused) {
  const auto rule = [](const Mesh& m) -> std::string {
    const TemporaryMesh mesh("bad", m);
    CutSpec s;
    s.region = mesh.path;
    try {
      cut(s);
    } catch (const InputError& e) {
      std::string all;
      for (const Problem& p : e.problems()) all += p.key + ": " + p.rule + "; " + p.remedy + "\n";
      return all;
    }
    return "";
  };
  Mesh holed = ell();
  holed.triangles.erase(holed.triangles.begin() + 2);
  EXPECT_NE(rule(holed).find("edge"), std::string::npos) << rule(holed);
  Mesh crossing = ell();  // one corner of the top pushed through the bottom
  crossing.vertices[6].z() = -0.5;
  EXPECT_NE(rule(crossing).find("cross"), std::string::npos) << rule(crossing);
  Mesh inside_out = ell();
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  EXPECT_NE(rule(inside_out), "");
}

TEST(Cut, BlockSystemsGoOutAndIn) {
  CutSpec s = box_spec({4, 3, 2});
  s.joint_sets = {joint_set("a", 267, 87, 1.1), joint_set("b", 92, 88, 0.9)};
  s.least_volume = 0.2;
  const CutResult r = cut(s);
  const std::string base =
      (std::filesystem::temp_directory_path() / ("talus_cut_" + std::to_string(::getpid()) + "_system"))
          .string();
  write_mesh(base + ".obj", block_system(r));
  write_blocks_vtu(base + "_polygons.vtu", r);
  write_mesh(base + "_triangles.vtu", read_mesh(base + ".obj"));
  for (const std::string& file : {base + ".obj", base + "_polygons.vtu", base + "_triangles.vtu"}) {
    const auto blocks = read_block_system(file);
    ASSERT_EQ(blocks.size(), r.blocks.size()) << file;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      EXPECT_EQ(blocks[k].name, "R" + std::to_string(k + 1));
      EXPECT_NEAR(blocks[k].volume, r.blocks[k].volume, 1e-12);
      EXPECT_LT((blocks[k].centroid - r.blocks[k].centroid).norm(), 1e-12);
      EXPECT_EQ(blocks[k].body.faces(), r.blocks[k].body.faces());
      EXPECT_EQ(blocks[k].body.convex, r.blocks[k].body.convex);
    }
    std::filesystem::remove(file);
  }
}

// A file that was cut short, or made by a program that writes in pieces, is no smaller system.
TEST(Cut, AFileThatContradictsItsHeaderIsRefused) {
  const std::string file =
      (std::filesystem::temp_directory_path() / ("talus_cut_" + std::to_string(::getpid()) + "_header.vtu"))
          .string();
  CutSpec s = box_spec({4, 3, 2});
  s.joint_sets = {joint_set("a", 267, 87, 1.1)};
  write_blocks_vtu(file, cut(s));
  std::stringstream whole;
  whole << std::ifstream(file).rdbuf();
  const auto refusal = [&](const std::string& from, const std::string& to) -> std::string {
    std::string text = whole.str();
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    std::ofstream(file) << text.replace(at, from.size(), to);
    try {
      read_block_system(file);
    } catch (const InputError& e) { return e.what(); }
    return {};
  };
  EXPECT_EQ(refusal("<UnstructuredGrid>", "<UnstructuredGrid>"), "");
  EXPECT_NE(refusal("NumberOfCells=\"", "NumberOfCells=\"1").find("its header counts 1"), std::string::npos);
  EXPECT_NE(refusal("NumberOfPoints=\"", "NumberOfPoints=\"1").find("points (NumberOfPoints)"),
            std::string::npos);
  EXPECT_NE(refusal("</UnstructuredGrid>", "<Piece/></UnstructuredGrid>").find("several pieces"),
            std::string::npos);
  EXPECT_NE(refusal("</DataArray>", " 7</DataArray>").find("not three each"), std::string::npos);
  EXPECT_NE(refusal("<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">",
                    "<DataArray type=\"Int64\" Name='connectivity' format='ascii'>0 ")
                .size(),
            0u);
  std::filesystem::remove(file);
}

TEST(Cut, RandomJointSets) {
  const int seeds = std::getenv("TALUS_FULL") ? 500 : 30;
  for (int seed = 0; seed < seeds; ++seed) {
    Random random(static_cast<unsigned>(seed));
    CutSpec s = box_spec({random.uniform(4, 9), random.uniform(4, 9), random.uniform(4, 9)});
    const int n = 1 + static_cast<int>(random.uniform(0, 4));
    for (int k = 0; k < n; ++k) {
      CutJointSet set = joint_set("s" + std::to_string(k), random.uniform(0, 360), random.uniform(0, 90),
                                  random.uniform(1.5, 4));
      set.seed = static_cast<unsigned>(seed);
      if (random.uniform() < 0.5) set.fisher = random.uniform(10, 300);
      if (random.uniform() < 0.5) set.spacing_distribution = "exponential";
      if (random.uniform() < 0.4) set.persistence = random.uniform(0.3, 0.9);
      if (random.uniform() < 0.5) set.bond_tension = 1e5;
      s.joint_sets.push_back(set);
    }
    for (int k = 0; k < 3; ++k) {
      CutJoint j{.name = "j" + std::to_string(k),
                 .dip_direction = random.uniform(0, 360) * deg,
                 .dip = random.uniform(0, 90) * deg,
                 .through = Vec3(random.uniform(1, 4), random.uniform(1, 4), random.uniform(1, 4)),
                 .radius = random.uniform(0.5, 5)};
      if (random.uniform() < 0.5) j.bond_tension = 1e5;
      s.joints.push_back(j);
    }
    if (random.uniform() < 0.3) s.least_volume = 0.05;
    const CutResult r = cut(s);
    expect_invariants(r, "seed " + std::to_string(seed));
    if (HasFatalFailure()) return;
  }
}
