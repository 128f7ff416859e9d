#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/assert.hpp"
#include "core/error.hpp"
#include "fem/discretisation/hanging.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

Vec3 FemStructure::base_force() const {
  forces_.evaluate(fields_.time);
  return Vec3(loads_.foot_reactions(fields_.contact_step).data());
}

Vec3 FemStructure::base_moment() const {
  forces_.evaluate(fields_.time);
  return Vec3(loads_.foot_reactions(fields_.contact_step).data() + 3);
}

double FemStructure::damage_max() const {
  return body_.damage ? (body_.lost.eroded_volume > 0 ? 1.0 : body_.largest(body_.damage->largest())) : 0;
}
double FemStructure::damaged_volume() const {
  double volume = 0;
  if (body_.damage)
    for (int cell : body_.damage->cells())
      if (body_.own_cell(cell) &&
          std::max(body_.damage->tension(cell), body_.damage->compression(cell)) > 0.5)
        volume += body_.cell_mass[cell] / body_.spec.density;
  body_.sum({&volume, 1});
  return volume + body_.lost.eroded_volume;
}
long FemStructure::elements() const {
  long count = 0;
  for (std::size_t cell = 0; cell < body_.live.size(); ++cell)
    count += body_.live[cell] && body_.own_cell(static_cast<int>(cell));
  return body_.count_of(count);
}

/// Steps longer than the explicit ones, and what of the choice of the integrator cannot be.
std::string FemStructure::plan_of_steps() const {
  if (body_.spec.integrator == "explicit" || body_.partition || body_.supports.none ||
      body_.free_dofs > largest_factored_system)
    return fmt::format("{}: no condensed steps, each touch is explicit ({})\n", body_.spec.name,
                       body_.spec.integrator == "explicit" ? "integrator"
                       : body_.partition                   ? "several processes"
                       : body_.supports.none               ? "no support"
                                                           : "too large to factor");
  std::string text = fmt::format("{}: long implicit steps while blocks {} it and the structure is quiet{}\n",
                                 body_.spec.name, condensed_by_choice() ? "are at" : "rest on",
                                 body_.bearings ? "; explicit sub-steps wherever bearings slide" : "");
  if (body_.spec.integrator == "modal" && !rings_in_modes())
    text += fmt::format("{}: integrator = \"modal\" finds no modes ({}): it goes on as with \"implicit\"\n",
                        body_.spec.name,
                        body_.bearings                ? "bearings"
                        : body_.bars                  ? "bars"
                        : body_.spec.damage != "none" ? "damage"
                                                      : "parts that turn");
  return text;
}

std::string FemStructure::plan() const {
  std::string text = fmt::format(
      "{}: {} cells, {} free degrees of freedom, kernels {} ({} elements at a time)\n", body_.spec.name,
      body_.partition ? body_.partition->cells_in_all() : body_.mesh.hexes.size(), body_.free_dofs,
      kernels().name, kernels().width);
  if (!body_.mesh.remark.empty())
    text += fmt::format(
        "{}: the mesh file holds {} elements beside its cells; they name groups and carry nothing\n",
        body_.spec.name, body_.mesh.remark);
  text += fmt::format("{}: explicit sub-step {:.3g} s; {}\n", body_.spec.name, body_.critical_step,
                      body_.finite ? "total Lagrangian, any rotation" : "small strains and rotations");
  if (const double fine = impact_refinement(body_.spec).cell_size; fine > 0)
    text += fmt::format(
        "{}: cells are halved down to {:g} m where a block is about to strike, as long as nothing of it has "
        "cracked\n",
        body_.spec.name, fine);
  text += plan_of_steps();
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
  text += body_.bars
              ? fmt::format("{}: {} bars in {} segments, {:.4g} m^3 of steel, {}\n", body_.spec.name,
                            body_.bars->count(), body_.bars->segments_in_all(), body_.bars->steel_volume(),
                            body_.bars->slips() ? "bond slip by the Model Code" : "perfect bond")
              : fmt::format("{}: no reinforcement\n", body_.spec.name);
  if (body_.bearings)
    text += fmt::format("{}: viaduct, {} springs in bearings with friction and seat\n", body_.spec.name,
                        body_.bearings->sites().size());
  if (body_.partition) {
    const std::vector<long> cells = body_.partition->cells_per_rank();
    text += fmt::format(
        "{}: divided over {} ranks{}, {} to {} cells each, {:.2g} % of them computed more than once\n",
        body_.spec.name, body_.partition->size(), body_.divided() ? ", its memory too" : "",
        *std::min_element(cells.begin(), cells.end()), *std::max_element(cells.begin(), cells.end()),
        100 * body_.partition->repeated_share());
  }
  if (const auto parts = memory_consumption(); body_.partition || body_.mesh.hexes.size() >= 20000) {
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

/// `here`: what this process holds, as it holds it; else the whole, in its own order, on the first rank.
void FemStructure::save(std::vector<double>& state, bool here) const {
  const bool gathers = body_.partition && !here;
  const TakeRows take = [&](std::span<const double> rows) {
    if (here || body_.first_rank()) state.insert(state.end(), rows.begin(), rows.end());
  };
  const auto nodes = [&](int width, const WriteRow& write) {
    return gathers ? each_node(width, write, take) : rows_of(body_.mass.size(), width, write, take);
  };
  const std::size_t nodes_in_all = gathers ? body_.partition->nodes_in_all() : body_.mass.size(),
                    cells_in_all = gathers ? body_.partition->cells_in_all() : body_.live.size();
  if (here || body_.first_rank())
    state.reserve(state.size() + 10 * nodes_in_all +
                  cells_in_all);  // most of it: else twice as much is asked for on the way
  state.insert(state.end(), {fields_.h_last,
                             energy_.power,
                             energy_.power_valid ? 1.0 : 0.0,
                             fields_.time,
                             fields_.contact_step,
                             energy_.stored_half,
                             fields_.reference_kinetic,
                             fields_.still_since,
                             fields_.still ? 1.0 : 0.0,
                             blow_time_,
                             fields_.steps_taken,
                             energy_.works.damping_work,
                             energy_.works.damage_work,
                             energy_.works.plastic_work,
                             energy_.works.bulk_viscosity_work,
                             energy_.works.eroded_energy,
                             energy_.works.external_work,
                             energy_.works.contact_work,
                             energy_.works.algorithmic,
                             energy_.works.step_dependence});
  nodes(9, [this](int n, double* to) {
    for (std::size_t i = 4 * static_cast<std::size_t>(n), c = 0; c < 3; ++c, ++i)
      *to++ = fields_.u[i], *to++ = fields_.v[i], *to++ = fields_.contact_impulse[i];
  });
  save_linear(state);
  if (body_.bars) body_.bars->save(state, here);
  if (body_.bearings) body_.bearings->save(state);
  if (body_.damage || body_.bearings) {
    state.insert(state.end(),
                 {static_cast<double>(body_.lost.breaks), static_cast<double>(body_.lost.cuts_seen),
                  body_.lost.dust_mass, body_.lost.dust_potential, body_.lost.eroded_volume,
                  body_.lost.detached_volume});
    for (const Vec3* p : {&body_.lost.dust_momentum, &body_.lost.dust_spin})
      state.insert(state.end(), p->data(), p->data() + 3);
    if (gathers)
      each_cell(
          1, [this](int cell, double* to) { *to = body_.live[cell]; }, take);
    else
      state.insert(state.end(), body_.live.begin(), body_.live.end());
    nodes(1, [this](int n, double* to) { *to = body_.mass[n]; });
    if (body_.damage && here) {
      body_.damage->save_here(state);
    } else if (body_.damage && gathers) {
      std::vector<double> records;
      body_.damage->save_records(records);
      records = body_.damage->state_of(body_.partition->collect_at_first(records));
      state.insert(state.end(), records.begin(), records.end());
    } else if (body_.damage) {
      body_.damage->save(state);
    }
  }
  state.push_back(frames_.empty() ? 0 : 1);
  for (const Mat3& t : frames_) state.insert(state.end(), t.data(), t.data() + 9);
  loads_.track().save(state);
  state.push_back(taken_by_condensed_);
}

void FemStructure::restore(std::span<const double> state, bool here) {
  const bool whole = body_.partition && !here;
  std::size_t at = 0;
  const auto next = [&]() {
    if (at >= state.size())
      throw NumericalFailure("structure " + body_.spec.name +
                             ": the saved state belongs to another structure");
    return state[at++];
  };
  const auto take = [&](std::size_t count, std::size_t width) {  // of a table
    if (state.size() - at < count * width)
      throw NumericalFailure("structure " + body_.spec.name +
                             ": the saved state belongs to another structure");
    const double* const from = state.data() + at;
    at += count * width;
    return from;
  };
  fields_.h_last = next(), energy_.power = next();
  energy_.power_valid = next() != 0;
  fields_.time = next(), fields_.contact_step = next(), energy_.stored_half = next(),
  fields_.reference_kinetic = next(), fields_.still_since = next();
  fields_.still = next() != 0;
  blow_time_ = next();
  fields_.steps_taken = next();
  energy_.works = {};
  for (double* p :
       {&energy_.works.damping_work, &energy_.works.damage_work, &energy_.works.plastic_work,
        &energy_.works.bulk_viscosity_work, &energy_.works.eroded_energy, &energy_.works.external_work,
        &energy_.works.contact_work, &energy_.works.algorithmic, &energy_.works.step_dependence})
    *p = next();
  const auto node = [&](std::size_t n) {
    return whole ? static_cast<std::size_t>(body_.partition->whole_node(static_cast<int>(n))) : n;
  };
  const std::size_t nodes = whole ? body_.partition->nodes_in_all() : body_.mass.size();
  const double* const motion = take(nodes, 9);
  for (std::size_t n = 0; n < body_.mass.size(); ++n) {
    const double* from = motion + 9 * node(n);
    for (std::size_t i = 4 * n; i < 4 * n + 3; ++i)
      fields_.u[i] = *from++, fields_.v[i] = *from++, fields_.contact_impulse[i] = *from++;
  }
  at += restore_linear(state.subspan(at));
  if (body_.bars) at += body_.bars->restore(state.subspan(at), here);
  if (body_.bearings) at += body_.bearings->restore(state.subspan(at));
  if (body_.damage || body_.bearings) {
    body_.lost.breaks = static_cast<long>(next()), body_.lost.cuts_seen = static_cast<long>(next()),
    body_.lost.dust_mass = next(), body_.lost.dust_potential = next(), body_.lost.eroded_volume = next(),
    body_.lost.detached_volume = next();
    for (Vec3* p : {&body_.lost.dust_momentum, &body_.lost.dust_spin})
      for (int c = 0; c < 3; ++c) (*p)[c] = next();
    double changed = 0;
    std::fill(body_.cells_at_node.begin(), body_.cells_at_node.end(), 0);
    const double* const lives = take(whole ? body_.partition->cells_in_all() : body_.live.size(), 1);
    for (std::size_t cell = 0; cell < body_.live.size(); ++cell) {
      const char now =
          lives[whole ? static_cast<std::size_t>(body_.partition->whole_cell(static_cast<int>(cell)))
                      : cell] != 0;
      if (now != body_.live[cell]) changed = 1;
      body_.live[cell] = now;
      if (now)
        for (int n : carriers(body_.mesh, static_cast<int>(cell))) ++body_.cells_at_node[n];
    }
    if (body_.partition) body_.partition->exchange_numbers(body_.cells_at_node);
    const double* const masses = take(nodes, 1);
    for (std::size_t n = 0; n < body_.mass.size(); ++n) {
      const double mass = masses[node(n)];
      if (mass != body_.mass[n]) changed = 1;
      body_.mass[n] = mass;
      forces_.masses_changed();
      for (int c = 0; c < 3; ++c)
        body_.inverse_mass[4 * n + c] =
            body_.mass[n] > 0 && !body_.supports.held[n][c] ? 1 / body_.mass[n] : 0.0;
    }
    if (body_.damage)
      at += here ? body_.damage->restore_here(state.subspan(at)) : body_.damage->restore(state.subspan(at));
    for (int cell = 0; cell < static_cast<int>(body_.live.size()); ++cell)
      body_.elements->set_on(cell, body_.live[cell] && !(body_.damage && body_.damage->has(cell)));
    if (body_.largest(changed) > 0) {
      skin_.rebuild();
      forces_.pass_over_the_gone();
      ++body_.revision;
    }
  }
  std::vector<Mat3> frames(at < state.size() && next() != 0 ? body_.mesh.hexes.size()
                                                            : 0);  // vectors of former versions end here
  for (Mat3& t : frames)
    for (int i = 0; i < 9; ++i) t.data()[i] = next();
  if (frames != frames_) set_frames(std::move(frames));
  const bool loads_known = at < state.size();
  if (loads_known) at += loads_.track().restore(state.subspan(at));
  taken_by_condensed_ = at < state.size() ? next() : 0.0;
  if (at != state.size())
    throw NumericalFailure("structure " + body_.spec.name + ": the saved state belongs to another structure");
  fields_.struck.clear();
  for (std::size_t i = 0; i < body_.mass.size(); ++i)
    if (Vec3(&fields_.contact_impulse[4 * i]) != Vec3::Zero()) fields_.struck.push_back(static_cast<int>(i));
  forces_.moved();
  if (!loads_known) loads_.begin();
}

void FemStructure::start_over() {
  energy_.works = {};
  taken_by_condensed_ = 0;
  fields_.still_since -= fields_.time;
  blow_time_ -= fields_.time;
  fields_.time = 0;
  fields_.contact_step = 0;
  std::fill(fields_.contact_impulse.begin(), fields_.contact_impulse.end(), 0.0);
  fields_.struck.clear();
  forces_.moved();
  loads_.begin_again();
}

void FemStructure::each_node(int width, const WriteRow& write, const TakeRows& take) const {
  if (body_.partition) return body_.partition->each_node(width, write, take);
  rows_of(body_.mass.size(), width, write, take);
}

void FemStructure::each_cell(int width, const WriteRow& write, const TakeRows& take) const {
  if (body_.partition) return body_.partition->each_cell(width, write, take);
  rows_of(body_.live.size(), width, write, take);
}

void FemStructure::shape(const TakePart& take) const {
  each_node(
      3, [this](int n, double* to) { std::copy_n(body_.mesh.nodes[n].data(), 3, to); },
      [&](std::span<const double> rows) {
        Snapshot part;
        for (std::size_t at = 0; at < rows.size(); at += 3) part.nodes.emplace_back(&rows[at]);
        take(part);
      });
  constexpr int width = 9;
  each_cell(
      width,
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
  if (body_.bars) body_.bars->shape(take);
}

void FemStructure::values(const TakePart& take) const {
  each_node(
      6,
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
  each_cell(
      width,
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
    for (const rebar::Bar& bar : body_.bars->list())
      lines.push_back({bar.points.front(), bar.points.back(), bar.diameter});
  return lines;
}

}  // namespace talus::fem
