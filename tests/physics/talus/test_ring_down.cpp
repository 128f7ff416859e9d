// A structure rings on after a blow or a pulse: whatever way of going on `auto` takes, it is that of explicit
// steps within 1 % of the peak.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "verify/impact_text.hpp"

namespace talus::verify {
namespace {

/// A leapfrog at nine tenths of its stable step is itself off by some tenths of a per cent.
const std::string fine = "critical_step_fraction = 0.3\n";

constexpr double kinetic = 0.5 * 2600 * 25;  // of the block [J]

/// A column of 8 m, and a cube of 2.6 t that strikes it at three quarters of its height.
Outcome struck(const std::string& integrator) {
  SceneText s(Method::by_accuracy(1e-3), 0.3, Vec3(0, 0, -9.81));
  s.history(2.5e-3)
      .material("rock", 2600, "young = 30e9\npoisson = 0.25")
      .material("column", 2450, "young = 33e9\npoisson = 0.2");
  s.interface("rock", "column", 0.6, "normal_stiffness = \"30 GPa/m\"");
  s.box("B", Vec3(1, 1, 1), Vec3(-1.02, 0, 6), velocity(Vec3(5, 0, 0)));
  return run_scene(
      s.raw(structure_box(
                "P", Vec3(1, 1, 8), Vec3(0, 0, 4), {2, 2, 16}, "column",
                fmt::format("support = [\"-z\"]\npreload = \"gravity\"\nintegrator = \"{}\"\ndamping_ratio = "
                            "0.02\n{}[[structure.probe]]\nname = \"top\"\nat = [0, 0, 8]\n",
                            integrator, fine)))
          .str());
}

/// The same column with a pulse of 4 ms at half its height: a third of the first mode's period of the second.
Outcome pulsed(const std::string& integrator, const std::string& more) {
  SceneText s(Method::by_accuracy(1e-3), 0.6, Vec3::Zero());
  s.history(2e-3).material("column", 2450, "f_cm = 38e6");
  return run_scene(
      s.raw(fmt::format("[[structure]]\nname = \"P\"\nkind = \"column\"\nmaterial = \"column\"\nbase = [0, "
                        "0, 0]\nsection = [1, 1]\nheight = 8\ncells = [2, 2, 16]\n"
                        "integrator = \"{}\"\ndamping_ratio = 0.02\n{}"
                        "[[structure.load]]\nregion = {{ min = [-0.51, -0.5, 3.5], max = [-0.49, 0.5, 4.5] "
                        "}}\ntraction = [1e6, 0, 0]\nhistory = [[0, 0], [0.002, 1], [0.004, 0]]\n"
                        "[[structure.probe]]\nname = \"top\"\nat = [0, 0, 8]\n",
                        integrator, more))
          .str());
}

double motion(const sim::HistoryRow& row) { return row.structures[0].probe_displacement[0].x(); }

/// Largest distance of two histories of the top over the largest deflection.
double distance(const Outcome& a, const Outcome& b) {
  double worst = 0, peak = 0;
  EXPECT_EQ(a.rows.size(), b.rows.size());
  for (std::size_t i = 0; i < std::min(a.rows.size(), b.rows.size()); ++i) {
    worst = std::max(worst, std::abs(motion(a.rows[i]) - motion(b.rows[i])));
    peak = std::max(peak, std::abs(motion(b.rows[i])));
  }
  return worst / peak;
}

TEST(RingDown, AfterABlow) {
  const Outcome reference = struck("explicit");
  ASSERT_TRUE(reference.ok());
  for (const char* how : {"auto", "modal", "implicit"}) {
    const Outcome o = struck(how);
    ASSERT_TRUE(o.ok()) << how;
    EXPECT_LT(distance(o, reference), 0.01) << how;
    EXPECT_NEAR(o.last().ledger.numerical_dissipation(), reference.last().ledger.numerical_dissipation(),
                0.01 * kinetic)
        << how;
    EXPECT_NEAR(o.last().ledger.damping_work / reference.last().ledger.damping_work, 1, 0.01) << how;
  }
}

TEST(RingDown, TwoModes) {
  const Outcome reference = pulsed("explicit", fine);
  ASSERT_TRUE(reference.ok());
  EXPECT_LT(distance(pulsed("auto", ""), reference), 0.01);
}

/// With bars nothing goes on in modes: condensed steps, as long as what rings allows.
TEST(RingDown, TwoModesWithBars) {
  const std::string bars =
      "rebar = [{ kind = \"longitudinal\", bars = 8, diameter = \"28 mm\", cover = \"50 mm\" }]\n";
  const Outcome reference = pulsed("explicit", bars + fine);
  ASSERT_TRUE(reference.ok());
  EXPECT_LT(distance(pulsed("auto", bars), reference), 0.01);
}

/// A wall with bars that a block strikes once, and that rings on, without damping, beside the block, with
/// another that it has thrown off its top; rows every so many seconds.
Outcome ringing_wall(const std::string& integrator, double accuracy, double interval, bool with_second) {
  SceneText s(Method::by_accuracy(accuracy), 0.12, Vec3(0, 0, -9.81));
  s.history(interval).material("rock", 2600, "young = 20e9").material("C30", 2450, "f_cm = 38e6");
  s.interface("rock", "C30", 0.5, "normal_stiffness = \"3e8 N/m\"")
      .interface("rock", "rock", 0.5, "normal_stiffness = \"3e8 N/m\"");
  s.box("B", Vec3(0.67, 0.67, 0.67), Vec3(-1.0, 0.3, 2.6), velocity(Vec3(12, 1, -2)));
  if (with_second) s.box("D", Vec3::Constant(0.3), Vec3(0.02, -1.2, 4.16));
  return run_scene(
      s.raw(structure_box(
                "W", Vec3(0.4, 3, 4), Vec3(0, 0, 2), {2, 15, 20}, "C30",
                fmt::format("support = [\"-z\"]\nintegrator = \"{}\"\nrebar = [{{ kind = "
                            "\"longitudinal\", bars = 12, diameter = \"16 mm\", cover = \"40 mm\" }}]\n"
                            "[[structure.probe]]\nname = \"top\"\nat = [0, 0, 4]\n",
                            integrator)))
          .str());
}

/// Condensed steps beside blocks were as long as the accuracy of one period of the first mode allows, at
/// whatever amplitude, and kept the phase of no other mode: the top was off by 9 % of its peak at an accuracy
/// of a thousandth of the block, and by nothing where rows half a millisecond apart kept steps short.
TEST(RingDown, BesideBlocksToTheAccuracyWhateverRowsAreWritten) {
  for (const bool with_second : {false, true})
    for (const double accuracy : {1e-2, 1e-3}) {
      const double size = with_second ? 0.3 : 0.67;
      const Outcome reference = ringing_wall("explicit", accuracy, 1e-2, with_second);
      ASSERT_TRUE(reference.ok());
      for (const double interval : {1e-2, 5e-4}) {
        const Outcome o = ringing_wall("auto", accuracy, interval, with_second);
        ASSERT_TRUE(o.ok());
        const auto every = static_cast<std::size_t>(std::lround(1e-2 / interval));
        ASSERT_GE(o.rows.size(), every * (reference.rows.size() - 1) + 1);
        for (std::size_t i = 0; i < reference.rows.size(); ++i)
          EXPECT_NEAR(motion(o.rows[every * i]), motion(reference.rows[i]), accuracy * size)
              << with_second << ' ' << accuracy << ' ' << interval << ' ' << reference.rows[i].time;
      }
    }
}

}  // namespace
}  // namespace talus::verify
