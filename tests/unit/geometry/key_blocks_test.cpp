#include "geometry/key_blocks.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>

#include "geometry/block_output.hpp"

using namespace talus;
using namespace talus::geometry;

namespace {
constexpr double degree = std::numbers::pi / 180;
}

TEST(KeyBlocks, WedgeOnTwoPlanesHasItsClosedForm) {
  // Wedge on planes 130/40 and 220/60, weight alone, the same friction on both.
  const auto wedge = [](double phi) {
    return key_block({{joint_normal(130 * degree, 40 * degree), 1, {phi, 0}, 0},
                      {joint_normal(220 * degree, 60 * degree), 1, {phi, 0}, 1}},
                     1.0, Vec3(0, 0, -1));
  };
  const KeyBlock k = wedge(30 * degree);
  EXPECT_EQ(k.mode, KeyBlock::Mode::wedge);
  EXPECT_NEAR(k.normal_force_1, 0.6733123, 1e-7);
  EXPECT_NEAR(k.normal_force_2, 0.2421064, 1e-7);
  EXPECT_NEAR(std::asin(-k.direction.z()) / degree, 37.058295, 1e-6);
  EXPECT_NEAR(std::atan2(k.direction.x(), k.direction.y()) / degree, 155.848, 1e-3);
  EXPECT_EQ(k.type, KeyBlock::Type::unstable);
  EXPECT_NEAR(k.driving_force * (1 - k.factor_of_safety), 0.0741100, 1e-7);  // a/g
  EXPECT_NEAR(wedge(20 * degree).driving_force * (1 - wedge(20 * degree).factor_of_safety), 0.2694421, 1e-7);
  EXPECT_NEAR(wedge(33.357221 * degree).factor_of_safety, 1, 1e-7);
  EXPECT_EQ(wedge(34 * degree).type, KeyBlock::Type::needs_friction);
}

TEST(KeyBlocks, PlaneSlidingWithCohesion) {
  const double a = 35 * degree, phi = 25 * degree, c = 2000, area = 3, w = 50000;
  const KeyBlock k = key_block({{joint_normal(90 * degree, a), area, {phi, c}, 4}}, 1, Vec3(0, 0, -w));
  EXPECT_EQ(k.mode, KeyBlock::Mode::plane);
  EXPECT_EQ(k.joint_1, 4);
  EXPECT_NEAR(k.factor_of_safety, (w * std::cos(a) * std::tan(phi) + c * area) / (w * std::sin(a)), 1e-12);
  EXPECT_GT(k.direction.x(), 0);
}

TEST(KeyBlocks, FallingTaperedStableEnclosed) {
  const Vec3 down(0, 0, -1);
  EXPECT_EQ(key_block({{Vec3(0, 0, -1), 1, {}, 0}}, 1, down).mode, KeyBlock::Mode::falling);  // roof block
  EXPECT_EQ(key_block({{Vec3(0, 0, 1), 1, {}, 0}}, 1, down).type,
            KeyBlock::Type::stable);  // on a level joint
  EXPECT_EQ(key_block({{Vec3(0, 0, 1), 1, {}, 0}}, 0, down).type, KeyBlock::Type::enclosed);
  // Four planes that close around the block from all sides.
  std::vector<BlockPlane> closed;
  for (const Vec3& n : {Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)})
    closed.push_back({n.normalized(), 1, {}, 0});
  EXPECT_EQ(key_block(closed, 1, down).type, KeyBlock::Type::tapered);
  // Two walls that face each other leave a way out between them.
  EXPECT_NE(key_block({{Vec3(1, 0, 0), 1, {}, 0}, {Vec3(-1, 0, 0), 1, {}, 1}}, 1, down).type,
            KeyBlock::Type::tapered);
}

TEST(KeyBlocks, OfACutRockMass) {
  // One steep and one level joint: the upper block over a plane that dips east at 40 degrees slides.
  CutSpec s;
  s.box = Box3(Vec3::Zero(), Vec3(4, 4, 4));
  s.joints.push_back(
      {.name = "dipping", .dip_direction = 90 * degree, .dip = 40 * degree, .through = Vec3(2, 2, 2)});
  const CutResult r = cut(s);
  ASSERT_EQ(r.blocks.size(), 2u);
  KeyBlockOptions o;
  o.strength = {{30 * degree, 0}};
  o.is_held = [](const Vec3&, const Vec3& n) { return n.x() < -0.5; };
  const auto keys = key_blocks(r, o);
  EXPECT_EQ(keys[1].type, KeyBlock::Type::unstable);
  EXPECT_EQ(keys[1].mode, KeyBlock::Mode::plane);
  EXPECT_NEAR(keys[1].factor_of_safety, std::tan(30 * degree) / std::tan(40 * degree), 1e-9);
  EXPECT_NE(keys[0].type, KeyBlock::Type::unstable);
}

/// The same by a set of one joint that is a rock bridge as a whole: its shear strength holds beside friction.
TEST(KeyBlocks, RockBridgesHoldWhatSlides) {
  CutSpec s;
  s.box = Box3(Vec3::Zero(), Vec3(4, 4, 4));
  s.joint_sets.push_back({.name = "dipping",
                          .dip_direction = 90 * degree,
                          .dip = 40 * degree,
                          .spacing = 20,
                          .origin = Vec3(2, 2, 2),
                          .persistence = 1e-9,
                          .bond_tension = 1e6,
                          .bond_shear = 40e3});
  const CutResult r = cut(s);
  ASSERT_EQ(r.blocks.size(), 2u);
  ASSERT_EQ(r.interfaces.size(), 1u);
  const double area = 4 * 4 / std::cos(40 * degree);
  ASSERT_NEAR(r.interfaces[0].bonded_area, area, 1e-9);
  KeyBlockOptions o;
  o.density = 2600;
  o.strength = {{30 * degree, 0}};
  o.is_held = [](const Vec3&, const Vec3& n) { return n.x() < -0.5; };
  const double driving = 2600 * 9.81 * r.blocks[1].volume * std::sin(40 * degree);
  EXPECT_NEAR(key_blocks(r, o)[1].factor_of_safety,
              std::tan(30 * degree) / std::tan(40 * degree) + 40e3 * area / driving, 1e-9);
}

/// A cliff that overhangs, 10 m high and deep: its face runs from (2, 0) to (12, 10) in x and z; one joint,
/// or two.
CutResult overhang(std::vector<CutJoint> joints) {
  const auto file =
      std::filesystem::temp_directory_path() / ("talus_overhang_" + std::to_string(::getpid()) + ".obj");
  std::ofstream(file) << "v 0 0 0\nv 2 0 0\nv 12 0 10\nv 0 0 10\nv 0 10 0\nv 2 10 0\nv 12 10 10\nv 0 10 10\n"
                         "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
  CutSpec s;
  s.region = file.string();
  s.joints = std::move(joints);
  CutResult r = cut(s);
  std::filesystem::remove(file);
  return r;
}

TEST(KeyBlocks, AnOverhangingFaceIsFree) {
  KeyBlockOptions o;
  o.strength = {{25 * degree, 0}};
  {
    // The joint dips into the mountain: what hangs under it falls; the mountain stands on the region's base.
    const auto keys = key_blocks(
        overhang(
            {{.name = "roof", .dip_direction = 270 * degree, .dip = 60 * degree, .through = Vec3(6, 5, 5)}}),
        o);
    ASSERT_EQ(keys.size(), 2u);
    EXPECT_EQ(keys[1].mode, KeyBlock::Mode::falling);
    EXPECT_EQ(keys[1].factor_of_safety, 0);
    EXPECT_NE(keys[0].type, KeyBlock::Type::unstable);
  }
  {
    // It dips out of the mountain: the wedge over it slides, F = tan(25)/tan(30).
    const auto keys = key_blocks(
        overhang(
            {{.name = "floor", .dip_direction = 90 * degree, .dip = 30 * degree, .through = Vec3(4, 5, 6)}}),
        o);
    ASSERT_EQ(keys.size(), 2u);
    EXPECT_EQ(keys[1].mode, KeyBlock::Mode::plane);
    EXPECT_NEAR(keys[1].factor_of_safety, std::tan(25 * degree) / std::tan(30 * degree), 1e-9);
  }
  {
    // Ground right under the face holds it.
    o.is_held = [](const Vec3&, const Vec3& n) { return n.z() < -0.5; };
    const auto keys = key_blocks(
        overhang(
            {{.name = "roof", .dip_direction = 270 * degree, .dip = 60 * degree, .through = Vec3(6, 5, 5)}}),
        o);
    EXPECT_NE(keys[1].mode, KeyBlock::Mode::falling);
  }
}

TEST(Stereonet, EqualAreaProjection) {
  EXPECT_NEAR(equal_area({0, 0, -1}).norm(), 0, 1e-15);
  EXPECT_NEAR((equal_area({0, 1, 0}) - Eigen::Vector2d(0, 1)).norm(), 0, 1e-12);
  // Plunge 30 degrees to the east: r = sqrt(2) sin(30 deg).
  EXPECT_NEAR((equal_area({std::cos(30 * degree), 0, -std::sin(30 * degree)}) -
               Eigen::Vector2d(std::sqrt(2) * std::sin(30 * degree), 0))
                  .norm(),
              0, 1e-12);
  // An upward line is its opposite.
  EXPECT_NEAR(
      (equal_area({0, std::cos(1.0), std::sin(1.0)}) - equal_area({0, -std::cos(1.0), -std::sin(1.0)}))
          .norm(),
      0, 1e-15);
}

TEST(BlockOutput, SystemIsReadBackAndCurveEndsAtOne) {
  CutSpec s;
  s.box = Box3(Vec3::Zero(), Vec3(4, 3, 2));
  CutJointSet set;
  set.name = "a";
  set.dip_direction = 1;
  set.dip = 1;
  set.spacing = 1.1;
  s.joint_sets = {set};
  set.name = "b<c";
  set.dip_direction = 3;
  s.joint_sets.push_back(set);
  const CutResult r = cut(s);
  const auto dir = std::filesystem::temp_directory_path() / ("talus_blocks_" + std::to_string(::getpid()));
  std::filesystem::create_directory(dir);
  write_mesh((dir / "blocks.obj").string(), block_system(r));
  const auto again = read_block_system((dir / "blocks.obj").string());
  ASSERT_EQ(again.size(), r.blocks.size());
  for (std::size_t b = 0; b < again.size(); ++b) {
    EXPECT_EQ(again[b].name, "R" + std::to_string(b + 1));
    EXPECT_NEAR(again[b].volume, r.blocks[b].volume, 1e-12);
    EXPECT_NEAR((again[b].centroid - r.blocks[b].centroid).norm(), 0, 1e-12);
  }
  KeyBlockOptions o;
  o.strength = {{0.5, 0}};
  const auto keys = key_blocks(r, o);
  write_blocks_vtu((dir / "blocks.vtu").string(), r, keys);
  write_blocks_csv((dir / "blocks.csv").string(), r, "R", keys);
  write_interfaces_csv((dir / "interfaces.csv").string(), r);
  std::ifstream csv(dir / "blocks.csv");
  std::size_t lines = 0;
  for (std::string line; std::getline(csv, line);) ++lines;
  EXPECT_EQ(lines, r.blocks.size() + 1);
  const SizeCurve c = size_curve(r);
  EXPECT_NEAR(c.passing.back(), 1, 1e-12);
  EXPECT_LE(c.v25, c.v50);
  EXPECT_LE(c.v50, c.v90);
  EXPECT_NE(size_curve_svg(c).find("</svg>"), std::string::npos);
  const std::string net = stereonet_svg(s, r);
  EXPECT_NE(net.find("b&lt;c"), std::string::npos);
  std::filesystem::remove_all(dir);
}
