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
// A cracked cell carries pressure along its cracks and across them once they close, and its bars hold:
// however wide it stands open, it goes only when it is crushed, too, or when what it parts comes off
// (structure_pieces.cpp).
constexpr double open_gap = 5e-3;  // of what is cracked and crushed [m]
// No solid to touch or to compute with, also where nothing is to erode:
constexpr double torn_strain = 1;       // of a cell 1.7 times as long as it was
constexpr double flat_volume = 0.1;     // of what it was: next to inside out
constexpr std::size_t least_piece = 2;  // cells; a single one is rubble
constexpr double least_volume = 1e-3;   // [m^3], and so is what a hand can hold
constexpr double least_share = 0.01;    // unless the structure is small itself: this share of its volume
constexpr double bent =
    0.1;  // of a cell's edge: by so much less a piece may be deformed and is still given its planar faces
}  // namespace

namespace {

/// Masses of a cell at its corners.
std::array<double, 8> node_shares(const HexMesh& mesh, int cell, double density) {
  std::array<double, 8> share{};
  for (int q = 0; q < 8; ++q) {
    const std::array<double, 8> n = shape_values(gauss_point(q));
    const double w = density * jacobian(mesh, cell, gauss_point(q)).determinant();
    for (int a = 0; a < 8; ++a) share[a] += w * n[a];
  }
  return share;
}

}  // namespace

double FemStructure::cell_energy(int cell) const {
  return damage_ && damage_->has(cell) ? damage_->stored(cell) : operator_->energy(cell);
}

std::vector<double> FemStructure::of_cells(const std::vector<int>& cells, std::size_t width,
                                           const std::function<void(int, double*)>& write) const {
  std::vector<double> values(width * cells.size(), 0.0);
  for (std::size_t k = 0; k < cells.size(); ++k)
    if (const int cell = cell_here(cells[k]); cell >= 0 && own_cell(cell)) write(cell, &values[width * k]);
  sum(values);
  return values;
}

double FemStructure::link_energy(const std::vector<int>& cells) const {
  const std::vector<int> here = partition_ ? partition_->cells_here(cells) : cells;
  double energy = bars_ ? bars_->stored_in(here) : 0.0;
  if (bearings_ && first_rank()) energy += bearings_->stored_at(here, live_);
  sum({&energy, 1});
  return energy;
}

void FemStructure::switch_off(const std::vector<int>& cells) {
  power_valid_ = false;
  forget_stiffness();
  for (const int whole : cells) {
    const int cell = cell_here(whole);
    if (cell < 0) continue;
    live_[cell] = 0;
    operator_->set_on(cell, false);
    if (damage_) damage_->remove(cell);
    for (int n : carriers(mesh_, cell)) --cells_at_node_[n];
  }
  if (partition_) partition_->exchange_numbers(cells_at_node_);
}

/// Removes cells: their stored energy is accounted for, that of their bars and bearings too, and the mass of
/// their nodes stays where other cells hold it. A node without cells would fly on for ever: its mass is dust,
/// and leaves with its motion. A free body keeps it, and with it its mass and momenta to the last digit.
void FemStructure::drop_orphans(const std::vector<int>& cells) {
  const std::vector<double> values = of_cells(
      cells, 2, [this](int cell, double* to) { to[0] = cell_energy(cell), to[1] = cell_mass_[cell]; });
  const double links = link_energy(cells);
  books_.eroded_energy += links;
  stored_half_ -= links;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    books_.eroded_energy += values[2 * k];
    stored_half_ -= values[2 * k];
    eroded_volume_ += values[2 * k + 1] / spec_.density;
  }
  switch_off(cells);
  if (supports_.none) return;
  // Node by node in the order of the cells, each told of by its owner: mass, place, velocity.
  constexpr std::size_t width = 7;
  std::vector<double> dust;
  for (const int whole : cells) {
    const int cell = cell_here(whole);
    const std::vector<int> nodes = cell >= 0 ? carriers(mesh_, cell) : std::vector<int>(8, -1);
    for (const int n : nodes) {
      dust.resize(dust.size() + width, 0.0);
      if (n < 0 || cells_at_node_[n] > 0 || mass_[n] == 0) continue;
      if (own_node(n)) {
        double* const to = dust.data() + dust.size() - width;
        to[0] = mass_[n];
        Eigen::Map<Vec3>(to + 1) = position(n);
        Eigen::Map<Vec3>(to + 4) = velocity(n);
      }
      remove_node(n);
    }
  }
  sum(dust);
  for (std::size_t at = 0; at < dust.size(); at += width) {
    const double mass = dust[at];
    if (mass == 0) continue;
    const Vec3 x(&dust[at + 1]), v(&dust[at + 4]);
    books_.eroded_energy += 0.5 * mass * v.squaredNorm();
    dust_potential_ -=
        mass * gravity_.dot(x - 0.5 * h_last_ * v);  // where it came off: its fall is not followed
    dust_mass_ += mass;
    dust_momentum_ += mass * v;
    dust_spin_ += mass * x.cross(v);
  }
}

void FemStructure::remove_node(int n) {
  mass_[n] = 0;
  weights_valid_ = false;
  for (int c = 0; c < 3; ++c) inverse_mass_[4 * n + c] = 0, v_[4 * n + c] = v_hat_[4 * n + c] = 0;
}

std::vector<int> FemStructure::spent_cells() const {
  const std::vector<char> none;
  return damage_->spent(
      {flat_volume, torn_strain, spec_.erosion ? open_gap : std::numeric_limits<double>::infinity()},
      bars_ ? bars_->tied(live_.size()) : none);
}

void FemStructure::erode(const std::vector<int>& cells) {
  if (!spec_.erosion && eroded_volume_ == 0)
    report_(
        fmt::format("structure {}: cells torn to 1.7 times their length or crushed flat are removed, "
                    "although erosion is off",
                    spec_.name));
  drop_orphans(cells);
  ++breaks_;
  rebuild_skin();
}

/// Rubble that still shares nodes with others stays in the mesh: its cells carry pressure and no tension.
bool FemStructure::is_rubble(const std::vector<int>& piece) const {
  const double least = std::min(least_volume, least_share * mass_of_cells_ / spec_.density);
  double volume = 0;
  for (const double mass : of_cells(piece, 1, [this](int cell, double*to) { *to = cell_mass_[cell]; }))
    volume += mass / spec_.density;
  return piece.size() < least_piece || volume < least;
}

Structure::Unsupported FemStructure::unsupported() {
  Unsupported lost;
  if (!damage_ && !bearings_) return lost;
  const long cuts = count_cuts();
  if (cuts == cuts_seen_) return lost;
  cuts_seen_ = cuts;
  for (const std::vector<int>& piece : loose_pieces()) {
    if (is_rubble(piece)) continue;
    const std::vector<double> values = of_cells(piece, 4, [this](int cell, double* to) {
      Vec3 middle = Vec3::Zero();
      for (int n : mesh_.hexes[cell]) middle += mesh_.nodes[n] / 8;
      to[0] = cell_mass_[cell];
      Eigen::Map<Vec3>(to + 1) = cell_mass_[cell] * middle;
    });
    for (std::size_t at = 0; at < values.size(); at += 4)
      lost.mass += values[at], lost.centroid += Vec3(&values[at + 1]);
  }
  if (lost.mass > 0) lost.centroid /= lost.mass;
  lost.share = lost.mass / mass_of_cells_;
  return lost;
}

/// Cells of the whole mesh, with what a piece needs of them and of their nodes, from the ranks that own them.
FemStructure::Excerpt FemStructure::excerpt(const std::vector<int>& cells) const {
  Excerpt e;
  const auto node = [&](int n) { return partition_ ? partition_->whole_node(n) : n; };
  const std::vector<double> of_cell = of_cells(cells, 9, [&](int cell, double* to) {
    for (const int n : mesh_.hexes[cell]) *to++ = node(n);
    *to = cell_mass_[cell];
  });
  for (std::size_t at = 0; at < of_cell.size(); at += 9)
    for (std::size_t a = 0; a < 8; ++a) e.node.push_back(static_cast<int>(of_cell[at + a]));
  std::vector<int> corners = e.node;
  std::sort(e.node.begin(), e.node.end());
  e.node.erase(std::unique(e.node.begin(), e.node.end()), e.node.end());
  for (std::size_t at = 0, k = 0; at < of_cell.size(); at += 9) {
    std::array<int, 8>& hex = e.mesh.hexes.emplace_back();
    for (int& n : hex) n = e.place(corners[k++]);
    e.cell_mass.push_back(of_cell[at + 8]);
  }
  constexpr std::size_t width = 14;
  std::vector<double> of_node(width * e.node.size(), 0.0);
  for (std::size_t k = 0; k < e.node.size(); ++k) {
    const int n = node_here(e.node[k]);
    if (n < 0 || !own_node(n)) continue;
    double* const to = &of_node[width * k];
    const Vec3 places[4] = {mesh_.nodes[n], mesh_.local[n], position(n), velocity(n)};
    for (int i = 0; i < 4; ++i) std::copy_n(places[i].data(), 3, to + 3 * i);
    to[12] = mass_[n], to[13] = cells_at_node_[n];
  }
  sum(of_node);
  for (std::size_t at = 0; at < of_node.size(); at += width) {
    e.mesh.nodes.emplace_back(&of_node[at]), e.mesh.local.emplace_back(&of_node[at + 3]);
    e.position.emplace_back(&of_node[at + 6]), e.velocity.emplace_back(&of_node[at + 9]);
    e.mass.push_back(of_node[at + 12]);
    e.cells_at_node.push_back(static_cast<int>(of_node[at + 13]));
  }
  std::map<std::array<int, 4>, std::pair<std::size_t, std::size_t>> open;  // faces that have one cell yet
  e.mesh.across.assign(e.mesh.hexes.size(), {-1, -1, -1, -1, -1, -1});
  for (std::size_t cell = 0; cell < e.mesh.hexes.size(); ++cell)
    for (std::size_t face = 0; face < 6; ++face) {
      std::array<int, 4> nodes;
      for (std::size_t i = 0; i < 4; ++i)
        nodes[i] = e.mesh.hexes[cell][static_cast<std::size_t>(hex_faces[face][i])];
      std::sort(nodes.begin(), nodes.end());
      const auto [mate, alone] = open.emplace(nodes, std::pair(cell, face));
      if (alone) continue;
      e.mesh.across[cell][face] = static_cast<int>(mate->second.first);
      e.mesh.across[mate->second.first][mate->second.second] = static_cast<int>(cell);
      open.erase(mate);
    }
  return e;
}

int FemStructure::Excerpt::place(int whole) const {
  const auto at = std::lower_bound(node.begin(), node.end(), whole);
  return at == node.end() || *at != whole ? -1 : static_cast<int>(at - node.begin());
}

std::vector<Fragment> FemStructure::take_fragments() {
  if (!damage_ && !bearings_) return {};
  const long cuts = count_cuts();
  if (cuts == cuts_seen_) return {};
  cuts_seen_ = cuts;
  std::vector<std::vector<int>> pieces = loose_pieces();
  const auto hangs = [&](const std::vector<int>& piece) {
    std::map<int, int> inside;  // cells of the piece
    const auto hanging = [&](const auto& cells_at) {
      return std::any_of(inside.begin(), inside.end(), [&](const auto& at) {
        return at.second < cells_at[static_cast<std::size_t>(at.first)];
      });
    };
    if (!partition_) {
      for (int cell : piece)
        for (int n : carriers(mesh_, cell)) ++inside[n];
      return hanging(cells_at_node_);
    }
    const Excerpt e = excerpt(piece);
    for (const auto& hex : e.mesh.hexes)
      for (int n : hex) ++inside[n];
    return hanging(e.cells_at_node);
  };
  std::erase_if(pieces, [&](const std::vector<int>& piece) { return is_rubble(piece) && hangs(piece); });
  if (pieces.empty()) return {};

  forces(time_);  // energies of the cells
  drop_orphans(parted_beside(pieces));
  const std::vector<SeatedNode> seats = seated_nodes();  // a cap beam may come off before its deck
  std::vector<Fragment> fragments;
  for (const std::vector<int>& piece : pieces) {
    if (is_rubble(piece))
      drop_orphans(piece);
    else
      fragments.push_back(detach(piece, seats));
  }
  ++breaks_;
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
    seats.push_back({partition_ ? partition_->whole_node(site.deck_node) : site.deck_node,
                     partition_ ? partition_->whole_cell(site.deck_cell) : site.deck_cell,
                     2 * site.deck + site.end, mesh_.local[site.deck_node].z() - site.place.z(), place});
  }
  return seats;
}

/// Mass that leaves with each node of a piece; of a hanging node that of what it follows. A node that keeps
/// no cell gives all it has: steel, and what rounding left.
std::map<int, FemStructure::Leaving> FemStructure::leaving_nodes(const HexMesh& mesh,
                                                                 const std::vector<int>& cells,
                                                                 const Excerpt* apart) const {
  std::map<int, Leaving> nodes;
  for (int cell : cells) {
    const std::array<double, 8> m = node_shares(mesh, cell, spec_.density);
    for (int a = 0; a < 8; ++a) {
      const int n = mesh.hexes[cell][a];
      const HangingNode* h = hanging_node(mesh, n);
      nodes[n].mass += h != nullptr ? 0 : m[a];
      if (h != nullptr)
        for (const auto& [master, weight] : h->masters) nodes[master].mass += weight * m[a];
    }
    for (int n : carriers(mesh, cell)) ++nodes[n].cells;
  }
  for (auto& [n, node] : nodes) {
    const auto i = static_cast<std::size_t>(n);
    node.goes = node.cells == (apart != nullptr ? apart->cells_at_node[i] : cells_at_node_[i]);
    if (node.goes) node.mass = apart != nullptr ? apart->mass[i] : mass_[i];
    node.position = apart != nullptr ? apart->position[i] : position(n);
    node.velocity = apart != nullptr ? apart->velocity[i] : velocity(n);
  }
  return nodes;
}

/// The surface of a piece: vertices and triangles of `f`.
void FemStructure::shape_of_piece(const HexMesh& mesh, const std::vector<int>& cells, double smallest,
                                  const std::map<int, Leaving>& nodes, const std::vector<SeatedNode>& seated,
                                  Fragment& f) const {
  std::vector<char> only(mesh.hexes.size(), 0);
  for (int cell : cells) only[cell] = 1;
  std::vector<SkinQuad> quads = skin(mesh, only);
  std::vector<Vec3> reference, present;
  std::vector<double> weight;
  std::map<int, std::size_t> at;
  for (const auto& [n, node] : nodes) {
    at.emplace(n, at.size());
    reference.push_back(mesh.nodes[n]);
    present.push_back(node.position);
    weight.push_back(node.mass);
  }
  std::vector<Vec3> points = straightened(reference, present, weight, bent * std::cbrt(smallest));
  stand_on_pads(mesh, seated, quads, at, points);
  quads = cut_at_middles(mesh, quads);
  const ClosedSurface surface = close_surface(quads);
  for (int n : surface.node) f.vertices.push_back(points[at.at(n)]);
  std::vector<int> cell;  // of each triangle
  for (std::size_t q = 0; q < quads.size(); ++q) {
    const auto& v = surface.quad[q];
    f.triangles.push_back({v[0], v[1], v[2]});
    if (v[3] != v[2]) f.triangles.push_back({v[0], v[2], v[3]});
    cell.resize(f.triangles.size(), quads[q].cell);
  }
  part_touching_edges(f.vertices, f.triangles, std::move(cell));
  merge_planar(f.vertices, f.triangles);
}

Fragment FemStructure::detach(const std::vector<int>& whole_cells, const std::vector<SeatedNode>& seats) {
  // On several ranks by an excerpt with numbers of its own, which all of them have; on one in the mesh
  // itself.
  std::optional<Excerpt> excerpted;
  if (partition_) excerpted = excerpt(whole_cells);
  const Excerpt* const apart = excerpted ? &*excerpted : nullptr;
  const HexMesh& mesh = apart != nullptr ? apart->mesh : mesh_;
  std::vector<int> cells = whole_cells;
  if (apart != nullptr) std::iota(cells.begin(), cells.end(), 0);
  Fragment f;
  f.elastic = link_energy(whole_cells);
  for (const double energy :
       of_cells(whole_cells, 1, [this](int cell, double*to) { *to = cell_energy(cell); }))
    f.elastic += energy;
  double smallest = std::numeric_limits<double>::infinity();
  for (const int cell : cells) {
    const auto i = static_cast<std::size_t>(cell);
    const double volume = (apart != nullptr ? apart->cell_mass[i] : cell_mass_[i]) / spec_.density;
    detached_volume_ += volume;
    smallest = std::min(smallest, volume);
  }
  const std::map<int, Leaving> nodes = leaving_nodes(mesh, cells, apart);
  for (const auto& [n, node] : nodes) {
    f.mass += node.mass;
    f.centroid += node.mass * node.position;
    f.linear_momentum += node.mass * node.velocity;
    f.kinetic += 0.5 * node.mass * node.velocity.squaredNorm();
  }
  f.centroid /= f.mass;
  for (const auto& [n, node] : nodes)
    f.angular_momentum += node.mass * (node.position - f.centroid).cross(node.velocity);
  std::vector<SeatedNode> seated;
  for (SeatedNode s : seats) {
    if (!std::binary_search(whole_cells.begin(), whole_cells.end(), s.cell)) continue;
    if (apart != nullptr) s.node = apart->place(s.node);
    seated.push_back(s);
  }
  shape_of_piece(mesh, cells, smallest, nodes, seated, f);
  switch_off(whole_cells);
  for (const auto& [of_piece, node] : nodes) {
    const int n = apart != nullptr ? node_here(apart->node[static_cast<std::size_t>(of_piece)]) : of_piece;
    if (n < 0) continue;
    if (node.goes) {
      remove_node(n);
      continue;
    }
    mass_[n] -= node.mass;
    for (int c = 0; c < 3; ++c)
      if (inverse_mass_[4 * n + c] > 0) inverse_mass_[4 * n + c] = 1 / mass_[n];
  }
  weights_valid_ = false;
  stored_half_ -= f.elastic;
  books_.eroded_energy += f.elastic;  // as of a cell that erodes
  books_.algorithmic +=
      0.5 * h_last_ * gravity_.dot(f.linear_momentum);  // the structure's potential is that of half steps,
                                                        // the block's that of its place
  report_(fmt::format("structure {}: {} cells came off, {:.4g} kg", spec_.name, whole_cells.size(), f.mass));
  return f;
}

}  // namespace talus::fem
