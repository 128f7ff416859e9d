// Erosion and fragments: what leaves the structure.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "fem/piece_shape.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {
// A cracked cell still closes, carries pressure along its cracks, and its bars hold: it is eroded only once it stands wide open,
// and as long as a bar in it holds, not before it is distorted beyond use.
constexpr double strain_limit = 0.5;     // strain at which a cell is eroded whatever its damage
constexpr double open_gap = 5e-3;        // with all points at the cap [m]
constexpr double cut_damage = 0.99;      // a face is cut when both sides are damaged beyond this in every point
// and stand apart along its normal: a crack of 1 mm has no cohesion left (that ends near 0.2 mm) and little interlock.
constexpr double cut_opening = 1e-3;     // [m]
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

double FemStructure::steel_energy(const std::vector<int>& cells) const {
  double energy = bars_ ? bars_->stored_in(cells) : 0.0;
  sum({&energy, 1});
  return energy;
}

void FemStructure::switch_off(int cell) {
  live_[cell] = 0;
  operator_->set_on(cell, false);
  if (damage_) damage_->remove(cell);
  damage_shared_ = !partition_;
  for (int n : mesh_.hexes[cell]) --cells_at_node_[n];
}

/// Removes cells: their stored energy is booked, that of their bars too, and the mass of their nodes stays where other cells hold it. A node without cells would
/// fly on for ever: its mass is dust, and leaves with its motion. A free body keeps it, and with it its mass and momenta to the last digit.
void FemStructure::drop_orphans(const std::vector<int>& cells) {
  share_motion();
  const std::vector<double> energies = cell_energies(cells);
  const double steel = steel_energy(cells);
  books_.eroded_energy += steel;
  stored_half_ -= steel;
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
    for (int n : mesh_.hexes[cell]) {
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
  std::vector<int> cells = damage_->spent(strain_limit, open_gap, {});
  if (cells.empty() || !bars_) return cells;
  std::vector<char> kept(live_.size(), 0);
  bars_->ties([&](int a, int b) { kept[a] = kept[b] = 1; });
  return damage_->spent(strain_limit, open_gap, kept);
}

void FemStructure::erode(const std::vector<int>& cells) {
  drop_orphans(cells);
  ++breaks_;
  rebuild_skin();
}

std::vector<Fragment> FemStructure::take_fragments() {
  if (!damage_ && !bearings_) return {};
  // Only when cracks or bearings changed: count what may cut.
  const auto count = [&] {
    long cuts = breaks_ * 1'000'000'000L;  // apart from the count: an eroded cell leaves it
    double cracked = 0;
    if (damage_)
      for (int cell : damage_->cells()) cracked += own_cell(cell) && damage_->tension_least(cell) > cut_damage ? 1 : 0;
    sum({&cracked, 1});
    cuts += static_cast<long>(cracked);
    if (bearings_)
      for (std::size_t i = 0; i < bearings_->sites().size(); ++i) cuts += bearings_->holds(i) ? 0 : 1;
    return cuts;
  };
  const long cuts = count();
  if (cuts == cuts_seen_) return {};
  cuts_seen_ = cuts;
  share_motion();
  const DamageField* cracks = damage_ ? &history() : nullptr;

  const int cells = static_cast<int>(mesh_.hexes.size());
  std::vector<int> parent(cells);
  for (int i = 0; i < cells; ++i) parent[i] = i;
  const auto root = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto join = [&](int a, int b) {
    a = root(a), b = root(b);
    if (a != b) parent[std::max(a, b)] = std::min(a, b);
  };
  const auto gradient_at_centre = [&](int cell) {
    const Mat3 inverse_t = jacobian(mesh_, cell, Vec3::Zero()).inverse().transpose();
    const std::array<Vec3, 8> g = shape_gradients(Vec3::Zero());
    Mat3 h = Mat3::Zero();
    for (int a = 0; a < 8; ++a) {
      const int n = 4 * mesh_.hexes[cell][a];
      h += Vec3(u_[n], u_[n + 1], u_[n + 2]) * (inverse_t * g[a]).transpose();
    }
    return h;
  };
  // How far the two halves beside a face have moved apart along its normal [m].
  const auto opening = [&](int a, int b, int face) {
    const int* f = hex_faces[face];
    const auto& hex = mesh_.hexes[a];
    const Vec3 normal = (mesh_.nodes[hex[f[2]]] - mesh_.nodes[hex[f[0]]]).cross(mesh_.nodes[hex[f[3]]] - mesh_.nodes[hex[f[1]]]).normalized();
    double sum = 0;
    for (int cell : {a, b}) {
      const Mat3 h = gradient_at_centre(cell);
      const double extent = 2 * (jacobian(mesh_, cell, Vec3::Zero()).transpose() * normal).cwiseAbs().sum();
      sum += 0.5 * extent * (normal.dot(h * normal) + 0.5 * (h * normal).squaredNorm());
    }
    return sum;
  };
  for (int cell = 0; cell < cells; ++cell) {
    if (!live_[cell]) continue;
    for (int face = 0; face < 6; ++face) {
      const int other = neighbours_[cell][face];
      if (other < cell || !live_[other]) continue;
      const bool cut = cracks && cracks->has(cell) && cracks->has(other) && cracks->tension_least(cell) > cut_damage &&
                       cracks->tension_least(other) > cut_damage && opening(cell, other, face) > cut_opening;
      if (!cut) join(cell, other);
    }
  }
  if (bars_) bars_->ties([&](int a, int b) {
    if (live_[a] && live_[b]) join(a, b);
  });
  if (bearings_) {
    // A piece of deck rests on its cap beams only if it reaches bearings at both ends; with one end off its seat it falls.
    const auto& sites = bearings_->sites();
    std::map<int, std::map<int, std::array<bool, 2>>> reached;  // deck, piece -> ends
    for (std::size_t i = 0; i < sites.size(); ++i)
      if (bearings_->holds(i) && live_[sites[i].deck_cell] && live_[sites[i].cap_cell]) reached[sites[i].deck][root(sites[i].deck_cell)][sites[i].end] = true;
    std::vector<std::pair<int, int>> pairs;
    for (std::size_t i = 0; i < sites.size(); ++i) {
      if (!bearings_->holds(i) || !live_[sites[i].deck_cell] || !live_[sites[i].cap_cell]) continue;
      const std::array<bool, 2>& ends = reached[sites[i].deck][root(sites[i].deck_cell)];
      if (ends[0] && ends[1]) pairs.emplace_back(sites[i].deck_cell, sites[i].cap_cell);
    }
    for (const auto& [deck, cap] : pairs) join(deck, cap);
  }
  std::vector<char> supported(cells, 0);
  for (int cell = 0; cell < cells; ++cell) {
    if (!live_[cell]) continue;
    for (int n : mesh_.hexes[cell])
      if (supports_.held[n][0] || supports_.held[n][1] || supports_.held[n][2]) supported[root(cell)] = 1;
  }
  const bool free_body = supports_.nodes.empty();
  // A free body keeps its largest part as itself.
  if (free_body) {
    std::vector<double> mass(cells, 0.0);
    for (int cell = 0; cell < cells; ++cell)
      if (live_[cell]) mass[root(cell)] += cell_mass_[cell];
    supported[std::max_element(mass.begin(), mass.end()) - mass.begin()] = 1;
  }
  std::map<int, std::vector<int>> parts;
  for (int cell = 0; cell < cells; ++cell)
    if (live_[cell] && !supported[root(cell)]) parts[root(cell)].push_back(cell);
  // Rubble that still hangs on nodes of others stays in the mesh: its cells carry pressure and no tension.
  const double least = std::min(least_volume, least_share * std::accumulate(cell_mass_.begin(), cell_mass_.end(), 0.0) / spec_.density);
  const auto small = [&](const std::vector<int>& part) {
    double volume = 0;
    for (int cell : part) volume += cell_mass_[cell] / spec_.density;
    return part.size() < least_piece || volume < least;
  };
  const auto hangs = [&](const std::vector<int>& part) {
    std::map<int, int> inside;
    for (int cell : part)
      for (int n : mesh_.hexes[cell]) ++inside[n];
    return std::any_of(inside.begin(), inside.end(), [&](const auto& at) { return at.second < cells_at_node_[at.first]; });
  };
  std::erase_if(parts, [&](const auto& part) { return small(part.second) && hangs(part.second); });
  if (parts.empty()) return {};

  forces(time_);  // energies of the cells
  std::vector<Fragment> fragments;
  for (const auto& [first, list] : parts) {
    if (small(list)) drop_orphans(list);
    else fragments.push_back(detach(list));
  }
  cuts_seen_ = count();  // the parts that left took some of it along
  rebuild_skin();
  moved();
  return fragments;
}

Fragment FemStructure::detach(const std::vector<int>& cells) {
  Fragment f;
  std::map<int, double> share;  // node -> mass that leaves
  f.elastic = steel_energy(cells);
  for (const double energy : cell_energies(cells)) f.elastic += energy;
  for (int cell : cells) {
    const std::array<double, 8> m = node_shares(cell);
    for (int a = 0; a < 8; ++a) share[mesh_.hexes[cell][a]] += m[a];
    detached_volume_ += cell_mass_[cell] / spec_.density;
  }
  for (auto& [n, m] : share) {
    // Steel and rounding: a node that keeps no cell gives all it has.
    int inside = 0;
    for (int cell : cells) inside += std::count(mesh_.hexes[cell].begin(), mesh_.hexes[cell].end(), n) > 0;
    if (inside == cells_at_node_[n]) m = mass_[n];
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
  const ClosedSurface surface = close_surface(skin(mesh_, neighbours_, only));
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
  const std::vector<Vec3> points = straightened(reference, present, weight, bent * std::cbrt(smallest));
  for (int n : surface.node) f.vertices.push_back(points[at.at(n)]);
  for (const auto& v : surface.quad) {
    f.triangles.push_back({v[0], v[1], v[2]});
    f.triangles.push_back({v[0], v[2], v[3]});
  }
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
