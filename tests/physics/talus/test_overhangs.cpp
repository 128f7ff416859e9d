// Rock that leans over: a cliff and a notch stop what flies against them from outside, however the faces are
// wound in the file.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

using Profile = std::vector<std::array<double, 2>>;  // x and z, from the plateau to the floor

/// A profile extruded along y from -10 to 10 m, in columns; seed 0 keeps the winding, 1 turns all faces,
/// others turn some.
class Overhangs : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  void write(const Profile& profile, unsigned seed) const {
    constexpr int columns = 4;
    std::ofstream file(path_);
    for (const auto& [x, z] : profile)
      for (int j = 0; j <= columns; ++j)
        file << "v " << x << ' ' << -10 + 20.0 * j / columns << ' ' << z << '\n';
    std::mt19937 random(seed);
    const auto face = [&](int a, int b, int c) {
      if (seed == 1 || (seed > 1 && random() % 2)) std::swap(b, c);
      file << "f " << a << ' ' << b << ' ' << c << '\n';
    };
    for (int i = 0; i + 1 < static_cast<int>(profile.size()); ++i)
      for (int j = 1; j <= columns; ++j) {
        const int a = i * (columns + 1) + j, b = a + columns + 1;
        face(a, b, b + 1);
        face(a, b + 1, a + 1);
      }
  }
  Outcome thrown(const Vec3& from, const Vec3& speed, double duration) const {
    SceneText s(Method::by_accuracy(1e-3), duration);
    s.history(0.01)
        .material("rock", 2650)
        .interface("rock", "wall", 0.7, "restitution = 0.3\n")
        .raw("[site]\nterrain = \"" + path_ + "\"\nmaterial = \"wall\"\n");
    s.raw("[[block]]\nname = \"B\"\nmaterial = \"rock\"\nshape = \"EOTA111\"\nvolume = 0.4\nposition = " +
          vector(from) + "\n" + velocity(speed));
    return run_scene(s.str());
  }
  const std::string path_ =
      (std::filesystem::temp_directory_path() / ("talus_overhang_" + std::to_string(::getpid()) + ".obj"))
          .string();
};

const Profile leaning{{-10, 10}, {1, 10}, {0, 0}, {30, 0}};
const Profile notch{{-10, 10}, {0, 10}, {0, 4},
                    {-3, 1.5}, {0, 0},  {30, 0}};  // undercut: its roof overhangs by 50 degrees

TEST_F(Overhangs, ALeaningWallStopsABlock) {
  write(leaning, 0);
  const Outcome o = thrown({5, 0, 6}, {-10, 0, 0}, 2);
  ASSERT_TRUE(o.ok());
  double nearest = 10;
  for (const auto& row : o.rows)
    nearest = std::min(nearest, (row.position[0].x() - 0.1 * row.position[0].z()) / std::sqrt(1.01));
  EXPECT_GT(nearest,
            0.25);  // the wall is reached, and the centroid keeps off it: the block's least radius is 0.36 m
  EXPECT_LT(nearest, 0.6);
  EXPECT_GT(o.last().position[0].x(), 0.3);
}

TEST_F(Overhangs, ANotchHoldsABlockThatIsThrownIntoIt) {
  write(notch, 0);
  const Outcome o = thrown({3, 0, 2.2}, {-10, 0, 2}, 2);
  ASSERT_TRUE(o.ok());
  double farthest = 10;
  for (const auto& row : o.rows) {
    const Vec3& c = row.position[0];
    farthest = std::min(farthest, c.x());
    if (c.x() < 0) {
      EXPECT_LT(c.z(), 4 + c.x() * 2.5 / 3) << row.time;  // below the roof
      EXPECT_GT(c.z(), -c.x() * 0.5) << row.time;         // above the floor of the notch
    }
  }
  EXPECT_LT(farthest, -0.2);  // it was in the notch
  EXPECT_GT(farthest, -2.6);
}

TEST_F(Overhangs, WindingInTheFileChangesNoBit) {
  write(leaning, 0);
  const Outcome given = thrown({5, 1, 6}, {-10, 1, 0}, 1);
  ASSERT_TRUE(given.ok());
  for (unsigned seed = 1; seed < 4; ++seed) {
    write(leaning, seed);
    const Outcome o = thrown({5, 1, 6}, {-10, 1, 0}, 1);
    ASSERT_TRUE(o.ok());
    ASSERT_EQ(o.rows.size(), given.rows.size());
    for (std::size_t i = 0; i < o.rows.size(); ++i) {
      EXPECT_EQ(o.rows[i].position[0], given.rows[i].position[0]) << seed << " " << i;
      EXPECT_EQ(o.rows[i].velocity[0], given.rows[i].velocity[0]) << seed << " " << i;
    }
  }
}

TEST_F(Overhangs, ABlockMayStartUnderOne) {
  write(notch, 0);
  const Outcome o = thrown({-0.8, 0, 1.6}, {0, 0, 0}, 0.2);
  EXPECT_TRUE(o.ok());
}

}  // namespace
}  // namespace talus::verify
