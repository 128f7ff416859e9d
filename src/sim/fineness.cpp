#include "sim/fineness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "contact/structures/refinable.hpp"
#include "core/round_section.hpp"

namespace talus::sim {
namespace {

constexpr int least = 3, wanted = 6;  // cells across
// Around a round section. The face of a cube of 5 t at 18 m/s against a pier of 1.5 m (300 Hz): 27 MN with 8
// facets, 20, 23 with 16, 20, and 13 to 16 with 24, 28, 32, 36.
constexpr int wanted_facets = 24;

double parameter(const StructureSpec& spec, const char* name, double otherwise) {
  for (const auto& [key, value] : spec.parameters)
    if (key == name) return value;
  return otherwise;
}

int along(double extent, double size) {
  return std::max(1, static_cast<int>(std::ceil(extent / size - 1e-9)));
}

/// Diameter of a round section, 0 of another [m].
double diameter_of(const StructureSpec& spec) {
  if (spec.section != "round" || (spec.kind != "column" && spec.kind != "viaduct")) return 0;
  if (spec.kind == "column") return std::max(spec.size.x(), spec.size.y());
  return parameter(spec, "pier_diameter", parameter(spec, "pier_width", 1.5));
}

/// Of a round section as it is meshed: what is halved later has twice as many facets, and cells across.
struct Around {
  int facets, across;
};

Around around(const StructureSpec& spec, double diameter) {
  const bool halved = parameter(spec, "local_refinement", 0) != 0;
  double meshed = spec.cells[0] > 0 ? diameter / spec.cells[0] : spec.cell_size, finest = meshed;
  for (const StructureSpec::Refinement& zone : spec.refinements)
    (halved ? finest : meshed) = std::min(halved ? finest : meshed, zone.cell_size);
  if (const double struck = impact_refinement(spec).cell_size; struck > 0) finest = std::min(finest, struck);
  const RoundSection section = round_section(diameter, meshed);
  Around found{section.facets(), section.across()};
  while (M_PI * diameter / found.facets > finest * (1 + 1e-9) && finest < meshed && found.facets < 10000)
    found.facets *= 2, found.across *= 2;
  return found;
}

/// To two digits, downwards: what is read off is fine enough.
std::string size_for(double extent, int parts) {
  const double size = extent / parts, unit = std::pow(10.0, std::floor(std::log10(size)) - 1);
  return fmt::format("{:.2g} m", unit * std::floor(size / unit + 1e-9));
}

}  // namespace

std::optional<Fineness> fineness(const StructureSpec& spec) {
  if (spec.kind == "mesh") return {};
  double size = spec.cell_size;
  for (const StructureSpec::Refinement& zone : spec.refinements) size = std::min(size, zone.cell_size);
  if (const double struck = impact_refinement(spec).cell_size; struck > 0) size = std::min(size, struck);
  if (const double diameter = diameter_of(spec); diameter > 0 && (size > 0 || spec.cells[0] > 0))
    return Fineness{diameter, around(spec, diameter).across};
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
                         size_for(found->section, wanted), wanted, least);
  return {p};
}

std::string fineness_line(const StructureSpec& spec) {
  const auto found = fineness(spec);
  if (spec.damage == "none" || !found || found->cells < least || found->cells >= wanted) return "";
  return fmt::format(
      "Damage of {}: {} cells across its smallest section ({:.4g} m); where and how much wants 6 to 8 (cells "
      "of {} or less), with fewer a damage class may be one off.",
      spec.name, found->cells, found->section, size_for(found->section, wanted));
}

std::string round_line(const StructureSpec& spec) {
  const double diameter = diameter_of(spec);
  if (!(diameter > 0) || !(spec.cell_size > 0 || spec.cells[0] > 0)) return "";
  const Around found = around(spec, diameter);
  const std::string line = fmt::format("Round section of {}: {} facets of {:.2g} m around, {} cells across",
                                       spec.name, found.facets, M_PI * diameter / found.facets, found.across);
  if (found.facets >= wanted_facets) return line + ".";
  return line + fmt::format(
                    "; a blow wants {} facets or more (cells of {} or less): a block's face that "
                    "meets a wide facet presses as on a flat wall.",
                    wanted_facets, size_for(M_PI * diameter, wanted_facets));
}

}  // namespace talus::sim
