// The ledger of straining blocks on springs that the step does not resolve: what turning and straining give each other is booked.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// A turned box falls on its own material's springs by steps of 20 ms, far longer than the contact: positions and strains go by the rule of the end. Up to 1e-2 of the energy was in no book.
TEST(StrainingBooks, CloseByStepsLongerThanTheContact) {
  for (const double friction : {0.0, 0.3})
    for (const char* stiffness : {"", "normal_stiffness = \"1 GPa/m\"\nrestitution = 0.5"}) {
      SceneText s(Method::fixed_step(0.02), 1);
      s.history(0.02).material("rock", 2500, "young = 1e9\npoisson = 0.25").interface("rock", "ground", friction, stiffness).plane(Vec3::UnitZ());
      s.box("B", Vec3(1, 0.7, 0.5), Vec3(0, 0, 1.2), turned(Vec3(0.3, 0.5, 0.2)) + spin(Vec3(1, 2, -1)));
      const Outcome o = run_scene(s.str());
      ASSERT_TRUE(o.ok()) << o.result.message;
      double moves = 0;
      for (const auto& r : o.rows) moves = std::max(moves, r.ledger.kinetic);
      for (const auto& r : o.rows) EXPECT_NEAR(r.ledger.residual, 0, 1e-11 * moves) << friction << ' ' << stiffness << " at " << r.time;
    }
}

}  // namespace
}  // namespace talus::verify
