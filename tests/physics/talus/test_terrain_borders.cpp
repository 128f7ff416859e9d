// Over the border of a terrain, and over the rim of a hole in it: the ground ends in a wall, and nothing
// gains energy there.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// Level ground of 40 m, whose middle node has no data.
class TerrainBorders : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream file(path_);
    file << "ncols 9\nnrows 9\nxllcenter -20\nyllcenter -20\ncellsize 5\nNODATA_value -9999\n";
    for (int i = 0; i < 81; ++i) file << (i == 40 ? -9999 : 0) << (i % 9 == 8 ? '\n' : ' ');
  }
  void TearDown() override { std::filesystem::remove(path_); }
  SceneText scene(double duration, double friction, const std::string& more) const {
    SceneText s(Method::by_accuracy(1e-3), duration);
    return s.history(0.05)
        .material("rock", 2500)
        .interface("rock", "ground", friction, "normal_stiffness = \"hard\"\n" + more)
        .raw("[site]\nterrain = \"" + path_ + "\"\nmaterial = \"ground\"\n");
  }
  const std::string path_ =
      (std::filesystem::temp_directory_path() / ("talus_borders_" + std::to_string(::getpid()) + ".asc"))
          .string();
};

double most_gained(const Outcome& o) {
  double most = 0;
  for (std::size_t i = 1; i < o.rows.size(); ++i) {
    const sim::LedgerRow &now = o.rows[i].ledger, &before = o.rows[i - 1].ledger;
    most = std::max(most, now.kinetic + now.potential - before.kinetic - before.potential);
  }
  return most;
}

TEST_F(TerrainBorders, FallsThroughAHoleWithoutGain) {
  SceneText s = scene(2, 0.5, "");
  s.box("A", Vec3(1, 1, 1), Vec3(-8, 0, 0.5), velocity(Vec3(6, 0, 0)));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  EXPECT_LT(most_gained(o), 1e-4 * 45000);  // 5.6e3 J where the sheet ended in the air
  EXPECT_LT(o.last().position[0].z(), -3);
  const double fallen = o.last().velocity[0].z() - o.rows[o.rows.size() - 5].velocity[0].z();
  EXPECT_NEAR(fallen, -g * 0.2, 1e-9);  // free
}

/// A bar that slides flat over an oblique rim and tips: its upright edges lean towards the rim, far behind
/// it.
TEST_F(TerrainBorders, TipsOverAnObliqueRimWithoutGain) {
  SceneText s = scene(1.1, 0.17, "restitution = 0.4");
  s.box("A", Vec3(2, 0.4, 0.3), Vec3(4, -8, 0.2),
        velocity(Vec3(-2.93, 5, 0)) + spin(Vec3(0, 0, 1)) + turned(Vec3(0, 0, -0.423)));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  EXPECT_LT(most_gained(o), 1e-4 * o.rows.front().ledger.kinetic);
}

TEST_F(TerrainBorders, RollsOverACornerWithoutGain) {
  SceneText s = scene(3, 0.363997, "");
  s.raw(
      "[[block]]\nname = \"A\"\nmaterial = \"rock\"\nshape = \"dodecahedron\"\nvolume = 0.6\nposition = "
      "[17.5, 17.5, 0.9]\n" +
      velocity(Vec3(4, 4, 0)) + spin(Vec3(2.162, 0.477236, 0.346955)) +
      turned(Vec3(0.329478, 0.355343, 0.167197)));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  EXPECT_LT(most_gained(o), 1e-3 * o.rows.front().ledger.kinetic);
}

/// A cube slides along the border of two zones, flush with it: on either side it is the zone under it that
/// brakes, whichever triangle names the corners on the border.
TEST_F(TerrainBorders, WhatIsFlushWithTheBorderOfAZoneStandsOnOneAlone) {
  const std::string zone = path_ + ".geojson";
  std::ofstream(zone)
      << R"({"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, "geometry": )"
      << R"({"type": "Polygon", "coordinates": [[[10, -20], [20, -20], [20, 20], [10, 20], [10, -20]]]}}]})";
  for (const bool on_ice : {false, true}) {
    SceneText s(Method::by_accuracy(1e-3), 0.3);
    s.history(0.3)
        .material("rock", 2500)
        .material("ice", 900)
        .interface("rock", "ground", 0.6, "normal_stiffness = \"hard\"")
        .interface("rock", "ice", 0.1, "normal_stiffness = \"hard\"")
        .raw("[site]\nterrain = \"" + path_ + "\"\nmaterial = \"ground\"\n[[site.area]]\npolygon = \"" +
             zone + "\"\nmaterial = \"ice\"\n");
    s.box("A", Vec3(2, 1, 1), Vec3(on_ice ? 11 : 9, -8, 0.5), velocity(Vec3(0, 2, 0)));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok()) << o.result.message;
    EXPECT_NEAR(o.last().velocity[0].y(), 2 - (on_ice ? 0.1 : 0.6) * g * 0.3, 1e-6);
  }
  std::filesystem::remove(zone);
}

/// A cube of 2 m slides over the end of a channel that it fills from wall to wall, and tips over the lip: the
/// walls that only touch it change nothing. Reference: the same with a play of 1 um, to the accuracy of
/// impacts on the lip.
TEST(ChannelEnd, ACubeThatFillsTheChannelTipsAsOneWithPlay) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("talus_channel_" + std::to_string(::getpid()) + ".obj"))
          .string();
  {
    std::ofstream file(path);
    for (const double y : {-10.0, 1.0})  // 1 to 12: the channel's section at its start and end
      for (const Vec3& x :
           {Vec3(-11, y, 3), Vec3(-1, y, 3), Vec3(-1, y, 0), Vec3(1, y, 0), Vec3(1, y, 3), Vec3(11, y, 3)})
        file << "v " << x.transpose() << '\n';
    for (const double x : {-11.0, -1.0, 1.0, 11.0})
      file << "v " << x << " 1 -20\n";  // 13 to 16: the cliff's foot
    file << "v -11 31 -20\nv 11 31 -20\n";
    for (int k = 1; k <= 5; ++k)
      file << "f " << k << ' ' << k + 1 << ' ' << k + 7 << "\nf " << k << ' ' << k + 7 << ' ' << k + 6
           << '\n';
    file << "f 7 8 9\nf 7 9 13\nf 9 14 13\nf 9 10 15\nf 9 15 14\nf 10 11 12\nf 10 12 16\nf 10 16 15\n"
         << "f 13 14 17\nf 14 15 18\nf 14 18 17\nf 15 16 18\n";
  }
  for (const double friction : {0.0, 0.1}) {
    Vec3 way[2];
    for (const bool flush : {true, false}) {
      SceneText s(Method::by_accuracy(1e-3), 1.5);
      s.history(0.05)
          .material("rock", 2500)
          .interface("rock", "ground", friction, "normal_stiffness = \"hard\"")
          .raw("[site]\nterrain = \"" + path + "\"\nmaterial = \"ground\"\n");
      s.box("A", Vec3(flush ? 2 : 2 - 2e-6, 2, 2), Vec3(0, 0, 1), velocity(Vec3(0, 2, 0)));
      const Outcome o = run_scene(s.str());
      ASSERT_TRUE(o.ok()) << o.result.message;
      EXPECT_LT(most_gained(o), 1e-3 * o.last().ledger.kinetic) << friction << flush;  // the accuracy
      way[flush ? 0 : 1] = o.last().position[0] - o.rows.front().position[0];
    }
    EXPECT_NEAR((way[0] - way[1]).norm(), 0, 5e-3 * way[1].norm()) << friction;
  }
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace talus::verify
