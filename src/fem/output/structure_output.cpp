#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/assert.hpp"
#include "core/error.hpp"
#include "fem/discretisation/hanging.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {

/// Steps longer than the explicit ones, and what of the choice of the integrator cannot be.
std::string plan_of_steps(const StructureBody& body, bool by_choice, bool modes) {
  if (body.spec.integrator == "explicit" || body.partition || body.supports.none ||
      body.free_dofs > largest_factored_system)
    return fmt::format("{}: no condensed steps, each touch is explicit ({})\n", body.spec.name,
                       body.spec.integrator == "explicit" ? "integrator"
                       : body.partition                   ? "several processes"
                       : body.supports.none               ? "no support"
                                                          : "too large to factor");
  std::string text = fmt::format("{}: long implicit steps while blocks {} it and the structure is quiet{}\n",
                                 body.spec.name, by_choice ? "are at" : "rest on",
                                 body.bearings ? "; explicit sub-steps wherever bearings slide" : "");
  if (body.spec.integrator == "modal" && !modes)
    text += fmt::format("{}: integrator = \"modal\" finds no modes ({}): it goes on as with \"implicit\"\n",
                        body.spec.name,
                        body.bearings                ? "bearings"
                        : body.bars                  ? "bars"
                        : body.spec.damage != "none" ? "damage"
                                                     : "parts that turn");
  return text;
}

/// What the tables and fields of a structure take on this process [bytes], by name.
std::vector<std::pair<std::string, std::size_t>> memory_parts(const StructureBody& body,
                                                              const NodalFields& fields,
                                                              const MemberLoads& loads,
                                                              const ContactSurface& skin,
                                                              const AlignedVector& jump) {
  const auto of = [](const auto& list) { return list.capacity() * sizeof(list[0]); };
  std::size_t held = of(body.mass) + of(body.built_mass) + of(body.cells_at_node) + of(body.live) +
                     of(body.cell_mass) + loads.stresses().memory_consumption() + of(body.supports.held) +
                     of(body.dofs.number);
  for (const AlignedVector* field : {&fields.u, &fields.v, &fields.f_int, &fields.f_visc, &fields.f_ext,
                                     &fields.v_hat, &body.inverse_mass, &fields.contact_impulse, &jump})
    held += of(*field);
  return {{"mesh", of(body.mesh.nodes) + of(body.mesh.local) + of(body.mesh.hexes) + of(body.mesh.across) +
                       of(body.mesh.component) + of(body.mesh.number)},
          {"fields", held},
          {"elements", body.elements->memory_consumption() + loads.memory_of_packs()},
          {"damage", body.damage ? body.damage->memory_consumption() : 0},
          {"bars", body.bars ? body.bars->memory_consumption() : 0},
          {"skin", skin.memory_consumption()},
          {"partition", body.partition ? body.partition->memory_consumption() : 0}};
}

}  // namespace

Structure::Damage FemStructure::damage() const {
  Damage d{0, 0, body_.lost.eroded_volume + body_.lost.detached_volume};
  if (body_.damage)
    for (int cell : body_.damage->cells()) {
      if (!body_.own_cell(cell)) continue;
      const double most = std::max(body_.damage->tension(cell), body_.damage->compression(cell));
      d.largest = std::max(d.largest, most);
      if (most > 0.5) d.volume += body_.cell_mass[cell] / body_.spec.density;
    }
  body_.sum({&d.volume, 1});
  d.volume += body_.lost.eroded_volume;
  d.largest = body_.damage && body_.lost.eroded_volume > 0 ? 1 : body_.largest(d.largest);
  return d;
}

long FemStructure::elements() const {
  long count = 0;
  for (std::size_t cell = 0; cell < body_.live.size(); ++cell)
    count += body_.live[cell] && body_.own_cell(static_cast<int>(cell));
  return body_.count_of(count);
}

std::string FemStructure::plan() const {
  std::string text =
      fmt::format("{}: {} cells, {} free degrees of freedom, kernels {} ({} elements at a time)\n",
                  body_.spec.name, body_.cells_in_all(), body_.free_dofs, kernels().name, kernels().width);
  if (!body_.mesh.remark.empty())
    text += fmt::format(
        "{}: the mesh file holds {} elements beside its cells; they name groups and carry nothing\n",
        body_.spec.name, body_.mesh.remark);
  text += fmt::format("{}: explicit sub-step {:.3g} s; {}\n", body_.spec.name, body_.critical_step,
                      body_.finite ? "total Lagrangian, any rotation" : "small strains and rotations");
  if (const double fine = impact_refinement(body_.spec).cell_size; fine > 0)
    text += fmt::format(
        "{}: cells are halved down to {:g} m where a block is about to strike; those that have cracked "
        "stay\n",
        body_.spec.name, fine);
  text += plan_of_steps(body_, motion_.condensed.by_choice(), motion_.modal.possible());
  text += body_.spec.damage == "none" ? fmt::format("{}: elastic, no damage history kept\n", body_.spec.name)
                                      : "";
  if (body_.damage)
    text += fmt::format(
        "{}: concrete damage, f_cm {:.4g} MPa, f_t {:.4g} MPa, G_F {:.4g} N/m; only cells near the damage "
        "threshold store damage variables, bulk viscosity 0.06 / 1.2, erosion {}{}\n",
        body_.spec.name, body_.concrete->f_cm / 1e6, body_.concrete->f_t / 1e6,
        body_.concrete->fracture_energy, body_.spec.erosion ? "on" : "off",
        body_.spec.aggregate > 0
            ? fmt::format(", faces of cracks interlock (grains of {:.3g} mm)", 1e3 * body_.spec.aggregate)
            : "");
  if (body_.bars) {
    double steel = 0;
    for (const rebar::Bar& bar : body_.bars->embedded().bars()) steel += bar.area() * bar.length();
    text += fmt::format("{}: {} bars in {} segments, {:.4g} m^3 of steel, {}\n", body_.spec.name,
                        body_.bars->embedded().bars().size(), body_.bars->division().in_all(), steel,
                        body_.bars->slips() ? "bond slip by the Model Code" : "perfect bond");
  } else {
    text += fmt::format("{}: no reinforcement\n", body_.spec.name);
  }
  if (body_.bearings)
    text += fmt::format("{}: viaduct, {} springs in bearings with friction and seat\n", body_.spec.name,
                        body_.bearings->sites().size());
  if (body_.partition) {
    const std::vector<long> cells = body_.partition->cells_per_rank();
    text += fmt::format(
        "{}: divided over {} ranks{}, {} to {} cells each, {:.2g} % of them computed more than once\n",
        body_.spec.name, body_.partition->size(), body_.divided() ? ", its memory too" : "",
        *std::min_element(cells.begin(), cells.end()), *std::max_element(cells.begin(), cells.end()),
        100.0 * static_cast<double>(std::accumulate(cells.begin(), cells.end(), 0L)) /
                static_cast<double>(body_.cells_in_all()) -
            100);
  }
  if (const auto parts = memory_parts(body_, fields_, loads_, skin_, motion_.leapfrog.jump());
      body_.partition || body_.mesh.hexes.size() >= 20000) {
    std::string list;
    std::size_t bytes = 0;
    for (const auto& [name, size] : parts) {
      list += fmt::format("{}{} {:.2f}", list.empty() ? "" : ", ", name, static_cast<double>(size) / 1e6);
      bytes += size;
    }
    text += fmt::format("{}: {:.2f} MB on this process: {}\n", body_.spec.name,
                        static_cast<double>(bytes) / 1e6, list);
  }
  if (body_.alpha > 0)
    text += fmt::format("{}: damping {:g} of the first mode, {:.4g} Hz\n", body_.spec.name,
                        body_.spec.damping_ratio, body_.omega_1 / (2 * M_PI));
  else if (body_.spec.damping_ratio > 0)
    text += fmt::format("{}: no support, hence no first mode: damping left out\n", body_.spec.name);
  return text;
}

void FemStructure::shape(const TakePart& take) const {
  body_.each(
      Of::nodes, 3, [this](int n, double* to) { std::copy_n(body_.mesh.nodes[n].data(), 3, to); },
      [&](std::span<const double> rows) {
        Snapshot part;
        for (std::size_t at = 0; at < rows.size(); at += 3) part.nodes.emplace_back(&rows[at]);
        take(part);
      });
  constexpr int width = 9;
  body_.each(
      Of::cells, width,
      [this](int cell, double* to) {
        *to++ = body_.live[cell];
        for (const int n : body_.mesh.hexes[cell]) *to++ = body_.whole_node(n);
      },
      [&](std::span<const double> rows) {
        Snapshot part;
        for (std::size_t at = 0; at < rows.size(); at += width)
          if (rows[at] != 0) std::copy_n(&rows[at + 1], 8, part.hexes.emplace_back().begin());
        take(part);
      });
  const std::size_t segments = body_.bars ? body_.bars->division().in_all() : 0;
  for (std::size_t k = 0; k < segments;) {
    Snapshot part;
    for (const std::size_t end = std::min(k + rows_at_once, segments); k < end; ++k)
      part.bars.push_back({2 * static_cast<int>(k), 2 * static_cast<int>(k) + 1});
    take(part);
  }
}

void FemStructure::values(const TakePart& take) const {
  body_.each(
      Of::nodes, 6,
      [this](int n, double* to) {
        for (const AlignedVector* field : {&fields_.u, &fields_.v})
          to = std::copy_n(&(*field)[4 * static_cast<std::size_t>(n)], 3, to);
      },
      [&](std::span<const double> rows) {
        Snapshot part;
        for (std::size_t at = 0; at < rows.size(); at += 6)
          part.displacement.emplace_back(&rows[at]), part.velocity.emplace_back(&rows[at + 3]);
        take(part);
      });
  constexpr int width = 5;
  body_.each(
      Of::cells, width,
      [this](int cell, double* to) {
        *to++ = body_.live[cell];
        if (body_.live[cell] == 0) return;
        const Mat3 strain = loads_.stresses().strain(cell);  // where it is most accurate
        const double tension = body_.damage ? body_.damage->tension(cell) : 0,
                     compression = body_.damage ? body_.damage->compression(cell) : 0;
        // In a damaged cell the effective stress is reduced by the larger damage: a measure for a picture,
        // not for a check.
        const Mat3 deviator = 2 * body_.shear * (1 - std::max(tension, compression)) *
                              (strain - strain.trace() / 3 * Mat3::Identity());
        *to++ = std::sqrt(1.5) * deviator.norm();
        *to++ = tension;
        *to++ = compression;
        *to = body_.damage ? body_.damage->crack_width(cell, fields_.u.data()) : 0.0;
      },
      [&](std::span<const double> rows) {
        Snapshot part;
        for (std::size_t at = 0; at < rows.size(); at += width) {
          if (rows[at] == 0) continue;
          part.stress_von_mises.push_back(rows[at + 1]);
          part.damage_tension.push_back(rows[at + 2]);
          part.damage_compression.push_back(rows[at + 3]);
          part.crack_width.push_back(rows[at + 4]);
        }
        take(part);
      });
  if (body_.bars) body_.bars->values(fields_.u.data(), take);
}

std::vector<BarLine> FemStructure::bars() const {
  std::vector<BarLine> lines;
  if (body_.bars)
    for (const rebar::Bar& bar : body_.bars->embedded().bars())
      lines.push_back({bar.points.front(), bar.points.back(), bar.diameter});
  return lines;
}

}  // namespace talus::fem
