#include <cmath>

#include <fmt/format.h>

#include "app/commands.hpp"
#include "app/tell.hpp"
#include "core/units.hpp"
#include "formulas/formulas.hpp"

namespace talus::app {
namespace {

double argument(const std::string& option, const std::string& text, Dimension dimension) {
  std::string error;
  const auto value = parse_quantity(text, error);
  if (value && (value->dimension == dimension || value->dimension.none()) && value->value > 0)
    return value->value;
  Problem problem;
  problem.key = option;
  problem.value = text;
  problem.rule = "must be " + describe(dimension) + (error.empty() ? "" : ": " + error);
  problem.remedy = "give a value above 0, with or without its unit";
  throw InputError(problem);
}

}  // namespace

int command_formulas(const Options& options) {
  const double mass = argument("--mass", options.mass, dimension::mass),
               velocity = argument("--velocity", options.velocity, dimension::velocity);
  const double diameter =
      options.diameter.empty() ? 0 : argument("--diameter", options.diameter, dimension::length);
  constexpr double lightest = 500, heaviest = 10000;  // of what blocks are made of [kg/m^3]
  const double density = diameter > 0 ? 6 * mass / (M_PI * std::pow(diameter, 3)) : lightest;
  if (density < lightest || density > heaviest)
    tell("{}\n", Problem{.severity = Problem::Severity::warning,
                         .file = {},
                         .line = 0,
                         .column = 0,
                         .key = "--diameter",
                         .value = options.diameter,
                         .rule = fmt::format(
                             "a sphere of it with this mass has {:.3g} kg/m^3, as no rock has", density),
                         .remedy = "check the units of both; without --diameter it is that of 2600 kg/m^3"}
                     .str());
  formulas::Inputs inputs(mass, velocity, diameter);
  for (const auto& [name, value] : options.scene_overrides("f_ck=\"40 MPa\"")) inputs.set(name, value);
  fmt::print("{}", formulas::table(inputs, formulas::evaluate(inputs)));
  return done;
}

}  // namespace talus::app
