// Blocks over the edges of structures: a face of the block that lies across another face of the structure is
// no contact as deep as the structure is wide.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

double mechanical(const sim::HistoryRow& r) {
  return r.ledger.kinetic + r.ledger.potential + r.ledger.strain + r.ledger.contact;
}

/// A girder of 15 t that slides across two elastic columns, on springs per area: at the columns' tops it
/// overlaps their sides by a strip of a millimetre that is as deep as the girder still lies on the column.
TEST(StructureEdges, AGirderThatSlidesAcrossColumnsMakesNoEnergy) {
  SceneText s(Method::by_accuracy(1e-3), 0.25, Vec3(0, 0, -9.81));
  s.history(0.005)
      .material("concrete", 2450, "young = 33e9\npoisson = 0.2")
      .material("rock", 2600, "young = 30e9\npoisson = 0.25");
  s.interface("*", "*", 0.625, "normal_stiffness = \"18.3 GPa/m\"");
  s.box("girder", Vec3(9, 0.8, 0.8), Vec3(0, 0.1, 4.41), "velocity = [0.0, 2.5, -0.4]\n");
  for (const double x : {-4.0, 4.0})
    s.raw(structure_box(x < 0 ? "west" : "east", Vec3(0.8, 0.8, 4), Vec3(x, 0, 2), {2, 2, 10}, "concrete",
                        "support = [\"-z\"]\npreload = \"gravity\"\ndamping_ratio = 0.03\n"));
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  const double in_motion = o.rows.front().ledger.kinetic;
  double growth = 0, made = 0, lifted = 0;
  for (std::size_t i = 1; i < o.rows.size(); ++i) {
    growth = std::max(growth, mechanical(o.rows[i]) - mechanical(o.rows[i - 1]));
    made = std::max(made, -o.rows[i].ledger.numerical_dissipation());
    lifted = std::max(lifted, std::abs(o.rows[i].velocity[0].z()));
  }
  EXPECT_LT(growth, 1e-6 * in_motion);
  EXPECT_LT(made, 1e-2 * in_motion);
  EXPECT_GT(o.rows.back().ledger.friction_work, 0.1 * in_motion);  // it did slide on them
  EXPECT_LT(lifted, 3.0);
}

/// A block of 5.2 t whose edge bends a column on soft springs: the skin under it is not flat any more, and
/// the edges stay crossed.
TEST(StructureEdges, AnEdgeThatBendsAColumnKeepsItsSprings) {
  SceneText s(Method::by_accuracy(1e-3), 0.06, Vec3::Zero());
  s.history(5e-4)
      .material("concrete", 2450, "young = 33e9\npoisson = 0.2")
      .material("rock", 2600, "young = 5e9\npoisson = 0.25");
  s.interface("*", "*", 0.8, "normal_stiffness = \"1e8 N/m\"\nrestitution = 0.5");
  s.raw(structure_box("S", Vec3(1, 1, 6), Vec3(0, 0, 3), {4, 4, 20}, "concrete",
                      "support = [\"-z\"]\npreload = \"none\"\n"));
  s.raw(
      "[[block]]\nname = \"B\"\nmaterial = \"rock\"\nshape = \"box\"\nsize = [1.0, 0.536164, 0.775602]\nmass "
      "= 5205.89\n"
      "position = [-1.7782458053460912, 0.208280859495729, 3.8551848965911253]\n"
      "orientation = { quaternion = [-0.5833395834186199, -0.4016158440137038, 0.700211608065095, "
      "0.09012961880006541] }\n"
      "velocity = [9.526552537804063, 2.2492204575601984, -1.1271283685037445]\nspin = [-1.6566649434923814, "
      "0.44225414182184153, 0.7898543631708392]\n");
  const Outcome o = run_scene(s.str());
  ASSERT_TRUE(o.ok()) << o.result.message;
  EXPECT_LT(std::abs(o.rows.back().ledger.numerical_dissipation()), 0.01 * o.rows.front().ledger.kinetic);
}

/// A cube beside a slab that it overtops above and below; it hangs on by cohesion and leans out, its lower
/// edge goes below the slab.
Outcome leaning_out(const std::string& slab, double tension) {
  SceneText s(Method::by_accuracy(1e-3), 0.3, Vec3(0, 0, -9.81));
  s.history(0.005)
      .material("slab", 2500, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600, "young = 40e9\npoisson = 0.25");
  s.interface("rock", "slab", 0.5,
              fmt::format("normal_stiffness = \"hard\"\ncohesion = 1e5\ntension = {:e}\n", tension));
  s.box("B", Vec3::Constant(0.5), Vec3(1.25, 0.02, 0.03));
  return run_scene(s.raw(slab).str());
}

TEST(StructureEdges, ACubeThatLeansOverARimGainsNothing) {
  const std::string slab =
      structure_box("S", Vec3(2, 2, 0.4), Vec3::Zero(), {8, 8, 2}, "slab",
                    "support = [\"+z\", \"-z\"]\npreload = \"none\"\ndamping_ratio = 0.05\n");
  const std::string fixed =
      "[[block]]\nname = \"S\"\nmaterial = \"slab\"\nshape = \"box\"\nsize = [2.0, 2.0, 0.4]\nposition = "
      "[0.0, 0.0, 0.0]\nfixed = true\n";
  const Outcome as_block = leaning_out(fixed, 0);
  ASSERT_TRUE(as_block.ok()) << as_block.result.message;
  for (const double tension : {0.0, 1e4}) {
    const Outcome o = leaning_out(slab, tension);
    ASSERT_TRUE(o.ok()) << o.result.message;
    double most = mechanical(o.rows.front());
    for (const auto& r : o.rows) {
      EXPECT_LT(mechanical(r), most + 0.01) << r.time;  // of 900 J
      most = std::min(most, mechanical(r));
    }
    EXPECT_NEAR(o.last().position[0].z(), as_block.last().position[0].z(), 0.02)
        << tension;  // it falls by 0.35 m
    EXPECT_NEAR(o.last().position[0].x(), as_block.last().position[0].x(), 0.01) << tension;
  }
}

/// A tower that leans against a slab's rim reaches over the slab and below it: neither side of it lies in the
/// slab.
TEST(StructureEdges, ATowerLeansPastARim) {
  for (const char* stiffness : {"hard", "5 GPa/m"}) {
    SceneText s(Method::by_accuracy(1e-3), 0.3, Vec3(0, 0, -9.81));
    s.history(0.005)
        .material("slab", 2500, "young = 30e9\npoisson = 0.2")
        .material("rock", 2600, "young = 40e9\npoisson = 0.25");
    s.interface("rock", "slab", 0.5, fmt::format("normal_stiffness = \"{}\"\n", stiffness));
    s.box(
        "tower", Vec3(0.3, 0.5, 1.5), Vec3(1.25, 0.02, 0.35),
        "orientation = { rotation_vector = [0.0, -0.2617993877991494, 0.0] }\nvelocity = [-1.0, 0.0, 0.0]\n");
    s.raw(structure_box("S", Vec3(2, 2, 0.4), Vec3::Zero(), {8, 8, 2}, "slab",
                        "support = [\"-x\"]\npreload = \"none\"\ndamping_ratio = 0.05\n"));
    const Outcome o = run_scene(s.str());
    ASSERT_TRUE(o.ok()) << o.result.message;
    const double in_motion = o.rows.front().ledger.kinetic;
    EXPECT_LT(mechanical(o.last()), mechanical(o.rows.front()) - 0.05 * in_motion);  // it did strike
    for (std::size_t i = 1; i < o.rows.size(); ++i)
      EXPECT_LT(mechanical(o.rows[i]), mechanical(o.rows[i - 1]) + 1e-3 * in_motion)
          << stiffness << " " << o.rows[i].time;
  }
}

/// A cube slides with friction over the joint of two girders, the second `step` higher [m]; how far it comes,
/// and how high it gets.
std::pair<double, double> over_a_joint(double step, const std::string& law, double turned_by = 0) {
  SceneText s(Method::by_accuracy(1e-3), 0.3, Vec3(0, 0, -9.81));
  s.history(0.01)
      .material("concrete", 2450, "young = 30e9\npoisson = 0.2")
      .material("rock", 2600)
      .interface("rock", "concrete", 0.4, law);
  s.box("B", Vec3::Constant(0.4), Vec3(-0.45, 0.03, 0.4),
        "velocity = [2.0, 0.0, 0.0]\n" + turned(Vec3(0, 0, turned_by)));
  for (const double x : {-0.75, 0.75})
    s.raw(structure_box(x < 0 ? "first" : "second", Vec3(1.5, 1, 0.4), Vec3(x, 0, x > 0 ? step : 0),
                        {8, 5, 2}, "concrete",
                        "support = [\"-z\"]\npreload = \"gravity\"\ndamping_ratio = 0.02\n"));
  const Outcome o = run_scene(s.str());
  EXPECT_TRUE(o.ok()) << o.result.message;
  double high = 0;
  for (const sim::HistoryRow& r : o.rows) high = std::max(high, r.position[0].z());
  return {o.rows.back().position[0].x() + 0.45, high};
}

/// What carries the cube has sunk by less than a micrometre, and the end face of the second girder stood in
/// its way: it stopped there, and pitched over.
TEST(StructureEdges, JointsOfFlushGirdersAreSlidAcross) {
  const double way = 2 * 0.3 - 0.5 * 0.4 * 9.81 * 0.09;
  for (const auto& [law, angle] :
       {std::pair{"normal_stiffness = \"hard\"", 0.0}, std::pair{"normal_stiffness = \"1e9 N/m\"", 0.2}}) {
    const auto [gone, high] = over_a_joint(0, law, angle);
    EXPECT_NEAR(gone, way, 1e-3 * way) << law << ", turned by " << angle;
    EXPECT_LT(high, 0.4001) << law << ", turned by " << angle;
  }
}

/// A step that is one stops it.
TEST(StructureEdges, StepsAreNoJoints) {
  EXPECT_LT(over_a_joint(5e-3, "normal_stiffness = \"hard\"").first, 0.35);
}

}  // namespace
}  // namespace talus::verify
