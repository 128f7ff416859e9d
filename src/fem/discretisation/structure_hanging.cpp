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
  HexMesh coarse = make_mesh(of_coarse_mesh(spec_));
  check_cells(coarse, "structure." + spec_.name, spec_.file);
  if (!spec_.file.empty()) {
    check_faces(coarse, "structure." + spec_.name, spec_.file);
    if (const auto pair = overlapping_cells(coarse))
      report_(fmt::format(
          "warning: {}: {} and {} overlap but share no nodes: nothing ties them together, and the volume "
          "counts twice; merge the parts' nodes where they touch, or remove one of them",
          spec_.file, cell_name(coarse, pair->first), cell_name(coarse, pair->second)));
  }
  const Box3 extent = bounds(coarse.nodes);
  const auto settle = [this](const HexMesh& mesh) {
    supports_ = find_supports(spec_, mesh);
    probes_ = find_probes(spec_, mesh);
    finite_ = supports_.none || spec_.damage != "none" || spec_.kind == "viaduct";
  };
  if (ranks() != nullptr) {
    settle(coarse);
    if (divides_memory(coarse)) {
      find_places(coarse);
      find_feet(coarse);
      make_links(coarse);
      check_supports(coarse);
      take_part(std::move(coarse));
      return extent;
    }
  }
  const bool given = refines_locally(spec_) && !spec_.refinements.empty();
  Zones zones = given ? spec_.refinements : Zones{};
  zones.insert(zones.end(), struck_zones_.begin(), struck_zones_.end());
  const std::size_t before = coarse.hexes.size();
  discretisation_.reinit(std::move(coarse), zones, most_cells(spec_));
  if (given && struck_zones_.empty() && mesh_.hexes.size() == before)
    bad(spec_, "refine", fmt::format("{} zones", spec_.refinements.size()),
        "no cell lies in them that is larger than they ask for",
        "give the region in scene coordinates, about the part to refine, and cells smaller than the "
        "structure's");
  if (impact_refinement(spec_).cell_size == 0) discretisation_.forget_cells();
  settle(mesh_);
  find_places(mesh_);
  make_links(mesh_);
  return extent;
}

bool FemStructure::refinable() const {
  if (impact_refinement(spec_).cell_size == 0) return false;  // its triangulation is gone
  // What has been at rest since the start is in the state that its permanent load brings it to; that of finer
  // cells has its own cracks.
  const bool unmoved = still_ && !(reference_kinetic_ > 1e-14 * std::abs(stored_part_));
  const bool whole = (!damage_ || damage_->cells().empty() || unmoved) && !supports_.none &&
                     std::find(live_.begin(), live_.end(), 0) == live_.end() &&
                     (!bars_ || bars_->dissipation() == 0);
  return largest(whole ? 0 : 1) == 0;  // on every rank
}

std::unique_ptr<Structure> FemStructure::refined(std::span<const StructureSpec::Refinement> zones) {
  const auto asked_for = [&](const std::array<int, 8>& hex) {
    std::array<Vec3, 8> corners;
    for (std::size_t a = 0; a < 8; ++a) corners[a] = mesh_.nodes[static_cast<std::size_t>(hex[a])];
    return std::any_of(zones.begin(), zones.end(),
                       [&](const auto& zone) { return to_be_halved(corners, zone); });
  };
  if (!refinable() || std::none_of(mesh_.hexes.begin(), mesh_.hexes.end(), asked_for)) return nullptr;
  auto finer =
      std::make_unique<FemStructure>(spec_, gravity_, report_, Zones(zones.begin(), zones.end()), this);
  finer->take_over(*this);
  return finer;
}

/// What a coarser mesh has moved by since its state at rest, u - u_rest, is a field of this mesh too, since
/// every cell is one of that mesh or a part of one: its values at new nodes are means of their corners'.
/// Linear momentum is that of the field in either mesh, masses being row sums; energies are not, by the
/// assumed strains and by the sums of squares.
void FemStructure::take_over(FemStructure& before) {
  before.leave_modal();
  const double energy_before = before.mechanical_energy();
  before.synchronise(before.time_);
  before.share_motion();
  AlignedVector moved_by(before.u_);
  for (std::size_t i = 0; i < moved_by.size(); ++i) moved_by[i] -= before.rest_.u[i];
  discretisation_.interpolate(before.discretisation_, moved_by, u_);
  discretisation_.interpolate(before.discretisation_, before.v_, v_);
  for (std::size_t i = 0; i < u_.size(); ++i) u_[i] += rest_.u[i];
  books_ = before.books_;
  time_ = before.time_, still_ = before.still_, still_since_ = before.still_since_,
  blow_time_ = before.blow_time_;
  reference_kinetic_ = before.reference_kinetic_, steps_taken_ = before.steps_taken_,
  taken_by_condensed_ = before.taken_by_condensed_;
  if (bearings_ && bearings_->sites().size() == before.bearings_->sites().size()) {
    std::vector<double> state;
    before.bearings_->save(state);
    bearings_->restore(state);
  }
  load_track_ = before.load_track_;
  std::vector<std::array<double, 2>> drift;
  for (std::size_t k = 0; k < rest_.drift.size(); ++k)
    drift.push_back(
        {rest_.drift[k][0] - before.rest_.drift[k][0], rest_.drift[k][1] - before.rest_.drift[k][1]});
  find_feet(mesh_);  // load_track_ is told of this mesh's
  std::vector<double> reaction;
  for (std::size_t i = 0; i < std::min(rest_.reaction.size(), before.rest_.reaction.size()); ++i)
    reaction.push_back(rest_.reaction[i] - before.rest_.reaction[i]);
  load_track_.shift(reaction, drift);
  moved();
  books_.algorithmic -= mechanical_energy() - energy_before - (rest_.energy - before.rest_.energy);
}

void FemStructure::keep_rest() {
  if (impact_refinement(spec_).cell_size == 0) return;
  rest_.u = u_;
  const StructureEnergy e = energy();
  rest_.energy = e.elastic + e.gravity_potential;
  forces(time_);
  find_feet(mesh_);
  rest_.reaction = foot_reactions(0);
  for (const MemberState& m : member_states()) rest_.drift.push_back(m.drift);
}

void FemStructure::settle_hanging_nodes() {
  for (const HangingNode& h : mesh_.hanging) {
    const auto n = static_cast<std::size_t>(h.node);
    for (const auto& [master, weight] : h.masters)
      mass_[static_cast<std::size_t>(master)] += weight * mass_[n];
    mass_[n] = 0;
    supports_.held[n] = {false, false, false};
  }
  if (mesh_.hanging.empty()) return;
  std::vector<char> hangs(mesh_.nodes.size(), 0);
  for (const HangingNode& h : mesh_.hanging) hangs[static_cast<std::size_t>(h.node)] = 1;
  std::erase_if(supports_.nodes, [&](int n) { return hangs[static_cast<std::size_t>(n)] != 0; });
  for (PatchLoad& load : loads_) {
    std::vector<Vec3> force(mesh_.nodes.size(), Vec3::Zero());
    for (std::size_t k = 0; k < load.node.size(); ++k)
      force[static_cast<std::size_t>(load.node[k])] += load.force[k];
    for (const HangingNode& h : mesh_.hanging) {
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
