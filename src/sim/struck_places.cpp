// Finer cells where blocks are about to strike a structure ([[structure.refine]] where = "impact").
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "contact/structures/refinable.hpp"
#include "core/place.hpp"
#include "coupling/motion/strike_ahead.hpp"
#include "sim/world.hpp"

namespace talus::sim {
namespace {

constexpr double least_share = 0.05;  // of the strongest blow so far: weaker ones find the cells as they are
constexpr double reach_of_size =
    0.5;  // how far around the first contact cells are halved, of the block's size, unless the scene says

/// Springs that a block presses at the structure's surface, or that another structure does, are kept by nodes
/// that would be others: no cell is halved as long as there are any.
bool pressed(const coupling::SystemState& state, int q) {
  const std::uint64_t partner = coupling::Partner{coupling::Partner::Kind::structure, q}.id();
  const auto holds = [](const coupling::ContactMemory& m) {
    return m.normal_energy > 0 || m.shear_energy > 0;
  };
  for (const coupling::ContactHistory* history : {&state.contacts, &state.surface_contacts})
    for (const auto& list : *history)
      if (std::any_of(list.begin(), list.end(),
                      [&](const coupling::ContactMemory& m) { return m.partner == partner && holds(m); }))
        return true;
  const auto& own = state.surface_contacts[static_cast<std::size_t>(q)];
  return std::any_of(own.begin(), own.end(), holds);
}

}  // namespace

bool World::refine_structure(int q) {
  coupling::StructurePart& part = system->environment().structures[static_cast<std::size_t>(q)];
  std::vector<StructureSpec::Refinement> zones;
  for (const StruckPlace& s : struck)
    if (s.structure == q) zones.push_back(s.zone);
  auto* const now = dynamic_cast<RefinableStructure*>(part.structure.get());
  if (zones.empty() || now == nullptr) return false;
  std::unique_ptr<Structure> finer = now->refined(zones);
  if (!finer) return false;
  if (built_energy)
    energy_start +=
        dynamic_cast<const RefinableStructure&>(*finer).permanent_energy() - now->permanent_energy();
  part.structure = std::move(finer);
  part.index = coupling::moving_index(part.structure->skin().surface());
  part.followed = {};
  part.lagging_index = false;
  system->state().structure_step[static_cast<std::size_t>(q)] = 0;
  return true;
}

/// Halves cells where blocks are about to strike. The time at which to look again, `end` at the latest: by
/// then nothing that is near now can have been turned towards other cells.
double World::foresee_strikes(double end) {
  auto& parts = system->environment().structures;
  for (std::size_t q = 0; q < parts.size(); ++q) {
    const StructureSpec& spec = scene.structures[q];
    const ImpactRefinement asked = impact_refinement(spec);
    const auto* refinable = dynamic_cast<const RefinableStructure*>(parts[q].structure.get());
    if (asked.cell_size == 0 || parts[q].fixed_surface || refinable == nullptr) continue;
    const bool whole = refinable->refinable(), free = whole && !pressed(system->state(), static_cast<int>(q));
    const coupling::StrikesAhead ahead =
        coupling::strikes_ahead(system->model(), system->state().blocks, system->state().contacts, parts[q],
                                static_cast<int>(q), std::min(system->longest_stretch(), end - time()));
    double strongest = 0;
    for (const StruckPlace& s : struck)
      if (s.structure == static_cast<int>(q)) strongest = std::max(strongest, s.energy);
    const std::size_t before = struck.size();
    const auto keep_cells = [&] {
      for (const Box3& box : refinable->kept_cells())
        if (std::none_of(struck.begin(), struck.end(), [&](const StruckPlace& k) {
              return k.structure == static_cast<int>(q) && k.zone.cell_size == 0 &&
                     k.zone.region.min() == box.min() && k.zone.region.max() == box.max();
            }))
          struck.push_back({static_cast<int>(q), {box, 0}, 0});
    };
    for (const coupling::StrikeAhead& s : ahead.strikes) {
      if (s.energy < least_share * strongest) continue;
      const dda::Model::Block& block = system->model().blocks[static_cast<std::size_t>(s.block)];
      if (block.structure == static_cast<int>(q))
        continue;  // a piece of it, whose ways are those of its cells
      const double reach = asked.reach > 0 ? asked.reach : reach_of_size * 2 * block.shape->radius;
      const Box3 place(s.place.min() - Vec3::Constant(reach), s.place.max() + Vec3::Constant(reach));
      const auto holds = [&](const StruckPlace& k) {
        return k.structure == static_cast<int>(q) && k.zone.cell_size > 0 && k.zone.region.contains(s.place);
      };
      const auto known = [&](const auto& of) { return std::any_of(of.begin(), of.end(), holds); };
      const StruckPlace here{static_cast<int>(q), {place, asked.cell_size}, s.energy};
      if (known(struck)) continue;
      if (free && struck.size() == before) keep_cells();
      if (free) struck.push_back(here);
      if (free || known(left_coarse) || !refinable->larger_cells({&here.zone, 1})) continue;
      left_coarse.push_back(here);
      due_warnings.push_back(fmt::format(
          "{}: block {}, about to strike it at t = {:.4g} s about {} with {:.3g} kJ, finds cells larger than "
          "the {:g} m that [[structure.refine]] where = \"impact\" asks for, since {}: force and damage of "
          "that "
          "blow are those of coarse cells; give this place smaller ones from the start by "
          "[[structure.refine]] region",
          spec.name, block.name, time(), place_text(s.place.center()), s.energy / 1e3, asked.cell_size,
          whole
              ? "springs of other contacts press on it"
              : "it has cracked, yielded or lost cells, and its bars slip or several processes compute it"));
    }
    if (!free) continue;
    end = std::min(end, time() + ahead.look_again);
    if (struck.size() == before) continue;
    const long cells = parts[q].structure->elements();
    if (refine_structure(static_cast<int>(q)))
      report(fmt::format(
          "structure {}: t = {:.4g} s, block {} is about to strike: cells of {:g} m around [{:.4g}, {:.4g}, "
          "{:.4g}], {} cells in place of {}",
          spec.name, time(),
          system->model().blocks[static_cast<std::size_t>(ahead.strikes.front().block)].name, asked.cell_size,
          struck.back().zone.region.center().x(), struck.back().zone.region.center().y(),
          struck.back().zone.region.center().z(), parts[q].structure->elements(), cells));
  }
  return end;
}

}  // namespace talus::sim
