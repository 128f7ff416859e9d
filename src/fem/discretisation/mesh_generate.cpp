// Meshes of boxes and columns.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "contact/structures/refinable.hpp"
#include "core/memory.hpp"
#include "core/sort_unique.hpp"
#include "fem/discretisation/disc.hpp"
#include "fem/discretisation/grid_in.hpp"
#include "fem/discretisation/hanging.hpp"
#include "fem/discretisation/hex_mesh.hpp"
#include "fem/discretisation/lattice.hpp"
#include "fem/discretisation/viaduct.hpp"
#include "fem/spec_error.hpp"
#include "fem/structure_plan.hpp"

namespace talus::fem {
namespace {

/// What a box or a column, rectangular or hollow, is made of, in its own axes.
std::vector<Box3> boxes_of(const StructureSpec& spec) {
  const Vec3& s = spec.size;
  const double x = s.x() / 2, y = s.y() / 2, low = spec.kind == "box" ? -s.z() / 2 : 0, z = low + s.z();
  if (spec.kind == "box" || spec.section != "hollow") return {Box3(Vec3(-x, -y, low), Vec3(x, y, z))};
  const double in_x = x - spec.wall_thickness, in_y = y - spec.wall_thickness;
  return {Box3(Vec3(-x, -y, low), Vec3(-in_x, y, z)), Box3(Vec3(in_x, -y, low), Vec3(x, y, z)),
          Box3(Vec3(-in_x, -y, low), Vec3(in_x, -in_y, z)), Box3(Vec3(-in_x, in_y, low), Vec3(in_x, y, z))};
}

/// Planes along an axis between `fixed` ones: as many cells as given, one of them through each wall, or by
/// the cell size and the zones of finer cells.
std::vector<double> planes(const StructureSpec& spec, int axis, std::vector<double> fixed) {
  sort_unique(fixed);
  if (spec.cells[axis] > 0) {
    if (fixed.size() == 2) return even_lines(fixed[0], fixed[1], spec.cells[axis]);
    std::vector<double> lines = even_lines(fixed[1], fixed[2], std::max(1, spec.cells[axis] - 2));
    lines.insert(lines.begin(), fixed.front());
    lines.push_back(fixed.back());
    return lines;
  }
  if (!(spec.cell_size > 0))
    bad(spec, "cell_size", "", "a cell size or the numbers of cells are needed",
        "give cell_size = \"0.25 m\" or cells = [nx, ny, nz]");
  return graded_lines(fixed, spec.cell_size, zones_along(local_refinements(spec), axis));
}

/// Volume of what is meshed, from its measures alone [m^3].
double volume_of(const StructureSpec& spec) {
  const Vec3& s = spec.size;
  if (spec.kind == "viaduct") {
    double sum = 0;
    for (const ViaductPlan::Part& part : viaduct_plan(spec).parts) {
      for (const Box3& box : part.boxes) sum += box.volume();
      for (const auto& round : part.rounds)
        sum += M_PI * round.radius * round.radius * (round.top - round.foot.z());
    }
    return sum;
  }
  if (spec.kind == "column" && spec.section == "round") return M_PI / 4 * s.x() * s.y() * s.z();
  double sum = 0;
  for (const Box3& box : boxes_of(spec)) sum += box.volume();
  return sum;
}

/// Cells of a bent of round piers: in plan as fine as the finest zone that meets it, in height by layers.
double round_bent_count(const ViaductPlan::Part& part, const StructureSpec& spec,
                        const std::vector<StructureSpec::Refinement>& zones) {
  const Box3& cap = part.boxes.back();
  Box3 bent = cap;
  for (const auto& pier : part.rounds) bent.extend(pier.foot);
  double size = spec.cell_size;
  std::vector<FineZone> in_height;
  for (const auto& r : zones) {
    if (!r.region.intersects(bent)) continue;
    size = std::min(size, r.cell_size);
    in_height.push_back({r.region.min().z(), r.region.max().z(), r.cell_size});
  }
  const auto layers = [&](double low, double high) {
    return graded_count({low, high}, spec.cell_size, in_height, low, high);
  };
  double count = cap.sizes().x() * cap.sizes().y() / (size * size) * layers(cap.min().z(), cap.max().z());
  for (const auto& pier : part.rounds)
    count += M_PI * pier.radius * pier.radius / (size * size) * layers(pier.foot.z(), pier.top);
  return count;
}

/// Cells of the section of a round column: as fine as its finest zone.
RoundSection section_of(const StructureSpec& spec) {
  const double diameter = std::max(spec.size.x(), spec.size.y());
  if (spec.cells[0] > 0) return round_section(diameter, diameter / spec.cells[0]);
  double size = spec.cell_size;
  for (const auto& r : spec.refinements) size = std::min(size, r.cell_size);
  return round_section(diameter, size);
}

/// Cells of a structure with zones of finer ones, from its measures alone.
double refined_count(const StructureSpec& spec) {
  const std::vector<StructureSpec::Refinement> zones = local_refinements(spec);
  if (spec.kind == "viaduct") {
    double sum = 0;
    for (const ViaductPlan::Part& part : viaduct_plan(spec).parts)
      sum += part.rounds.empty() ? brick_count(part.boxes, spec.cell_size, zones_of(part, spec))
                                 : round_bent_count(part, spec, zones_of(part, spec));
    return sum;
  }
  if (spec.kind == "column" && spec.section == "round")
    return section_of(spec).cells() *
           graded_count({0, spec.size.z()}, spec.cell_size, zones_along(zones, 2), 0, spec.size.z());
  return brick_count(boxes_of(spec), spec.cell_size, zones);
}

/// Cells that one cell of the structure at least becomes where `where = "impact"` asks for smaller ones.
double struck_count(const StructureSpec& spec, double h) {
  const ImpactRefinement asked = impact_refinement(spec);
  if (!(asked.cell_size > 0 && asked.cell_size < h)) return 0;
  const double halvings = std::min<double>(most_halvings, std::ceil(std::log2(h / asked.cell_size)));
  return std::pow(8, halvings) * std::max(1.0, std::pow(2 * asked.reach / h, 3));
}

/// Cells without finer zones, from measures alone; a round section takes more than its area by the square of
/// their edge.
double plain_count(const StructureSpec& spec) {
  const double h = spec.cell_size;
  const bool round = spec.kind == "column" && spec.section == "round";
  if (!(h > 0))
    return (round ? section_of(spec).cells() : double(spec.cells[0]) * spec.cells[1]) * spec.cells[2];
  const double by_volume = volume_of(spec) / (h * h * h);
  if (!round) return by_volume;
  StructureSpec plain = spec;
  plain.refinements.clear();
  return std::max(by_volume, section_of(plain).cells() * std::ceil(spec.size.z() / h));
}

/// Refuses what this machine cannot hold before any of it is made: a slip of the unit would fill its memory
/// in silence.
void check_count(const StructureSpec& spec) {
  const double cell = bytes_of_cell(spec), memory = available_memory();
  const double volume = volume_of(spec), h = spec.cell_size, most = most_cells(spec);
  const auto too_many = [&](double count) {
    return fmt::format(
        "makes about {:.3g} million cells of {:.3g} m^3 of structure, some {:.3g} GB; {:.3g} GB are free, "
        "and at most 20 million cells are meshed",
        count / 1e6, volume, count * cell / 1e9, memory / 1e9);
  };
  const double count = plain_count(spec);
  if (count > most)
    bad(spec, h > 0 ? "cell_size" : "cells",
        h > 0 ? fmt::format("{:g} m", h)
              : fmt::format("[{}, {}, {}]", spec.cells[0], spec.cells[1], spec.cells[2]),
        too_many(count),
        h > 0 ? fmt::format(
                    "take cells of {:.2g} m or more, finer ones only where blocks strike (refine)",
                    1.05 * (std::isfinite(count) ? h * std::cbrt(count / most) : std::cbrt(volume / most)))
              : "take fewer");
  const double struck = struck_count(spec, h > 0 ? h : std::cbrt(volume / count));
  if (struck > most)
    bad(spec, "refine.cell_size", fmt::format("{:g} m", impact_refinement(spec).cell_size),
        too_many(struck) + ", where a block strikes", "take larger cells there, or a smaller reach");
  if (spec.refinements.empty() || !(h > 0)) return;
  const double refined = refined_count(spec);
  if (!(refined > most)) return;
  const auto finest =
      std::min_element(spec.refinements.begin(), spec.refinements.end(),
                       [](const auto& a, const auto& b) { return a.cell_size < b.cell_size; });
  bad(spec, fmt::format("refine.{}.cell_size", finest - spec.refinements.begin()),
      fmt::format("{:g} m", finest->cell_size), too_many(refined),
      "take larger cells there, or a smaller region: fine cells go on along each axis to the far side");
}

HexMesh round_column(const StructureSpec& spec) {
  const DiscMesh disc = disc_mesh(section_of(spec));
  const std::vector<double> z = planes(spec, 2, {0, spec.size.z()});
  const int layer = static_cast<int>(disc.nodes.size());
  HexMesh mesh;
  for (double height : z)
    for (const auto& p : disc.nodes)
      mesh.nodes.emplace_back(0.5 * p[0] * spec.size.x(), 0.5 * p[1] * spec.size.y(), height);
  for (int k = 0; k + 1 < static_cast<int>(z.size()); ++k)
    for (const auto& q : disc.quads) {
      const int low = k * layer, high = low + layer;
      mesh.hexes.push_back({low + q[0], low + q[1], low + q[2], low + q[3], high + q[0], high + q[1],
                            high + q[2], high + q[3]});
    }
  return mesh;
}

void place(HexMesh& mesh, const StructureSpec& spec) {
  mesh.local = mesh.nodes;
  for (Vec3& x : mesh.nodes) x = spec.rotation * x + spec.position;
}

HexMesh prismatic_mesh(const StructureSpec& spec) {
  for (int i = 0; i < 3; ++i)
    if (!(spec.size[i] > 0))
      bad(spec, "size", fmt::format("[{:g}, {:g}, {:g}]", spec.size.x(), spec.size.y(), spec.size.z()),
          "every extent must be positive", "give three lengths");
  if (spec.kind == "column") {
    if (spec.section != "rectangular" && spec.section != "round" && spec.section != "hollow")
      bad(spec, "section", spec.section, "one of rectangular, round, hollow", "choose one");
    if (spec.section != "rectangular" && !(spec.cell_size > 0) && spec.cells[0] == 0)
      bad(spec, "cell_size", "", "a cell size is needed", "give cell_size = \"0.25 m\"");
    const double t = spec.wall_thickness;
    if (spec.section == "hollow" && !(t > 0 && 2 * t < std::min(spec.size.x(), spec.size.y())))
      bad(spec, "wall_thickness", fmt::format("{:g} m", t), "between 0 and half of the section",
          "give the thickness of the wall");
  } else if (spec.kind != "box") {
    bad(spec, "kind", spec.kind, "one of box, column, viaduct, mesh", "choose one");
  }
  HexMesh mesh;
  if (spec.kind == "column" && spec.section == "round") {
    mesh = round_column(spec);
  } else {
    const std::vector<Box3> boxes = boxes_of(spec);
    Lines lines = ends_of(boxes);
    for (int axis = 0; axis < 3; ++axis) lines[axis] = planes(spec, axis, lines[axis]);
    mesh = lattice(lines, boxes);
  }
  place(mesh, spec);
  return mesh;
}

/// A zone that meets nothing is a mistake in its coordinates.
void check_refinements(const StructureSpec& spec, const HexMesh& mesh) {
  Box3 bounds;
  for (const Vec3& x : mesh.nodes) bounds.extend(spec.rotation.transpose() * (x - spec.position));
  for (const auto& zone : local_refinements(spec))
    if (!zone.region.intersects(bounds)) {
      const Vec3 &a = zone.region.min(), &b = zone.region.max();
      bad(spec, "refine",
          fmt::format("[{:g}, {:g}, {:g}] to [{:g}, {:g}, {:g}] in the structure's axes", a.x(), a.y(), a.z(),
                      b.x(), b.y(), b.z()),
          "no part of the structure lies there",
          "give the region in scene coordinates, about the part to refine");
    }
}

}  // namespace

double most_cells(const StructureSpec& spec) {
  return std::min(2e7, available_memory() / bytes_of_cell(spec));
}

double cell_count(const StructureSpec& spec) {
  check_count(spec);
  const double h = spec.cell_size;
  if (!(h > 0)) return plain_count(spec);
  return refined_count(spec);
}

HexMesh make_mesh(const StructureSpec& spec) {
  if (spec.kind == "mesh") return is_grid_file(spec.file) ? read_grid(spec) : read_mesh(spec);
  check_count(spec);
  HexMesh mesh = spec.kind == "viaduct" ? viaduct_mesh(spec) : prismatic_mesh(spec);
  check_refinements(spec, mesh);
  return mesh;
}

}  // namespace talus::fem
