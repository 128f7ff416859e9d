#include <gtest/gtest.h>

#include <cmath>

#include "core/error.hpp"
#include "fem/materials/material_mc2010.hpp"

namespace talus::material {
namespace {

TEST(Mc2010, C30FromMeanStrengthAlone) {
  const Concrete c = mc2010(38e6);
  EXPECT_NEAR(c.young, 33.55e9, 0.005e9);  // values of the Model Code for C30
  EXPECT_NEAR(c.f_t, 2.896e6, 0.0005e6);
  EXPECT_NEAR(c.fracture_energy, 140.5, 0.05);
  EXPECT_DOUBLE_EQ(c.eps_c1, 2.3e-3);
  EXPECT_DOUBLE_EQ(c.f_ck, 30e6);
  EXPECT_GE(c.report.size(), 8u);
  EXPECT_NE(c.report[1].find("33.55 GPa"), std::string::npos) << c.report[1];
}

TEST(Mc2010, GivenValuesWinAndAreReportedSo) {
  ConcreteInput in;
  in.f_cm = 38e6;
  in.f_t = 2.5e6;
  const Concrete c = mc2010(in);
  EXPECT_DOUBLE_EQ(c.f_t, 2.5e6);
  bool said = false;
  for (const auto& line : c.report)
    said = said || (line.find("f_t") == 0 && line.find("given") != std::string::npos);
  EXPECT_TRUE(said);
}

/// It was taken for one left out, and read as 0.2.
TEST(Mc2010, APoissonsRatioOfNothingIsGiven) {
  ConcreteInput in;
  in.f_cm = 38e6;
  EXPECT_EQ(mc2010(in).poisson, 0.2);
  in.poisson = 0;
  EXPECT_EQ(mc2010(in).poisson, 0);
}

TEST(Mc2010, HighStrengthUsesTheLogarithm) {
  EXPECT_NEAR(mc2010(68e6).f_t, 2.12e6 * std::log(7.8), 1);
  // Both branches nearly meet at f_ck = 50 MPa.
  EXPECT_NEAR(mc2010(58e6).f_t, mc2010(58.001e6).f_t, 0.02e6);
}

TEST(Mc2010, EveryStrengthInRangeGivesAConsistentCurve) {
  for (double f = 20; f <= 130; f += 1) {
    const Concrete c = mc2010(f * 1e6);
    EXPECT_GT(c.young * c.eps_c1, c.f_cm);
    EXPECT_LT(c.f_t, 0.15 * c.f_cm);
  }
}

TEST(Mc2010, OutOfRangeNamesEveryProblem) {
  ConcreteInput in;
  in.f_cm = 5e6;
  in.poisson = 0.6;
  try {
    mc2010(in, "material.C5");
    FAIL() << "accepted";
  } catch (const InputError& e) {
    ASSERT_EQ(e.problems().size(), 2u);
    EXPECT_EQ(e.problems()[0].key, "material.C5.f_cm");
    EXPECT_EQ(e.problems()[0].value, "5 MPa");
    EXPECT_EQ(e.problems()[1].key, "material.C5.poisson");
  }
  EXPECT_THROW(mc2010(200e6), InputError);
  EXPECT_THROW(mc2010(std::nan("")), InputError);
  in = {};
  in.f_cm = 38e6;
  in.young = 10e9;  // below the secant modulus at the peak
  EXPECT_THROW(mc2010(in), InputError);
}

TEST(Mc2010, RateFactors) {
  EXPECT_NEAR(rate_factor_tension(1), 1.282, 5e-4);
  EXPECT_NEAR(rate_factor_tension(10), 1.337, 5e-4);
  EXPECT_NEAR(rate_factor_tension(100), 2.878, 5e-4);
  EXPECT_NEAR(rate_factor_compression(1), 1.157, 5e-4);
  EXPECT_NEAR(rate_factor_compression(10), 1.195, 5e-4);
  EXPECT_NEAR(rate_factor_compression(100), 1.793, 5e-4);
  EXPECT_DOUBLE_EQ(rate_factor_tension(0), 1);
  EXPECT_DOUBLE_EQ(rate_factor_compression(1e-7), 1);
}

TEST(Mc2010, SnapbackErrorNamesTheSizeNeeded) {
  const Concrete c = mc2010(38e6);
  const double limit = snapback_limit(c.young, c.f_t, c.fracture_energy);
  EXPECT_NEAR(limit, 1.124, 0.002);  // 2 x 33.55e9 x 140.5 / 2.896e6^2
  EXPECT_NO_THROW(check_cell_size(limit, "2 E G_F / f_t^2", {0.99 * limit, 0.99 * limit}));
  EXPECT_NO_THROW(check_cell_size(limit, "2 E G_F / f_t^2", {0.59 * limit, 0.59 * std::sqrt(3.0) * limit}));
  try {
    check_cell_size(limit, "2 E G_F / f_t^2", {0.7, 0.7 * std::sqrt(3.0)}, "structure.P1.cell_size");
    FAIL() << "a crack across the diagonal would cost 1.10 G_F";
  } catch (const InputError& e) {
    EXPECT_NE(e.problems()[0].rule.find("diagonal"), std::string::npos) << e.what();
    EXPECT_NE(e.problems()[0].rule.find("1.10 G_F"), std::string::npos) << e.what();
    EXPECT_NE(e.problems()[0].remedy.find("0.634 m or less"), std::string::npos) << e.what();
  }
  try {
    check_cell_size(limit, "2 E G_F / f_t^2", {1.5, 1.5}, "structure.P1.cell_size");
    FAIL() << "accepted";
  } catch (const InputError& e) {
    EXPECT_EQ(e.problems()[0].key, "structure.P1.cell_size");
    EXPECT_NE(e.problems()[0].rule.find("1.12"), std::string::npos) << e.what();
    EXPECT_NE(e.problems()[0].remedy.find("1.07"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace talus::material
