// Restitution along a face: what a contact keeps of its slip or turns round, as far as that makes no energy.
#include <gtest/gtest.h>

#include <cmath>

#include <fmt/format.h>

#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

double energy(const sim::HistoryRow& row) { return row.ledger.kinetic + row.ledger.potential; }

/// An octahedron that turns at 46 rad/s and comes down on a corner. To keep all of the corner's slip while
/// its fall is stopped takes more than the fall has.
Outcome corner(double along, double friction) {
  SceneText s(Method::by_accuracy(1e-3), 0.15);
  s.history(1e-3).material("rock", 2500).plane(Vec3::UnitZ(), Vec3::Zero(), "rock");
  s.interface(
      "rock", "rock", friction,
      fmt::format("normal_stiffness = \"hard\"\nrestitution = 0\nrestitution_tangential = {}", along));
  std::vector<Vec3> corners;
  for (int i = 0; i < 3; ++i)
    for (const double sign : {0.25, -0.25}) corners.push_back(sign * Vec3::Unit(i) + Vec3(0, 0, 0.3));
  s.hull("B", corners, Vec3(0, 0, 0.3),
         velocity(Vec3(-1.8519074290295716, 0, -0.013476300420524612)) +
             spin(Vec3(41.95077759364776, 18.092447837949305, 1.866617722479195)) +
             turned(Vec3(0.5985626223219302, -1.5978302164874512, -0.14433720734847633)));
  return run_scene(s.str());
}

TEST(RestitutionAlong, OfOneContactIsReducedToTheMostThatMakesNoEnergy) {
  for (const double along : {-1.0, -0.97}) {
    const Outcome o = corner(along, 1.5);
    ASSERT_TRUE(o.ok());
    const double start = energy(o.rows.front()), peak = o.last().ledger.kinetic;
    for (const sim::HistoryRow& row : o.rows) EXPECT_LT(energy(row) - start, 1e-7 * peak) << row.time;
    // The first impact keeps what it may: all of its energy, but for what the halvings leave.
    std::size_t first = 1;
    while (first + 1 < o.rows.size() && (o.rows[first].spin[0] - o.rows[first - 1].spin[0]).norm() < 5)
      ++first;
    ASSERT_LT(first + 1, o.rows.size());
    EXPECT_GT(energy(o.rows[first]) - start, -2e-3 * peak);
  }
}

/// A ball's contact does not couple its slip with its fall: all of both is turned round, or kept, and no
/// energy is made.
TEST(RestitutionAlong, IsLeftWhereItMakesNone) {
  for (const double along : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    SceneText s(Method::by_accuracy(1e-3), 0.1);
    s.history(1e-3).material("rock", 2500).plane(Vec3::UnitZ(), Vec3::Zero(), "rock");
    s.interface(
        "rock", "rock", 5,
        fmt::format("normal_stiffness = \"hard\"\nrestitution = 0.5\nrestitution_tangential = {}", along));
    s.box("B", Vec3::Ones(), Vec3(0, 0, 0.51), velocity(Vec3(0.3, 0, -1)));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok());
    for (const sim::HistoryRow& row : o.rows)
      EXPECT_LT(energy(row) - energy(o.rows.front()), 1e-7 * o.rows.front().ledger.kinetic) << along;
  }
}

}  // namespace
}  // namespace talus::verify
