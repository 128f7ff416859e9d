// What `talus check` says of the ground under the blocks: the friction of the zone that each lies on, and the
// area of each zone.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "scene/scene.hpp"
#include "sim/simulation.hpp"

namespace talus::verify {
namespace {

std::string text_file(const std::string& name, const std::string& text) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("talus_plan_" + std::to_string(::getpid()) + "_" + name))
          .string();
  std::ofstream(path) << text;
  return path;
}

/// A level grid of 40 m x 20 m; its half x > 20 is ice.
std::string plan_of(const std::string& blocks, const std::string& more = "") {
  std::string grid = "ncols 41\nnrows 21\nxllcenter 0\nyllcenter 0\ncellsize 1\n";
  for (int i = 0; i < 21 * 41; ++i) grid += "0 ";
  const std::string terrain = text_file("level.asc", grid);
  const std::string area = text_file(
      "east.geojson",
      R"({"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [[[20, -5], [45, -5], [45, 25], [20, 25], [20, -5]]]}}]})");
  const std::string scene =
      "schema = 1\n[simulation]\nduration = 1\n[site]\nterrain = \"" + terrain +
      "\"\nmaterial = \"gravel\"\n[[site.area]]\npolygon = \"" + area +
      "\"\nmaterial = \"ice\"\n[[material]]\nname = \"rock\"\ndensity = 2650\n[[interface]]\nbetween = "
      "[\"rock\", \"gravel\"]\nfriction = \"35 deg\"\n[[interface]]\nbetween = [\"rock\", \"ice\"]\nfriction "
      "= "
      "\"10 deg\"\n[[interface]]\nbetween = [\"rock\", \"rock\"]\nfriction = \"30 deg\"\n" +
      more + blocks;
  std::string all;
  for (const std::string& line : sim::Simulation(scene::read_scene_text(scene, "/test.toml")).plan())
    all += line + "\n";
  std::filesystem::remove(terrain);
  std::filesystem::remove(area);
  return all;
}

std::string block(const std::string& name, double x, double z = 0.5) {
  return "[[block]]\nname = \"" + name +
         "\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1, 1, 1]\nposition = [" + std::to_string(x) +
         ", 10, " + std::to_string(z) + "]\n";
}

TEST(PlanOfTheRun, SaysThatTheTimeOfSliversAmongBlocksIsUnknown) {
  std::string blocks;
  for (int i = 0; i < 20; ++i) blocks += block("B" + std::to_string(i), 1 + 1.5 * i);
  EXPECT_EQ(plan_of(blocks).find("CPU time: unknown"), std::string::npos) << plan_of(blocks);
  const std::string sliver =
      "[[block]]\nname = \"sliver\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [0.05, 0.05, "
      "0.002]\nposition = [35, 10, 0.5]\n";
  EXPECT_NE(plan_of(blocks + sliver).find("CPU time: unknown"), std::string::npos)
      << plan_of(blocks + sliver);
}

TEST(PlanOfTheGround, NamesTheFrictionOfTheZoneUnderEachBlock) {
  EXPECT_NE(plan_of(block("A", 10)).find("friction alone holds 35 deg"), std::string::npos)
      << plan_of(block("A", 10));
  EXPECT_NE(plan_of(block("A", 30)).find("friction alone holds 10 deg"), std::string::npos)
      << plan_of(block("A", 30));
  EXPECT_NE(plan_of(block("A", 10) + block("B", 30)).find("friction alone holds 10 to 35 deg"),
            std::string::npos);
}

TEST(PlanOfTheRun, GivesTheMassOfEachBlock) {
  EXPECT_NE(plan_of(block("A", 10) + block("B", 30))
                .find("Mass and size: A 2.65 t, 1 x 1 x 1 m; B 2.65 t, 1 x 1 x 1 m."),
            std::string::npos)
      << plan_of(block("A", 10) + block("B", 30));
  std::string many;
  for (int i = 0; i < 9; ++i) many += block("B" + std::to_string(i), 1 + 1.5 * i);
  many +=
      "[[block]]\nname = \"small\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [0.1, 0.1, 0.2]\nposition = "
      "[35, 10, 0.5]\n";
  EXPECT_NE(plan_of(many).find("Mass: 5.3 kg to 2.65 t, the least small, "), std::string::npos)
      << plan_of(many);
}

TEST(PlanOfTheGround, APlaneAboveTheTerrainIsTheGround) {
  const std::string plane = "[[plane]]\npoint = [0, 0, 1]\nnormal = [0, 0, 1]\nmaterial = \"rock\"\n";
  EXPECT_NE(plan_of(block("A", 30, 1.5), plane).find("friction alone holds 30 deg"), std::string::npos)
      << plan_of(block("A", 30, 1.5), plane);
}

TEST(PlanOfTheGround, GivesTheAreaOfEachMaterial) {
  const std::string plan = plan_of(block("A", 10));
  EXPECT_NE(plan.find("gravel 400 m^2, ice 400 m^2"), std::string::npos) << plan;
}

}  // namespace
}  // namespace talus::verify
