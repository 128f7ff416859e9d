/// What every law must satisfy, one set of tests for all of them.
#include <gtest/gtest.h>

#include <random>

#include "drive.hpp"
#include "fem/materials/material_cdpm2.hpp"
#include "fem/materials/material_damage.hpp"

namespace talus::material {
namespace {

template <class L>
struct Sample;

template <>
struct Sample<ConcreteDamage> {
  static constexpr double work_tolerance = 2e-3;
  static ConcreteDamage::Parameters good() { return test::c30(); }
};

template <>
struct Sample<Cdpm2> {
  // Lateral plastic strain against undamaged lateral compression gives back work that a non-negative
  // dissipation cannot book.
  static constexpr double work_tolerance = 0.03;
  static Cdpm2::Parameters good() {
    Cdpm2::Parameters p;
    p.concrete = mc2010(38e6);
    p.rate_effect = false;
    return p;
  }
};

template <class L>
class EveryLaw : public ::testing::Test {};
using Laws = ::testing::Types<ConcreteDamage, Cdpm2>;
TYPED_TEST_SUITE(EveryLaw, Laws);

TYPED_TEST(EveryLaw, ZeroAtRest) {
  const TypeParam law(Sample<TypeParam>::good());
  typename TypeParam::State state{};
  const Response r = law(Sym{}, Sym{}, state, state);
  for (const double s : r.stress) EXPECT_EQ(s, 0);
  EXPECT_EQ(r.energy, 0);
  EXPECT_EQ(r.dissipation, 0);
}

TYPED_TEST(EveryLaw, ElasticStressIsTheGradientOfTheEnergy) {
  const TypeParam law(Sample<TypeParam>::good());
  const Sym e{2e-5, -3e-5, 1e-5, 2e-5, -1e-5, 3e-5};
  const auto at = [&](const Sym& x) {
    typename TypeParam::State state{};
    return law(x, Sym{}, state, state);
  };
  const Response r = at(e);
  for (int i = 0; i < 6; ++i) {
    Sym up = e, down = e;
    up[i] += 1e-9;
    down[i] -= 1e-9;
    EXPECT_NEAR((at(up).energy - at(down).energy) / 2e-9, r.stress[i], 1e-5 * 3e6);
  }
  EXPECT_EQ(r.dissipation, 0);
}

/// Work put in along a path is what is stored plus what is dissipated; dissipation is never negative.
/// Proportional paths, along which the split stress has an energy.
TYPED_TEST(EveryLaw, WorkIsStoredOrDissipated) {
  const TypeParam law(Sample<TypeParam>::good());
  for (const Sym& s :
       {Sym{1, 0, 0, 0, 0, 0}, Sym{-1, 0, 0, 0, 0, 0}, Sym{-1, -0.5, 0, 0, 0, 0}, Sym{0, 0, 1, 0, 0, 0}}) {
    typename TypeParam::State state{};
    const Sym direction = test::strain_of(s, 30e9, 0.2);
    const double top = s[0] < 0 ? 150e6 : 20e6;
    Sym before{};
    Response last{};
    double work = 0, lost = 0;
    for (int i = 1; i <= 12000; ++i) {
      const double phase = i / 12000.0;
      const double level =
          top *
          (phase < 0.5 ? phase / 0.5 : (phase < 0.75 ? 1 - 2 * (phase - 0.5) : 0.5 + 2.4 * (phase - 0.75)));
      const Sym e = test::scaled(direction, level);
      const Response r = law(e, Sym{}, state, state);
      ASSERT_GE(r.dissipation, 0);
      for (int k = 0; k < 6; ++k) work += 0.5 * (r.stress[k] + last.stress[k]) * (e[k] - before[k]);
      lost += r.dissipation;
      before = e;
      last = r;
    }
    EXPECT_NEAR(work, last.energy + lost, Sample<TypeParam>::work_tolerance * work);
  }
}

/// Cracked concrete that turns between tension and compression has no potential: its books close at every
/// step all the same, and tell what it gave back.
TEST(Cdpm2Books, CloseAtEveryStepOfARandomPath) {
  const Cdpm2 law(Sample<Cdpm2>::good());
  std::mt19937 generator(3);
  std::normal_distribution<double> u(0, 1);
  double returned = 0, taken = 0;
  for (int path = 0; path < 50; ++path) {
    Cdpm2::State state{};
    Sym e{};
    Response last{};
    for (int i = 0; i < 100; ++i) {
      const Sym before = e;
      for (double& x : e) x += 5e-5 * u(generator);
      const Response r = law(e, Sym{}, state, state);
      double work = 0;
      for (int k = 0; k < 6; ++k) work += 0.5 * (r.stress[k] + last.stress[k]) * (e[k] - before[k]);
      ASSERT_NEAR(work, r.energy - last.energy + r.dissipation - r.returned, 1e-9 * (r.energy + last.energy));
      returned += r.returned;
      taken += r.dissipation;
      last = r;
    }
  }
  EXPECT_GT(returned, 0);
  EXPECT_LT(returned, 0.2 * taken);
}

TYPED_TEST(EveryLaw, DissipationIsNeverNegativeOnRandomPaths) {
  const TypeParam law(Sample<TypeParam>::good());
  std::mt19937 generator(2);
  std::normal_distribution<double> u(0, 1);
  for (int path = 0; path < 100; ++path) {
    typename TypeParam::State state{};
    Sym e{};
    for (int i = 0; i < 100; ++i) {
      for (double& x : e) x += 5e-5 * u(generator);
      const Response r = law(e, Sym{}, state, state);
      ASSERT_GE(r.dissipation, 0);
      ASSERT_GE(r.energy, 0);
      for (const double x : r.stress) ASSERT_TRUE(std::isfinite(x));
    }
  }
}

TYPED_TEST(EveryLaw, ARejectedCallLeavesNoTrace) {
  const TypeParam law(Sample<TypeParam>::good());
  typename TypeParam::State start{}, scratch{}, once{}, twice{};
  const Sym e{3e-4, -1e-3, 1e-4, 0, 2e-4, 0};
  const Response first = law(e, Sym{}, start, once);
  law(test::scaled(e, 3), Sym{}, start, scratch);
  const Response second = law(e, Sym{}, start, twice);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(first.stress[i], second.stress[i]);
}

}  // namespace
}  // namespace talus::material
