#include "fem/structure_fem.hpp"

#include <algorithm>
#include <cmath>

#include "core/memory.hpp"
#include "fem/discretisation/hanging.hpp"
#include "fem/structure_setup.hpp"

namespace talus::fem {

FemStructure::FemStructure(const StructureSpec& spec, const Vec3& gravity, const Report& report, Zones struck,
                           const FemStructure* before)
    : body_(spec, gravity, report, std::move(struck)) {
  StructureSetup setup(body_, fields_, skin_, loads_);
  setup.build(before != nullptr ? &before->body_ : nullptr);
  if (setup.weighs() && !body_.supports.none && body_.free_dofs > 0) permanent_.apply();
  body_.factored = body_.elastic->factored();
  body_.elastic->forget_multigrid();  // only the preload and the first frequency of large systems need it
  give_back_memory();
  loads_.complete();
  setup.divide();
  forces_.moved();
  loads_.begin();
  if (impact_refinement(body_.spec).cell_size > 0) permanent_.keep();
}

void FemStructure::predict_condensed(double t, double h) {
  predict_condensed(t, h, body_.spec.damping_ratio > 0);
}

void FemStructure::predict_condensed(double t, double h, bool smoothed) {
  modal_.leave();
  condensed_.predict(t, h, smoothed);
  before_.clear();
  save(before_);
}

void FemStructure::undo_condensed() {
  restore(before_);
  condensed_.undone();
}

/// By condensed steps alone; false: not now.
bool FemStructure::ring_on(double t, double duration) {
  const double h = condensed_.lone_step(t, duration);
  if (!(h > 0)) return false;
  const double steps = duration / h;
  for (double k = 0; k < steps; ++k) {
    const double now = t + duration * (k / steps);
    predict_condensed(now, h, false);
    if (condensed_.correct(now, h, {})) continue;
    undo_condensed();
    condensed_.struck(now);
    leapfrog_.advance(now, t + duration - now);
    break;
  }
  fields_.time = t + duration;
  return true;
}

/// Goes on as nothing touches it: asleep, in modes, by condensed steps or by explicit ones.
std::string FemStructure::advance_alone(double t, double duration) {
  if (!(duration > 0)) return "none";
  if (undisturbed(t, duration)) {
    fields_.time = t + duration;
    return "asleep";
  }
  if (modal_.running()) {
    modal_.advance(t, duration);
    return "modal";
  }
  // Not before explicit steps alone have cost as much as what saves them; what is not linear tries condensed
  // steps.
  constexpr double least_steps = 100;
  const std::string& how = body_.spec.integrator;
  const bool linear = modal_.possible();
  const double explicit_count = std::ceil(duration / body_.critical_step);
  const bool waited =
      linear ? modal_.due() : fields_.reference_kinetic == 0 || fields_.steps_taken >= least_steps;
  const bool worth = how == "auto" && explicit_count >= 8 && waited;
  if (linear && (how == "modal" || worth) && modal_.enter(t, how == "modal")) {
    modal_.advance(t, duration);
    return "modal";
  }
  if ((how == "implicit" || (!linear && (how == "modal" || worth))) && ring_on(t, duration))
    return "condensed";
  leapfrog_.advance(t, duration);
  return "explicit";
}

bool FemStructure::undisturbed(double t, double duration) const {
  if (!fields_.still) return false;
  const bool moved_before = fields_.has_moved(energy_.stored_half);
  const double since = moved_before ? fields_.still_since : 0;
  if (moved_before && t - since < settling_time()) return false;
  for (const PatchLoad& load : body_.loads) {
    // What the structure is in balance with: nothing before it ever moved, since the preload is gravity
    // alone.
    const double held = moved_before ? load.factor(since) : 0;
    if (load.factor(t) != held || load.factor(t + duration) != held) return false;
    for (const auto& [when, factor] : load.history)
      if (when > since && when < t + duration && factor != held) return false;
  }
  return true;
}

double FemStructure::settling_time() const {
  if (factors_.possible()) return M_PI / factors_.lowest_frequency();
  return body_.omega_1 > 0 ? M_PI / body_.omega_1 : 200 * body_.critical_step;
}

bool FemStructure::quiet() const {
  for (const PatchLoad& load : body_.loads)
    if (!load.history.empty() && fields_.time < load.history.back().first) return false;
  if (!fields_.still) return false;
  if (!fields_.has_moved(energy_.stored_half))
    return std::all_of(body_.loads.begin(), body_.loads.end(),
                       [&](const PatchLoad& load) { return load.factor(fields_.time) == 0; });
  // Kinetic energy also vanishes at a turning point: it has to stay small for half a period (or many steps,
  // if that is unknown).
  return fields_.time - fields_.still_since >= settling_time();
}

std::vector<double> FemStructure::frequencies(int count) {
  if (body_.supports.none) return {};
  std::vector<double> m(body_.dofs.size);
  for (std::size_t i = 0; i < body_.mass.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const int d = body_.dofs.number[i][c]; d >= 0) m[d] = body_.mass[i];
  const ModalBasis modes = lowest_modes(body_.elastic->factor(), m, count);
  return {modes.omega.data(), modes.omega.data() + modes.omega.size()};
}

/// `here`: what this process holds, as it holds it; else the whole, in its own order, on the first rank.
void FemStructure::save(std::vector<double>& state, bool here) const {
  const bool gathers = body_.partition && !here;
  const TakeRows take = [&](std::span<const double> rows) {
    if (here || body_.first_rank()) state.insert(state.end(), rows.begin(), rows.end());
  };
  const auto nodes = [&](int width, const WriteRow& write) {
    return gathers ? body_.each_node(width, write, take) : rows_of(body_.mass.size(), width, write, take);
  };
  const std::size_t nodes_in_all = gathers ? body_.partition->nodes_in_all() : body_.mass.size(),
                    cells_in_all = gathers ? body_.partition->cells_in_all() : body_.live.size();
  if (here || body_.first_rank())
    state.reserve(state.size() + 10 * nodes_in_all +
                  cells_in_all);  // most of it: else twice as much is asked for on the way
  state.insert(
      state.end(),
      {fields_.h_last, energy_.power, energy_.power_valid ? 1.0 : 0.0, fields_.time, fields_.contact_step,
       energy_.stored_half, fields_.reference_kinetic, fields_.still_since, fields_.still ? 1.0 : 0.0,
       fields_.steps_taken, energy_.works.damping_work, energy_.works.damage_work, energy_.works.plastic_work,
       energy_.works.bulk_viscosity_work, energy_.works.eroded_energy, energy_.works.external_work,
       energy_.works.contact_work, energy_.works.algorithmic, energy_.works.step_dependence});
  nodes(9, [this](int n, double* to) {
    for (std::size_t i = 4 * static_cast<std::size_t>(n), c = 0; c < 3; ++c, ++i)
      *to++ = fields_.u[i], *to++ = fields_.v[i], *to++ = fields_.contact_impulse[i];
  });
  modal_.save(state);
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
      body_.each_cell(
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
  factors_.save(state);
  loads_.track().save(state);
  condensed_.save(state);
}

void FemStructure::restore(std::span<const double> saved, bool here) {
  const bool whole = body_.partition && !here;
  StateReader state(saved);
  double still = 0, power_valid = 0;
  energy_.works = {};
  for (double* p :
       {&fields_.h_last, &energy_.power, &power_valid, &fields_.time, &fields_.contact_step,
        &energy_.stored_half, &fields_.reference_kinetic, &fields_.still_since, &still, &fields_.steps_taken,
        &energy_.works.damping_work, &energy_.works.damage_work, &energy_.works.plastic_work,
        &energy_.works.bulk_viscosity_work, &energy_.works.eroded_energy, &energy_.works.external_work,
        &energy_.works.contact_work, &energy_.works.algorithmic, &energy_.works.step_dependence})
    *p = state.next();
  fields_.still = still != 0, energy_.power_valid = power_valid != 0;
  const double* const motion = state.take(9 * (whole ? body_.partition->nodes_in_all() : body_.mass.size()));
  for (std::size_t n = 0; n < body_.mass.size(); ++n) {
    const double* from =
        motion + 9 * (whole ? static_cast<std::size_t>(body_.whole_node(static_cast<int>(n))) : n);
    for (std::size_t i = 4 * n; i < 4 * n + 3; ++i)
      fields_.u[i] = *from++, fields_.v[i] = *from++, fields_.contact_impulse[i] = *from++;
  }
  modal_.restore(state);
  if (body_.bars) body_.bars->restore(state, here);
  if (body_.bearings) body_.bearings->restore(state);
  if (body_.damage || body_.bearings) restore_cells(state, here);
  factors_.restore(state);
  loads_.track().restore(state);
  condensed_.restore(state);
  if (!state.empty())
    throw NumericalFailure("structure " + body_.spec.name + ": the saved state belongs to another structure");
  fields_.struck.clear();
  for (std::size_t i = 0; i < body_.mass.size(); ++i)
    if (Vec3(&fields_.contact_impulse[4 * i]) != Vec3::Zero()) fields_.struck.push_back(static_cast<int>(i));
  forces_.moved();
}

/// What cells and masses are left, and the history of the law.
void FemStructure::restore_cells(StateReader& state, bool here) {
  const bool whole = body_.partition && !here;
  body_.lost.breaks = static_cast<long>(state.next()), body_.lost.cuts_seen = static_cast<long>(state.next());
  for (double* p : {&body_.lost.dust_mass, &body_.lost.dust_potential, &body_.lost.eroded_volume,
                    &body_.lost.detached_volume})
    *p = state.next();
  for (Vec3* p : {&body_.lost.dust_momentum, &body_.lost.dust_spin}) std::copy_n(state.take(3), 3, p->data());
  double changed = 0;
  std::fill(body_.cells_at_node.begin(), body_.cells_at_node.end(), 0);
  const double* const lives = state.take(whole ? body_.partition->cells_in_all() : body_.live.size());
  for (std::size_t cell = 0; cell < body_.live.size(); ++cell) {
    const char now =
        lives[whole ? static_cast<std::size_t>(body_.whole_cell(static_cast<int>(cell))) : cell] != 0;
    if (now != body_.live[cell]) changed = 1;
    body_.live[cell] = now;
    if (now)
      for (int n : carriers(body_.mesh, static_cast<int>(cell))) ++body_.cells_at_node[n];
  }
  if (body_.partition) body_.partition->exchange_numbers(body_.cells_at_node);
  const double* const masses = state.take(whole ? body_.partition->nodes_in_all() : body_.mass.size());
  for (std::size_t n = 0; n < body_.mass.size(); ++n) {
    const double mass = masses[whole ? static_cast<std::size_t>(body_.whole_node(static_cast<int>(n))) : n];
    if (mass != body_.mass[n]) changed = 1;
    body_.mass[n] = mass;
    for (int c = 0; c < 3; ++c)
      body_.inverse_mass[4 * n + c] = mass > 0 && !body_.supports.held[n][c] ? 1 / mass : 0.0;
  }
  forces_.masses_changed();
  if (body_.damage && here)
    body_.damage->restore_here(state);
  else if (body_.damage)
    body_.damage->restore(state);
  for (int cell = 0; cell < static_cast<int>(body_.live.size()); ++cell)
    body_.elements->set_on(cell, body_.live[cell] && !(body_.damage && body_.damage->has(cell)));
  if (body_.largest(changed) > 0) {
    skin_.rebuild();
    forces_.pass_over_the_gone();
    ++body_.revision;
  }
}

void FemStructure::start_over() {
  energy_.works = {};
  fields_.still_since -= fields_.time;
  condensed_.start_over(fields_.time);
  fields_.time = 0;
  fields_.contact_step = 0;
  fields_.clear_impulses();
  forces_.moved();
  loads_.begin_again();
}

bool FemStructure::refinable() const {
  if (impact_refinement(body_.spec).cell_size == 0) return false;  // its triangulation is gone
  // What has been at rest since the start is in the state that its permanent load brings it to; that of finer
  // cells has its own cracks.
  const bool unmoved = fields_.still && !fields_.has_moved(forces_.stored());
  const bool whole = (!body_.damage || body_.damage->cells().empty() || unmoved) && !body_.supports.none &&
                     std::find(body_.live.begin(), body_.live.end(), 0) == body_.live.end() &&
                     (!body_.bars || body_.bars->dissipation() == 0);
  return body_.largest(whole ? 0 : 1) == 0;  // on every rank
}

std::unique_ptr<Structure> FemStructure::refined(std::span<const StructureSpec::Refinement> zones) {
  const auto asked_for = [&](const std::array<int, 8>& hex) {
    std::array<Vec3, 8> corners;
    for (std::size_t a = 0; a < 8; ++a) corners[a] = body_.mesh.nodes[static_cast<std::size_t>(hex[a])];
    return std::any_of(zones.begin(), zones.end(),
                       [&](const auto& zone) { return to_be_halved(corners, zone); });
  };
  if (!refinable() || std::none_of(body_.mesh.hexes.begin(), body_.mesh.hexes.end(), asked_for))
    return nullptr;
  auto finer = std::make_unique<FemStructure>(body_.spec, body_.gravity, body_.report,
                                              Zones(zones.begin(), zones.end()), this);
  finer->take_over(*this);
  return finer;
}

/// What a coarser mesh has moved by since its state at rest, u - u_rest, is a field of this mesh too, since
/// every cell is one of that mesh or a part of one: its values at new nodes are means of their corners'.
/// Linear momentum is that of the field in either mesh, masses being row sums; energies are not, by the
/// assumed strains and by the sums of squares.
void FemStructure::take_over(FemStructure& before) {
  before.modal_.leave();
  const double energy_before = before.energy_.mechanical();
  before.leapfrog_.synchronise(before.fields_.time);
  before.body_.share(before.fields_.u, before.fields_.v);
  AlignedVector moved_by(before.fields_.u);
  for (std::size_t i = 0; i < moved_by.size(); ++i) moved_by[i] -= before.permanent_.u[i];
  body_.discretisation.interpolate(before.body_.discretisation, moved_by, fields_.u);
  body_.discretisation.interpolate(before.body_.discretisation, before.fields_.v, fields_.v);
  for (std::size_t i = 0; i < fields_.u.size(); ++i) fields_.u[i] += permanent_.u[i];
  energy_.works = before.energy_.works;
  fields_.time = before.fields_.time, fields_.still = before.fields_.still,
  fields_.still_since = before.fields_.still_since;
  fields_.reference_kinetic = before.fields_.reference_kinetic,
  fields_.steps_taken = before.fields_.steps_taken;
  condensed_.go_on_from(before.condensed_);
  if (body_.bearings && body_.bearings->sites().size() == before.body_.bearings->sites().size()) {
    std::vector<double> state;
    before.body_.bearings->save(state);
    StateReader reader(state);
    body_.bearings->restore(reader);
  }
  loads_.track() = before.loads_.track();
  permanent_.shift_peaks(before.permanent_);
  forces_.moved();
  energy_.works.algorithmic -=
      energy_.mechanical() - energy_before - (permanent_.energy - before.permanent_.energy);
}

}  // namespace talus::fem
