#include "fem/bearings.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/reject.hpp"
#include "fem/rebar_embed.hpp"

namespace talus::fem {

namespace {
/// The upper cells of one cap beam, to be searched in body axes.
struct Cap {
  Cap(const HexMesh& mesh, int part, double top) {
    for (int c = 0; c < static_cast<int>(mesh.hexes.size()); ++c) {
      if (mesh.component[c] != part || std::abs(mesh.local[mesh.hexes[c][6]].z() - top) > 1e-6) continue;
      cell.push_back(c);
      hexes.push_back(mesh.hexes[c]);
      for (int n : mesh.hexes[c]) box.extend(mesh.local[n]);
    }
    search = rebar::host_search(mesh.local, hexes);
  }
  Cap(const Cap&) = delete;
  std::vector<int> cell;
  std::vector<std::array<int, 8>> hexes;
  Box3 box;
  rebar::HostSearch search;
};
}  // namespace

Bearings::Bearings(const StructureSpec& spec, const HexMesh& mesh, const ViaductPlan& plan) {
  along_ = spec.rotation.col(0);
  across_ = spec.rotation.col(1);
  up_ = spec.rotation.col(2);
  std::vector<int> cell_of(mesh.nodes.size(), -1), part_of(mesh.nodes.size(), -1);
  for (int cell = static_cast<int>(mesh.hexes.size()) - 1; cell >= 0; --cell)
    for (int n : mesh.hexes[cell]) cell_of[n] = cell, part_of[n] = mesh.component[cell];
  const int bents = static_cast<int>(plan.parts.size()) - [&] {
    int decks = 0;
    for (const auto& p : plan.parts) decks += p.deck >= 0;
    return decks;
  }();
  std::map<int, Cap> caps;
  for (const ViaductPlan::Pad& pad : plan.pads) {
    const int deck_part = bents + pad.deck, cap_part = pad.deck + pad.end;
    const double bottom = pad.at.z() + plan.bearing_height;
    std::vector<int> nodes;
    int nearest = -1;
    double best = INFINITY;
    for (int n = 0; n < static_cast<int>(mesh.nodes.size()); ++n) {
      if (part_of[n] != deck_part || std::abs(mesh.local[n].z() - bottom) > 1e-6) continue;
      const Vec3 d = mesh.local[n] - pad.at;
      if (std::abs(d.x()) <= pad.length / 2 + 1e-9 && std::abs(d.y()) <= pad.width / 2 + 1e-9) nodes.push_back(n);
      const double distance = std::hypot(d.x(), d.y());
      if (distance < best - 1e-9) best = distance, nearest = n;
    }
    if (nodes.empty() && nearest >= 0) nodes.push_back(nearest);
    const Cap& cap = caps.try_emplace(cap_part, mesh, cap_part, pad.at.z()).first->second;
    std::vector<Site> found;
    for (int n : nodes) {
      // The point of the cap below the node, or the cap's nearest one.
      Site site{pad.deck, pad.end, n, cell_of[n], -1, {}, {}};
      Vec3 target = mesh.local[n].cwiseMax(cap.box.min()).cwiseMin(cap.box.max());
      target.z() = pad.at.z();
      if (const auto host = cap.search(target)) {
        site.cap_cell = cap.cell[host->cell];
        site.cap_node = cap.hexes[host->cell];
        site.weight = shape_values(host->xi);
      }
      if (site.cap_cell >= 0) found.push_back(site);
    }
    if (found.empty()) reject("structure." + spec.name + ".bearing", "", "a bearing finds no node of the deck or no cap beam below it", "a smaller cell_size, or a wider cap beam");
    material::Bearing::Parameters p;
    const double share = 1.0 / static_cast<double>(found.size());
    p.shear_stiffness = plan.bearing_stiffness * share;
    p.normal_stiffness = 100 * plan.bearing_stiffness * share;
    p.friction = plan.bearing_friction;
    p.seat_length = plan.bearing_seat;
    for (const Site& s : found) {
      const double y = std::clamp(mesh.local[s.deck_node].y(), cap.box.min().y(), cap.box.max().y());
      p.seat_across = {cap.box.min().y() - y, cap.box.max().y() - y};
      sites_.push_back(s), law_.emplace_back(p);
    }
  }
  old_.resize(sites_.size());
  next_ = old_;
  site_energy_.assign(sites_.size(), 0.0);
}

void Bearings::add_forces(const double* u, const std::vector<char>& live, double* f) {
  energy_ = dissipation_ = 0;
  for (std::size_t i = 0; i < sites_.size(); ++i) {
    const Site& s = sites_[i];
    next_[i] = old_[i];
    site_energy_[i] = 0;
    if (!live[s.deck_cell] || !live[s.cap_cell]) continue;
    Vec3 d(u[4 * s.deck_node], u[4 * s.deck_node + 1], u[4 * s.deck_node + 2]);
    for (int a = 0; a < 8; ++a) d -= s.weight[a] * Vec3(u[4 * s.cap_node[a]], u[4 * s.cap_node[a] + 1], u[4 * s.cap_node[a] + 2]);
    const auto r = law_[i](-d.dot(up_), {d.dot(along_), d.dot(across_)}, old_[i], next_[i]);
    site_energy_[i] = r.energy;
    energy_ += r.energy;
    dissipation_ += r.dissipation;
    const Vec3 on_deck = r.normal * up_ + r.shear[0] * along_ + r.shear[1] * across_;
    for (int c = 0; c < 3; ++c) {
      f[4 * s.deck_node + c] -= on_deck[c];
      for (int a = 0; a < 8; ++a) f[4 * s.cap_node[a] + c] += s.weight[a] * on_deck[c];
    }
  }
}

double Bearings::stored_at(const std::vector<int>& cells, const std::vector<char>& live) const {
  const std::set<int> among(cells.begin(), cells.end());
  double energy = 0;
  for (std::size_t i = 0; i < sites_.size(); ++i) {
    const Site& s = sites_[i];
    if (live[s.deck_cell] && live[s.cap_cell] && (among.count(s.deck_cell) || among.count(s.cap_cell))) energy += site_energy_[i];
  }
  return energy;
}

std::vector<Spring> Bearings::springs() const {
  std::vector<Spring> list;
  for (std::size_t i = 0; i < sites_.size(); ++i) {
    Spring spring;
    spring.node.push_back(sites_[i].deck_node);
    spring.weight.push_back(1);
    for (int a = 0; a < 8; ++a)
      if (sites_[i].weight[a] != 0) spring.node.push_back(sites_[i].cap_node[a]), spring.weight.push_back(-sites_[i].weight[a]);
    const auto& p = law_[i].parameters();
    spring.stiffness = p.normal_stiffness * up_ * up_.transpose() + p.shear_stiffness * (along_ * along_.transpose() + across_ * across_.transpose());
    list.push_back(std::move(spring));
  }
  return list;
}

std::vector<int> Bearings::nodes() const {
  std::vector<int> list;
  for (const Site& s : sites_) {
    list.push_back(s.deck_node);
    list.insert(list.end(), s.cap_node.begin(), s.cap_node.end());
  }
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  return list;
}

void Bearings::save(std::vector<double>& state) const {
  for (const auto& s : old_) state.insert(state.end(), {s.slip[0], s.slip[1], s.lost});
}

std::size_t Bearings::restore(std::span<const double> state) {
  if (state.size() < 3 * old_.size()) throw NumericalFailure("the saved bearings belong to another structure");
  for (std::size_t i = 0; i < old_.size(); ++i) old_[i].slip = {state[3 * i], state[3 * i + 1]}, old_[i].lost = state[3 * i + 2];
  next_ = old_;
  return 3 * old_.size();
}

}  // namespace talus::fem
