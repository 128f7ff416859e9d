// Method "dda-1988" at a structure: its blocks strike the undeformed skin, what they do to it is told and put
// on the structure.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "core/error.hpp"
#include "helpers/resumed.hpp"
#include "sim/simulation.hpp"
#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

constexpr double mass = 2600;  // of a cube of 1 m [kg]

/// A cube that slides and comes down on an elastic slab.
std::string on_a_slab(const std::string& coupling = {}, double speed = 3) {
  SceneText s(Method::paper(2e-5), 0.15, Vec3(0, 0, -9.81));
  s.history(1e-3)
      .material("concrete", 2400, "young = 30e9\npoisson = 0.2")
      .material("rock", mass, "young = 20e9\npoisson = 0.25")
      .interface("rock", "concrete", 0.5, {}, 5e8);
  s.box("B", Vec3::Ones(), Vec3(0, 0.1, 1.0), velocity(Vec3(1, 0, -speed)));
  s.raw(structure_box("slab", Vec3(5, 3, 0.8), Vec3::Zero(), {10, 6, 2}, "concrete",
                      "support = [\"-z\"]\npreload = \"gravity\"\ndamping_ratio = 0.05\n"));
  return s.raw(coupling).str();
}

TEST(Scheme1988AtStructures, TheStructureFeelsWhatStrikesIt) {
  const Outcome o = run_scene(on_a_slab("[coupling]\naudit = \"strict\"\n"));
  ASSERT_NE(o.result.exit_code, 3) << o.result.message;
  ASSERT_FALSE(o.structure_contacts.empty());
  Vec3 impulse = Vec3::Zero();
  for (const sim::ContactRow& r : o.structure_contacts) impulse += r.dt * r.force;
  // The block's momentum is lost to the slab, all but what gravity gave meanwhile.
  const Vec3 lost =
      mass * (o.rows.front().velocity[0] - o.last().velocity[0] + o.last().time * Vec3(0, 0, -9.81));
  EXPECT_LT((impulse - lost).norm(), 1e-9 * lost.norm()) << impulse.transpose() << " / " << lost.transpose();
  EXPECT_LT((o.result.audit.impulse_on_structure - lost).norm(), 1e-9 * lost.norm());
  EXPECT_GT(o.last().structures[0].peaks.force.value, 1e6);
  EXPECT_GT(o.result.audit.work_on_structure, 1);
  EXPECT_TRUE(o.result.audit_made);
  for (const auto& r : o.rows)
    EXPECT_LT(std::abs(r.ledger.residual), 1e-9 * o.rows.front().ledger.kinetic) << r.time;
}

/// In the mean over time a slab carries the block that lies on it, beside its own weight.
TEST(Scheme1988AtStructures, WhatRestsOnItPresses) {
  SceneText s(Method::paper(1e-4), 0.5, Vec3(0, 0, -9.81));
  s.history(1e-3)
      .material("concrete", 2400, "young = 30e9\npoisson = 0.2")
      .material("rock", mass, "young = 20e9\npoisson = 0.25")
      .interface("rock", "concrete", 0.5, {}, 5e8);
  s.box("B", Vec3::Ones(), Vec3(0, 0.1, 0.9));
  s.raw(structure_box("slab", Vec3(5, 3, 0.8), Vec3::Zero(), {10, 6, 2}, "concrete",
                      "support = [\"-z\"]\npreload = \"gravity\"\ndamping_ratio = 0.05\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  double sum = 0;
  int count = 0;
  for (const auto& r : o.rows)
    if (r.time > 0.25)
      sum += r.structures[0].base_force.z() - o.rows.front().structures[0].base_force.z(), ++count;
  EXPECT_NEAR(sum / count, -mass * 9.81, 0.03 * mass * 9.81);
}

/// Blocks of method talus too: a restart struck the skin as it had deformed, in place of the undeformed one.
class OneWayRestart : public testing::TestWithParam<bool> {};

TEST_P(OneWayRestart, GoesOnToTheSameBits) {
  const std::string text = [] {
    if (GetParam()) return on_a_slab();
    std::string by_talus = on_a_slab("[coupling]\nscheme = \"one-way\"\n");
    const std::string method = "method = \"dda-1988\"\n";
    by_talus.erase(by_talus.find(method), method.size());
    return by_talus;
  }();
  for (const double stop_at : {0.0123, 0.1}) {  // before the blow and after
    const auto [whole, resumed, stopped] = test::run_and_resume(text, stop_at);
    EXPECT_EQ(resumed.position[0], whole.position[0]);
    EXPECT_EQ(resumed.structures[0].base_force, whole.structures[0].base_force);
    EXPECT_EQ(resumed.structures[0].peaks.force.value, whole.structures[0].peaks.force.value);
    EXPECT_EQ(resumed.ledger.external_work, whole.ledger.external_work);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, OneWayRestart, testing::Values(false, true),
                         [](const auto& info) { return std::string(info.param ? "Scheme1988" : "Talus"); });

/// Dissipation is positive; what lagging friction drives is the scheme's.
TEST(Scheme1988AtStructures, FrictionTakes) {
  const Outcome o = run_scene(on_a_slab());
  double before = 0;
  for (const auto& r : o.rows) {
    EXPECT_GE(r.ledger.friction_work, before) << r.time;
    before = r.ledger.friction_work;
  }
  EXPECT_GT(before, 0);
}

TEST(Scheme1988AtStructures, ARigidOneIsHitAndTold) {
  const Outcome o = run_scene(on_a_slab("[coupling]\nscheme = \"rigid\"\n"));
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_FALSE(o.structure_contacts.empty());
  EXPECT_FALSE(o.result.audit_made);
  EXPECT_EQ(o.last().structures[0].base_force, o.rows.front().structures[0].base_force);
}

TEST(Scheme1988AtStructures, ThePlanSaysWhatTheyAre) {
  const auto plan = [](const std::string& coupling) {
    std::string all;
    for (const std::string& line :
         sim::Simulation(scene::read_scene_text(on_a_slab(coupling), "/test.toml")).plan())
      all += line + "\n";
    return all;
  };
  EXPECT_NE(plan({}).find("structures do not react on blocks (scheme one-way)"), std::string::npos)
      << plan({});
  EXPECT_NE(plan("[coupling]\nscheme = \"rigid\"\n").find("structures are fixed surfaces (scheme rigid)"),
            std::string::npos);
}

TEST(Scheme1988AtStructures, TwoWayIsRefused) {
  const auto refusal = [](const std::string& coupling) -> std::string {
    try {
      scene::read_scene_text(on_a_slab(coupling), "/test.toml");
    } catch (const InputError& e) { return e.what(); }
    return {};
  };
  const std::string both = refusal("[coupling]\nscheme = \"two-way\"\n");
  EXPECT_NE(both.find("does not couple both ways"), std::string::npos) << both;
  EXPECT_EQ(refusal("[coupling]\nscheme = \"rigid\"\naudit = \"strict\"\n"), "");
  EXPECT_EQ(refusal({}), "");
}

}  // namespace
}  // namespace talus::verify
