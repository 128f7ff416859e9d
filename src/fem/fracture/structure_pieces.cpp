// Which cells of a broken structure hang together, and which of these pieces nothing holds any more.
#include <algorithm>
#include <map>

#include "core/disjoint_sets.hpp"
#include "fem/structure_fem.hpp"

namespace talus::fem {

namespace {
constexpr double cut_damage = 0.99;      // a face is cut when both sides are damaged beyond this in every point
// and stand apart along its normal: a crack of 1 mm has no cohesion left (that ends near 0.2 mm) and little interlock.
constexpr double cut_opening = 1e-3;     // [m]
}  // namespace

/// A number that changes when a cell cracks or goes, or a bearing lets go: only then pieces can come off.
long FemStructure::count_cuts() {
  long cuts = breaks_ * 1'000'000'000L;  // apart from the count: an eroded cell leaves it
  double cracked = 0;
  if (damage_)
    for (int cell : damage_->cells()) cracked += own_cell(cell) && damage_->tension_least(cell) > cut_damage ? 1 : 0;
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
  const Vec3 normal = (mesh_.nodes[hex[f[2]]] - mesh_.nodes[hex[f[0]]]).cross(mesh_.nodes[hex[f[3]]] - mesh_.nodes[hex[f[1]]]).normalized();
  double sum = 0;
  for (int cell : {a, b}) {
    const Mat3 h = gradient_at_centre(cell);
    const double extent = 2 * (jacobian(mesh_, cell, Vec3::Zero()).transpose() * normal).cwiseAbs().sum();
    sum += 0.5 * extent * (normal.dot(h * normal) + 0.5 * (h * normal).squaredNorm());
  }
  return sum;
}

/// Cells that hang together: by faces that no crack cuts, and by bars.
DisjointSets FemStructure::joined_cells() const {
  const DamageField* cracks = damage_ ? &history() : nullptr;
  const int cells = static_cast<int>(mesh_.hexes.size());
  DisjointSets sets(cells);
  for (int cell = 0; cell < cells; ++cell) {
    if (!live_[cell]) continue;
    for (int face = 0; face < 6; ++face) {
      const int other = mesh_.across[cell][face];
      if (other < 0 || !live_[other]) continue;
      if (const auto& back = mesh_.across[other]; other < cell && std::find(back.begin(), back.end(), cell) != back.end()) continue;   // seen from there
      const bool cut = cracks && cracks->has(cell) && cracks->has(other) && cracks->tension_least(cell) > cut_damage &&
                       cracks->tension_least(other) > cut_damage && face_opening(cell, other, face) > cut_opening;
      if (!cut) sets.join(cell, other);
    }
  }
  if (bars_) bars_->ties([&](int a, int b) {
    if (live_[a] && live_[b]) sets.join(a, b);
  });
  return sets;
}

/// Whether a piece is held, by the name of its set: by supports, or, a deck, by bearings at both ends on pieces that supports hold. With one end off its seat
/// it falls, and so does a cap beam that has lost its pier: bearings do not pull. A free body keeps its largest piece as itself.
std::vector<char> FemStructure::held_pieces(DisjointSets& pieces) const {
  const int cells = static_cast<int>(mesh_.hexes.size());
  std::vector<char> held(cells, 0);
  if (supports_.nodes.empty()) {
    std::vector<double> mass(cells, 0.0);
    for (int cell = 0; cell < cells; ++cell)
      if (live_[cell]) mass[pieces.root(cell)] += cell_mass_[cell];
    held[std::max_element(mass.begin(), mass.end()) - mass.begin()] = 1;
    return held;
  }
  for (int cell = 0; cell < cells; ++cell) {
    if (!live_[cell]) continue;
    for (int n : mesh_.hexes[cell])
      if (supports_.held[n][0] || supports_.held[n][1] || supports_.held[n][2]) held[pieces.root(cell)] = 1;
  }
  if (!bearings_) return held;
  std::map<int, std::array<bool, 2>> seated;  // piece of a deck -> its ends
  for (std::size_t i = 0; i < bearings_->sites().size(); ++i) {
    const Bearings::Site& site = bearings_->sites()[i];
    if (bearings_->holds(i) && live_[site.deck_cell] && live_[bearings_->cap_cell(i)] && held[pieces.root(bearings_->cap_cell(i))]) seated[pieces.root(site.deck_cell)][site.end] = true;
  }
  for (const auto& [piece, ends] : seated)
    if (ends[0] && ends[1]) held[piece] = 1;
  return held;
}

/// The cells of each piece that nothing holds, in the order of their lowest cells.
std::vector<std::vector<int>> FemStructure::loose_pieces() const {
  DisjointSets pieces = joined_cells();
  const std::vector<char> held = held_pieces(pieces);
  std::map<int, std::vector<int>> loose;
  for (int cell = 0; cell < static_cast<int>(mesh_.hexes.size()); ++cell)
    if (live_[cell] && !held[pieces.root(cell)]) loose[pieces.root(cell)].push_back(cell);
  std::vector<std::vector<int>> list;
  for (auto& [first, cells] : loose) list.push_back(std::move(cells));
  return list;
}

}  // namespace talus::fem
