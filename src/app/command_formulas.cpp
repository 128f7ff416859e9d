#include <fmt/format.h>

#include "app/commands.hpp"
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
  formulas::Inputs inputs(mass, velocity, diameter);
  for (const auto& [name, value] : options.overrides()) inputs.set(name, value);
  fmt::print("{}", formulas::table(inputs, formulas::evaluate(inputs)));
  return done;
}

}  // namespace talus::app
