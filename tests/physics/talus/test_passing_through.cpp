// Steps leave nothing behind ground that it went through. No vertex behind a plane: neither of a block that
// rings, whose strains turn about many times within a step, nor of one that turns. No block behind a wall of
// the ground that it slides on.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include <array>

#include <fmt/format.h>

#include "dda/state.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// Least height of a vertex over the planes, of all rows [m].
double lowest(const Outcome& o, const std::vector<Plane>& planes) {
  double low = 0;
  for (const sim::HistoryRow& r : o.rows) {
    const Mat3 F = Quat(r.orientation[0][0], r.orientation[0][1], r.orientation[0][2], r.orientation[0][3])
                       .toRotationMatrix() *
                   (Mat3::Identity() + dda::strain_tensor(r.strain[0]));
    for (const Vec3& x : o.simulation->header().blocks[0].shape.vertices)
      for (const Plane& p : planes) low = std::min(low, p.normal.dot(r.position[0] + F * x - p.point));
  }
  return low;
}

TEST(RingingBlocks, LeaveNoVertexBehindAPlane) {
  for (int k = 0; k < 8; ++k) {
    SceneText s(Method::by_accuracy(1e-3), 1.5);
    s.history(0.05)
        .material("rock", 2600, "young = 1e9\npoisson = 0.4\n")
        .material("ground", 2600)
        .interface("*", "*", 10);
    s.plane(Vec3::UnitZ()).plane(Vec3::UnitX(), Vec3(-0.9, 0, 0));
    s.box("B", Vec3(1.1, 0.85, 0.95), Vec3(0, 0, 2),
          "deformable = true\n" + turned(Vec3(2 - 0.3 * k, -1.4 + 0.2 * k, -0.7)) +
              spin(Vec3(0.3, -1, 0.1 * k)));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    EXPECT_GT(lowest(o, o.simulation->header().planes), -1e-9) << k;
  }
}

/// A box that turns on one corner, on a stiff spring, dips another in and lifts it again within one long
/// step.
TEST(TurningBlocks, PutNoCornerThroughAPlaneAndBack) {
  const double k = 5e10;
  for (int i = 0; i < 40; ++i) {
    SceneText s(Method::by_accuracy(1e-3), 0.05);
    s.history(0.05)
        .material("rock", 2600)
        .material("ground", 2600)
        .interface("*", "*", 0,
                   fmt::format("normal_stiffness = \"{} N/m\"\ndamping_ratio = 1.0\nrestitution = 0.1", k),
                   k);
    s.plane(Vec3::UnitZ());
    s.box("B", Vec3(0.55609724217782353, 0.57249597304792976, 0.4835704521942239),
          Vec3(0, 0, 0.33261874709430411 + 2.6e-7),
          "deformable = false\n" +
              turned(Vec3(-0.77885103246038512, 2.8857198007072613, -0.56822326704843473)) +
              velocity(Vec3(0, 0, -0.56384514901135552)) +
              spin(Vec3(2.9161400832074129, 1.807966653822239, -3.2357989794738589) * (1 + 0.002 * i)));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    EXPECT_GT(lowest(o, o.simulation->header().planes), -1.4e-4) << i;  // what the spring takes to stop it
  }
}

/// In contact with the floor, a block meets the wall of the same terrain within a step that takes it farther
/// than its size: deep in there it touches nothing.
TEST(SlidingBlocks, GoThroughNoWallOfTheirGround) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("talus_wall_" + std::to_string(::getpid()) + ".asc"))
          .string();
  std::ofstream file(path);
  file << "ncols 13\nnrows 5\nxllcenter -4\nyllcenter -4\ncellsize 2\nNODATA_value -9999\n";
  for (int i = 0; i < 65; ++i)
    file << (i % 13 < 7 ? 0 : 20) << (i % 13 == 12 ? '\n' : ' ');  // rises between x = 8 and 10
  file.close();
  for (int i = 0; i < 20; ++i) {
    SceneText s(Method::by_accuracy(1e-3), 0.8);
    s.history(0.05)
        .material("rock", 2500)
        .interface("rock", "ground", 0, "normal_stiffness = \"hard\"\nrestitution = 0.0")
        .raw("[site]\nterrain = \"" + path + "\"\nmaterial = \"ground\"\n");
    s.box("B", Vec3(0.1, 0.1, 0.1), Vec3(0.05 * i, 0.03, 0.05),
          "deformable = false\n" + velocity(Vec3(14, 0, 0)));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    for (const sim::HistoryRow& r : o.rows)
      ASSERT_GT(r.position[0].z(), 10 * (r.position[0].x() - 8)) << i << " at " << r.time;
  }
  std::filesystem::remove(path);
}

/// A rod that is struck at its end turns about its middle, which goes no farther than it would have gone: its
/// other end goes twice as far, into what was out of reach.
TEST(TurningBlocks, MeetWhatOnlyTheirTurningReaches) {
  for (int i = 0; i < 8; ++i) {
    SceneText s(Method::by_accuracy(1e-3), 0.1, Vec3::Zero());
    s.history(0.05)
        .material("rock", 2600)
        .interface("*", "*", 0, "normal_stiffness = \"hard\"\nrestitution = 0.0");
    s.box("rod", Vec3(1.6, 0.08, 0.08), Vec3::Zero(), "deformable = false\n" + velocity(Vec3(0, 0, 1)));
    s.box("striker", Vec3(0.09, 0.09, 0.09), Vec3(0.75, -0.1 - 0.01 * i, 0),
          "deformable = false\n" + velocity(Vec3(0, 20, 1)));
    s.box("plate", Vec3(0.6, 1, 4), Vec3(-0.8, -0.625, 0), "fixed = true\n");
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    EXPECT_GT(std::abs(o.rows.back().spin[0].z()), 0.1) << i;  // it was struck
    for (const sim::HistoryRow& r : o.rows) {
      const Mat3 R = Quat(r.orientation[0][0], r.orientation[0][1], r.orientation[0][2], r.orientation[0][3])
                         .toRotationMatrix();
      for (const Vec3& corner : o.simulation->header().blocks[0].shape.vertices) {
        const Vec3 x = r.position[0] + R * corner;
        if (x.x() < -0.5) { EXPECT_GT(x.y(), -0.125 - 1e-8) << i << " at " << r.time; }
      }
    }
  }
}

/// A chip that spins by 5000 rad/s and falls from 0.2 m: only where its ball may touch the ground is it
/// followed by half radians (2091 steps all the way), and there it is met as ever.
TEST(PassingThrough, WhatSpinsOutOfReachTakesLongSteps) {
  SceneText s(Method::by_accuracy(1e-3), 0.3);
  s.history(0.01)
      .material("rock", 2500)
      .interface("*", "*", 0.3, "normal_stiffness = \"hard\"\nrestitution = 0.5")
      .plane(Vec3::UnitZ(), Vec3::Zero(), "rock");
  s.box("chip", Vec3(0.02, 0.01, 0.005), Vec3(0, 0, 0.2), spin(Vec3(5000, 0, 0)));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_LT(o.result.counters.steps, 200);
  EXPECT_EQ(o.result.counters.impacts, 1);
  EXPECT_NEAR(o.last().position[0].z(), 0.85185681,
              1e-6);  // thrown up by its edge, as in steps of half a radian
}

}  // namespace
}  // namespace talus::verify
