#include "fem/bearings/bearings.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/reject.hpp"

namespace talus::fem {

namespace {

/// The upper cells of a part of the mesh.
std::vector<int> cells_below(const HexMesh& mesh, int part, double top) {
  std::vector<int> cells;
  for (int c = 0; c < static_cast<int>(mesh.hexes.size()); ++c)
    if (mesh.component[c] == part && std::abs(mesh.local[mesh.hexes[c][6]].z() - top) <= 1e-6)
      cells.push_back(c);
  return cells;
}

}  // namespace

Bearings::Cap::Cap(const HexMesh& mesh, int part, double top) : Cap(mesh, cells_below(mesh, part, top)) {}

Bearings::Cap::Cap(const HexMesh& mesh, std::vector<int> cells) : cell(std::move(cells)) {
  for (const int c : cell) {
    hexes.push_back(mesh.hexes[c]);
    for (int n : mesh.hexes[c]) box.extend(mesh.local[n]);
  }
  search = rebar::host_search(mesh.local, hexes);
}

Bearings::Foot Bearings::Cap::foot(const HexMesh& mesh, const Vec3& place) const {
  Foot foot;
  const Vec3 on_cap = place.cwiseMax(box.min()).cwiseMin(box.max());
  const auto host = search(on_cap);
  if (!host) return foot;
  foot.cell = cell[static_cast<std::size_t>(host->cell)];
  foot.node = hexes[static_cast<std::size_t>(host->cell)];
  foot.weight = shape_values(host->xi);
  const std::array<Vec3, 8> reference = shape_gradients(host->xi);
  const Mat3 inverse = TrilinearMap(mesh.local, foot.node).jacobian(host->xi).inverse();
  for (int k = 0; k < 2; ++k)
    for (std::size_t a = 0; a < 8; ++a)
      foot.gradient[static_cast<std::size_t>(k)][a] =
          on_cap[k] == place[k] ? reference[a].dot(inverse.col(k)) : 0.0;
  return foot;
}

Bearings::Bearings(const StructureSpec& spec, const HexMesh& mesh, const ViaductPlan& plan) : mesh_(&mesh) {
  const Mat3 axes =
      spec.rotation * plan.parts.front().turn;  // of the cap beams: a deck slides off their edges
  along_ = axes.col(0);
  across_ = axes.col(1);
  up_ = axes.col(2);
  std::vector<int> cell_of(mesh.nodes.size(), -1), part_of(mesh.nodes.size(), -1);
  for (int cell = static_cast<int>(mesh.hexes.size()) - 1; cell >= 0; --cell)
    for (int n : mesh.hexes[cell]) cell_of[n] = cell, part_of[n] = mesh.component[cell];
  const auto bents = static_cast<int>(
      std::count_if(plan.parts.begin(), plan.parts.end(), [](const auto& part) { return part.deck < 0; }));
  for (const ViaductPlan::Pad& pad : plan.pads) {
    const int deck_part = bents + pad.deck, cap_part = pad.deck + pad.end;
    const ViaductPlan::Part &deck = plan.parts[static_cast<std::size_t>(deck_part)],
                            &bent = plan.parts[static_cast<std::size_t>(cap_part)];
    const double top = bent.boxes.back().max().z();
    std::vector<int> nodes, nearest;  // of a pad between two lines of nodes all that are nearest
    double best = INFINITY;
    for (int n = 0; n < static_cast<int>(mesh.nodes.size()); ++n) {
      if (part_of[n] != deck_part || std::abs(mesh.local[n].z() - pad.at.z()) > 1e-6) continue;
      const Vec3 d = mesh.local[n] - pad.at;
      if (std::abs(d.x()) <= pad.length / 2 + 1e-9 && std::abs(d.y()) <= pad.width / 2 + 1e-9)
        nodes.push_back(n);
      const double distance = std::hypot(d.x(), d.y());
      if (distance < best - 1e-9) best = distance, nearest.clear();
      if (distance <= best + 1e-9) nearest.push_back(n);
    }
    if (nodes.empty()) nodes = nearest;
    const Cap& cap = caps_.try_emplace(cap_part, mesh, cap_part, top).first->second;
    std::vector<Site> found;
    for (int n : nodes) {
      const Vec3 on_cap = bent.own(deck.placed(mesh.local[n]));
      Site site{pad.deck,         pad.end, n, cell_of[n], cap_part, Vec3(on_cap.x(), on_cap.y(), top),
                on_cap.z() - top, {}};
      site.built = cap.foot(mesh, site.place);
      if (site.built.cell >= 0) found.push_back(site);
    }
    if (found.empty())
      reject("structure." + spec.name + ".bearing", "",
             "a bearing finds no node of the deck or no cap beam below it",
             "a smaller cell_size, or a wider cap beam");
    material::Bearing::Parameters p;
    const double share = 1.0 / static_cast<double>(found.size());
    p.shear_stiffness = plan.bearing_stiffness * share;
    p.normal_stiffness = 100 * plan.bearing_stiffness * share;
    p.friction = plan.bearing_friction;
    p.seat_along = {
        -INFINITY,
        INFINITY};  // away from its span an end comes to lie on the cap beam with more of its length
    (pad.end == 0 ? p.seat_along[1] : p.seat_along[0]) =
        pad.end == 0 ? plan.bearing_seat : -plan.bearing_seat;
    for (const Site& s : found) {
      const double y = std::clamp(s.place.y(), cap.box.min().y(), cap.box.max().y());
      p.seat_across = {cap.box.min().y() - y, cap.box.max().y() - y};
      sites_.push_back(s), foot_.push_back(s.built), law_.emplace_back(p);
    }
  }
  old_.resize(sites_.size());
  next_ = old_;
  site_energy_.assign(sites_.size(), 0.0);
}

void Bearings::divide(const Partition& partition, const HexMesh& part) {
  const auto here = [&](Foot& foot) {
    foot.cell = partition.cell_here(foot.cell);
    for (int& n : foot.node) n = partition.node_here(n);
  };
  mesh_ = &part;
  std::map<int, std::vector<int>> cells;
  for (const auto& [number, cap] : caps_) cells[number] = partition.cells_here(cap.cell);
  caps_.clear();
  for (auto& [number, list] : cells) caps_.try_emplace(number, part, std::move(list));
  for (Site& s : sites_) {
    s.deck_node = partition.node_here(s.deck_node), s.deck_cell = partition.cell_here(s.deck_cell);
    here(s.built);
  }
  for (Foot& foot : foot_) here(foot);
}

void Bearings::add_forces(const double* u, const std::vector<char>& live, double* f) {
  energy_ = dissipation_ = 0;
  for (std::size_t i = 0; i < sites_.size(); ++i) {
    const Site& s = sites_[i];
    const Foot& foot = foot_[i];
    next_[i] = old_[i];
    site_energy_[i] = 0;
    if (!live[s.deck_cell] || !live[foot.cell]) continue;
    Vec3 d(u[4 * s.deck_node], u[4 * s.deck_node + 1], u[4 * s.deck_node + 2]);
    std::array<double, 2> slope{};
    for (std::size_t a = 0; a < 8; ++a) {
      const Vec3 there(u[4 * foot.node[a]], u[4 * foot.node[a] + 1], u[4 * foot.node[a] + 2]);
      d -= foot.weight[a] * there;
      for (std::size_t k = 0; k < 2; ++k) slope[k] += foot.gradient[k][a] * there.dot(up_);
    }
    const auto r = law_[i](-d.dot(up_), {d.dot(along_), d.dot(across_)}, old_[i], next_[i], slope);
    site_energy_[i] = r.energy;
    energy_ += r.energy;
    dissipation_ += r.dissipation;
    const Vec3 on_deck = r.normal * up_ + r.shear[0] * along_ + r.shear[1] * across_;
    for (int c = 0; c < 3; ++c) {
      f[4 * s.deck_node + c] -= on_deck[c];
      for (std::size_t a = 0; a < 8; ++a) f[4 * foot.node[a] + c] += foot.weight[a] * on_deck[c];
    }
  }
}

void Bearings::move_foot(std::size_t i) {
  const Site& s = sites_[i];
  const Foot foot = caps_.at(s.cap).foot(*mesh_, s.place + Vec3(old_[i].slip[0], old_[i].slip[1], 0));
  if (foot.cell >= 0) foot_[i] = foot;
}

int Bearings::ends_unseated(int deck) const {
  std::array<bool, 2> held{};
  for (std::size_t i = 0; i < sites_.size(); ++i)
    if (sites_[i].deck == deck && holds(i)) held[static_cast<std::size_t>(sites_[i].end)] = true;
  return static_cast<int>(!held[0]) + static_cast<int>(!held[1]);
}

void Bearings::accept() {
  for (std::size_t i = 0; i < sites_.size(); ++i) {
    const bool slid = next_[i].slip != old_[i].slip;
    old_[i] = next_[i];
    if (slid) move_foot(i);
  }
}

double Bearings::stored_at(const std::vector<int>& cells, const std::vector<char>& live) const {
  const std::set<int> among(cells.begin(), cells.end());
  double energy = 0;
  for (std::size_t i = 0; i < sites_.size(); ++i) {
    const int deck = sites_[i].deck_cell, cap = foot_[i].cell;
    if (live[deck] && live[cap] && (among.count(deck) || among.count(cap))) energy += site_energy_[i];
  }
  return energy;
}

std::vector<Spring> Bearings::springs() const {
  std::vector<Spring> list;
  for (std::size_t i = 0; i < sites_.size(); ++i) {
    Spring spring;
    spring.node.push_back(sites_[i].deck_node);
    spring.weight.push_back(1);
    const Foot& foot = sites_[i].built;
    for (std::size_t a = 0; a < 8; ++a)
      if (foot.weight[a] != 0) spring.node.push_back(foot.node[a]), spring.weight.push_back(-foot.weight[a]);
    const auto& p = law_[i].parameters();
    spring.stiffness = p.normal_stiffness * up_ * up_.transpose() +
                       p.shear_stiffness * (along_ * along_.transpose() + across_ * across_.transpose());
    list.push_back(std::move(spring));
  }
  return list;
}

std::vector<int> Bearings::cells() const {
  std::set<int> list;
  for (const Site& s : sites_) list.insert(s.deck_cell);
  for (const auto& [part, cap] : caps_) list.insert(cap.cell.begin(), cap.cell.end());
  return {list.begin(), list.end()};
}

std::vector<int> Bearings::nodes() const {
  std::set<int> list;
  for (const Site& s : sites_) list.insert(s.deck_node);
  for (const auto& [part, cap] : caps_)
    for (const auto& hex : cap.hexes) list.insert(hex.begin(), hex.end());
  return {list.begin(), list.end()};
}

void Bearings::save(std::vector<double>& state) const {
  for (const auto& s : old_) state.insert(state.end(), {s.slip[0], s.slip[1], s.lost});
}

void Bearings::restore(StateReader& state) {
  for (std::size_t i = 0; i < old_.size(); ++i) {
    old_[i].slip = {state.next(), state.next()};
    old_[i].lost = state.next();
    foot_[i] = sites_[i].built;
    if (old_[i].slip != std::array<double, 2>{}) move_foot(i);
  }
  next_ = old_;
}

}  // namespace talus::fem
