// What one run hands on to the next about contacts: bonds that hold, bonds that are torn, where springs have
// sunk to.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "core/error.hpp"
#include "sim/simulation.hpp"
#include "verify/impact_text.hpp"
#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

constexpr double cube_density = 2500, cube_weight = cube_density * g, cube_friction = 0.3;  // of cubes of 1 m

class Rows : public sim::Sink {
 public:
  void history(const sim::HistoryRow& row) override { rows.push_back(row); }
  std::vector<sim::HistoryRow> rows;
};

/// Two cubes on the ground, glued to it with twice their weight and more; one is kicked and comes to rest
/// again beside where it stood.
struct Kicked {
  std::string law = "normal_stiffness = \"hard\"\n";
  bool on_block = false;  // the ground is a fixed block, not a plane
  Vec3 kick = Vec3(0, 0, 0.5);
  Vec3 later = Vec3(0, 0, g);       // gravity of the second run
  double settled = 0.4, end = 0.2;  // durations of the two runs [s]

  std::string text(const Vec3& gravity, double duration, const std::string& more = {}) const {
    // Whether a bond on a spring holds a kick depends on the step that stops it: a fixed one. A checkpoint
    // keeps asleep what sleeps.
    SceneText s(Method::fixed_step(0.01), duration, gravity, "sleeping = false\n");
    s.history(0.01).material("rock", cube_density).material("ground", cube_density);
    for (const char* other : {"ground", "rock"})
      s.interface("rock", other, cube_friction,
                  law + fmt::format("tension = {0}\ncohesion = {0}\n", 2 * cube_weight));
    s.box("kicked", Vec3::Ones(), Vec3(0, 0, 0.5), velocity(kick)).box("left", Vec3::Ones(), Vec3(0, 3, 0.5));
    if (on_block)
      s.box("floor", Vec3(9, 9, 1), Vec3(0, 0, -0.5), "fixed = true\n", "ground");
    else
      s.plane(Vec3::UnitZ());
    return s.raw(more).str();
  }
  Outcome first() const { return run_scene(text({0, 0, -g}, settled)); }
};

/// How far the two have moved in the second run.
struct Moved {
  Vec3 kicked, left;
};
Moved go_on(sim::Simulation& second, const sim::HistoryRow& from) {
  Rows sink;
  EXPECT_EQ(second.run(sink).exit_code, 0);
  return {sink.rows.back().position[0] - from.position[0], sink.rows.back().position[1] - from.position[1]};
}

std::vector<Kicked> all_ways() {
  std::vector<Kicked> list;
  for (const char* law :
       {"normal_stiffness = \"hard\"\n", "normal_stiffness = \"1e9 Pa/m\"\ndamping_ratio = 0.5\n"})
    for (const bool on_block : {false, true})
      for (const bool aside : {false, true})
        list.push_back({law, on_block, aside ? Vec3(0.3, 0, 0) : Vec3(0, 0, 0.5),
                        aside ? Vec3(6, 0, -g) : Vec3(0, 0, g)});
  return list;
}

/// Way of a cube that nothing bonds to the ground.
Vec3 free_way(const Kicked& k) {
  const double t = k.end;
  return k.later.z() > 0 ? Vec3(0.5 * t * t * k.later)
                         : Vec3(0.5 * t * t * (k.later.x() - cube_friction * g), 0, 0);
}

TEST(CarriedContacts, TornBondsStayTornAndOthersHold) {
  for (const Kicked& k : all_ways()) {
    const Outcome first = k.first();
    ASSERT_TRUE(first.ok());
    EXPECT_LT(first.last().velocity[0].norm(), 1e-3);
    sim::Simulation second(scene::read_scene_text(k.text(k.later, k.end), "/test.toml"));
    second.start_from(first.simulation->final_state(), "first.h5");
    const Moved m = go_on(second, first.last());
    EXPECT_LT((m.kicked - free_way(k)).norm(), 2e-3)
        << k.law << k.on_block << k.kick.transpose() << " moved " << m.kicked.transpose();
    EXPECT_LT(m.left.norm(), 2e-4) << k.law << k.on_block << k.kick.transpose() << " moved "
                                   << m.left.transpose();
  }
}

TEST(CarriedContacts, AfterAResumeAsWell) {
  for (const Kicked& k : all_ways()) {
    const Outcome first = k.first();
    ASSERT_TRUE(first.ok());
    sim::Simulation second(scene::read_scene_text(k.text(k.later, k.settled + k.end), "/test.toml"));
    second.restore(first.simulation->save());
    const Moved m = go_on(second, first.last());
    EXPECT_LT((m.kicked - free_way(k)).norm(), 2e-3)
        << k.law << k.on_block << k.kick.transpose() << " moved " << m.kicked.transpose();
    EXPECT_LT(m.left.norm(), 2e-4) << k.law << k.on_block << k.kick.transpose() << " moved "
                                   << m.left.transpose();
  }
}

/// What was not there in the first run is glued where it touches, as at any start.
TEST(CarriedContacts, WhatIsNewIsGlued) {
  const Kicked k;
  const Outcome first = k.first();
  const std::string more =
      "[[block]]\nname = \"aaa\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1.0, 1.0, 1.0]\nposition = "
      "[3.0, 0.0, 0.5]\ndeformable = false\n";
  sim::Simulation second(scene::read_scene_text(k.text(k.later, k.end, more), "/test.toml"));
  second.start_from(first.simulation->final_state(), "first.h5");
  Rows sink;
  EXPECT_EQ(second.run(sink).exit_code, 0);
  const std::size_t added = sink.rows.back().position.size() - 1;  // first of all by its name
  EXPECT_LT((sink.rows.back().position[added] - Vec3(3, 0, 0.5)).norm(), 1e-6);
  EXPECT_GT(sink.rows.back().position[0].z(), 0.6);
}

/// A block held in the first run and let go in the second is the other one of its pairs; its bonds stay.
TEST(CarriedContacts, WhatIsLetGoKeepsItsBonds) {
  const auto text = [](bool held, double strength) {
    SceneText s(Method::by_accuracy(1e-3), 0.2);
    s.history(0.01)
        .material("rock", cube_density)
        .interface("rock", "rock", 0.5,
                   fmt::format("normal_stiffness = \"hard\"\ntension = {0}\ncohesion = {0}\n", strength));
    s.box("a_roof", Vec3(2, 2, 1), Vec3(0, 0, 2), "fixed = true\n")
        .box("b_hung", Vec3::Ones(), Vec3(0, 0, 1))
        .box("c_held", Vec3::Ones(), Vec3::Zero(), held ? "fixed = true\n" : "");
    return s.str();
  };
  const Outcome first = run_scene(text(true, 5 * cube_weight));
  ASSERT_TRUE(first.ok());
  sim::Simulation second(scene::read_scene_text(text(false, 5 * cube_weight), "/test.toml"));
  second.start_from(first.simulation->final_state(), "first.h5");
  Rows sink;
  EXPECT_EQ(second.run(sink).exit_code, 0);
  for (const std::size_t b : {1, 2})
    EXPECT_LT((sink.rows.back().position[b] - first.last().position[b]).norm(), 1e-6) << b;
}

TEST(CarriedContacts, SpringsKeepWhatTheyHold) {
  Kicked k;
  k.law = "normal_stiffness = \"1e7 Pa/m\"\ndamping_ratio = 0.5\n";  // 2.5 mm under the weight
  k.kick.setZero();
  const Outcome first = k.first();
  ASSERT_TRUE(first.ok());
  sim::Simulation second(scene::read_scene_text(k.text({0, 0, -g}, k.end), "/test.toml"));
  second.start_from(first.simulation->final_state(), "first.h5");
  Rows sink;
  EXPECT_EQ(second.run(sink).exit_code, 0);
  EXPECT_NEAR(sink.rows.front().ledger.contact, first.last().ledger.contact, 1e-12 * cube_weight);
  for (const auto& r : sink.rows)
    EXPECT_LT((r.position[0] - first.last().position[0]).norm(), 1e-5) << r.time;
}

/// A cube that hangs glued under a slab of finite elements, and one that a kick has torn from it and thrown
/// against it again.
TEST(CarriedContacts, OnAStructureToo) {
  const auto text = [](const Vec3& kick) {
    SceneText s(Method::by_accuracy(1e-3), 0.15, {0, 0, g});
    s.history(0.01)
        .material("slab", cube_density, "young = 30e9\npoisson = 0.2")
        .material("rock", cube_density);
    s.interface("*", "*", 0.5, "tension = 1e5\ncohesion = 1e5\nnormal_stiffness = \"hard\"\n");
    s.box("kicked", Vec3::Constant(0.5), Vec3(0.03, 0.02, -0.45), velocity(kick))
        .box("left", Vec3::Constant(0.5), Vec3(3.03, 0.02, -0.45));
    for (const double x : {0.0, 3.0})
      s.raw(structure_box(fmt::format("slab{}", x), Vec3(1, 1, 0.4), Vec3(x, 0, 0), {4, 4, 1}, "slab",
                          "support = [\"+z\"]\npreload = \"none\"\ndamping_ratio = 0.3\n"));
    return s.str();
  };
  std::string thrown = text(Vec3(0, 0, -0.3)), down = text(Vec3::Zero());
  const Outcome first = run_scene(thrown);
  ASSERT_TRUE(first.ok());
  EXPECT_NEAR(first.last().position[0].z(), -0.45, 1e-3);
  const std::string up = "gravity = " + vector(Vec3(0, 0, g));
  down.replace(down.find(up), up.size(), "gravity = " + vector(Vec3(0, 0, -g)));
  sim::Simulation second(scene::read_scene_text(down, "/test.toml"));
  second.start_from(first.simulation->final_state(), "first.h5");
  const Moved m = go_on(second, first.last());
  EXPECT_LT(m.kicked.z(), -0.03);
  EXPECT_LT(m.left.norm(), 1e-4);
}

/// A column bulges under its weight: what is flush with it in the scene touches it, in a run that starts from
/// a state as in any.
TEST(CarriedContacts, WhatIsFlushWithAStructureMayJoin) {
  const auto text = [](const std::string& stiffness, const std::string& more) {
    SceneText s(Method::by_accuracy(1e-3), 0.02);
    s.history(5e-3)
        .material("concrete", 2500, "young = 30e9\npoisson = 0.2")
        .material("rock", 2600, "young = 40e9\npoisson = 0.25");
    s.interface("*", "*", 0.5, fmt::format("normal_stiffness = \"{}\"", stiffness));
    s.box("ground", Vec3(6, 4, 1), Vec3(0, 0, -0.5), "fixed = true\n")
        .box("B", Vec3::Constant(0.5), Vec3(1.25, 0.02, 0.25))
        .raw(more);
    return s
        .raw(structure_box("column", Vec3(2, 2, 4), Vec3(0, 0, 2), {4, 4, 8}, "concrete",
                           "support = [\"-z\"]\npreload = \"gravity\"\ndamping_ratio = 0.05\n"))
        .str();
  };
  const auto joins = [](double x) {
    return fmt::format(
        "[[block]]\nname = \"C\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [0.5, 0.5, 0.5]\nposition = "
        "[{}, 0.02, 0.25]\ndeformable = false\n",
        x);
  };
  for (const char* stiffness : {"hard", "5 GPa/m", "1 GN/m"}) {
    const Outcome first = run_scene(text(stiffness, ""));
    ASSERT_TRUE(first.ok()) << first.result.message;
    const sim::FinalState state = first.simulation->final_state();
    std::string told;
    sim::Simulation second(scene::read_scene_text(text(stiffness, joins(-1.25)), "/test.toml"),
                           [&](const std::string& line) { told += line + "\n"; });
    second.start_from(state, "first.h5");
    EXPECT_NE(told.find("the run before moved its surface into block C"), std::string::npos)
        << stiffness << told;
    Rows sink;
    EXPECT_EQ(second.run(sink).exit_code, 0);
    for (const auto& r : sink.rows)
      for (const Vec3& v : r.velocity)
        EXPECT_LT(v.norm(), 1e-3) << stiffness << r.time;  // nothing pushes them
  }
}

}  // namespace
}  // namespace talus::verify
