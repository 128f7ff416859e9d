// Blocks on springs per area at a structure: cushions that crush, and an elastic bed.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/bisect.hpp"
#include "verify/impact_text.hpp"
#include "verify/measures.hpp"
#include "verify/scene_text.hpp"

namespace talus::verify {
namespace {

/// Area across the direction of motion that a shape shows at depth x, integrated once (volume) and twice over
/// the depth.
struct Shape {
  std::string name, block;
  double height = 0;  // of the mass centre above the lowest point [m]
  double (*twice)(double) = nullptr;
};

constexpr double radius = 0.5;

double of_sphere(double x) {
  return std::numbers::pi * (radius * x * x * x / 3 - x * x * x * x / 12);
}  // A = pi (2 R x - x^2)
double of_face(double x) { return 0.5 * x * x; }    // A = 1
double of_edge(double x) { return x * x * x / 3; }  // A = 2 x

/// Work of the bed down to depth d: k (J(d) - J(d - L)), L = p/k, since a column gives k min(d, L).
double work(const Shape& s, double stiffness, double yield, double d) {
  const auto j = [&](double x) { return x > 0 ? s.twice(x) : 0.0; };
  return stiffness * (j(d) - (std::isfinite(yield) ? j(d - yield) : 0.0));
}

double depth_of(const Shape& s, double stiffness, double yield, double energy) {
  return bisect(0, 1, [&](double d) { return !(work(s, stiffness, yield, d) > energy); }).first;
}

Shape sphere(int longitudes) {
  return {fmt::format("sphere of {} by {}", longitudes, longitudes / 2 + 1),
          fmt::format("shape = \"sphere\"\nlongitudes = {}\nlatitudes = {}\ndiameter = 1.0\n", longitudes,
                      longitudes / 2 + 1),
          radius, of_sphere};
}

void strike(CaseRun& c, const Shape& shape, double stiffness, double pressure, double speed, double duration,
            double allowed) {
  c.method(Method::by_accuracy(1e-3));
  SceneText s(Method::by_accuracy(1e-3), duration, Vec3::Zero());
  const bool crushes = std::isfinite(pressure);
  s.history(2.5e-4).material("concrete", 2450, "young = \"33 GPa\"\npoisson = 0.2").material("rock", 2600);
  s.interface(
      "rock", "concrete", 0,
      fmt::format("normal_stiffness = \"{} Pa/m\"", number(stiffness)) +
          (crushes ? fmt::format("\ncontact_law = {{ kind = \"crushing\", pressure = {} }}", number(pressure))
                   : ""));
  s.raw(structure_box("slab", Vec3(2, 2, 0.4), Vec3(0, 0, -0.2), {8, 8, 2}, "concrete", held_below));
  s.raw(
      fmt::format("[[block]]\nname = \"B\"\nmaterial = \"rock\"\ndeformable = false\n{}position = [0.03, "
                  "-0.02, {}]\nvelocity = [0.0, 0.0, {}]\n",
                  shape.block, number(shape.height + 1e-3), number(-speed)));
  const Outcome o = c.run(s.str());
  const std::string title = shape.name + (crushes ? ", cushion: " : ", elastic bed: ");
  if (!o.ok()) return c.failed(title + o.result.message);
  const double energy = o.rows.front().ledger.kinetic, yield = pressure / stiffness,
               deepest = depth_of(shape, stiffness, yield, energy);
  double depth = 0, algorithmic = 0;
  for (const sim::HistoryRow& r : o.rows) {
    depth = std::max(depth, shape.height - r.position[0].z());
    algorithmic = std::max(algorithmic, std::abs(r.ledger.numerical_dissipation()));
  }
  c.relative(title + "greatest depth [m]", "energy over the area across the motion", deepest, depth, allowed);
  c.absolute(title + "numerical energy error over the energy of the impact", "ledger", 0,
             algorithmic / energy, 0.005);
  if (crushes)
    c.relative(title + "energy crushed [J]", "what does not come back", energy - o.last().ledger.kinetic,
               o.last().ledger.damping_work, 0.005);
  else
    c.relative(title + "energy that comes back [J]", "elastic", energy, o.last().ledger.kinetic, 0.01);
}

void cushion(CaseRun& c) {
  const double p = 5e5, k = 5e7;
  std::vector<int> facets{16, 32};
  if (!c.quick()) facets.push_back(64);
  for (const int n : facets) strike(c, sphere(n), k, p, 7, 0.075, n == 16 ? 0.04 : 0.02);
  strike(c, {"cube on its face", "shape = \"box\"\nsize = [1.0, 1.0, 1.0]\n", 0.5, of_face}, k, p, 7, 0.08,
         0.02);
  strike(c,
         {"cube on its edge",
          "shape = \"box\"\nsize = [1.0, 1.0, 1.0]\norientation = { rotation_vector = [0.785398163397448, "
          "0.0, 0.0] }\n",
          std::sqrt(0.5), of_edge},
         k, p, 7, 0.1, 0.02);
}

void elastic_bed(CaseRun& c) {
  for (const int n : {16, 32})
    if (n == 32 || !c.quick()) strike(c, sphere(n), 2e6, INFINITY, 7, 0.16, n == 16 ? 0.04 : 0.02);
}

}  // namespace

std::vector<Case> cushion_cases() {
  return {{"coupling", "C7", "Cushion that crushes: sphere, cube on its face and on its edge", "closed form",
           true, cushion},
          {"coupling", "C8", "Elastic bed: sphere", "closed form, F = k V", true, elastic_bed}};
}

}  // namespace talus::verify
