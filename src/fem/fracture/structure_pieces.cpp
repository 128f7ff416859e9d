// Which cells of a broken structure hang together, and which of these pieces nothing holds any more.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/disjoint_sets.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {
constexpr double cut_damage = 0.99;  // a face is cut when both sides are damaged beyond this in every point
// and stand apart along its normal: a crack of 1 mm has no cohesion left (that ends near 0.2 mm) and little
// interlock.
constexpr double cut_opening = 1e-3;  // [m]
constexpr double parted_opening =
    5e-3;  // of a cell that is cracked through: of one row of cells alone, which as a whole is the crack [m]
}  // namespace

/// Whether a cell is the gap between what it joined: cracked through and open, and no bar that holds goes
/// through it.
bool FemStructure::parted(int cell) const {
  if (!spec_.erosion || !damage_ || !damage_->has(cell) || !damage_->cracked_through(cell)) return false;
  if (bars_ && bars_->tied(live_.size())[static_cast<std::size_t>(cell)]) return false;
  return ((Mat3::Identity() + gradient_at_centre(cell)).determinant() - 1) *
             std::cbrt(cell_mass_[cell] / spec_.density) >
         parted_opening;
}

/// Own cells that are parted and share a node with one of these pieces, of all ranks, by their numbers in the
/// whole mesh.
std::vector<int> FemStructure::parted_beside(const std::vector<std::vector<int>>& pieces) const {
  if (!damage_ || !spec_.erosion) return {};
  const auto whole = [this](int n) { return partition_ ? partition_->whole_node(n) : n; };
  std::set<int> nodes;
  for (const std::vector<int>& piece : pieces)
    for (const double n : of_cells(piece, 8, [&](int cell, double*to) {
           for (const int at : mesh_.hexes[cell]) *to++ = whole(at);
         }))
      nodes.insert(static_cast<int>(n));
  std::vector<int> list;
  for (const int cell : damage_->cells()) {
    const auto& hex = mesh_.hexes[cell];
    if (own_cell(cell) && live_[cell] &&
        std::any_of(hex.begin(), hex.end(), [&](int n) { return nodes.count(whole(n)) > 0; }) && parted(cell))
      list.push_back(cell);
  }
  return joined(list);
}

/// A number that changes when a cell cracks or goes, or a bearing lets go: only then pieces can come off.
long FemStructure::count_cuts() {
  long cuts = breaks_ * 1'000'000'000L;  // apart from the count: an eroded cell leaves it
  double cracked = 0;
  if (damage_)
    for (int cell : damage_->cells())
      if (own_cell(cell) && damage_->tension_least(cell) > cut_damage) cracked += parted(cell) ? 2 : 1;
  sum({&cracked, 1});
  cuts += static_cast<long>(cracked);
  if (bearings_)
    for (std::size_t i = 0; i < bearings_->sites().size(); ++i) cuts += bearings_->holds(i) ? 0 : 1;
  return cuts;
}

/// Displacement gradient at the middle of a cell.
Mat3 FemStructure::gradient_at_centre(int cell) const {
  const Mat3 inverse_t = jacobian(mesh_, cell, Vec3::Zero()).inverse().transpose();
  const std::array<Vec3, 8> g = shape_gradients(Vec3::Zero());
  Mat3 h = Mat3::Zero();
  for (int a = 0; a < 8; ++a) {
    const int n = 4 * mesh_.hexes[cell][a];
    h += Vec3(u_[n], u_[n + 1], u_[n + 2]) * (inverse_t * g[a]).transpose();
  }
  return h;
}

/// How far the two halves beside a face have moved apart along its normal [m].
double FemStructure::face_opening(int a, int b, int face) const {
  const int* f = hex_faces[face];
  const auto& hex = mesh_.hexes[a];
  const Vec3 normal = (mesh_.nodes[hex[f[2]]] - mesh_.nodes[hex[f[0]]])
                          .cross(mesh_.nodes[hex[f[3]]] - mesh_.nodes[hex[f[1]]])
                          .normalized();
  double sum = 0;
  for (int cell : {a, b}) {
    const Mat3 h = gradient_at_centre(cell);
    const double extent = 2 * (jacobian(mesh_, cell, Vec3::Zero()).transpose() * normal).cwiseAbs().sum();
    sum += 0.5 * extent * (normal.dot(h * normal) + 0.5 * (h * normal).squaredNorm());
  }
  return sum;
}

/// Of each cell here the lowest number, in the whole mesh, of those that it hangs together with: by faces
/// that no crack cuts, and by bars. -1: it is gone, parted, or not computed here.
std::vector<int> FemStructure::piece_labels() const {
  const int cells = static_cast<int>(mesh_.hexes.size());
  std::vector<char> solid(live_.begin(), live_.end());
  if (damage_)
    for (const int cell : damage_->cells())
      solid[static_cast<std::size_t>(cell)] = live_[cell] && !parted(cell);
  const auto counts = [&](int cell) {
    return solid[static_cast<std::size_t>(cell)] && (!partition_ || partition_->local_cells()[cell]);
  };
  DisjointSets sets(cells);
  for (int cell = 0; cell < cells; ++cell) {
    if (!counts(cell)) continue;
    for (int face = 0; face < 6; ++face) {
      const int other = mesh_.across[cell][face];
      if (other < 0 || !counts(other)) continue;
      if (const auto& back = mesh_.across[other];
          other < cell && std::find(back.begin(), back.end(), cell) != back.end())
        continue;  // seen from there
      const bool cut =
          damage_ && damage_->has(cell) && damage_->has(other) && damage_->tension_least(cell) > cut_damage &&
          damage_->tension_least(other) > cut_damage && face_opening(cell, other, face) > cut_opening;
      if (!cut) sets.join(cell, other);
    }
  }
  std::vector<int> label(static_cast<std::size_t>(cells), -1);
  if (!partition_) {
    if (bars_)
      bars_->ties([&](int, int a, int b) {
        if (live_[a] && live_[b]) sets.join(a, b);
      });
    for (int cell = 0; cell < cells; ++cell)
      if (solid[static_cast<std::size_t>(cell)]) label[static_cast<std::size_t>(cell)] = sets.root(cell);
    return label;
  }
  // What each rank calls the sets of those cells that others know, too, and of those that bars tie to others.
  std::vector<double> mine;
  const auto name = [&](int cell) { return partition_->whole_cell(sets.root(cell)); };
  const auto tell = [&](std::size_t of, int cell) {
    mine.insert(mine.end(), {static_cast<double>(of), static_cast<double>(name(cell))});
  };
  for (int cell = 0; cell < cells; ++cell) {
    if (!counts(cell)) continue;
    label[static_cast<std::size_t>(cell)] = name(cell);
    const auto& hex = mesh_.hexes[cell];
    if (std::any_of(hex.begin(), hex.end(), [&](int n) { return !own_node(n); }))
      tell(static_cast<std::size_t>(partition_->whole_cell(cell)), cell);
  }
  if (bars_)
    bars_->ties([&](int tie, int a, int b) {  // of which both cells are told of if both are there
      for (const int cell : {a, b})
        if (cell >= 0 && own_cell(cell) && live_[cell])
          tell(partition_->cells_in_all() + static_cast<std::size_t>(tie), cell);
    });
  const std::vector<double> all = partition_->records(2, mine);
  std::map<int, int> lower;  // labels that stand for a lower one
  const auto lowest = [&](int of) {
    for (auto at = lower.find(of); at != lower.end(); at = lower.find(of)) of = at->second;
    return of;
  };
  for (std::size_t at = 2; at < all.size(); at += 2) {
    if (all[at] != all[at - 2]) continue;
    const int a = lowest(static_cast<int>(all[at - 1])), b = lowest(static_cast<int>(all[at + 1]));
    if (a != b) lower[std::max(a, b)] = std::min(a, b);
  }
  for (int& of : label)
    if (of >= 0) of = lowest(of);
  return label;
}

/// Pieces that are held, by their labels: by supports, or, a deck, by bearings at both ends on pieces that
/// supports hold. With one end off its seat it falls, and so does a cap beam that has lost its pier: bearings
/// do not pull. A free body keeps its largest piece as itself.
std::set<int> FemStructure::held_pieces(const std::vector<int>& label) const {
  std::set<int> held;
  std::map<int, double> mass;
  for (std::size_t cell = 0; cell < label.size(); ++cell) {
    if (label[cell] < 0 || !own_cell(static_cast<int>(cell))) continue;
    if (supports_.none) mass[label[cell]] += cell_mass_[cell];
    for (int n : mesh_.hexes[cell])
      if (supports_.held[n][0] || supports_.held[n][1] || supports_.held[n][2]) held.insert(label[cell]);
  }
  if (partition_) {
    std::vector<double> mine;
    for (const auto& [piece, of] : mass) mine.insert(mine.end(), {static_cast<double>(piece), of});
    for (const int piece : held) mine.insert(mine.end(), {static_cast<double>(piece), 0.0});
    const std::vector<double> all = partition_->records(2, mine);
    mass.clear();
    for (std::size_t at = 0; at < all.size(); at += 2)
      supports_.none ? void(mass[static_cast<int>(all[at])] += all[at + 1])
                     : void(held.insert(static_cast<int>(all[at])));
  }
  if (supports_.none) {
    const auto heaviest = std::max_element(mass.begin(), mass.end(),
                                           [](const auto& a, const auto& b) { return a.second < b.second; });
    if (heaviest != mass.end()) held.insert(heaviest->first);
    return held;
  }
  if (!bearings_) return held;
  std::vector<int> cells;  // of each site, below and above
  for (std::size_t i = 0; i < bearings_->sites().size(); ++i)
    for (const int cell : {bearings_->cap_cell(i), bearings_->sites()[i].deck_cell})
      cells.push_back(partition_ ? partition_->whole_cell(cell) : cell);
  const std::vector<double> piece =
      of_cells(cells, 1, [&](int cell, double* to) { *to = label[static_cast<std::size_t>(cell)]; });
  std::map<int, std::array<bool, 2>> seated;  // piece of a deck -> its ends
  for (std::size_t i = 0; i < bearings_->sites().size(); ++i) {
    const Bearings::Site& site = bearings_->sites()[i];
    if (bearings_->holds(i) && live_[site.deck_cell] && live_[bearings_->cap_cell(i)] &&
        held.count(static_cast<int>(piece[2 * i])) > 0)
      seated[static_cast<int>(piece[2 * i + 1])][site.end] = true;
  }
  for (const auto& [of, ends] : seated)
    if (ends[0] && ends[1]) held.insert(of);
  return held;
}

/// The cells of each piece that nothing holds, by their numbers in the whole mesh, in the order of their
/// lowest cells.
std::vector<std::vector<int>> FemStructure::loose_pieces() const {
  const std::vector<int> label = piece_labels();
  const std::set<int> held = held_pieces(label);
  std::map<int, std::vector<int>> loose;
  for (std::size_t cell = 0; cell < label.size(); ++cell)
    if (label[cell] >= 0 && own_cell(static_cast<int>(cell)) && held.count(label[cell]) == 0)
      loose[label[cell]].push_back(partition_ ? partition_->whole_cell(static_cast<int>(cell))
                                              : static_cast<int>(cell));
  if (partition_) {
    std::vector<double> mine;
    for (const auto& [piece, cells] : loose)
      for (const int cell : cells)
        mine.insert(mine.end(), {static_cast<double>(cell), static_cast<double>(piece)});
    const std::vector<double> all = partition_->records(2, mine);
    loose.clear();
    for (std::size_t at = 0; at < all.size(); at += 2)
      loose[static_cast<int>(all[at + 1])].push_back(static_cast<int>(all[at]));
  }
  std::vector<std::vector<int>> list;
  for (auto& [first, cells] : loose) list.push_back(std::move(cells));
  return list;
}

}  // namespace talus::fem
