#include "sim/fineness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "contact/structures/refinable.hpp"

namespace talus::sim {
namespace {

constexpr int least = 3, wanted = 6;  // cells across

double parameter(const StructureSpec& spec, const char* name, double otherwise) {
  for (const auto& [key, value] : spec.parameters)
    if (key == name) return value;
  return otherwise;
}

int along(double extent, double size) {
  return std::max(1, static_cast<int>(std::ceil(extent / size - 1e-9)));
}

/// To two digits, downwards: what is read off is fine enough.
std::string size_for(double section) {
  const double size = section / wanted, unit = std::pow(10.0, std::floor(std::log10(size)) - 1);
  return fmt::format("{:.2g} m", unit * std::floor(size / unit + 1e-9));
}

}  // namespace

std::optional<Fineness> fineness(const StructureSpec& spec) {
  if (spec.kind == "mesh") return {};
  double size = spec.cell_size;
  for (const StructureSpec::Refinement& zone : spec.refinements) size = std::min(size, zone.cell_size);
  if (const double struck = impact_refinement(spec).cell_size; struck > 0) size = std::min(size, struck);
  const bool walls = spec.section == "hollow" && spec.kind != "box" && spec.wall_thickness > 0;
  if (spec.kind == "viaduct") {
    const double diameter = parameter(spec, "pier_diameter", 1.5),
                 width = parameter(spec, "pier_width", diameter),
                 depth = parameter(spec, "pier_depth", diameter);
    const double section = walls ? spec.wall_thickness : std::min(width, depth);
    return Fineness{section, along(section, size)};
  }
  if (walls && size > 0) return Fineness{spec.wall_thickness, along(spec.wall_thickness, size)};
  std::optional<Fineness> fewest;
  for (int axis = 0; axis < (spec.kind == "column" ? 2 : 3); ++axis) {
    const double extent = spec.size[axis];
    const Fineness here{extent, spec.cells[static_cast<std::size_t>(axis)] > 0
                                    ? spec.cells[static_cast<std::size_t>(axis)]
                                    : along(extent, size)};
    if (!fewest || here.section < fewest->section) fewest = here;
  }
  return fewest;
}

std::vector<Problem> fineness_problems(const StructureSpec& spec) {
  const auto found = fineness(spec);
  if (spec.damage == "none" || !found || found->cells >= least) return {};
  Problem p;
  p.severity = Problem::Severity::warning;
  p.key = fmt::format("structure.{}.{}", spec.name, spec.cell_size > 0 ? "cell_size" : "cells");
  p.value = spec.cell_size > 0 ? fmt::format("{:g} m", spec.cell_size)
                               : fmt::format("[{}, {}, {}]", spec.cells[0], spec.cells[1], spec.cells[2]);
  p.rule = fmt::format(
      "makes {} cell{} across the smallest section ({:.4g} m): damage comes out neither where nor as much as "
      "it is",
      found->cells, found->cells == 1 ? "" : "s", found->section);
  p.remedy = fmt::format("take {} or less ({} across), at least {} across for balances alone",
                         size_for(found->section), wanted, least);
  return {p};
}

std::string fineness_line(const StructureSpec& spec) {
  const auto found = fineness(spec);
  if (spec.damage == "none" || !found || found->cells < least || found->cells >= wanted) return "";
  return fmt::format(
      "Damage of {}: {} cells across its smallest section ({:.4g} m); where and how much wants 6 to 8 (cells "
      "of {} or less), with fewer a damage class may be one off.",
      spec.name, found->cells, found->section, size_for(found->section));
}

}  // namespace talus::sim
