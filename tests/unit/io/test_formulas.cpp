#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "formulas/formulas.hpp"

namespace talus::formulas {
namespace {

double value(const std::vector<Result>& all, const std::string& id) {
  for (const Result& r : all)
    if (r.id == id) return r.value;
  ADD_FAILURE() << id;
  return 0;
}

TEST(Formulas, HertzAgainstTheClosedForm) {
  // Sphere R 1 cm at 1 cm/s on a half-space, both 210 GPa, nu 0.3, 7800 kg/m^3: 6.942 N.
  Inputs in(7800 * 4.0 / 3.0 * 3.14159265358979 * 1e-6, 0.01, 0.02);
  for (const char* e : {"block_young", "target_young"}) in.set(e, "210 GPa");
  for (const char* nu : {"block_poisson", "target_poisson"}) in.set(nu, "0.3");
  EXPECT_NEAR(value(evaluate(in), "hertz"), 6.942, 0.0005);
}

TEST(Formulas, ByHand) {
  Inputs in(1000, 20, 0.9);
  in.set("cushion_modulus", "3200 kPa");
  in.set("cushion_thickness", "0.6 m");
  in.set("cushion_friction_angle", "35 deg");
  in.set("contact_stiffness", 4e8);
  const auto r = evaluate(in);
  // 200 kJ, in kN and m: 1.765 x 3200^0.4 x 0.45^0.2 x 200^0.6 = 25.24 x 0.8524 x 24.02 x 1.765 = 912.1 kN.
  EXPECT_NEAR(value(r, "labiouse") / 1e3,
              1.765 * std::pow(3200, 0.4) * std::pow(0.45, 0.2) * std::pow(200, 0.6), 0.1);
  EXPECT_NEAR(value(r, "labiouse") / 1e3, 912.1, 0.5);
  EXPECT_NEAR(value(r, "switzerland") / 1e3,
              2.8 / std::sqrt(0.6) * std::pow(0.45, 0.7) * std::pow(3200, 0.4) *
                  std::tan(35 * 3.14159265358979 / 180) * std::pow(200, 0.6),
              0.1);
  const double h = 400 / 19.62;
  EXPECT_NEAR(value(r, "japan") / 1e3,
              2.108 * std::pow(9.81, 2.0 / 3) * std::pow(1000, 0.4) * std::pow(h, 0.6) * std::sqrt(0.9 / 0.6),
              0.1);
  EXPECT_NEAR(value(r, "en1991-hard"), 20 * std::sqrt(4e8 * 1000), 1);
}

TEST(Formulas, PunchingByHand) {
  Inputs in(1000, 20, 0.8);
  in.set("effective_depth", 0.45);
  in.set("reinforcement_ratio", 0.005);
  in.set("gamma_c", 1.5);
  in.set("f_ck", 30e6);
  in.set("load_diameter", 0.4);
  // k = 1 + sqrt(200/450) = 1.6667; v = 0.12 x 1.6667 x 15^(1/3) = 0.49324 MPa; v_min = 0.035 x 2.1517
  // x 5.4772 = 0.41248; u1 = 6.9115 m
  EXPECT_NEAR(value(evaluate(in), "en1992-punching"), 0.49324e6 * 6.9115 * 0.45, 200);
  in.set("load_diameter", 0.05);  // the edge of a small area crushes first: 0.24 x 0.88 x 20 MPa
  EXPECT_NEAR(value(evaluate(in), "en1992-punching"), 0.24 * 0.88 * 20e6 * 3.14159265 * 0.05 * 0.45, 200);
}

/// The control perimeter ends at the edges of the member, and of what is no slab there is none.
TEST(Formulas, PunchingKeepsWithinTheMember) {
  Inputs in(1000, 20, 0.8);
  in.set("effective_depth", 0.4);
  in.set("load_diameter", 0.4);
  const double whole = value(evaluate(in), "en1992-punching");  // 2 m across
  in.set("width", 2.001), in.set("width_across", 2.001);
  EXPECT_EQ(value(evaluate(in), "en1992-punching"), whole);
  // As wide as 5d and no slab's edge within reach.
  in.set("load_diameter", 0.8);
  const double wide = [&] {
    Inputs free = in;
    free.set("width", 1000.0), free.set("width_across", 1000.0);
    return value(evaluate(free), "en1992-punching");
  }();
  in.set("width_across", 1000.0);
  // r = 1.2 m, half width 1.0005 m: of each quadrant asin(1.0005 / 1.2) of pi / 2 lies within.
  EXPECT_NEAR(value(evaluate(in), "en1992-punching") / wide, std::asin(1.0005 / 1.2) / (3.14159265358979 / 2),
              1e-9);
  in.set("width", 1.9);
  for (const Result& r : evaluate(in)) {
    if (r.id != "en1992-punching") continue;
    EXPECT_TRUE(std::isnan(r.value));
    EXPECT_NE(
        r.note.find(
            "not applicable: the control perimeter at 2d, 2.4 m across, is wider than the member (1.9 m)"),
        std::string::npos)
        << r.note;
  }
  EXPECT_EQ(table(in, evaluate(in)).find("nan"), std::string::npos);
}

TEST(Formulas, EveryResultSaysWhatItIs) {
  const Inputs in(5000, 25);
  std::set<std::string> ids;
  for (const Result& r : evaluate(in)) {
    ids.insert(r.id);
    EXPECT_FALSE(r.equation.empty() || r.source.empty() || r.status.empty() || r.note.empty() ||
                 r.inputs.empty())
        << r.id;
    EXPECT_TRUE(r.status == "verified: closed form" || r.status == "as commonly cited, unverified");
    EXPECT_GT(r.value, 0);
    for (const InputValue& v : r.inputs) EXPECT_FALSE(v.symbol.empty() || v.origin.empty());
  }
  EXPECT_EQ(ids.size(), 6u);
  EXPECT_NEAR(in.get("diameter"), std::cbrt(6 * 5000 / (3.14159265358979 * 2600)), 1e-12);
  EXPECT_NE(table(in, evaluate(in)).find("as commonly cited, unverified"), std::string::npos);
}

TEST(Formulas, BadInputIsNamed) {
  EXPECT_THROW(Inputs(-1, 10), InputError);
  EXPECT_THROW(Inputs(10, std::nan("")), InputError);
  Inputs in(1000, 20);
  try {
    in.set("cushion_thicknes", "1 m");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("cushion_thickness"), std::string::npos);
  }
  EXPECT_THROW(in.set("cushion_thickness", "1 kg"), InputError);
  EXPECT_THROW(in.set("cushion_thickness", "thick"), InputError);
  EXPECT_THROW(in.set("cushion_friction_angle", "35"), InputError);
  EXPECT_THROW(in.set("f_ck", "300 MPa"), InputError);
  EXPECT_EQ(in.get("f_ck"), 30e6);  // unchanged by the refusal
  in.set("block_young", "60 GPa");
  EXPECT_NEAR(in.get("contact_stiffness"), 60e9 * 3.14159265358979 * in.get("diameter") / 4, 1e3);
}

}  // namespace
}  // namespace talus::formulas
