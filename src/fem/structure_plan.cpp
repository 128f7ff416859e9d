#include "fem/structure_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/memory.hpp"
#include "fem/discretisation/hex_mesh.hpp"
#include "fem/discretisation/lattice.hpp"
#include "fem/materials/damage_field.hpp"
#include "fem/setup.hpp"
#include "fem/spec_error.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {
namespace {

// Measured on viaducts and boxes of 2,000 to 260,000 cells, rounded up [bytes].
constexpr double bytes_by_multigrid = 1500;  // of a cell, while the whole is solved for
constexpr double bytes_by_factor = 20000;    // of a cell up to largest_factored_system degrees of freedom
constexpr double seconds_by_multigrid = 1e-4,
                 seconds_by_factor = 2e-4;  // of CPU, of a cell, for each solution that is asked for
constexpr double dofs_of_cell = 4.8;        // of thin-walled sections; a solid has some 3.3

std::string spoken(double seconds) {
  return seconds < 90 ? fmt::format("{:.0f} s", std::max(1.0, seconds))
                      : fmt::format("{:.0f} min", seconds / 60);
}

/// A count to three digits, written out.
std::string rounded(double count) {
  const double unit = count >= 1000 ? std::pow(10.0, std::floor(std::log10(count)) - 2) : 1;
  return fmt::format("{:.0f}", unit * std::round(count / unit));
}

/// A bound from below on the longest edge and diagonal of the cells [m].
material::CellSize largest_cell(const StructureSpec& spec) {
  if ((spec.kind != "box" && spec.kind != "column") || !spec.refinements.empty()) return {};
  material::CellSize size;
  double square = 0;
  for (int i = spec.kind == "column" && spec.section != "rectangular" ? 2 : 0; i < 3; ++i) {
    const double count = spec.cells[i] > 0    ? spec.cells[i]
                         : spec.cell_size > 0 ? std::ceil(spec.size[i] / spec.cell_size - 1e-9)
                                              : 0;
    if (!(count > 0)) continue;
    const double edge = spec.size[i] / count;
    size.edge = std::max(size.edge, edge), square += edge * edge;
  }
  size.diagonal = std::sqrt(square);
  return size;
}

void check_law(const StructureSpec& spec) {
  if (spec.damage == "none" || !(spec.f_cm > 0)) return;  // no concrete: said where the structure is made
  make_damage_field(spec.damage, HexMesh{}, concrete_of(spec), spec.rate_effect, true, largest_cell(spec),
                    "structure." + spec.name + ".cell_size");
}

}  // namespace

/// Triangulation, then kernels and fields; with damage its history.
double bytes_of_cell(const StructureSpec& spec) { return spec.damage == "none" ? 2400 : 6800; }

StructurePlan plan_of(const StructureSpec& spec, const Vec3& gravity) {
  StructurePlan plan;
  check_law(spec);
  if (spec.kind == "mesh") {
    plan.text = fmt::format("structure {}: cells by its mesh file", spec.name);
    return plan;
  }
  plan.cells = cell_count(of_coarse_mesh(spec));
  if (refines_locally(spec))
    for (const StructureSpec::Refinement& zone : spec.refinements)
      plan.cells +=
          zone.region.volume() / std::pow(zone.cell_size, 3);  // at most: where it is solid throughout
  const bool held = !spec.supports.empty();
  std::string solved;
  int solutions = 0;
  if (held && spec.damping_ratio > 0) solved = "the first frequency", solutions += 2;
  if (held && spec.gravity_preload && !gravity.isZero(0))
    solved += solved.empty() ? "the permanent load" : " and the permanent load", solutions += 2;
  const bool multigrid = dofs_of_cell * plan.cells > largest_factored_system;
  plan.memory = plan.cells * bytes_of_cell(spec);
  if (solutions > 0) plan.memory += plan.cells * (multigrid ? bytes_by_multigrid : bytes_by_factor);
  const double seconds =
      plan.cells * (2e-5 + solutions * (multigrid ? seconds_by_multigrid : seconds_by_factor));
  plan.text = fmt::format(
      "structure {}: about {} cells; {}; up to {:.2g} GB while it is made, at most about {} of CPU time",
      spec.name, rounded(plan.cells),
      solutions == 0 ? "no static solution is asked for"
                     : fmt::format("solved for before the first step: {}, {}", solved,
                                   multigrid ? "by multigrid" : "by a factor of its stiffness"),
      plan.memory / 1e9, spoken(seconds));
  const double room = available_memory();
  if (plan.memory > room)
    bad(spec, spec.cell_size > 0 ? "cell_size" : "cells",
        spec.cell_size > 0 ? fmt::format("{:g} m", spec.cell_size)
                           : fmt::format("[{}, {}, {}]", spec.cells[0], spec.cells[1], spec.cells[2]),
        fmt::format(
            "makes about {} cells, which take up to {:.3g} GB while they are made{}; {:.3g} GB are free",
            rounded(plan.cells), plan.memory / 1e9, solutions > 0 ? " and solved" : "", room / 1e9),
        spec.cell_size > 0 ? fmt::format("take cells of {:.2g} m or more, finer ones only where blocks "
                                         "strike (refine), or free memory",
                                         1.05 * spec.cell_size * std::cbrt(plan.memory / room))
                           : "take fewer, or free memory");
  return plan;
}

}  // namespace talus::fem
