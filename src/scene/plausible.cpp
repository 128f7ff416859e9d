#include <fmt/format.h>

#include "scene/reading.hpp"

namespace talus::scene {
namespace {

constexpr double least_density = 100, most_density = 20000;   // [kg/m^3] foam to tungsten
constexpr auto warning = Problem::Severity::warning;

}  // namespace

void warn_of_the_implausible(const Reading& in, const View& root) {
  for (const View& view : root.tables("material"))
    if (const auto density = view.maybe("density"); density && *density > 0 && (*density < least_density || *density > most_density))
      view.problem("density", fmt::format("{:.4g} kg/m^3 is no rock, concrete or steel", *density), "check the unit: rock is about 2.6 t/m^3, or 2600 kg/m^3", warning);
  if (const auto simulation = root.table("simulation"); simulation && simulation->get("gravity") && in.scene.simulation.gravity.z() > 0)
    simulation->problem("gravity", "points upwards", "z is up: write [0, 0, -9.81]", warning);
}

}  // namespace talus::scene
