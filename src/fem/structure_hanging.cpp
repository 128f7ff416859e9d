// Nodes that hang between larger cells follow the nodes of those: u_h = sum w u_m. Forces and masses go the transposed way,
//
//   f_m += w f_h,     m_m += w m_h,
//
// so that the power of every force, the whole mass and, since a hanging node lies where its masters' mean does, both momenta are those of the free mesh.
#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"
#include "fem/lattice.hpp"
#include "fem/services.hpp"
#include "fem/spec_error.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

bool refines_locally(const StructureSpec& spec) {
  return std::any_of(spec.parameters.begin(), spec.parameters.end(), [](const auto& p) { return p.first == "local_refinement" && p.second != 0; });
}

StructureSpec of_coarse_mesh(const StructureSpec& spec) {
  StructureSpec coarse = spec;
  if (refines_locally(spec)) coarse.refinements.clear();
  return coarse;
}

void FemStructure::refine_mesh() {
  if (!refines_locally(spec_) || spec_.refinements.empty()) return;
  if (spec_.damage != "none")
    bad(spec_, "refine.local", "true", "cells that crack are not refined locally yet: faces between cells of two sizes neither open nor come off", "leave local out (the planes of the zone then go on through the structure), or damage = \"none\"");
  const std::size_t before = mesh_.hexes.size();
  refine_locally(mesh_, spec_.refinements);
  if (mesh_.hexes.size() == before)
    bad(spec_, "refine", fmt::format("{} zones", spec_.refinements.size()), "no cell lies in them that is larger than they ask for", "give the region in scene coordinates, about the part to refine, and cells smaller than the structure's");
}

void FemStructure::settle_hanging_nodes() {
  for (const HangingNode& h : mesh_.hanging) {
    const auto n = static_cast<std::size_t>(h.node);
    for (const auto& [master, weight] : h.masters) mass_[static_cast<std::size_t>(master)] += weight * mass_[n];
    mass_[n] = 0;
    supports_.held[n] = {false, false, false};
  }
  if (mesh_.hanging.empty()) return;
  std::vector<char> hangs(mesh_.nodes.size(), 0);
  for (const HangingNode& h : mesh_.hanging) hangs[static_cast<std::size_t>(h.node)] = 1;
  std::erase_if(supports_.nodes, [&](int n) { return hangs[static_cast<std::size_t>(n)] != 0; });
  for (PatchLoad& load : loads_) {
    std::vector<Vec3> force(mesh_.nodes.size(), Vec3::Zero());
    for (std::size_t k = 0; k < load.node.size(); ++k) force[static_cast<std::size_t>(load.node[k])] += load.force[k];
    for (const HangingNode& h : mesh_.hanging) {
      for (const auto& [master, weight] : h.masters) force[static_cast<std::size_t>(master)] += weight * force[static_cast<std::size_t>(h.node)];
      force[static_cast<std::size_t>(h.node)].setZero();
    }
    load.node.clear(), load.force.clear();
    for (int n = 0; n < static_cast<int>(force.size()); ++n)
      if (force[static_cast<std::size_t>(n)] != Vec3::Zero()) load.node.push_back(n), load.force.push_back(force[static_cast<std::size_t>(n)]);
  }
}

void FemStructure::spread(AlignedVector& motion) const {
  for (const HangingNode& h : mesh_.hanging)
    for (std::size_t c = 0; c < 3; ++c) {
      double sum = 0;
      for (const auto& [master, weight] : h.masters) sum += weight * motion[4 * static_cast<std::size_t>(master) + c];
      motion[4 * static_cast<std::size_t>(h.node) + c] = sum;
    }
}

void FemStructure::collect(AlignedVector& force) const {
  for (const HangingNode& h : mesh_.hanging)
    for (std::size_t c = 0; c < 3; ++c) {
      double& here = force[4 * static_cast<std::size_t>(h.node) + c];
      for (const auto& [master, weight] : h.masters) force[4 * static_cast<std::size_t>(master) + c] += weight * here;
      here = 0;
    }
}

std::vector<NodeImpulse> FemStructure::on_masters(std::span<const NodeImpulse> impulses) const {
  std::vector<NodeImpulse> out;
  for (const NodeImpulse& p : impulses) {
    const auto at = std::lower_bound(mesh_.hanging.begin(), mesh_.hanging.end(), p.node, [](const HangingNode& h, int n) { return h.node < n; });
    if (at == mesh_.hanging.end() || at->node != p.node) out.push_back(p);
    else
      for (const auto& [master, weight] : at->masters) out.push_back({master, weight * p.impulse});
  }
  return out;
}

}  // namespace talus::fem
