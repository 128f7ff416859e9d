#include "io/design_checks.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/units.hpp"
#include "formulas/formulas.hpp"

namespace talus::io {
namespace {

using json = nlohmann::ordered_json;

constexpr double softest_concrete = 5e9;  // [Pa]; of what is given by its modulus alone
constexpr double least_speed = 1e-3;      // [m/s]; below it the formulas have no meaning

double normal_speed(const Impact& m) { return std::abs(m.velocity.dot(m.normal.normalized())); }

/// Inputs that the scene gives in place of the defaults. Throws InputError where one is outside of what the
/// formulas are meant for.
formulas::Inputs inputs_of(const sim::RunHeader& header, const Impact& m) {
  const auto& block = header.blocks[static_cast<std::size_t>(m.block)];
  const auto& structure = header.structures[static_cast<std::size_t>(m.structure)];
  formulas::Inputs inputs(block.mass, normal_speed(m), std::cbrt(6 * block.volume / std::numbers::pi));
  const auto give = [&](const char* name, double value) {
    if (value > 0) inputs.set(name, value);
  };
  give("block_young", block.young);
  give("block_poisson", block.poisson);
  if (structure.young > 0)
    inputs.set("target_young", structure.young,
               structure.f_cm > 0 ? "the structure's, f_cm by MC2010" : "the structure's");
  give("target_poisson", structure.poisson);
  const double f_ck = structure.f_cm - 8e6;  // fib Model Code 2010, eq. 5.1-1
  if (f_ck >= 12e6 && f_ck <= 90e6) inputs.set("f_ck", f_ck, "f_cm - 8 MPa");
  if (structure.axes.empty()) return inputs;
  // The section axis nearest to the contact's normal.
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(structure.axes[static_cast<std::size_t>(k)].dot(m.normal)) >
        std::abs(structure.axes[static_cast<std::size_t>(axis)].dot(m.normal)))
      axis = k;
  const double depth = structure.effective_depth[axis], ratio = structure.reinforcement_ratio[axis];
  if (depth >= 0.02 && depth <= 10)
    inputs.set("effective_depth", depth,
               ratio > 0 ? "section less cover" : "0.9 of the section, its bars are not known both ways");
  if (ratio > 0 && ratio <= 0.1)
    inputs.set("reinforcement_ratio", ratio, "the structure's bars across the blow");
  // Its extents across the blow, at the least: effective depths along its other axes.
  const char* names[] = {"width", "width_across"};
  for (int k = 0, n = 0; k < 3; ++k)
    if (const double extent = structure.effective_depth[k]; k != axis && extent >= 0.01 && extent <= 1e4)
      inputs.set(names[n++], extent, "effective, across the blow");
  return inputs;
}

/// The formulas for an impact; none where its block or structure is outside of their range, such as a block
/// of less than a gram.
std::vector<formulas::Result> formulas_of(const sim::RunHeader& header, const Impact& m) {
  try {
    return formulas::evaluate(inputs_of(header, m),
                              header.structures[static_cast<std::size_t>(m.structure)].cushion);
  } catch (const InputError&) { return {}; }
}

/// What of the run stands beside a formula: like beside like. A static resistance is no match for the force
/// of a single sub-step, nor what a block that rests and is pushed bears for the peak of the blow by which it
/// came down.
double computed(formulas::Kind kind, const Impact& m) {
  const double duration = m.end - m.start;
  switch (kind) {
    case formulas::Kind::peak: return m.blow_force;
    case formulas::Kind::resistance: return m.filtered_force;
    case formulas::Kind::mean:
    case formulas::Kind::equivalent_static: return duration > 0 ? m.impulse.norm() / duration : 0;
  }
  return 0;
}
const char* computed_is(formulas::Kind kind) {
  return kind == formulas::Kind::peak         ? "single sub-step"
         : kind == formulas::Kind::resistance ? "mean over 1.5 ms"
                                              : "mean over the impact";
}

std::string sentence(const std::vector<formulas::InputValue>& values) {
  std::string text;
  for (const auto& v : values)
    text += fmt::format("{}{} = {} ({})", text.empty() ? "" : "; ", v.symbol, formulas::text(v), v.origin);
  return text;
}

}  // namespace

json design_checks(const sim::RunHeader& header, const std::vector<Impact>& impacts) {
  json list = json::array();
  for (std::size_t s = 0; s < header.structures.size(); ++s) {
    int strongest = -1;
    double most = 0;
    for (std::size_t i = 0; i < impacts.size(); ++i) {
      const Impact& m = impacts[i];
      if (m.structure != static_cast<int>(s) || header.blocks[static_cast<std::size_t>(m.block)].fragment ||
          m.normal.norm() == 0 || normal_speed(m) < least_speed)
        continue;
      const double energy =
          header.blocks[static_cast<std::size_t>(m.block)].mass * normal_speed(m) * normal_speed(m);
      if (energy > most) most = energy, strongest = static_cast<int>(i);
    }
    if (strongest < 0) continue;
    const Impact& m = impacts[static_cast<std::size_t>(strongest)];
    const auto& info = header.structures[s];
    const bool concrete =
        info.f_cm > 0 ||
        !(info.young > 0 && info.young < softest_concrete);  // what a section resists with is of concrete
    for (const formulas::Result& r : formulas_of(header, m))
      if (concrete || r.kind != formulas::Kind::resistance)
        list.push_back({{"impact", strongest},
                        {"structure", header.structures[s].name},
                        {"block", header.blocks[static_cast<std::size_t>(m.block)].name},
                        {"id", r.id},
                        {"name", r.title},
                        {"symbol", r.symbol},
                        {"unit", r.unit},
                        {"value", std::isfinite(r.value) ? json(r.value) : json()},
                        {"kind", formulas::text(r.kind)},
                        {"computed", computed(r.kind, m)},
                        {"computed_is", computed_is(r.kind)},
                        {"computed_filtered", m.filtered_force},
                        {"equation", r.equation},
                        {"inputs", sentence(r.inputs)},
                        {"source", r.source},
                        {"status", r.status},
                        {"note", r.note}});
  }
  return list;
}

}  // namespace talus::io
