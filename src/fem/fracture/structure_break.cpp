// Erosion and fragments: what leaves the structure.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "fem/bearings/bearing_pads.hpp"
#include "fem/discretisation/hanging.hpp"
#include "fem/fracture/piece_shape.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {
// A cracked cell still closes, carries pressure along its cracks, and its bars hold: it is eroded only once it stands wide open,
// and as long as a bar in it holds, not before it is distorted beyond use.
constexpr double strain_limit = 0.5;     // strain at which a cell is eroded whatever its damage
constexpr double open_gap = 5e-3;        // with all points at the cap [m]
constexpr double torn_strain = 1;        // of a cell 1.7 times as long as it was: no solid to touch or to compute with, also where nothing is to erode
constexpr std::size_t least_piece = 2;   // cells; a single one is rubble
constexpr double least_volume = 1e-3;    // [m^3], and so is what a hand can hold
constexpr double least_share = 0.01;     // unless the structure is small itself: this share of its volume
constexpr double bent = 0.1;             // of a cell's edge: by so much less a piece may be deformed and is still given its planar faces
}  // namespace

std::array<double, 8> FemStructure::node_shares(int cell) const {
  std::array<double, 8> share{};
  for (int q = 0; q < 8; ++q) {
    const std::array<double, 8> n = shape_values(gauss_point(q));
    const double w = spec_.density * jacobian(mesh_, cell, gauss_point(q)).determinant();
    for (int a = 0; a < 8; ++a) share[a] += w * n[a];
  }
  return share;
}

double FemStructure::cell_energy(int cell) const {
  return damage_ && damage_->has(cell) ? damage_->stored(cell) : operator_->energy(cell);
}

double FemStructure::link_energy(const std::vector<int>& cells) const {
  double energy = bars_ ? bars_->stored_in(cells) : 0.0;
  if (bearings_ && first_rank()) energy += bearings_->stored_at(cells, live_);
  sum({&energy, 1});
  return energy;
}

void FemStructure::switch_off(int cell) {
  live_[cell] = 0;
  power_valid_ = false;
  forget_stiffness();
  operator_->set_on(cell, false);
  if (damage_) damage_->remove(cell);
  damage_shared_ = !partition_;
  for (int n : carriers(mesh_, cell)) --cells_at_node_[n];
}

/// Removes cells: their stored energy is booked, that of their bars and bearings too, and the mass of their nodes stays where other cells hold it. A node without cells would
/// fly on for ever: its mass is dust, and leaves with its motion. A free body keeps it, and with it its mass and momenta to the last digit.
void FemStructure::drop_orphans(const std::vector<int>& cells) {
  share_motion();
  const std::vector<double> energies = cell_energies(cells);
  const double links = link_energy(cells);
  books_.eroded_energy += links;
  stored_half_ -= links;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const int cell = cells[k];
    const double energy = energies[k];
    books_.eroded_energy += energy;
    stored_half_ -= energy;
    switch_off(cell);
    eroded_volume_ += cell_mass_[cell] / spec_.density;
  }
  if (supports_.nodes.empty()) return;
  for (int cell : cells)
    for (int n : carriers(mesh_, cell)) {
      if (cells_at_node_[n] > 0 || mass_[n] == 0) continue;
      const Vec3 v = velocity(n);
      books_.eroded_energy += 0.5 * mass_[n] * v.squaredNorm();
      dust_potential_ -= mass_[n] * gravity_.dot(position(n) - 0.5 * h_last_ * v);   // where it came off: its fall is not followed
      dust_mass_ += mass_[n];
      dust_momentum_ += mass_[n] * v;
      dust_spin_ += mass_[n] * position(n).cross(v);
      remove_node(n);
    }
}

void FemStructure::remove_node(int n) {
  mass_[n] = 0;
  weights_valid_ = false;
  for (int c = 0; c < 3; ++c) inverse_mass_[4 * n + c] = 0, v_[4 * n + c] = v_hat_[4 * n + c] = 0;
}

std::vector<int> FemStructure::spent_cells() const {
  const std::vector<char> none;
  if (!spec_.erosion) return damage_->spent(torn_strain, std::numeric_limits<double>::infinity(), none);
  return damage_->spent(strain_limit, open_gap, bars_ ? bars_->tied(live_.size()) : none);
}

void FemStructure::erode(const std::vector<int>& cells) {
  if (!spec_.erosion && eroded_volume_ == 0) report_(fmt::format("structure {}: cells torn to 1.7 times their length are removed, although erosion is off", spec_.name));
  drop_orphans(cells);
  ++breaks_;
  rebuild_skin();
}

/// Rubble that still hangs on nodes of others stays in the mesh: its cells carry pressure and no tension.
bool FemStructure::is_rubble(const std::vector<int>& piece) const {
  const double least = std::min(least_volume, least_share * std::accumulate(cell_mass_.begin(), cell_mass_.end(), 0.0) / spec_.density);
  double volume = 0;
  for (int cell : piece) volume += cell_mass_[cell] / spec_.density;
  return piece.size() < least_piece || volume < least;
}

Structure::Unsupported FemStructure::unsupported() {
  Unsupported lost;
  if (!damage_ && !bearings_) return lost;
  const long cuts = count_cuts();
  if (cuts == cuts_seen_) return lost;
  cuts_seen_ = cuts;
  share_motion();
  for (const std::vector<int>& piece : loose_pieces()) {
    if (is_rubble(piece)) continue;
    for (int cell : piece) {
      Vec3 middle = Vec3::Zero();
      for (int n : mesh_.hexes[cell]) middle += mesh_.nodes[n] / 8;
      lost.mass += cell_mass_[cell];
      lost.centroid += cell_mass_[cell] * middle;
    }
  }
  if (lost.mass > 0) lost.centroid /= lost.mass;
  lost.share = lost.mass / std::accumulate(cell_mass_.begin(), cell_mass_.end(), 0.0);
  return lost;
}

std::vector<Fragment> FemStructure::take_fragments() {
  if (!damage_ && !bearings_) return {};
  const long cuts = count_cuts();
  if (cuts == cuts_seen_) return {};
  cuts_seen_ = cuts;
  share_motion();
  std::vector<std::vector<int>> pieces = loose_pieces();
  const auto hangs = [&](const std::vector<int>& piece) {
    std::map<int, int> inside;
    for (int cell : piece)
      for (int n : carriers(mesh_, cell)) ++inside[n];
    return std::any_of(inside.begin(), inside.end(), [&](const auto& at) { return at.second < cells_at_node_[at.first]; });
  };
  std::erase_if(pieces, [&](const std::vector<int>& piece) { return is_rubble(piece) && hangs(piece); });
  if (pieces.empty()) return {};

  forces(time_);  // energies of the cells
  const std::vector<SeatedNode> seats = seated_nodes();   // a cap beam may come off before its deck
  std::vector<Fragment> fragments;
  for (const std::vector<int>& piece : pieces) {
    if (is_rubble(piece)) drop_orphans(piece);
    else fragments.push_back(detach(piece, seats));
  }
  cuts_seen_ = count_cuts();  // the parts that left took some of it along
  rebuild_skin();
  moved();
  return fragments;
}

std::vector<SeatedNode> FemStructure::seated_nodes() const {
  std::vector<SeatedNode> seats;
  if (!bearings_) return seats;
  for (std::size_t i = 0; i < bearings_->sites().size(); ++i) {
    const Bearings::Site& site = bearings_->sites()[i];
    if (!bearings_->holds(i) || !live_[site.deck_cell] || !live_[bearings_->cap_cell(i)]) continue;
    const Bearings::Foot& foot = bearings_->foot(i);
    Vec3 place = Vec3::Zero();
    for (std::size_t a = 0; a < 8; ++a) place += foot.weight[a] * position(foot.node[a]);
    seats.push_back({site.deck_node, site.deck_cell, 2 * site.deck + site.end, mesh_.local[site.deck_node].z() - site.place.z(), place});
  }
  return seats;
}

Fragment FemStructure::detach(const std::vector<int>& cells, const std::vector<SeatedNode>& seats) {
  Fragment f;
  std::map<int, double> share;  // node -> mass that leaves; of a hanging node that of what it follows
  std::map<int, int> inside;    // node -> cells of the piece
  f.elastic = link_energy(cells);
  for (const double energy : cell_energies(cells)) f.elastic += energy;
  for (int cell : cells) {
    const std::array<double, 8> m = node_shares(cell);
    for (int a = 0; a < 8; ++a) {
      const int n = mesh_.hexes[cell][a];
      const HangingNode* h = hanging_node(mesh_, n);
      share[n] += h != nullptr ? 0 : m[a];
      if (h != nullptr)
        for (const auto& [master, weight] : h->masters) share[master] += weight * m[a];
    }
    for (int n : carriers(mesh_, cell)) ++inside[n];
    detached_volume_ += cell_mass_[cell] / spec_.density;
  }
  for (auto& [n, m] : share) {
    // Steel and rounding: a node that keeps no cell gives all it has.
    if (inside.at(n) == cells_at_node_[n]) m = mass_[n];
    const Vec3 x = position(n), v = velocity(n);
    f.mass += m;
    f.centroid += m * x;
    f.linear_momentum += m * v;
    f.kinetic += 0.5 * m * v.squaredNorm();
  }
  f.centroid /= f.mass;
  for (const auto& [n, m] : share) f.angular_momentum += m * (position(n) - f.centroid).cross(velocity(n));
  std::vector<char> only(mesh_.hexes.size(), 0);
  for (int cell : cells) only[cell] = 1;
  std::vector<SkinQuad> quads = skin(mesh_, only);
  std::vector<Vec3> reference, present;
  std::vector<double> weight;
  std::map<int, std::size_t> at;
  for (const auto& [n, m] : share) {
    at.emplace(n, at.size());
    reference.push_back(mesh_.nodes[n]);
    present.push_back(position(n));
    weight.push_back(m);
  }
  double smallest = std::numeric_limits<double>::infinity();
  for (int cell : cells) smallest = std::min(smallest, cell_mass_[cell] / spec_.density);
  std::vector<Vec3> points = straightened(reference, present, weight, bent * std::cbrt(smallest));
  std::vector<SeatedNode> seated;
  std::copy_if(seats.begin(), seats.end(), std::back_inserter(seated), [&](const SeatedNode& s) { return only[s.cell]; });
  stand_on_pads(mesh_, seated, quads, at, points);
  quads = cut_at_middles(mesh_, quads);
  const ClosedSurface surface = close_surface(quads);
  for (int n : surface.node) f.vertices.push_back(points[at.at(n)]);
  std::vector<int> cell;   // of each triangle
  for (std::size_t q = 0; q < quads.size(); ++q) {
    const auto& v = surface.quad[q];
    f.triangles.push_back({v[0], v[1], v[2]});
    if (v[3] != v[2]) f.triangles.push_back({v[0], v[2], v[3]});
    cell.resize(f.triangles.size(), quads[q].cell);
  }
  part_touching_edges(f.vertices, f.triangles, std::move(cell));
  merge_planar(f.vertices, f.triangles);
  for (int cell : cells) switch_off(cell);
  for (const auto& [n, m] : share) {
    if (cells_at_node_[n] == 0) {
      remove_node(n);
      continue;
    }
    mass_[n] -= m;
    weights_valid_ = false;
    for (int c = 0; c < 3; ++c)
      if (inverse_mass_[4 * n + c] > 0) inverse_mass_[4 * n + c] = 1 / mass_[n];
  }
  stored_half_ -= f.elastic;
  books_.eroded_energy += f.elastic;   // as of a cell that erodes
  books_.algorithmic += 0.5 * h_last_ * gravity_.dot(f.linear_momentum);   // the structure's potential is that of half steps, the block's that of its place
  report_(fmt::format("structure {}: {} cells came off, {:.4g} kg", spec_.name, cells.size(), f.mass));
  return f;
}

}  // namespace talus::fem
