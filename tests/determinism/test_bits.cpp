// The same scene gives the same bits: again, with two threads, and in whatever order its blocks are listed.
#include <gtest/gtest.h>

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "contact/structures/structure.hpp"
#include "core/text_file.hpp"
#include "scene/scene.hpp"
#include "sim/simulation.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// Six falling and turning boxes in two heaps.
std::string scene_of(const std::vector<int>& order, bool apart) {
  SceneText s(Method::by_accuracy(1e-3), 0.6);
  s.history(0.1)
      .material("rock", 2600)
      .interface("rock", "rock", 0.5)
      .interface("rock", "ground", 0.5)
      .plane(Vec3::UnitZ());
  for (int i : order) {
    const Vec3 at = apart ? Vec3(4.0 * i, 0.3 * i, 1.2 + 0.1 * i)
                          : Vec3(6.0 * (i / 3) + 0.1 * i, 0.07 * i, 1.0 + 1.8 * (i % 3));
    s.box(fmt::format("B{}", i), Vec3(1, 1, 1), at, spin(Vec3(0.3 * i, 1, 0.2)));
  }
  return s.str();
}

std::string with_threads(std::string text, int n) {
  const std::string one = "threads = 1";
  text.replace(text.find(one), one.size(), fmt::format("threads = {}", n));
  return text;
}

void expect_same(const sim::HistoryRow& a, std::size_t i, const sim::HistoryRow& b, std::size_t j) {
  EXPECT_EQ(a.position[i], b.position[j]);
  EXPECT_EQ(a.orientation[i], b.orientation[j]);
  EXPECT_EQ(a.velocity[i], b.velocity[j]);
  EXPECT_EQ(a.spin[i], b.spin[j]);
}

/// 200 x 3 ms and 3 x 0.2 s are one instant, though not to the last bit: a checkpoint between the two lost
/// the frame to a run resumed there, and the row after it was some bits off.
TEST(Bits, InstantsThatDifferByRoundingAreOne) {
  ASSERT_NE(200 * 0.003, 3 * 0.2);
  class Instants : public sim::Sink {
   public:
    void history(const sim::HistoryRow& row) override { rows.push_back(row); }
    void field(double time, std::span<const Pose>, std::span<const Structure::Fields>) override {
      frames.push_back(time);
    }
    void checkpoint(const sim::Checkpoint& state) override {
      if (rows.size() == 201) kept = state;
    }
    std::vector<sim::HistoryRow> rows;
    std::vector<double> frames;
    std::optional<sim::Checkpoint> kept;
  } whole, resumed;
  SceneText s(Method::by_accuracy(1e-3), 0.9);
  s.history(0.003)
      .material("rock", 2600)
      .interface("rock", "ground", 0.5)
      .plane(Vec3::UnitZ())
      .box("B", Vec3(1, 1, 1), Vec3(0, 0, 1.2), spin(Vec3(0.3, 1, 0.2)));
  std::string text = s.str();
  text.replace(text.find("interval = "), std::string("interval = ").size(),
               "checkpoint_steps = 1\ninterval = 0.2 #");
  sim::Simulation one(scene::read_scene_text(text, "/test.toml"));
  ASSERT_EQ(one.run(whole).exit_code, 0);
  ASSERT_TRUE(whole.kept.has_value());
  ASSERT_EQ(whole.frames.size(), 6u);  // 0, 0.2, ..., 0.8, and the end
  EXPECT_NEAR(whole.frames[3], 0.6, 1e-12);
  EXPECT_EQ(whole.frames[3], whole.rows[200].time);
  sim::Simulation two(scene::read_scene_text(text, "/test.toml"));
  two.restore(*whole.kept);
  ASSERT_EQ(two.run(resumed).exit_code, 0);
  ASSERT_EQ(resumed.rows.size(), 100u);
  ASSERT_EQ(resumed.frames.size(), 2u);
  for (std::size_t i = 0; i < resumed.rows.size(); ++i)
    expect_same(whole.rows[201 + i], 0, resumed.rows[i], 0);
}

TEST(Bits, SameAgainAndWithTwoThreads) {
  const std::string text = scene_of({0, 1, 2, 3, 4, 5}, false);
  const Outcome a = run_scene(text), b = run_scene(text), two = run_scene(with_threads(text, 2));
  ASSERT_TRUE(a.ok());
  for (std::size_t i = 0; i < 6; ++i) {
    expect_same(a.last(), i, b.last(), i);
    expect_same(a.last(), i, two.last(), i);
  }
}

/// One island whose pairs are searched by several threads: 150 cubes dropped in a heap, each pushed its own
/// way.
TEST(Bits, OneLargeIslandIsTheSameWithTwoThreads) {
  SceneText s(Method::by_accuracy(1e-3), 0.2);
  s.history(0.1)
      .material("rock", 2600)
      .interface("rock", "rock", 0.5)
      .interface("rock", "ground", 0.5)
      .plane(Vec3::UnitZ());
  constexpr int count = 150;
  for (int i = 0; i < count; ++i) {
    const int x = i % 5, y = i / 5 % 5, z = i / 25;
    s.box(fmt::format("B{}", i), Vec3(1, 1, 1), Vec3(1.02 * x + 0.1 * z, 1.02 * y, 0.52 + 1.02 * z),
          spin(0.3 * Vec3((i * 7) % 5 - 2, (i * 3) % 5 - 2, (i * 11) % 3 - 1)));
  }
  const Outcome one = run_scene(s.str()), two = run_scene(with_threads(s.str(), 2));
  ASSERT_TRUE(one.ok());
  ASSERT_TRUE(two.ok());
  for (std::size_t i = 0; i < count; ++i) expect_same(one.last(), i, two.last(), i);
}

/// Islands that come and go, each computed by the thread that is free: what an impact found left over from
/// the island that the thread had before, or from none, put blocks 0.4 mm off.
TEST(Bits, IslandsKnowNothingOfEachOther) {
  const std::string text = read_text(TALUS_SOURCE_DIR "/tests/determinism/mixed_heap.toml");
  const Outcome one = run_scene(text), two = run_scene(with_threads(text, 2));
  ASSERT_TRUE(one.ok()) << one.result.message;
  for (std::size_t i = 0; i < one.last().position.size(); ++i) expect_same(one.last(), i, two.last(), i);
}

TEST(Bits, HeapsFarOffDoNotChangeEachOthersSteps) {
  const std::string both = read_text(TALUS_SOURCE_DIR "/tests/determinism/two_heaps.toml");
  std::string alone = both;
  const std::size_t other = alone.find("# The other heap");
  alone.erase(other, alone.find("# The heap") - other);
  const Outcome a = run_scene(alone), b = run_scene(both);
  ASSERT_TRUE(a.ok() && b.ok());
  const std::size_t n = a.last().position.size(), others = b.last().position.size() - n;
  ASSERT_EQ(n, 3u);
  ASSERT_EQ(others, 5u);
  for (std::size_t i = 0; i < n; ++i) expect_same(a.last(), i, b.last(), others + i);
}

TEST(Bits, OrderOfBlocksDoesNotMatter) {
  const std::vector<int> order{3, 0, 5, 1, 4, 2};
  for (const bool apart : {true, false}) {
    const Outcome a = run_scene(scene_of({0, 1, 2, 3, 4, 5}, apart)), b = run_scene(scene_of(order, apart));
    ASSERT_TRUE(a.ok());
    for (std::size_t i = 0; i < 6; ++i)
      expect_same(a.last(), static_cast<std::size_t>(order[i]), b.last(), i);
    EXPECT_EQ(a.last().ledger.friction_work, b.last().ledger.friction_work);
    EXPECT_EQ(a.last().ledger.kinetic, b.last().ledger.kinetic);
  }
}

/// Names in scene order, masses and fixed ones among them, are told of the right blocks.
TEST(Bits, ResultsListBlocksAsTheSceneDoes) {
  const std::vector<int> order{11, 2, 0, 10, 1};
  SceneText s(Method::by_accuracy(1e-3), 0.1);
  s.material("rock", 2600).interface("rock", "rock", 0.5);
  for (int i : order) s.box(fmt::format("B{}", i), Vec3(1, 1, 1 + i), Vec3(4.0 * i, 0, 20));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  for (std::size_t k = 0; k < order.size(); ++k) {
    EXPECT_EQ(o.simulation->header().blocks[k].name, fmt::format("B{}", order[k]));
    EXPECT_DOUBLE_EQ(o.simulation->header().blocks[k].mass, 2600.0 * (1 + order[k]));
    EXPECT_EQ(o.last().position[k].x(), 4.0 * order[k]);
  }
}

}  // namespace
}  // namespace talus::verify
