// until = "rest": blocks that fall past everything that is held are not waited for.
#include <gtest/gtest.h>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// A block lies on a ledge; with `astray` another falls beside it.
std::string ledge(bool astray, const std::string& end) {
  SceneText s(Method::by_accuracy(1e-3), 20, {0, 0, -9.81}, end);
  s.history(0.05).material("rock", 2600).interface("rock", "rock", 0.5);
  s.box("ledge", Vec3(2, 2, 1), Vec3(0, 0, 0), "fixed = true\n").box("lying", Vec3::Ones(), Vec3(0, 0, 1));
  if (astray) s.box("astray", Vec3::Ones(), Vec3(5, 0, 3));
  return s.str();
}

TEST(UntilRest, BlocksThatLeftTheModelAreNotWaitedFor) {
  const Outcome o = run_scene(ledge(true, "until = \"rest\"\n"));
  ASSERT_TRUE(o.ok());
  // Its highest point is below the lowest of the ledge: 3 m and two radii down, by the next row.
  EXPECT_EQ(o.result.status, "at rest");
  EXPECT_GT(o.last().time, std::sqrt(2 * 3 / 9.81));
  EXPECT_LT(o.last().time, 2);
  EXPECT_EQ(o.simulation->departed(), std::vector<std::string>{"astray"});
}

TEST(UntilRest, WhereAllHaveLeftTheModelNothingIsAtRest) {
  SceneText s(Method::by_accuracy(1e-3), 20, {0, 0, -9.81}, "until = \"rest\"\n");
  s.history(0.05).material("rock", 2600).interface("rock", "rock", 0.5);
  s.box("ledge", Vec3(2, 2, 1), Vec3(0, 0, 0), "fixed = true\n").box("astray", Vec3::Ones(), Vec3(5, 0, 3));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.status, "all left");
  EXPECT_LT(o.last().time, 2);
}

TEST(UntilRest, NobodyDepartsWhileSomethingBelowCouldHoldIt) {
  const Outcome o = run_scene(ledge(false, "until = \"rest\"\n"));
  ASSERT_TRUE(o.ok());
  EXPECT_EQ(o.result.status, "at rest");
  EXPECT_TRUE(o.simulation->departed().empty());
}

}  // namespace
}  // namespace talus::verify
