#include "core/units.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>

namespace talus {
namespace {

Quantity read(const std::string& text) {
  std::string error;
  const auto quantity = parse_quantity(text, error);
  EXPECT_TRUE(quantity.has_value()) << text << ": " << error;
  return quantity.value_or(Quantity{});
}

std::string complaint(const std::string& text) {
  std::string error;
  EXPECT_FALSE(parse_quantity(text, error).has_value()) << text;
  return error;
}

TEST(Units, TheExamplesOfTheSceneFile) {
  EXPECT_EQ(read("3.84 m").value, 3.84);
  EXPECT_EQ(read("3.84 m").dimension, dimension::length);
  EXPECT_EQ(read("28 deg").value, 28 * (std::numbers::pi / 180));
  EXPECT_EQ(read("28 deg").dimension, dimension::angle);
  EXPECT_EQ(read("30 GPa").value, 30e9);
  EXPECT_EQ(read("30 GPa").dimension, dimension::pressure);
  EXPECT_EQ(read("2.5 t/m^3").value, 2500);
  EXPECT_EQ(read("2.5 t/m^3").dimension, dimension::density);
  EXPECT_EQ(read("30 GN/m").value, 30e9);
  EXPECT_EQ(read("30 GN/m").dimension, dimension::stiffness);
  EXPECT_EQ(read("30 GPa/m").dimension, dimension::stiffness_per_area);
}

// A prefix shifts the decimal exponent, so the result is the double nearest to the decimal number; a product
// would miss it.
TEST(Units, PrefixesAreExact) {
  EXPECT_EQ(read("44.8 g").value, 0.0448);
  EXPECT_NE(1e-3 * 0.9, 0.0009);
  EXPECT_EQ(read("0.9 ms").value, 0.0009);
  EXPECT_EQ(read("4.35 ms").value, 0.00435);
  EXPECT_EQ(read("1 ms").value, 1e-3);
  EXPECT_EQ(read("0.1 mm").value, 1e-4);
  EXPECT_EQ(read("1.1e2 MPa").value, 1.1e8);
  EXPECT_EQ(read("1.1E+2 kPa").value, 1.1e5);
  EXPECT_EQ(read("5 cm^2").value, 5e-4);
  EXPECT_EQ(read("7.85 g/cm^3").value, 7850);
}

TEST(Units, CompoundForms) {
  EXPECT_EQ(read("9.81 m/s^2").dimension, dimension::acceleration);
  EXPECT_EQ(read("9.81 m/s2").dimension, dimension::acceleration);
  EXPECT_EQ(read("9.81 m/s\u00b2").dimension, dimension::acceleration);
  EXPECT_EQ(read("9.81 m s^-2").dimension, dimension::acceleration);
  EXPECT_EQ(read("9.81 m*s^-2").dimension, dimension::acceleration);
  EXPECT_EQ(read("1 kg m/s^2").dimension, dimension::force);
  EXPECT_EQ(read("1 N/m^2").dimension, dimension::pressure);
  EXPECT_EQ(read("1 J/m^2").dimension, dimension::stiffness);
  EXPECT_EQ(read("90 deg/s").dimension, dimension::angular_velocity);
  EXPECT_NEAR(read("90 km/h").value, 25, 1e-14);
  EXPECT_NEAR(read("2.2e6 kgf/cm^2").value, 2.2e6 * 98066.5, 1e-3);
  EXPECT_EQ(read("12").dimension, dimension::number);
  EXPECT_EQ(read(" +2.5  m ").value, 2.5);
  EXPECT_EQ(read("-3m").value, -3);
  EXPECT_EQ(read("2 %").value, 0.02);
  EXPECT_EQ(read("5 1/s").dimension, (Dimension{0, 0, -1, 0}));
  EXPECT_EQ(read("45\u00b0").dimension, dimension::angle);
}

TEST(Units, MinuteAndMillimetreAreNotMistaken) {
  EXPECT_EQ(read("2 min").value, 120);
  EXPECT_EQ(read("2 mm").value, 0.002);
  EXPECT_EQ(read("2 h").value, 7200);
  EXPECT_EQ(read("2 hPa").value, 200);
  EXPECT_EQ(read("2 mN").value, 0.002);
  EXPECT_EQ(read("2 kt").value, 2e6);
}

TEST(Units, BadTextSaysWhatIsWrong) {
  EXPECT_EQ(complaint("3.84 metre"), "unknown unit \"metre\": write \"m\"");
  EXPECT_EQ(complaint("-1,5 m"), "has a decimal comma: write \"-1.5 m\"");
  EXPECT_EQ(complaint("2,650 kg/m^3"),
            "has a comma: write \"2650 kg/m^3\" or \"2.650 kg/m^3\", as it is meant");
  EXPECT_EQ(complaint("m"), "does not start with a number");
  EXPECT_EQ(complaint(""), "does not start with a number");
  EXPECT_EQ(complaint("nan m"), "does not start with a number");
  EXPECT_EQ(complaint("inf"), "does not start with a number");
  EXPECT_EQ(complaint("--3 m"), "does not start with a number");
  EXPECT_EQ(complaint("1e999 m"), "the number is too large or too small");
  EXPECT_EQ(complaint("1e305 Gm"), "the number is too large or too small");
  EXPECT_EQ(complaint("3 m/"), "a unit is missing at the end of \" m/\"");
  EXPECT_EQ(complaint("3 m//s"), "a unit is missing in \" m//s\"");
  EXPECT_EQ(complaint("3 m^"), "the exponent of \"m\" is no whole number from -9 to 9");
  EXPECT_EQ(complaint("3 m^99"), "the exponent of \"m\" is no whole number from -9 to 9");
  EXPECT_EQ(complaint("3 m^99999999999999999999"), "the exponent of \"m\" is no whole number from -9 to 9");
}

TEST(Units, OneNumberIsRead) {
  for (const char* range :
       {"2-3 m^3", "28-3 deg", "0.3-9", "2-3", "2 - 3", "2 -3 m", "2021-01-01", "3-", "3 - m"})
    EXPECT_NE(complaint(range).find("where a unit or nothing is expected"), std::string::npos) << range;
  for (const char* blank : {"1 105 m^3", "1 105", "1 1 m", "2 1 m", "2 12", "5 m 3", "1 000 000 N"})
    EXPECT_NE(complaint(blank).find("where a unit or nothing is expected"), std::string::npos) << blank;
  EXPECT_EQ(complaint("2-3 m^3"), "goes on with \"-3 m^3\" where a unit or nothing is expected");
  complaint("3 m-2");
  complaint("5 % 3");
  complaint("5 1^2");
  EXPECT_EQ(read("0.3 -").value, 0.3);
  EXPECT_EQ(read("0.3 1").value, 0.3);
  EXPECT_EQ(read("5 1/s").value, 5);
  EXPECT_EQ(read("5 m 1 / s").dimension, dimension::velocity);
}

TEST(Units, ExactTextReadsBackToTheSameBits) {
  for (const double x : {0.1, 1.0 / 3, 5e-324, 1.7976931348623157e308, -0.0, 30e9, 0.5317094316614788})
    EXPECT_EQ(std::strtod(exact_text(x).c_str(), nullptr), x) << exact_text(x);
}

TEST(Units, DescribeNamesTheUnitAndAnExample) {
  EXPECT_EQ(describe(dimension::length), "a length in m, e.g. 3.84 or \"3.84 m\" or \"25 mm\"");
  EXPECT_EQ(unit_name(Dimension{2, 1, -3, 0}), "kg m^2 s^-3");
}

}  // namespace
}  // namespace talus
