// Nodes that hang between larger cells follow the nodes of those: u_h = sum w u_m. Forces and masses go the
// transposed way,
//
//   f_m += w f_h,     m_m += w m_h,
//
// so that the power of every force, the whole mass and, since a hanging node lies where its masters' mean
// does, both momenta are those of the free mesh.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "fem/discretisation/hanging.hpp"
#include "fem/discretisation/lattice.hpp"
#include "fem/spec_error.hpp"
#include "fem/structure_fem.hpp"
#include "fem/structure_plan.hpp"

namespace talus::fem {

bool refines_locally(const StructureSpec& spec) {
  return std::any_of(spec.parameters.begin(), spec.parameters.end(),
                     [](const auto& p) { return p.first == "local_refinement" && p.second != 0; });
}

StructureSpec of_coarse_mesh(const StructureSpec& spec) {
  StructureSpec coarse = spec;
  if (refines_locally(spec)) coarse.refinements.clear();
  return coarse;
}

/// Coarse cells as the specification says, halved by the zones that end at their borders; supports and probes
/// on them. Of several ranks that divide memory each keeps its part.
Box3 FemStructure::make_cells() {
  HexMesh coarse = make_mesh(of_coarse_mesh(body_.spec));
  check_cells(coarse, "structure." + body_.spec.name, body_.spec.file);
  if (!body_.spec.file.empty()) {
    check_faces(coarse, "structure." + body_.spec.name, body_.spec.file);
    if (const auto pair = overlapping_cells(coarse))
      body_.report(fmt::format(
          "warning: {}: {} and {} overlap but share no nodes: nothing ties them together, and the volume "
          "counts twice; merge the parts' nodes where they touch, or remove one of them",
          body_.spec.file, cell_name(coarse, pair->first), cell_name(coarse, pair->second)));
  }
  const Box3 extent = bounds(coarse.nodes);
  const auto settle = [this](const HexMesh& mesh) {
    body_.supports = find_supports(body_.spec, mesh);
    skin_.probe(find_probes(body_.spec, mesh));
    body_.finite = body_.supports.none || body_.spec.damage != "none" || body_.spec.kind == "viaduct";
  };
  if (ranks() != nullptr) {
    settle(coarse);
    if (divides_memory(coarse)) {
      loads_.find_places(coarse);
      loads_.find_feet(coarse);
      make_links(coarse);
      check_supports(coarse);
      take_part(std::move(coarse));
      return extent;
    }
  }
  const bool given = refines_locally(body_.spec) && !body_.spec.refinements.empty();
  Zones zones = given ? body_.spec.refinements : Zones{};
  zones.insert(zones.end(), body_.struck_zones.begin(), body_.struck_zones.end());
  const std::size_t before = coarse.hexes.size();
  body_.discretisation.reinit(std::move(coarse), zones, most_cells(body_.spec));
  if (given && body_.struck_zones.empty() && body_.mesh.hexes.size() == before)
    bad(body_.spec, "refine", fmt::format("{} zones", body_.spec.refinements.size()),
        "no cell lies in them that is larger than they ask for",
        "give the region in scene coordinates, about the part to refine, and cells smaller than the "
        "structure's");
  if (impact_refinement(body_.spec).cell_size == 0) body_.discretisation.forget_cells();
  settle(body_.mesh);
  loads_.find_places(body_.mesh);
  make_links(body_.mesh);
  return extent;
}

bool FemStructure::refinable() const {
  if (impact_refinement(body_.spec).cell_size == 0) return false;  // its triangulation is gone
  // What has been at rest since the start is in the state that its permanent load brings it to; that of finer
  // cells has its own cracks.
  const bool unmoved = fields_.still && !(fields_.reference_kinetic > 1e-14 * std::abs(forces_.stored()));
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
  before.leave_modal();
  const double energy_before = before.energy_.mechanical();
  before.leapfrog_.synchronise(before.fields_.time);
  before.body_.share(before.fields_.u, before.fields_.v);
  AlignedVector moved_by(before.fields_.u);
  for (std::size_t i = 0; i < moved_by.size(); ++i) moved_by[i] -= before.rest_.u[i];
  body_.discretisation.interpolate(before.body_.discretisation, moved_by, fields_.u);
  body_.discretisation.interpolate(before.body_.discretisation, before.fields_.v, fields_.v);
  for (std::size_t i = 0; i < fields_.u.size(); ++i) fields_.u[i] += rest_.u[i];
  energy_.works = before.energy_.works;
  fields_.time = before.fields_.time, fields_.still = before.fields_.still,
  fields_.still_since = before.fields_.still_since, blow_time_ = before.blow_time_;
  fields_.reference_kinetic = before.fields_.reference_kinetic,
  fields_.steps_taken = before.fields_.steps_taken, taken_by_condensed_ = before.taken_by_condensed_;
  if (body_.bearings && body_.bearings->sites().size() == before.body_.bearings->sites().size()) {
    std::vector<double> state;
    before.body_.bearings->save(state);
    body_.bearings->restore(state);
  }
  loads_.track() = before.loads_.track();
  std::vector<std::array<double, 2>> drift;
  for (std::size_t k = 0; k < rest_.drift.size(); ++k)
    drift.push_back(
        {rest_.drift[k][0] - before.rest_.drift[k][0], rest_.drift[k][1] - before.rest_.drift[k][1]});
  loads_.find_feet(body_.mesh);  // loads_.track() is told of this mesh's
  std::vector<double> reaction;
  for (std::size_t i = 0; i < std::min(rest_.reaction.size(), before.rest_.reaction.size()); ++i)
    reaction.push_back(rest_.reaction[i] - before.rest_.reaction[i]);
  loads_.track().shift(reaction, drift);
  forces_.moved();
  energy_.works.algorithmic -= energy_.mechanical() - energy_before - (rest_.energy - before.rest_.energy);
}

void FemStructure::keep_rest() {
  if (impact_refinement(body_.spec).cell_size == 0) return;
  rest_.u = fields_.u;
  const StructureEnergy e = energy_.total();
  rest_.energy = e.elastic + e.gravity_potential;
  forces_.evaluate(fields_.time);
  loads_.find_feet(body_.mesh);
  rest_.reaction = loads_.foot_reactions(0);
  for (const MemberState& m : loads_.states()) rest_.drift.push_back(m.drift);
}

void FemStructure::settle_hanging_nodes() {
  for (const HangingNode& h : body_.mesh.hanging) {
    const auto n = static_cast<std::size_t>(h.node);
    for (const auto& [master, weight] : h.masters)
      body_.mass[static_cast<std::size_t>(master)] += weight * body_.mass[n];
    body_.mass[n] = 0;
    body_.supports.held[n] = {false, false, false};
  }
  if (body_.mesh.hanging.empty()) return;
  std::vector<char> hangs(body_.mesh.nodes.size(), 0);
  for (const HangingNode& h : body_.mesh.hanging) hangs[static_cast<std::size_t>(h.node)] = 1;
  std::erase_if(body_.supports.nodes, [&](int n) { return hangs[static_cast<std::size_t>(n)] != 0; });
  for (PatchLoad& load : body_.loads) {
    std::vector<Vec3> force(body_.mesh.nodes.size(), Vec3::Zero());
    for (std::size_t k = 0; k < load.node.size(); ++k)
      force[static_cast<std::size_t>(load.node[k])] += load.force[k];
    for (const HangingNode& h : body_.mesh.hanging) {
      for (const auto& [master, weight] : h.masters)
        force[static_cast<std::size_t>(master)] += weight * force[static_cast<std::size_t>(h.node)];
      force[static_cast<std::size_t>(h.node)].setZero();
    }
    load.node.clear(), load.force.clear();
    for (int n = 0; n < static_cast<int>(force.size()); ++n)
      if (force[static_cast<std::size_t>(n)] != Vec3::Zero())
        load.node.push_back(n), load.force.push_back(force[static_cast<std::size_t>(n)]);
  }
}

}  // namespace talus::fem
