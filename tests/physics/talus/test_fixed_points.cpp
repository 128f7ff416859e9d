// Fixed points are points of their block.
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// A cube of 1 m about the origin, turned by 45 degrees about z and held at a point.
std::string held_at(const Vec3& x) {
  SceneText s(Method::by_accuracy(1e-3), 0.01);
  s.material("rock", 2600).box("B", Vec3::Ones(), Vec3::Zero(), turned(Vec3(0, 0, M_PI / 4)) + "fixed_points = [" + vector(x) + "]\n");
  return s.str();
}

TEST(FixedPoints, InsideAndOnTheSurface) {
  for (const Vec3& x : {Vec3(0.1, 0.2, -0.3), Vec3(0.7071, 0, 0.5), Vec3(0, 0, 0.5)}) EXPECT_TRUE(run_scene(held_at(x)).ok());
}

TEST(FixedPoints, OutsideIsAnErrorThatNamesTheNearestPoint) {
  try {
    run_scene(held_at(Vec3(0.5, 0.5, 0.2)));
    FAIL() << "accepted";
  } catch (const InputError& e) {
    ASSERT_EQ(e.problems().size(), 1u);
    const Problem& p = e.problems()[0];
    EXPECT_EQ(p.key, "block.B.fixed_points");
    EXPECT_EQ(p.value, "[0.5, 0.5, 0.2]");
    EXPECT_EQ(p.rule, "lies 0.2071 m outside of the block");
    EXPECT_NE(p.remedy.find("[0.353553, 0.353553, 0.2]"), std::string::npos) << p.remedy;
  }
}

}  // namespace
}  // namespace talus::verify
