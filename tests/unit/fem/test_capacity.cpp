// Push-down of columns that a blow has left bent.
#include <gtest/gtest.h>

#include <cmath>

#include "fem/materials/material_mc2010.hpp"
#include "unit/fem/fem_specs.hpp"

using namespace talus;
using namespace talus::fem;
using namespace talus::fem::test;

namespace {

constexpr double column_side = 0.2, column_height = 6.0, bar_thickness = 0.012, bar_depth = 0.04,
                 yield = 500e6;  // L / r = 104 between plates
constexpr int bars_per_face = 2;

/// A column on pins, the upper one free along the axis, pushed at mid-height beyond what its section can bear
/// for `held` seconds, then let go.
StructureSpec pushed_column(double held) {
  StructureSpec s;
  s.name = "column";
  s.kind = "column";
  s.f_cm = 38e6;
  s.density = 2450;
  s.size = Vec3(column_side, column_side, column_height);
  s.cells = {2, 1, 20};
  s.damage = "concrete";
  s.rate_effect = false;
  s.gravity_preload = false;
  s.damping_ratio = 0.2;
  s.supports.push_back(
      {"", "", Box3(Vec3(-0.01, -column_side, -0.01), Vec3(0.01, column_side, 0.01)), {true, true, true}});
  s.supports.push_back(
      {"",
       "",
       Box3(Vec3(-0.01, -column_side, column_height - 0.01), Vec3(0.01, column_side, column_height + 0.01)),
       {true, true, false}});
  s.rebar_rules.push_back({"longitudinal", "pier", 2 * bars_per_face, bar_thickness,
                           bar_depth - bar_thickness / 2, 0, yield, 0.2, 0});
  StructureSpec::Load load;
  load.region = Box3(Vec3(-0.5 * column_side - 0.001, -column_side, 2.39),
                     Vec3(-0.5 * column_side + 0.001, column_side, 3.61));
  load.traction = Vec3(70e3, 0, 0);  // 17 kN; the plastic hinge 4 M_p / L bears about 10 kN
  load.history = {{0, 0}, {0.01, 1}, {held, 1}, {held + 0.01, 0}};
  s.loads.push_back(load);
  return s;
}

/// Displacement of the axis at mid-height along x, from the line between the ends [m].
double bow(const FemStructure& column) {
  double sum = 0;
  int count = 0;
  const std::vector<Vec3> u = column.snapshot().displacement;
  for (std::size_t n = 0; n < column.mesh().nodes.size(); ++n)
    if (std::abs(column.mesh().nodes[n].z() - 0.5 * column_height) < 1e-9) sum += u[n].x(), ++count;
  return sum / count;
}

enum class Growth { plastic, elastic };

/// Model column: a bow of e_0 between clamped plates, whose end and middle sections bear N e / 2 each. Plane
/// sections; concrete without tension on the Model Code's parabola, constant beyond; bars ideally plastic.
/// The greatest N of all curvatures [N]. Growth of the bow: elastic, e = e_0 / (1 - N / N_E) with N_E = 4
/// pi^2 E I / L^2 of the sound section (Perry), too little: N is an upper bound; plastic, e = e_0 + 2 kappa
/// (L / 2 pi)^2 as one wave of a cosine, too much where curvature gathers at three sections: a lower one.
double model_column(double e_0, Growth growth) {
  const material::Concrete c = material::mc2010(38e6);
  const double k = c.young * c.eps_c1 / c.f_cm;
  const auto concrete = [&](double strain) {
    const double x = std::min(strain / c.eps_c1, 1.0);
    return strain > 0 ? c.f_cm * (k * x - x * x) / (1 + (k - 2) * x) : 0.0;
  };
  const auto steel = [](double strain) { return std::clamp(200e9 * strain, -yield, yield); };
  constexpr int strips = 60;
  const double area = bars_per_face * M_PI / 4 * bar_thickness * bar_thickness,
               wave = column_height / (2 * M_PI),
               euler = c.young * std::pow(column_side, 4) / 12 / (wave * wave);
  double greatest = 0;
  for (double kappa = 0; kappa < 0.03; kappa += 1e-4) {
    double force = 0, moment = 0;
    const auto section = [&](double middle) {
      force = moment = 0;
      for (int i = 0; i < strips; ++i) {
        const double y = column_side * ((i + 0.5) / strips - 0.5),
                     f = concrete(middle + kappa * y) * column_side * column_side / strips;
        force += f, moment += f * y;
      }
      for (const double y : {bar_depth - 0.5 * column_side, 0.5 * column_side - bar_depth}) {
        const double f = steel(middle + kappa * y) * area;
        force += f, moment += f * y;
      }
      const double e =
          growth == Growth::plastic ? e_0 + 2 * kappa * wave * wave : e_0 / std::max(0.01, 1 - force / euler);
      return moment - 0.5 * force * e;
    };
    double low = -0.5 * kappa * column_side,
           high = 5e-3;  // decreasing: the more force, the less moment is left over
    if (section(low) < 0 || section(high) > 0) continue;
    for (int i = 0; i < 60; ++i) (section(0.5 * (low + high)) > 0 ? low : high) = 0.5 * (low + high);
    greatest = std::max(greatest, force);
  }
  return greatest;
}

}  // namespace

TEST(PushDown, OfABentColumnIsThatOfItsBow) {
  FemStructure column(pushed_column(0.11), Vec3::Zero(), silent);
  const double h = column.critical_step();
  for (double t = 0; t < 0.5; t += h) column.predict(t, h), column.correct(t, h, {});
  const double e_0 = bow(column), now = column.capacity().push_down().at(0).capacity;
  EXPECT_GT(e_0, 0.15 * column_side);
  EXPECT_GT(now, model_column(e_0, Growth::plastic));
  EXPECT_LT(now, model_column(e_0, Growth::elastic));
  EXPECT_LT(model_column(e_0, Growth::elastic), 0.9 * model_column(0, Growth::plastic));
}
