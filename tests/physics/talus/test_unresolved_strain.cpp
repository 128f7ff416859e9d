// Vibrations of straining blocks that the steps of a large island do not resolve make no energy.
#include <gtest/gtest.h>

#include <algorithm>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// Largest growth of the energy from row to row over the largest kinetic energy.
double growth(const Outcome& o) {
  double most = 0, moves = 0;
  for (std::size_t i = 0; i < o.rows.size(); ++i) {
    const auto energy = [&](std::size_t k) {
      return o.rows[k].ledger.kinetic + o.rows[k].ledger.potential + o.rows[k].ledger.strain +
             o.rows[k].ledger.contact;
    };
    if (i > 0) most = std::max(most, energy(i) - energy(i - 1));
    moves = std::max(moves, o.rows[i].ledger.kinetic);
  }
  return most / moves;
}

/// A thin rod that turns falls onto thirty cubes.
TEST(UnresolvedStrain, RodOnCubesMakesNoEnergy) {
  SceneText s(Method::by_accuracy(1e-3), 0.3);
  s.history(0.01)
      .material("rock", 2600, "young = 2e8\npoisson = 0.3")
      .plane(Vec3::UnitZ(), Vec3::Zero(), "rock");
  s.interface("*", "*", 0.6, "normal_stiffness = \"hard\"");
  for (int k = 0; k < 30; ++k)
    s.box("cube" + std::to_string(k), Vec3::Constant(0.5), Vec3(0.5 * (k % 6), 0.5 * (k / 6), 0.25),
          "deformable = false\n");
  s.box("rod", Vec3(1.3, 0.06, 0.1), Vec3(1.25, 1, 1.1),
        "deformable = true\n" + velocity({0.3, 0.2, -3}) + spin({20, 10, 20}) + turned({0.3, 0.2, 0.4}));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_LT(growth(o), 1e-3);
}

}  // namespace
}  // namespace talus::verify
