#include <gtest/gtest.h>

#include <cmath>

#include "core/error.hpp"
#include "drive.hpp"
#include "fem/rebar/rebar_section.hpp"

namespace talus::rebar {
namespace {

const Strengths c30{30e6, 1.5, 1.15, 1.0};
constexpr double pi = 3.14159265358979;

TEST(Shear, ByHand) {
  ShearInput in;
  in.width = 0.3;
  in.effective_depth = 0.5;
  in.tension_area = 1.5e-3;  // rho = 1 %
  // k = 1.63246; 0.12 k 30^(1/3) = 0.60868 MPa
  const auto plain = shear_resistance(in, c30);
  EXPECT_NEAR(plain.concrete, 0.12 * 1.6324555 * std::cbrt(30.0) * 1e6 * 0.15, 1);
  EXPECT_NEAR(plain.governing, 91.3e3, 0.1e3);
  in.stirrup_area_per_length = 2 * pi * 0.005 * 0.005 / 0.2;  // two legs of 10 mm every 200 mm
  const auto tied = shear_resistance(in, c30);
  EXPECT_DOUBLE_EQ(tied.cot_theta, 2.5);
  EXPECT_NEAR(tied.stirrups, 2 * pi * 25e-6 / 0.2 * 0.45 * 500e6 / 1.15 * 2.5, 1);
  EXPECT_NEAR(tied.strut, 0.3 * 0.45 * 0.6 * 0.88 * 20e6 / 2.9, 1);
  EXPECT_DOUBLE_EQ(tied.governing, std::min(tied.stirrups, tied.strut));
  in.stirrup_area_per_length *= 4;  // now the struts and the stirrups fail together
  const auto heavy = shear_resistance(in, c30);
  EXPECT_LT(heavy.cot_theta, 2.5);
  EXPECT_GT(heavy.cot_theta, 1.0);
  EXPECT_NEAR(heavy.stirrups / heavy.strut, 1, 1e-9);
  in.axial = 0.3e6;
  in.gross_area = 0.165;
  EXPECT_NEAR(shear_resistance(in, c30).concrete - heavy.concrete, 0.15 * 0.3e6 / 0.165 * 0.15, 1);
  in.width = 0;
  EXPECT_THROW(shear_resistance(in, c30), InputError);
}

TEST(Section, PureForcesAndRectangularBeam) {
  // b 0.3, h 0.55, 4 bars 25 mm at the bottom (-y), d = 0.5: x = A f_yd / (0.809524 b f_cd), z = d - 0.415966
  // x, steel yields
  const double a = pi * 0.0125 * 0.0125;
  std::vector<SectionBar> bars;
  for (const double x : {-0.1, -0.03, 0.03, 0.1}) bars.push_back({x, -0.225, a, 500e6, 200e9});
  const Section s(Member::Section::rectangular, 0.3, 0.55, 0, bars, c30);
  EXPECT_NEAR(s.area(), 0.165, 1e-12);
  EXPECT_NEAR(s.steel_area(), 4 * a, 1e-12);
  const double force = 4 * a * 500e6 / 1.15, x = force / (0.809524 * 0.3 * 20e6);
  EXPECT_NEAR(s.moment(0, pi / 2) / (force * (0.5 - 0.415966 * x)), 1, 3e-3);
  EXPECT_NEAR(s.axial_tension(), force, 1e-6);
  EXPECT_NEAR(s.axial_compression(), 0.165 * 20e6 + 4 * a * (400e6 - 20e6),
              1e-3);  // 2 per mille: 400 MPa in the bars
  EXPECT_EQ(s.moment(1.01 * s.axial_compression(), 0), 0);
  EXPECT_EQ(s.moment(-1.01 * s.axial_tension(), 0), 0);
}

TEST(Section, SymmetricColumnInteraction) {
  Member m;
  m.width = 0.6;
  m.depth = 0.4;
  m.length = 5;
  const auto bars = longitudinal_bars(m, {8, 0.025, 0.04, 0.010, {}});
  const Section s(m, 0, bars, 2.5, c30);
  EXPECT_NEAR(s.steel_area(), 8 * pi * 0.0125 * 0.0125, 1e-12);
  for (const double n : {-0.5e6, 0.0, 1e6, 3e6}) {
    EXPECT_NEAR(s.moment(n, 0) / s.moment(n, pi), 1, 1e-6);
    EXPECT_NEAR(s.moment(n, pi / 2) / s.moment(n, -pi / 2), 1, 1e-6);
    EXPECT_GT(s.moment(n, 0), s.moment(n, pi / 2));  // the strong axis
  }
  EXPECT_GT(s.moment(1.5e6, 0), s.moment(0, 0));  // below the balance point compression helps
  const auto curve = s.interaction(0, 21);
  EXPECT_EQ(curve.size(), 21u);
  EXPECT_EQ(curve.front().moment, 0);
  EXPECT_EQ(curve.back().moment, 0);
}

TEST(Section, RoundAndHollow) {
  Member m;
  m.section = Member::Section::round;
  m.width = 1.2;
  m.length = 5;
  const auto bars = longitudinal_bars(m, {16, 0.028, 0.05, 0.012, {}});
  const Section solid(m, 0, bars, 2.5, c30), hollow(m, 0.3, bars, 2.5, c30);
  EXPECT_NEAR(solid.area(), pi * 0.36, 1e-9);
  EXPECT_NEAR(hollow.area(), pi * (0.36 - 0.09), 1e-9);
  EXPECT_NEAR(solid.moment(3e6, 0) / solid.moment(3e6, pi / 8), 1, 5e-3);
  EXPECT_LT(hollow.moment(8e6, 0), solid.moment(8e6, 0));
  const Section box(Member::Section::rectangular, 2, 1.5, 0.3, {}, c30);
  EXPECT_NEAR(box.area(), 2 * 1.5 - 1.4 * 0.9, 1e-12);
  EXPECT_THROW(Section(Member::Section::rectangular, 2, 1.5, 0.8, {}, c30), InputError);
  EXPECT_THROW(Section(Member::Section::rectangular, 2, 1.5, 0, {{1.1, 0, 1e-4, 500e6, 200e9}}, c30),
               InputError);
}

TEST(CrackWidth, BandStrainTimesLength) {
  using namespace material;
  const ConcreteDamage law(material::test::c30(0.2));
  const Concrete& c = law.parameters().concrete;
  ConcreteDamage::State state;
  Sym e{};
  Response r;
  for (int i = 1; i <= 1000; ++i) {  // the sides contract by what the stress asks for
    const double side = state.permanent[1] - c.poisson * (1 - state.d_t) * (i * 5e-7 - state.permanent[0]);
    e = {i * 5e-7, side, side, 0, 0, 0};
    r = law(e, Sym{}, state, state);
  }
  EXPECT_NEAR(crack_width(0.2, e, r.stress, c.young, c.poisson), 0.2 * (5e-4 - r.stress[0] / c.young), 1e-9);
}

}  // namespace
}  // namespace talus::rebar
