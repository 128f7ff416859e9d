// Blocks over the edges of structures: a face of the block that lies across another face of the structure is no contact as deep as the structure is wide.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

/// A girder of 15 t that slides across two elastic columns, on springs per area: at the columns' tops it overlaps their sides by a strip of a
/// millimetre that is as deep as the girder still lies on the column.
TEST(StructureEdges, AGirderThatSlidesAcrossColumnsMakesNoEnergy) {
  SceneText s(Method::by_accuracy(1e-3), 0.25, Vec3(0, 0, -9.81));
  s.history(0.005).material("concrete", 2450, "young = 33e9\npoisson = 0.2").material("rock", 2600, "young = 30e9\npoisson = 0.25");
  s.interface("*", "*", 0.625, "normal_stiffness = \"18.3 GPa/m\"");
  s.box("girder", Vec3(9, 0.8, 0.8), Vec3(0, 0.1, 4.41), "velocity = [0.0, 2.5, -0.4]\n");
  for (const double x : {-4.0, 4.0})
    s.raw(structure_box(x < 0 ? "west" : "east", Vec3(0.8, 0.8, 4), Vec3(x, 0, 2), {2, 2, 10}, "concrete", "support = [\"-z\"]\npreload = \"gravity\"\ndamping_ratio = 0.03\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  const auto energy = [](const sim::HistoryRow& r) { return r.ledger.kinetic + r.ledger.potential + r.ledger.strain + r.ledger.contact; };
  const double in_motion = o.rows.front().ledger.kinetic;
  double growth = 0, made = 0, lifted = 0;
  for (std::size_t i = 1; i < o.rows.size(); ++i) {
    growth = std::max(growth, energy(o.rows[i]) - energy(o.rows[i - 1]));
    made = std::max(made, -o.rows[i].ledger.algorithmic);
    lifted = std::max(lifted, std::abs(o.rows[i].velocity[0].z()));
  }
  EXPECT_LT(growth, 1e-6 * in_motion);
  EXPECT_LT(made, 1e-2 * in_motion);
  EXPECT_GT(o.rows.back().ledger.friction_work, 0.1 * in_motion);   // it did slide on them
  EXPECT_LT(lifted, 3.0);
}

}  // namespace
}  // namespace talus::verify
