#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fem/rebar/rebar_dowel.hpp"

namespace talus::rebar {
namespace {

constexpr double diameter = 0.016, yield = 500e6, f_c = 38e6, area = 0.25 * M_PI * diameter * diameter;
const double strength = 1.6 * area * std::sqrt(f_c * yield), full = 0.1 * diameter;

Dowel in_wide_concrete() { return Dowel({diameter, yield, f_c, {10, 10}}); }

/// The law along a path of slips: work by the trapezoid of the forces, and what it dissipated.
struct Path {
  Dowel law;
  Dowel::State state;
  std::array<double, 2> at{}, force{};
  double work = 0, dissipated = 0, stored = 0;
  double go(const std::array<double, 2>& to, double stress = 0) {
    const Dowel::Result r = law(to, stress, state, state);
    work += 0.5 * ((force[0] + r.force[0]) * (to[0] - at[0]) + (force[1] + r.force[1]) * (to[1] - at[1]));
    dissipated += r.dissipation;
    stored = r.energy;
    EXPECT_GE(r.dissipation, 0);
    at = to, force = r.force;
    return std::hypot(r.force[0], r.force[1]);
  }
};

TEST(Dowel, FollowsTheRootOfTheSlip) {
  Path path{in_wide_concrete(), {}};
  const double c = std::cos(0.7), s = std::sin(0.7);
  for (int i = 1; i <= 6000; ++i) {
    const double slip = 2 * full * i / 6000;
    const double force = path.go({c * slip, s * slip});
    if (slip > full / 100) {
      EXPECT_NEAR(force, strength * std::sqrt(std::min(1.0, slip / full)), 1e-9 * strength);
    }
    EXPECT_NEAR(path.force[0] * s, path.force[1] * c, 1e-9 * strength);  // along the slip
  }
  // The root up to s_1, two thirds of V_max s_1, less the triangle under its chord; then V_max s_1.
  const double below = full / 100, missing = strength * 0.1 * below * (2.0 / 3 - 0.5);
  EXPECT_NEAR(path.work, strength * full * (2.0 / 3 + 1) - missing, 2e-5 * strength * full);
  EXPECT_NEAR(path.stored + path.dissipated, path.work, 1e-4 * path.work);
}

TEST(Dowel, YieldingBarsCarryNoShear) {
  const Dowel law = in_wide_concrete();
  EXPECT_NEAR(law.bar_strength(0.8 * yield), 0.6 * strength, 1e-9 * strength);
  EXPECT_EQ(law.bar_strength(-1.01 * yield), 0);
  EXPECT_EQ(law.bar_strength(INFINITY), 0);
  // At a slip that stands, what the steel's stress takes away is dissipated.
  Path path{law, {}};
  for (int i = 1; i <= 1000; ++i) path.go({full * i / 1000, 0});
  const double work = path.work, stored = path.stored, dissipated = path.dissipated;
  for (int i = 1; i <= 1000; ++i) path.go({full, 0}, yield * i / 1000);
  EXPECT_EQ(path.work, work);
  EXPECT_NEAR(path.stored, 0, 1e-9 * stored);
  EXPECT_NEAR(path.dissipated - dissipated, stored, 1e-6 * stored);
}

TEST(Dowel, CoverSplitsByBaumannAndRuesch) {
  // Two bars of 16 mm in a width of 200 mm: each splits 100 - 16 mm; 1.64 x 84 x 16 x 38^(1/3) = 7.41 kN.
  Path path{Dowel({diameter, yield, f_c, {0.084, 10}}), {}};
  const double split = 1.64 * 84 * 16 * std::cbrt(38.0), at = full * std::pow(split / strength, 2);  // 45 um
  double most = 0;
  for (int i = 1; i <= 20000; ++i) {
    const double slip = 3e-3 * i / 20000, force = path.go({slip, 0});
    most = std::max(most, force);
    if (slip > at) { EXPECT_NEAR(force, std::max(0.0, split * (1 - (slip - at) / 2.5e-3)), 1e-3 * split); }
  }
  EXPECT_NEAR(most, split, 1e-3 * split);
  EXPECT_NEAR(path.dissipated, path.work, 1e-3 * path.work);  // nothing is stored any more
  // Along the face it is not split off.
  Path other{Dowel({diameter, yield, f_c, {0.084, 10}}), {}};
  for (int i = 1; i <= 1000; ++i) other.go({0, full * i / 1000});
  EXPECT_NEAR(other.force[1], strength, 1e-9 * strength);
}

TEST(Dowel, ReversalLosesAndNeverMakesEnergy) {
  Path path{Dowel({diameter, yield, f_c, {0.3, 1}}), {}};
  const auto swing = [&](double to) {
    const double from = path.at[0];
    for (int i = 1; i <= 4000; ++i) path.go({from + (to - from) * i / 4000, 0});
  };
  swing(0.5 * full);
  const double peak = path.force[0], gap = path.state.gap;
  swing(0);
  EXPECT_EQ(path.force[0], 0);
  const double lost = path.work;
  EXPECT_GT(lost, 0.5 * peak * gap);
  swing(-0.5 * full);  // over the gap, and up to the same force on the other side
  EXPECT_NEAR(path.force[0], -peak, 1e-6 * peak);
  swing(0.5 * full), swing(0);
  EXPECT_NEAR(path.work, lost, 1e-4 * lost);  // within what is crushed nothing is lost
  swing(-full), swing(0);
  EXPECT_GT(path.work, lost);
}

TEST(Dowel, NoWayMakesEnergy) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    Path path{Dowel({diameter, yield, f_c, {0.1 + 0.05 * trial, 0.4}}), {}};
    std::array<double, 2> goal{};
    for (int leg = 0; leg < 30; ++leg) {
      const std::array<double, 2> from = path.at;
      goal = {full * any(random), full * any(random)};
      const double before = path.work - path.stored, stress = yield * any(random);
      for (int i = 1; i <= 500; ++i)
        path.go({from[0] + (goal[0] - from[0]) * i / 500, from[1] + (goal[1] - from[1]) * i / 500}, stress);
      EXPECT_GT(path.work - path.stored, before - 1e-3 * strength * full);
      EXPECT_NEAR(path.work, path.stored + path.dissipated, 0.01 * strength * full);
    }
  }
}

/// A row of three cells of 0.1 m along x; the right one is moved against the left one, so that the middle one
/// is the crack.
struct Cracked {
  std::vector<Vec3> nodes;
  std::vector<std::array<int, 8>> hexes;
  std::vector<Bar> bars;
  std::unique_ptr<EmbeddedBars> embedded;
  std::unique_ptr<DowelField> field;
  std::vector<double> u{}, f{};
  std::vector<char> live{1, 1, 1};
  double work = 0, dissipated = 0, stored = 0;
  static constexpr double opening = 50e-6;

  explicit Cracked(const std::vector<Vec3>& points = {Vec3(0.01, 0.05, 0.03), Vec3(0.29, 0.05, 0.03)}) {
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 4; ++i) nodes.emplace_back(0.1 * i, 0.1 * j, 0.1 * k);
    for (int i = 0; i < 3; ++i) hexes.push_back({i, i + 1, i + 5, i + 4, i + 8, i + 9, i + 13, i + 12});
    Bar bar;
    bar.name = "L", bar.diameter = diameter, bar.points = points;
    bars = {bar};
    embedded = std::make_unique<EmbeddedBars>(bars, embed(bars, host_search(nodes, hexes)), nodes, hexes);
    field = std::make_unique<DowelField>(*embedded, nodes, hexes, f_c, opening);
    u.assign(4 * nodes.size(), 0.0), f = u;
  }
  void see_cracks() {
    for (std::size_t k = 0; k < embedded->segments().size(); ++k) field->open(k, u.data());
  }
  /// The force on the right cell at a jump of the middle one; everything turned by `turn` about y afterwards.
  Vec3 jump(const Vec3& by, double turn = 0) {
    const Mat3 rotation = Eigen::AngleAxisd(turn, Vec3::UnitY()).toRotationMatrix();
    const std::vector<double> before = u, force = f;
    std::fill(f.begin(), f.end(), 0.0);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      const Vec3 moved = nodes[n].x() > 0.15 ? by : Vec3(0, 0, 0),
                 to = rotation * (nodes[n] + moved) - nodes[n];
      std::copy_n(to.data(), 3, &u[4 * n]);
    }
    const DowelField::Sums sums = field->forces(
        u.data(), [](std::size_t) { return 0.0; }, live.data(), nullptr, f.data());
    field->accept();
    for (std::size_t i = 0; i < u.size(); ++i) work += 0.5 * (force[i] + f[i]) * (u[i] - before[i]);
    dissipated += sums.dissipation, stored = sums.energy;
    Vec3 right = Vec3::Zero(), all = Vec3::Zero();
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      all += Eigen::Map<const Vec3>(&f[4 * n]);
      if (nodes[n].x() > 0.15) right += Eigen::Map<const Vec3>(&f[4 * n]);
    }
    EXPECT_LT(all.norm(), 1e-9 * strength);
    return rotation.transpose() * right;
  }
};

TEST(DowelField, AnOpenCrackShearedByHand) {
  Cracked row;
  EXPECT_FALSE(row.field->possible(1, 1e-4));  // cells of 0.17 m across would open by 17 micrometres
  row.jump(Vec3(0.9 * Cracked::opening, 0, 0));
  row.see_cracks();
  EXPECT_TRUE(row.field->empty());
  row.jump(Vec3(2 * Cracked::opening, 0, 0));
  EXPECT_TRUE(row.field->possible(1, 1e-3));
  row.see_cracks();
  ASSERT_EQ(row.field->count(), 1u);  // in the middle cell
  EXPECT_FALSE(row.field->possible(1, 1e-3));
  // Opening further does not strain it.
  for (int i = 2; i <= 20; ++i) EXPECT_LT(row.jump(Vec3(i * Cracked::opening, 0, 0)).norm(), 1e-9 * strength);
  // The bar lies 50 mm from both sides and 30 mm from below in 100 mm: 100 - 16 mm split, whichever way it is
  // pushed.
  const double split = 1.64 * 84 * 16 * std::cbrt(38.0), w = 20 * Cracked::opening,
               at = full * std::pow(split / strength, 2);
  double most = 0;
  for (int i = 1; i <= 4000; ++i) {
    const double slip = 1e-3 * i / 4000;
    const Vec3 force = row.jump(Vec3(w, 0, slip));
    most = std::max(most, force.z());
    const double root = strength * std::sqrt(slip / full);
    if (slip > full / 100) {
      EXPECT_NEAR(force.z() / std::min(root, split * (1 - (slip - at) / 2.5e-3)), 1, 1e-2) << slip;
    }
  }
  EXPECT_NEAR(most / split, 1, 0.02);
  EXPECT_NEAR((row.stored + row.dissipated) / row.work, 1, 1e-3);
  for (int i = 4000; i >= 0; --i) row.jump(Vec3(w, 0, 1e-3 * i / 4000));
  EXPECT_GT(row.work, 0);
  EXPECT_NEAR((row.stored + row.dissipated) / row.work, 1, 1e-3);
}

TEST(DowelField, TurnsWithItsHost) {
  Cracked row;
  row.jump(Vec3(2 * Cracked::opening, 0, 0));
  row.see_cracks();
  const Vec3 force = row.jump(Vec3(2 * Cracked::opening, 1e-5, 2e-5));
  const double stored = row.stored;
  EXPECT_LT((row.jump(Vec3(2 * Cracked::opening, 1e-5, 2e-5), 1.0) - force).norm(), 1e-6 * force.norm());
  EXPECT_NEAR(row.stored, stored, 1e-9 * stored);
}

TEST(DowelField, SegmentsShareACell) {
  Cracked one, two({Vec3(0.01, 0.05, 0.03), Vec3(0.13, 0.05, 0.03), Vec3(0.29, 0.05, 0.03)});
  for (Cracked* row : {&one, &two}) row->jump(Vec3(2 * Cracked::opening, 0, 0)), row->see_cracks();
  EXPECT_EQ(two.field->count(), 2u);
  const Vec3 jump(2 * Cracked::opening, 0, 3e-4);
  EXPECT_NEAR(two.jump(jump).z() / one.jump(jump).z(), 1, 1e-8);
}

TEST(DowelField, BarsAlongTheCrackBridgeNothing) {
  Cracked row({Vec3(0.15, 0.05, 0.01), Vec3(0.15, 0.05, 0.09)});
  row.jump(Vec3(2 * Cracked::opening, 0, 0));
  row.see_cracks();
  EXPECT_TRUE(row.field->empty());
}

TEST(DowelField, NeighboursShareTheConcrete) {
  Cracked row;
  Bar second = row.bars[0];
  for (Vec3& p : second.points) p.y() = 0.08;
  row.bars[0].points[0].y() = row.bars[0].points[1].y() = 0.03;
  row.bars.push_back(second);
  row.embedded = std::make_unique<EmbeddedBars>(row.bars, embed(row.bars, host_search(row.nodes, row.hexes)),
                                                row.nodes, row.hexes);
  row.field = std::make_unique<DowelField>(*row.embedded, row.nodes, row.hexes, f_c, Cracked::opening);
  row.jump(Vec3(2 * Cracked::opening, 0, 0));
  row.see_cracks();
  ASSERT_EQ(row.field->count(), 2u);
  // 30 + 25 - 16 and 25 + 20 - 16 mm.
  const double slip = 1e-4, fall = 1;  // split by one step
  EXPECT_NEAR(row.jump(Vec3(2 * Cracked::opening, 0, slip)).z(),
              1.64 * (39 + 29) * 16 * std::cbrt(38.0) * fall, 0.02 * 6000);
}

TEST(DowelField, StateIsRestoredToTheSameBits) {
  Cracked a, b;
  a.jump(Vec3(2 * Cracked::opening, 0, 0)), a.see_cracks();
  a.jump(Vec3(2 * Cracked::opening, 2e-4, 3e-4));
  std::vector<double> records;
  a.field->save(records, [](std::size_t) { return true; });
  EXPECT_EQ(records.size(), DowelField::record_width);
  b.field->restore(records);
  const Vec3 jump(2 * Cracked::opening, 1e-4, -3e-4);
  EXPECT_EQ(a.jump(jump), b.jump(jump));
}

}  // namespace
}  // namespace talus::rebar
