// Rock masses that are cut out of the terrain: they start in the slope.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include "sim/simulation.hpp"
#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double degree = M_PI / 180;

/// A slope of 40 degrees that falls along x from (0, 0, 30) for 46 m, and a slip surface of 25 degrees that
/// comes out of it at x = 20 m.
class CutFromTerrain : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    file_ =
        std::filesystem::temp_directory_path() / fmt::format("talus-slip-{}-{}.obj", test->name(), getpid());
    std::ofstream out(file_);
    const double exit = 30 - 20 * std::tan(40 * degree), rise = std::tan(25 * degree);
    for (const auto& [x, y] :
         {std::pair(6.0, -4.0), std::pair(24.0, -4.0), std::pair(24.0, 4.0), std::pair(6.0, 4.0)})
      out << fmt::format("v {} {} {:.17g}\n", x, y, exit + (20 - x) * rise);
    out << "f 1 2 3\nf 1 3 4\n";
  }
  void TearDown() override { std::filesystem::remove(file_); }

  std::string scene(double friction, double duration, const std::string& joints) const {
    return fmt::format(R"(schema = 1
[simulation]
duration = {}
accuracy = 1e-3
[output]
history_interval = 0.1
[site]
material = "slope"
crest = [0.0, 0.0, 30.0]
dip_direction = "90 deg"
width = "30 m"
face = [{{ dip = "40 deg", length = "46 m" }}, {{ dip = "0 deg", length = "40 m" }}]
[[material]]
name = "rock"
density = 2600
[[material]]
name = "slope"
[[interface]]
between = ["rock", "*"]
friction = {:.17g}
normal_stiffness = "hard"
[rock_mass]
slip_surface = "{}"
material = "rock"
{})",
                       duration, friction, file_.string(), joints);
  }

  std::filesystem::path file_;
};

const char* const joints = R"(
[[rock_mass.joint_set]]
orientation = "90/85"
spacing = 3
[[rock_mass.joint_set]]
orientation = "0/88"
spacing = 3.1
)";

TEST_F(CutFromTerrain, OneBlockSlidesOutByTheClosedForm) {
  const double friction = std::tan(15 * degree),
               a = g * (std::sin(25 * degree) - friction * std::cos(25 * degree));
  const Outcome o = run_scene(scene(friction, 1, ""));
  ASSERT_TRUE(o.ok()) << o.result.message;
  ASSERT_EQ(o.last().position.size(), 1u);
  const Vec3 way = o.last().position[0] - o.rows.front().position[0];
  EXPECT_NEAR(way.x(), 0.5 * a * std::cos(25 * degree), 1e-3);
  EXPECT_NEAR(way.z(), -0.5 * a * std::sin(25 * degree), 1e-3);
  EXPECT_NEAR(way.y(), 0, 1e-3);
}

TEST_F(CutFromTerrain, TheBedsFrictionHoldsIt) {
  // The slope beside holds at any angle, the bed does not.
  std::string text = scene(2, 1, "");
  text.insert(text.find("slip_surface"), "bed_material = \"bed\"\n");
  text += fmt::format(
      "[[material]]\nname = \"bed\"\n[[interface]]\nbetween = [\"rock\", \"bed\"]\n"
      "friction = {:.17g}\nnormal_stiffness = \"hard\"\n",
      std::tan(15 * degree));
  const Outcome o = run_scene(text);
  ASSERT_TRUE(o.ok()) << o.result.message;
  const double a = g * (std::sin(25 * degree) - std::tan(15 * degree) * std::cos(25 * degree));
  EXPECT_NEAR((o.last().position[0] - o.rows.front().position[0]).norm(), 0.5 * a, 1e-3);
}

TEST_F(CutFromTerrain, AMassInTheGroundIsOneFault) {
  std::string text = scene(0.5, 1, joints);
  const std::string key = "slip_surface = \"" + file_.string() + "\"";
  text.replace(text.find(key), key.size(), "box = { min = [8.0, -4.0, 10.0], max = [20.0, 4.0, 22.0] }");
  try {
    run_scene(text);
    FAIL() << "taken";
  } catch (const InputError& e) {
    ASSERT_EQ(e.problems().size(), 1u);
    EXPECT_EQ(e.problems()[0].key, "rock_mass");
    EXPECT_NE(e.problems()[0].remedy.find("from_terrain"), std::string::npos);
  }
}

TEST_F(CutFromTerrain, ThePlanSaysThatTheyLieInTheirHollow) {
  const sim::Simulation simulation(scene::read_scene_text(scene(0.5, 1, joints), "scene.toml"));
  std::string start;
  for (const std::string& line : simulation.plan())
    if (line.find("Start:") != std::string::npos) start = line;
  EXPECT_NE(start.find("blocks of the rock mass in their hollow"), std::string::npos) << start;
  EXPECT_EQ(start.find("m above the ground"), std::string::npos) << start;
}

TEST_F(CutFromTerrain, BlocksThatFrictionHoldsStayInTheirPlaces) {
  const Outcome o = run_scene(scene(std::tan(30 * degree), 2, joints));
  ASSERT_TRUE(o.ok()) << o.result.message;
  ASSERT_GE(o.last().position.size(), 12u);
  for (std::size_t i = 0; i < o.last().position.size(); ++i)
    EXPECT_LE((o.last().position[i] - o.rows.front().position[i]).norm(), 1e-6) << i;
}

// Slices that fill a box side by side, from wall to wall: nothing presses them on its sides, so that the bed
// alone holds them back.
TEST_F(CutFromTerrain, SlicesBetweenTheSidesOfABoxSlideOutByTheClosedForm) {
  const double friction = std::tan(15 * degree), t = 0.5,
               a = g * (std::sin(25 * degree) - friction * std::cos(25 * degree));
  const Outcome o = run_scene(scene(friction, t, R"(
box = { min = [7, -3, 10], max = [24, 3, 32] }
[[rock_mass.joint_set]]
orientation = "0/90"
spacing = 0.5
)"));
  ASSERT_TRUE(o.ok()) << o.result.message;
  ASSERT_GE(o.last().position.size(), 12u);
  for (std::size_t i = 0; i < o.last().position.size(); ++i)
    EXPECT_NEAR((o.last().position[i] - o.rows.front().position[i]).norm(), 0.5 * a * t * t, 2e-3) << i;
}

/// A rough slope of 1 m squares as an ESRI grid, and a slip surface that is it but for a spoon of 2 m.
class NaturalTerrain : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    static int count = 0;
    directory_ =
        std::filesystem::temp_directory_path() / fmt::format("talus-natural-{}-{}", getpid(), count++);
    std::filesystem::create_directories(directory_);
    std::ofstream dem(directory_ / "dem.asc"), slip(directory_ / "slip.asc");
    constexpr int n = 25;
    std::uint32_t state = 7;
    for (std::ofstream* out : {&dem, &slip})
      *out << "ncols 25\nnrows 25\nxllcenter 0\nyllcenter 0\ncellsize 1\n";
    for (int j = n - 1; j >= 0; --j, dem << "\n", slip << "\n")
      for (int i = 0; i < n; ++i) {
        state = state * 1664525u + 1013904223u;
        const double z = std::round(100 * (50 - 0.6 * i + std::sin(j / 4.0) + 4e-10 * state)) / 100;
        const double r_sq = ((i - 12.0) * (i - 12) + (j - 11.0) * (j - 11)) / 64;
        dem << fmt::format("{:.2f} ", z);
        slip << fmt::format("{:.2f} ", r_sq < 1 ? z - 2 * (1 - r_sq) : z);
      }
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }
  std::filesystem::path directory_;
};

TEST_P(NaturalTerrain, BlocksLieInTheirHollow) {
  const Outcome o = run_scene(fmt::format(R"(schema = 1
[simulation]
duration = 1
[site]
terrain = "{0}/dem.asc"
material = "slope"
{1}
[[material]]
name = "rock"
density = 2600
[[material]]
name = "slope"
[[interface]]
between = ["rock", "*"]
friction = "45 deg"
normal_stiffness = "hard"
[rock_mass]
slip_surface = "{0}/slip.asc"
material = "rock"
least_volume = 0.1
[[rock_mass.joint_set]]
orientation = "90/85"
spacing = 4
[[rock_mass.joint_set]]
orientation = "200/70"
spacing = 5
)",
                                          directory_.string(), GetParam()));
  ASSERT_TRUE(o.ok()) << o.result.message;
  ASSERT_GE(o.last().position.size(), 8u);
  for (std::size_t i = 0; i < o.last().position.size(); ++i)
    EXPECT_LE((o.last().position[i] - o.rows.front().position[i]).norm(), 1e-6) << i;
}

INSTANTIATE_TEST_SUITE_P(AsItIsAndThinnedOut, NaturalTerrain, ::testing::Values("", "decimation = 0.2"));

/// A rough slope, cut by two sets, and how small its blocks may be.
struct Merged {
  int seed;  // of its roughness
  double least_volume;
  const char *steep, *flat;
  double steep_spacing, flat_spacing;
};
class MergedBlocks : public ::testing::TestWithParam<Merged> {};

// Blocks that share a rough face meet edge on edge along it. Lines through edges that end in one corner,
// drawn out beyond it, pass each other at some depth: no overlap where that place is in one of the bodies
// alone.
TEST_P(MergedBlocks, DoNotOverlap) {
  const Merged& c = GetParam();
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("talus-merged-{}-{}.asc", c.seed, getpid());
  {
    std::ofstream dem(file);
    dem << "ncols 12\nnrows 12\nxllcenter 0\nyllcenter 0\ncellsize 1\n";
    for (int j = 11; j >= 0; --j, dem << "\n")
      for (int i = 0; i < 12; ++i)
        dem << fmt::format(
            "{:.3f} ",
            20 - 0.6 * i + 0.9 * ((7 * i * i + 13 * i * j + 5 * j * j + c.seed * (i + 3 * j)) % 17) / 17);
  }
  const std::string text =
      fmt::format(R"(schema = 1
[simulation]
duration = 0.01
[site]
terrain = "{}"
material = "slope"
[[material]]
name = "rock"
density = 2600
[[interface]]
between = ["*", "*"]
friction = 0.5
normal_stiffness = "hard"
[rock_mass]
from_terrain = true
box = {{ min = [1, 1, 11.4], max = [10, 10, 30] }}
material = "rock"
least_volume = {}
[[rock_mass.joint_set]]
orientation = "{}"
spacing = {}
[[rock_mass.joint_set]]
orientation = "{}"
spacing = {}
)",
                  file.string(), c.least_volume, c.flat, c.flat_spacing, c.steep, c.steep_spacing);
  try {
    const Outcome o = run_scene(text);
    EXPECT_TRUE(o.ok()) << o.result.message;
    EXPECT_GE(o.last().position.size(), 10u);
  } catch (const InputError& e) { ADD_FAILURE() << e.what(); }
  std::filesystem::remove(file);
}

INSTANTIATE_TEST_SUITE_P(OfRoughSlopes, MergedBlocks,
                         ::testing::Values(Merged{69, 0.5, "350/85", "80/30", 2, 1.5},
                                           Merged{158, 0.5, "350/85", "80/30", 3, 2},
                                           Merged{300, 1, "10/85", "100/30", 3, 2},
                                           Merged{362, 2, "350/85", "100/30", 3, 3}));

}  // namespace
}  // namespace talus::verify
