// Rock masses that are cut out of a terrain.
#include <cmath>

#include "fixture.hpp"

namespace talus::scene {
namespace {

/// A rock mass on a slip surface in a terrain, in words.
const std::string hollow = R"(schema = 1
[simulation]
duration = 1
[site]
material = "slope"
crest = [0.0, 0.0, 30.0]
dip_direction = "90 deg"
width = "30 m"
face = [{ dip = "40 deg", length = "46 m" }]
[[material]]
name = "rock"
density = 2600
[[material]]
name = "slope"
[[material]]
name = "bed"
roughness = { amplitude = 0.1, length = 1 }
[[interface]]
between = ["rock", "*"]
friction = 0.5
normal_stiffness = "hard"
[rock_mass]
slip_surface = "slope.stl"
material = "rock"
bed_material = "bed"
[[rock_mass.joint_set]]
orientation = "90/85"
spacing = 3
[[rock_mass.joint]]
orientation = "90/80"
through = [0, 0, 0]
)";

TEST(ReadScene, JointsWithoutANameHaveOneByTheirPlace) {
  const Place place;
  const Scene s = read_scene_text(
      hollow, place.scene(),
      {{"rock_mass.joint_set.J1.spacing", "4.5"}, {"rock_mass.joint.K1.through", "[1, 2, 3]"}});
  ASSERT_EQ(s.rock_mass->joint_sets.size(), 1u);
  EXPECT_EQ(s.rock_mass->joint_sets[0].name, "J1");
  EXPECT_EQ(s.rock_mass->joint_sets[0].spacing, 4.5);
  EXPECT_EQ(s.rock_mass->joints[0].name, "K1");
  EXPECT_EQ(s.rock_mass->joints[0].through, Vec3(1, 2, 3));
}

TEST(ReadScene, WhatTheProgramWroteItselfIsNotWarnedOf) {
  const Place place;
  const Scene s =
      read_scene_text(changed(hollow, "roughness = { amplitude = 0.1, length = 1 }\n", ""), place.scene());
  EXPECT_EQ(text_of(s.warnings), "");
  place.put("scene.resolved.json", s.resolved_json);
  EXPECT_EQ(text_of(read_scene((place.path() / "scene.resolved.json").string()).warnings), "");
}

TEST(ReadScene, RoughnessOfAHollowIsWarnedOfForWhatItIs) {
  const Place place;
  const std::string warnings = text_of(read_scene_text(hollow, place.scene()).warnings);
  EXPECT_NE(warnings.find("the hollow that the rock mass lies in keeps the shape"), std::string::npos)
      << warnings;
}

TEST(ReadScene, ARockMassIsCutOutOfATerrainAlone) {
  const Place place;
  std::string text = hollow;
  const auto from = text.find("[site]"), to = text.find("[[material]]");
  text.erase(from, to - from);
  for (const std::string& key : {std::string("slip_surface = \"slope.stl\""),
                                 std::string("from_terrain = true\nregion = \"slope.stl\"")}) {
    try {
      read_scene_text(changed(text, "slip_surface = \"slope.stl\"", key), place.scene());
      FAIL() << "taken";
    } catch (const InputError& e) {
      EXPECT_NE(text_of(e.problems()).find("has no terrain that the rock mass could be cut out of"),
                std::string::npos)
          << text_of(e.problems());
    }
  }
}

}  // namespace
}  // namespace talus::scene
