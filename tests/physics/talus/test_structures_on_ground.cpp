// Structures that fall, fly, bend or break onto what is fixed: planes, terrain, blocks without degrees of
// freedom.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "core/error.hpp"
#include "sim/simulation.hpp"
#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

const std::string ground_plane = "[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\nmaterial = \"ground\"\n";
const std::string fixed_slab =
    "[[block]]\nname = \"slab\"\nmaterial = \"ground\"\nshape = \"box\"\nsize = [6, 6, 1]\nposition = [0, 0, "
    "-0.5]\nfixed = true\n";

SceneText over_ground(const std::string& ground, double duration) {
  SceneText s(Method::by_accuracy(1e-3), duration, Vec3(0, 0, -9.81));
  s.history(0.01)
      .material("concrete", 2500, "young = 30e9\npoisson = 0.2")
      .material("ground", 2600)
      .interface("concrete", "ground", 0.5);
  s.raw(ground);
  return s;
}

double lowest(const Outcome& o) {
  double z = std::numeric_limits<double>::infinity();
  for (const auto& structure : o.simulation->structures())
    for (const Vec3& x : structure->skin().surface().vertices) z = std::min(z, x.z());
  return z;
}

/// A free cube falls by 1 m onto a plane, and onto a fixed block: it is there when a body in free flight is,
/// the contact's impulse ends its momentum and then bears its weight, and nothing goes through.
TEST(StructuresOnGround, FreeCubeLandsAndStays) {
  for (const std::string& ground : {ground_plane, fixed_slab}) {
    SceneText s = over_ground(ground, 0.8);
    s.raw(structure_box("cube", Vec3(1, 1, 1), Vec3(0.1, 0.05, 1.5), {4, 4, 4}, "concrete",
                        std::string(unsupported) + "probe = [{ name = \"m\", at = [0.1, 0.05, 1.5] }]\n"));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok()) << o.result.message;
    const double lands = std::sqrt(2 * 1.0 / 9.81);
    double deepest = 0;
    for (const sim::HistoryRow& r : o.rows) {
      const double fallen = -r.structures[0].probe_displacement[0].z();
      if (r.time < lands) { EXPECT_NEAR(fallen, 0.5 * 9.81 * r.time * r.time, 1e-6); }
      deepest = std::max(deepest, fallen);
    }
    EXPECT_LT(std::abs(o.last().ledger.numerical_dissipation()),
              0.02 * 2500 * 9.81);  // of the energy of its fall
    EXPECT_LT(deepest, 1.003);      // it is pressed together by a wave, v (rho / E)^(1/2) of its size
    EXPECT_GT(lowest(o), -1e-3);
  }
}

/// The same on terrain whose triangles do not follow the cube's cells.
TEST(StructuresOnGround, FreeCubeLandsOnTerrain) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "ground.obj";
  std::ofstream(file)
      << "v -5 -5 0\nv 5 -5 0\nv 5 5 0\nv -5 5 0\nv 0.3 0.2 0\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
  SceneText s = over_ground("[site]\nterrain = \"" + file.string() + "\"\nmaterial = \"ground\"\n", 0.6);
  s.raw(structure_box("cube", Vec3(1, 1, 1), Vec3(0.1, 0.05, 1.0), {3, 3, 3}, "concrete",
                      std::string(unsupported) + "probe = [{ name = \"m\", at = [0.1, 0.05, 1.0] }]\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  double deepest = 0;
  for (const sim::HistoryRow& r : o.rows)
    deepest = std::max(deepest, -r.structures[0].probe_displacement[0].z());
  EXPECT_NEAR(deepest, 0.5, 3e-3);  // where it lands, between two rows
  EXPECT_GT(lowest(o), -1e-3);
}

/// On a soft ground it sinks in by far more than it moves in a step, and stays found: at rest by m g / k.
TEST(StructuresOnGround, FreeCubeSinksIntoSoftGround) {
  SceneText s(Method::by_accuracy(1e-3), 1.5, Vec3(0, 0, -9.81));
  s.history(0.01)
      .material("concrete", 2500, "young = 30e9\npoisson = 0.2")
      .material("ground", 2600)
      .interface("concrete", "ground", 0.5, "normal_stiffness = \"1e6 Pa/m\"\ndamping_ratio = 0.5");
  s.raw(ground_plane);
  s.raw(structure_box("cube", Vec3(1, 1, 1), Vec3(0.1, 0.05, 0.5), {4, 4, 4}, "concrete", unsupported));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_NEAR(lowest(o), -2500 * 9.81 / 1e6, 2e-3);
}

/// A cantilever is pressed down onto a plane 0.1 m below its tip: it stops there.
TEST(StructuresOnGround, CantileverBearsOnPlane) {
  SceneText s = over_ground(ground_plane, 0.3);
  s.raw(
      structure_box("beam", Vec3(4, 0.4, 0.4), Vec3(2, 0, 0.3), {20, 2, 2}, "concrete",
                    "support = [\"-x\"]\npreload = \"none\"\nload = [{ region = { min = [3.5, -1, 0], max = "
                    "[4.1, 1, 1] }, traction = [0, 0, -3e6], history = [[0, 0], [0.2, 1]] }]\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_GT(lowest(o), -5e-3);
  EXPECT_LT(lowest(o), 1e-3);
}

/// What is built into the ground is founded there: a column whose foot stands half a metre below the plane
/// stays as it is.
TEST(StructuresOnGround, WhatIsBuiltIntoTheGroundIsNotLifted) {
  SceneText s = over_ground(ground_plane, 0.05);
  s.raw(
      structure_box("column", Vec3(1, 1, 3), Vec3(0, 0, 1.0), {4, 4, 12}, "concrete",
                    "support = [\"-z\"]\nprobe = [{ name = \"top\", at = [0, 0, 2.5] }]\ninitial_velocity = "
                    "[0.1, 0, 0]\npreload = \"none\"\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  for (const sim::HistoryRow& r : o.rows)
    EXPECT_LT(std::abs(r.structures[0].probe_displacement[0].z()), 1e-3) << r.time;
}

/// A pier breaks under a boulder: no piece is, or ends, below the ground that it stood on.
TEST(StructuresOnGround, PiecesOfABrokenPierLieOnIt) {
  SceneText s(Method::by_accuracy(1e-3), 0.8, Vec3(0, 0, -9.81));
  s.history(0.01)
      .material("C", 2450, "f_cm = \"38 MPa\"")
      .material("rock", 2600)
      .material("ground", 2600)
      .interface("*", "*", 0.6);
  s.raw(ground_plane);
  s.raw(
      "[[structure]]\nname = \"P\"\nkind = \"column\"\nmaterial = \"C\"\nbase = [0, 0, 0]\nsection = [0.6, "
      "0.6]\nheight = 3\ncell_size = 0.2\nsupport = [\"-z\"]\ndamage = \"concrete\"\n");
  s.raw(
      "[[block]]\nname = \"B\"\nmaterial = \"rock\"\nshape = \"EOTA111\"\nposition = [-1.6, 0.05, "
      "2.0]\nvolume = 0.8\nvelocity = [18.0, 0, 0]\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  ASSERT_GT(o.last().position.size(), 1u);
  for (std::size_t k = 0; k < o.last().position.size(); ++k) EXPECT_GT(o.last().position[k].z(), -0.02) << k;
  EXPECT_GT(lowest(o), -0.02);
}

/// A structure that nothing holds and that starts in the ground is refused: what is built into it is founded
/// there, and it sank through by g t^2 / 2. One that supports hold stands in it.
TEST(StructuresOnGround, WhatSinksInUnheldIsRefused) {
  const auto refused = [](const std::string& ground, double z, const char* held) -> std::string {
    SceneText s = over_ground(ground, 0.01);
    s.raw(structure_box("cube", Vec3(1, 1, 1), Vec3(0.1, 0.05, z), {4, 4, 4}, "concrete", held));
    try {
      return run_scene(s.str()).ok() ? "" : "it ran and failed";
    } catch (const InputError& e) { return e.what(); }
  };
  for (const std::string& ground : {ground_plane, fixed_slab}) {
    for (const double z : {0.4, -0.45})
      EXPECT_NE(refused(ground, z, unsupported).find("nothing holds it, and it overlaps"), std::string::npos)
          << z;
    EXPECT_EQ(refused(ground, 0.5, unsupported), "");
    EXPECT_EQ(refused(ground, 0.4, ""), "");
  }
}

}  // namespace
}  // namespace talus::verify
