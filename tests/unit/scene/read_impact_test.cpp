// The block of [impact], from keys and from files.
#include <cmath>

#include "fixture.hpp"

namespace talus::scene {
namespace {

TEST(ReadScene, AnImpactNeedsNoLawOfWhatItLeavesOut) {
  const Place place;
  std::string text = changed(full, "[output]",
                             "[impact]\nmaterial = \"rock\"\nshape = \"sphere\"\ndiameter = 1\nvelocity = "
                             "[10, 0, 0]\npoint = [0, 0, 5]\n"
                             "[output]");
  text +=
      "\n[[material]]\nname = \"ice\"\ndensity = 900\n[[block]]\nname = \"I\"\nmaterial = \"ice\"\nshape = "
      "\"box\"\nsize = [1, 1, 1]\nposition = [0, 0, 300]\n";
  const auto reads = [&](Purpose purpose) {
    place.put("scene.toml", text);
    try {
      return read_scene(place.scene(), {}, purpose).blocks.empty();
    } catch (const InputError& e) {
      EXPECT_NE(text_of(e.problems()).find("can meet, and no [[interface]] covers them"), std::string::npos)
          << text_of(e.problems());
      return false;
    }
  };
  EXPECT_FALSE(reads(Purpose::run));
  EXPECT_TRUE(reads(Purpose::impact));
}

TEST(ReadScene, ImpactFromSpeedAndFromATrajectory) {
  const Place place;
  const std::string structure = full.substr(full.find("[[structure]]"));
  const std::string head =
      "schema = 1\n[[material]]\nname = \"rock\"\ndensity = 2500\n[[material]]\nname = \"C40\"\nf_cm = \"48 "
      "MPa\"\n[[interface]]\nbetween = [\"*\", \"*\"]\nfriction = 0.5\n";
  const Scene s = read_scene_text(
      head +
          "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\nmass = \"5 t\"\nvelocity = \"20 m/s\"\nangle "
          "= \"30 deg\"\ndirection = \"90 deg\"\npoint = [19.0, 0.0, 6.0]\n" +
          structure,
      place.scene());
  ASSERT_TRUE(s.impact);
  EXPECT_TRUE(s.impact->velocity.isApprox(20 * Vec3(std::cos(30 * degree), 0, -0.5), 1e-14));
  EXPECT_EQ(s.impact->shape.mass, 5000);
  const Scene t = read_scene_text(
      head + "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\ntrajectories = \"paths.csv\"\nrow = 2\n" +
          structure,
      place.scene());
  EXPECT_EQ(t.impact->velocity, Vec3(12, 0, -2));
  EXPECT_EQ(t.impact->point, Vec3(0, 1, 5));
  EXPECT_EQ(t.impact->shape.mass, 3000);
  EXPECT_EQ(t.impact->trajectory, "row 2 (line 3) of " + (place.path() / "paths.csv").string());
  place.put("upper.csv", "X,Y,Z,VX [km/h],Vy,vz,MASS [t]\n0,1,5,36,0,-2,3\n");
  const Scene upper = read_scene_text(
      head + "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\ntrajectories = \"upper.csv\"\n" + structure,
      place.scene());
  EXPECT_TRUE(upper.impact->velocity.isApprox(Vec3(10, 0, -2), 1e-14));
  EXPECT_EQ(upper.impact->shape.mass, 3000);
  const Scene agreeing = read_scene_text(
      head + "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\ntrajectories = \"both.csv\"\nrow = 2\n" +
          structure,
      place.scene());
  EXPECT_EQ(agreeing.impact->shape.mass, 2500);
  const Scene again = read_scene_text(t.resolved_json, place.scene());
  EXPECT_TRUE(again.resolved_json == t.resolved_json);

  // Spin and orientation of the file, which went unread; those of the scene go before them.
  const std::string turning =
      head + "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\ntrajectories = \"turning.csv\"\n";
  const Scene w = read_scene_text(turning + structure, place.scene());
  EXPECT_EQ(w.impact->spin, Vec3(1, 2, 3));
  EXPECT_TRUE(w.impact->rotation.isApprox(Quat(0.6, 0, 0, 0.8).toRotationMatrix(), 1e-14));
  const Scene kept = read_scene_text(turning + "spin = [0, 0, 1]\n" + structure, place.scene());
  EXPECT_EQ(kept.impact->spin, Vec3(0, 0, 1));
  const Scene resolved = read_scene_text(w.resolved_json, place.scene());
  EXPECT_EQ(resolved.impact->spin, w.impact->spin);
  EXPECT_TRUE(resolved.impact->rotation.isApprox(w.impact->rotation, 1e-14));
}

TEST(ReadScene, ImpactByTheHistoriesThatConvertWrites) {
  const Place place;
  const std::string
      head =
          "schema = 1\n[[material]]\nname = \"rock\"\ndensity = 2600\n[[material]]\nname = \"C40\"\nf_cm = "
          "\"48 MPa\"\n[[interface]]\nbetween = [\"*\", \"*\"]\nfriction = 0.5\n",
      structure =
          "[[structure]]\nname = \"P\"\nkind = \"column\"\nmaterial = \"C40\"\nbase = [0, 0, 0]\nsection = "
          "[2, 2]\nheight = 6\ncell_size = 1\n";
  const auto scene = [&](const std::string& keys) {
    return read_scene_text(head +
                               "[impact]\nmaterial = \"rock\"\nshape = \"EOTA111\"\nvolume = 1\ntrajectories "
                               "= \"histories.csv\"\n" +
                               keys + structure,
                           place.scene());
  };
  const Scene s = scene("block = \"B 2\"\n");
  EXPECT_EQ(s.impact->point, Vec3(4, 5, 6));
  EXPECT_EQ(s.impact->velocity, Vec3(10, 11, 12));
  EXPECT_EQ(s.impact->spin, Vec3(1, 2, 3));
  EXPECT_TRUE(s.impact->rotation.isApprox(Quat(0.6, 0, 0, 0.8).toRotationMatrix(), 1e-14));
  EXPECT_EQ(scene("block = \"B1\"\nrow = 2\n").impact->velocity, Vec3(-7, -8, -9));
  for (const std::string keys : {"", "block = \"B3\"\n"}) {
    try {
      scene(keys);
      ADD_FAILURE() << "not refused: " << keys;
    } catch (const InputError& e) { EXPECT_EQ(e.problems().front().key, "impact.block"); }
  }
}

}  // namespace
}  // namespace talus::scene
