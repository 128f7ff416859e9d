// Springs that a block's own weight would press out of any use are refused, with the figure.
#include <gtest/gtest.h>

#include <string>

#include <fmt/format.h>

#include "core/error.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// A cube of 1 m and 2500 kg on three contact points, or on a face of 1 m^2; its inradius is 0.5 m.
std::string said(const std::string& stiffness) {
  SceneText s(Method::by_accuracy(1e-3), 0.01);
  s.material("rock", 2500)
      .interface("rock", "ground", 0.5, "normal_stiffness = " + stiffness)
      .plane(Vec3::UnitZ())
      .box("B", Vec3::Ones(), Vec3(0, 0, 0.5));
  try {
    run_scene(s.str());
  } catch (const InputError& e) { return e.what(); }
  return {};
}

TEST(StiffnessCheck, WeightMayNotSinkABlockInByATenthOfItsInradius) {
  const double weight = 2500 * 9.81;
  EXPECT_NE(said(number(0.99 * weight / (3 * 0.05))).find("interface.rock/ground.normal_stiffness"),
            std::string::npos);
  EXPECT_EQ(said(number(1.01 * weight / (3 * 0.05))), "");
  EXPECT_NE(said("\"" + number(0.99 * weight / 0.05) + " Pa/m\"")
                .find("block B sinks in by 0.0505 m under its own weight"),
            std::string::npos);
  EXPECT_EQ(said("\"" + number(1.01 * weight / 0.05) + " Pa/m\""), "");
  // Tables of a third of the weight at 0.05 m, reached within it and by its last slope.
  for (const char* points : {"[[0, 0], [0.05, {0}], [1, 1e9]]", "[[0, 0], [0.01, {1}], [0.02, {2}]]"}) {
    const auto by_table = [&](double share) {
      const double f = share * weight / 3;
      return said("\"hard\"\ncontact_law = { kind = \"table\", points = " +
                  fmt::format(fmt::runtime(points), f, 0.1 * f, 0.325 * f) + " }");
    };
    EXPECT_NE(by_table(0.99).find("interface.rock/ground.contact_law = table: block B sinks in by 0.05"),
              std::string::npos)
        << by_table(0.99);
    EXPECT_EQ(by_table(1.01), "");
  }
}

/// A block of mass m on three springs swings at (3 k/m)^(1/2), which a step of 1e-9 s is to follow.
TEST(StiffnessCheck, NoBlockSwingsFasterThanTheShortestStep) {
  const double most = 2500 / 3e-18;  // [N/m]
  EXPECT_EQ(said(number(0.99 * most)), "");
  for (const double stiffness : {1.01 * most, 1e300})
    EXPECT_NE(said(number(stiffness)).find("block B swings on it at"), std::string::npos) << stiffness;
  EXPECT_NE(said("\"1e30 Pa/m\"").find("what is as stiff as that is \"hard\""), std::string::npos);
  EXPECT_EQ(said("\"hard\""), "");
}

/// Penalties of the paper's scheme are implicit: its steps follow no swing.
TEST(StiffnessCheck, ThePapersSchemeIsNotAskedForSofterSprings) {
  SceneText s(Method::paper(1e-3), 0.01);
  s.material("rock", 2500, "young = 1e9\npoisson = 0.2")
      .interface("rock", "ground", 0.5, "", 2500 / 2e-18)
      .plane(Vec3::UnitZ())
      .box("B", Vec3::Ones(), Vec3(0, 0, 0.5));
  EXPECT_NO_THROW(run_scene(s.str()));
}

/// The reader keeps laws of materials that something in the scene brings together, and those alone are
/// judged: of two blocks on a plane, their own against each other.
TEST(StiffnessCheck, OnlyWhatCanMeetIsJudged) {
  const auto problems = [](bool second) {
    SceneText s(Method::by_accuracy(1e-3), 0.01);
    s.material("rock", 2500)
        .interface("rock", "ground", 0.5)
        .interface("rock", "rock", 0.5, "normal_stiffness = 1e4")
        .plane(Vec3::UnitZ())
        .box("B", Vec3::Ones(), Vec3(0, 0, 0.5));
    if (second) s.box("C", Vec3::Ones(), Vec3(3, 0, 0.5));
    try {
      run_scene(s.str());
    } catch (const InputError& e) { return std::string(e.what()); }
    return std::string();
  };
  EXPECT_EQ(problems(false), "");
  EXPECT_NE(problems(true).find("interface.rock/rock.normal_stiffness"), std::string::npos);
}

}  // namespace
}  // namespace talus::verify
