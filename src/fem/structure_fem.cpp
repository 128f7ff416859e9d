#include "fem/structure_fem.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "contact/geometry/bvh_tree.hpp"
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

std::vector<double> FemStructure::frequencies(int count) {
  if (body_.supports.none) return {};
  const ModalBasis modes = lowest_modes(body_.elastic->factor(), of_dofs(body_.dofs, body_.mass), count);
  return {modes.omega.data(), modes.omega.data() + modes.omega.size()};
}

/// `here`: what this process holds, as it holds it; else the whole, in its own order, on the first rank.
void FemStructure::write(std::vector<double>& state, bool here) const {
  if (here || body_.first_rank())  // most of it: else twice as much is asked for on the way
    state.reserve(state.size() + 11 * (here ? body_.mass.size() : body_.nodes_in_all()) +
                  body_.cells_in_all() + (body_.damage ? body_.damage->save_size() : 0));
  state.insert(
      state.end(),
      {fields_.h_last, energy_.power, energy_.power_valid ? 1.0 : 0.0, fields_.time, fields_.contact_step,
       energy_.stored_half, fields_.reference_kinetic, fields_.still_since, fields_.still ? 1.0 : 0.0,
       fields_.steps_taken, energy_.works.damping_work, energy_.works.damage_work, energy_.works.plastic_work,
       energy_.works.bulk_viscosity_work, energy_.works.eroded_energy, energy_.works.external_work,
       energy_.works.contact_work, energy_.works.algorithmic, energy_.works.step_dependence});
  body_.save(state, here, Of::nodes, 9, [this](int n, double* to) {
    for (std::size_t i = 4 * static_cast<std::size_t>(n), c = 0; c < 3; ++c, ++i)
      *to++ = fields_.u[i], *to++ = fields_.v[i], *to++ = fields_.contact_impulse[i];
  });
  motion_.modal.save(state);
  if (body_.bars) body_.bars->save(state, here);
  if (body_.bearings) body_.bearings->save(state);
  if (body_.damage || body_.bearings) fracture_.save(state, here);
  motion_.factors.save(state);
  loads_.track().save(state);
  motion_.condensed.save(state);
}

void FemStructure::read(std::span<const double> saved, bool here) {
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
  const auto motion = body_.saved(state, here, Of::nodes, 9);
  for (std::size_t n = 0; n < body_.mass.size(); ++n) {
    const double* from = motion(static_cast<int>(n));
    for (std::size_t i = 4 * n; i < 4 * n + 3; ++i)
      fields_.u[i] = *from++, fields_.v[i] = *from++, fields_.contact_impulse[i] = *from++;
  }
  motion_.modal.restore(state);
  if (body_.bars) body_.bars->restore(state, here);
  if (body_.bearings) body_.bearings->restore(state);
  if (body_.damage || body_.bearings) fracture_.restore(state, here);
  motion_.factors.restore(state);
  loads_.track().restore(state);
  motion_.condensed.restore(state);
  if (!state.empty())
    throw NumericalFailure("structure " + body_.spec.name + ": the saved state belongs to another structure");
  fields_.struck.clear();
  for (std::size_t i = 0; i < body_.mass.size(); ++i)
    if (Vec3(&fields_.contact_impulse[4 * i]) != Vec3::Zero()) fields_.struck.push_back(static_cast<int>(i));
  forces_.moved();
}

void FemStructure::start_over() {
  energy_.works = {};
  fields_.still_since -= fields_.time;
  motion_.condensed.start_over(fields_.time);
  fields_.time = 0;
  fields_.contact_step = 0;
  fields_.clear_impulses();
  forces_.moved();
  loads_.begin_again();
}

/// Cracked, yielded or lost cells since it began to move. What has been at rest since the start is in the
/// state that its permanent load brings it to; that of finer cells has its own cracks.
bool FemStructure::harmed() const {
  const bool unmoved = fields_.still && !fields_.has_moved(forces_.stored());
  const bool harmed = (body_.damage && !body_.damage->cells().empty() && !unmoved) ||
                      std::find(body_.live.begin(), body_.live.end(), 0) != body_.live.end() ||
                      (body_.bars && body_.bars->yielded());
  return body_.largest(harmed ? 1 : 0) > 0;  // on any rank
}

bool FemStructure::refinable() const {
  return impact_refinement(body_.spec).cell_size > 0 &&  // else its triangulation is gone
         !body_.supports.none && !((body_.partition || (body_.bars && body_.bars->slips())) && harmed());
}

bool FemStructure::stays(int cell) const {
  return body_.live[static_cast<std::size_t>(cell)] == 0 || (body_.damage && body_.damage->has(cell));
}

std::vector<Box3> FemStructure::kept_cells() const {
  std::vector<Box3> boxes;
  if (!harmed()) return boxes;
  for (int cell = 0; cell < static_cast<int>(body_.mesh.hexes.size()); ++cell)
    if (stays(cell)) {
      Box3& box = boxes.emplace_back();
      for (const Vec3& x : corners_of(body_.mesh, cell)) box.extend(x);
    }
  return boxes;
}

bool FemStructure::larger_cells(std::span<const StructureSpec::Refinement> zones) const {
  const bool whole = !harmed();
  for (int cell = 0; cell < static_cast<int>(body_.mesh.hexes.size()); ++cell) {
    const std::array<Vec3, 8> corners = corners_of(body_.mesh, cell);
    if ((whole || !stays(cell)) && std::any_of(zones.begin(), zones.end(), [&](const auto& zone) {
          return zone.cell_size > 0 && to_be_halved(corners, zone);
        }))
      return true;
  }
  return false;
}

std::unique_ptr<Structure> FemStructure::refined(std::span<const StructureSpec::Refinement> zones) {
  if (!refinable() || !larger_cells(zones)) return nullptr;
  auto finer = std::make_unique<FemStructure>(body_.spec, body_.gravity, body_.report,
                                              Zones(zones.begin(), zones.end()), this);
  finer->take_over(*this);
  return finer;
}

/// Histories and losses of larger cells, of which those that cracked or went are cells of this mesh, too. The
/// mass of a node beyond that of its cells, steel and what eroded cells left there, stays at the node.
void FemStructure::take_harm(const FemStructure& before) {
  std::map<CellBox, int> cell_of;
  for (int cell = 0; cell < static_cast<int>(body_.mesh.hexes.size()); ++cell)
    cell_of.emplace(box_about(corners_of(body_.mesh, cell)), cell);
  std::vector<int> same(before.body_.mesh.hexes.size(), -1), gone;
  for (int cell = 0; cell < static_cast<int>(same.size()); ++cell) {
    if (!before.stays(cell)) continue;
    same[static_cast<std::size_t>(cell)] = cell_of.at(box_about(corners_of(before.body_.mesh, cell)));
    if (before.body_.live[static_cast<std::size_t>(cell)] == 0)
      gone.push_back(same[static_cast<std::size_t>(cell)]);
  }
  fracture_.switch_off(gone);
  body_.lost = before.body_.lost;
  body_.mass = body_.mass_of_live();
  const std::vector<double> of_cells = before.body_.mass_of_live();
  contact::BoxTree nodes;
  nodes.build(static_cast<int>(body_.mesh.nodes.size()),
              [this](int n) { return Box3(body_.mesh.nodes[static_cast<std::size_t>(n)]); });
  const Vec3 near = Vec3::Constant(1e-6 * std::cbrt(body_.cell_mass.front() / body_.spec.density));
  for (std::size_t n = 0; n < of_cells.size(); ++n) {
    const Vec3 &x = before.body_.mesh.nodes[n], low = x - near, high = x + near;
    nodes.traverse(
        [&](const Vec3& from, const Vec3& to) { return Box3(low, high).intersects(Box3(from, to)); },
        [&](int here) {
          if (Box3(low, high).contains(body_.mesh.nodes[static_cast<std::size_t>(here)]))
            body_.mass[static_cast<std::size_t>(here)] += before.body_.mass[n] - of_cells[n];
          return true;
        });
  }
  for (int n = 0; n < static_cast<int>(body_.mass.size()); ++n) {
    if (body_.cells_at_node[n] == 0 && body_.mass[n] < 1e-9 * body_.built_mass[n]) fracture_.remove_node(n);
    for (std::size_t c = 0; c < 3; ++c)
      if (double& inverse = body_.inverse_mass[4 * static_cast<std::size_t>(n) + c]; inverse > 0)
        inverse = 1 / body_.mass[static_cast<std::size_t>(n)];
  }
  if (body_.damage) body_.damage->take_over(*before.body_.damage, same);
  for (int cell = 0; body_.damage && cell < static_cast<int>(body_.live.size()); ++cell)
    body_.elements->set_on(cell, body_.live[static_cast<std::size_t>(cell)] && !body_.damage->has(cell));
  if (body_.bars) body_.bars->take_over(*before.body_.bars);
  forces_.masses_changed();
  skin_.rebuild();
  forces_.pass_over_the_gone();
}

/// What a coarser mesh has moved by since its state at rest, u - u_rest, is a field of this mesh too, since
/// every cell is one of that mesh or a part of one: its values at new nodes are means of their corners'.
/// Linear momentum is that of the field in either mesh, masses being row sums; energies are not, by the
/// assumed strains and by the sums of squares.
void FemStructure::take_over(FemStructure& before) {
  before.motion_.modal.leave();
  if (before.harmed()) take_harm(before);
  const double energy_before = before.energy_.mechanical();
  before.motion_.leapfrog.synchronise(before.fields_.time);
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
  motion_.condensed.go_on_from(before.motion_.condensed);
  if (body_.bearings && body_.bearings->sites().size() == before.body_.bearings->sites().size()) {
    std::vector<double> state;
    before.body_.bearings->save(state);
    StateReader reader(state);
    body_.bearings->restore(reader);
  }
  loads_.track() = before.loads_.track();
  permanent_.shift_peaks(before.permanent_);
  forces_.moved();
  const double now = energy_.mechanical();
  energy_.works.algorithmic -=  // beside what the laws take here, which accept_laws() accounts for
      now + forces_.dissipation() - energy_before - (permanent_.energy - before.permanent_.energy);
}

}  // namespace talus::fem
