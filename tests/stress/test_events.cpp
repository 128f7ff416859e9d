// Event-driven steps whose rows contradict each other: taken as they are or rolled back whole, the ledger
// closes to round-off.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "verify/scene_text.hpp"

namespace talus::stress {
namespace {

using verify::SceneText;

/// Nine cubes in three loose columns, up to 0.3 m out of line, on a slope of 45 degrees above level ground.
std::string columns(int arrangement) {
  SceneText text(verify::Method::by_accuracy(1e-3), 0.25);
  text.history(0.01).material("rock", 2600).material("ground", 2600);
  text.interface("*", "*", 0.5, "normal_stiffness = \"hard\"\nrestitution = 0.0");
  text.raw(
      "[[plane]]\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 0.0, 1.0]\nmaterial = \"ground\"\n[[plane]]\npoint "
      "= [0.0, 0.0, 0.0]\nnormal = [1.0, 0.0, 1.0]\nmaterial = \"ground\"\n");
  for (int i = 0; i < 9; ++i) {
    const double along = -3 - 1.01 * (i % 3), above = 0.51 + 1.01 * (i / 3), c = std::sqrt(0.5),
                 side = 0.3 * std::sin(9.0 * arrangement + 2.4 * i);
    text.raw("[[block]]\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1.0, 1.0, 1.0]\nposition = " +
             verify::vector(Vec3(c * (along + above), side, c * (above - along))) + "\n" +
             verify::turned(Vec3(0, M_PI / 4, 0)));
  }
  return text.str();
}

TEST(Events, LedgerClosesWhereRowsContradictEachOther) {
  double left = 0;  // largest residual, of the speed
  for (int arrangement = 6; arrangement < 14; ++arrangement) {
    const verify::Outcome o = verify::run_scene(columns(arrangement));
    ASSERT_TRUE(o.ok()) << o.result.message;
    double kinetic = 0, residual = 0;
    for (const sim::HistoryRow& r : o.rows) {
      kinetic = std::max(kinetic, r.ledger.kinetic);
      residual = std::max(residual, std::abs(r.ledger.residual));
    }
    left = std::max(left, o.result.counters.worst_residual);
    EXPECT_LE(residual, 1e-10 * kinetic) << "arrangement " << arrangement;
  }
  EXPECT_GT(left, 1e-12);  // rows that no impulses meet to the tolerance; else this is about nothing
}

/// Onsets in islands too large for events: what the impacts take and the height that blocks keep are one
/// account: no numerical energy gain.
TEST(Events, OnsetsOfAHeapMakeNoEnergy) {
  SceneText text(verify::Method::by_accuracy(1e-3), 0.2);
  text.history(0.01)
      .material("rock", 2600)
      .interface("*", "*", 0.5, "normal_stiffness = \"hard\"\nrestitution = 0.0");
  for (int i = 0; i < 24; ++i)
    text.box("B" + std::to_string(i), Vec3::Ones(),
             Vec3(1.01 * (i % 2), 1.01 * (i / 2 % 2), 0.51 + 1.01 * (i / 4)));
  const verify::Outcome o = verify::run_scene(text.plane(Vec3::UnitZ(), Vec3::Zero(), "rock").str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  const double fallen = o.rows.front().ledger.potential - o.last().ledger.potential;
  EXPECT_GT(o.last().ledger.damping_work, 0.5 * fallen);
  for (const sim::HistoryRow& r : o.rows) EXPECT_GE(r.ledger.algorithmic, -1e-4 * fallen);
}

}  // namespace
}  // namespace talus::stress
