// Which cells of a broken structure hang together, and which of these pieces nothing holds any more.
#include "fem/fracture/pieces.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/disjoint_sets.hpp"

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
bool Pieces::parted(int cell) const {
  if (!body_.spec.erosion || !body_.damage || !body_.damage->has(cell) ||
      !body_.damage->cracked_through(cell))
    return false;
  if (body_.bars && body_.bars->ties().tied(body_.live.size())[static_cast<std::size_t>(cell)]) return false;
  return ((Mat3::Identity() + stresses_.gradient(cell)).determinant() - 1) *
             std::cbrt(body_.cell_mass[cell] / body_.spec.density) >
         parted_opening;
}

/// Own cells that are parted and share a node with one of these pieces, of all ranks, by their numbers in the
/// whole mesh.
std::vector<int> Pieces::parted_beside(const std::vector<std::vector<int>>& pieces) const {
  if (!body_.damage || !body_.spec.erosion) return {};
  const auto whole = [this](int n) { return body_.whole_node(n); };
  std::set<int> nodes;
  for (const std::vector<int>& piece : pieces)
    for (const double n : body_.of_cells(piece, 8, [&](int cell, double*to) {
           for (const int at : body_.mesh.hexes[cell]) *to++ = whole(at);
         }))
      nodes.insert(static_cast<int>(n));
  std::vector<int> list;
  for (const int cell : body_.damage->cells()) {
    const auto& hex = body_.mesh.hexes[cell];
    if (body_.own_cell(cell) && body_.live[cell] &&
        std::any_of(hex.begin(), hex.end(), [&](int n) { return nodes.count(whole(n)) > 0; }) && parted(cell))
      list.push_back(cell);
  }
  return body_.joined(list);
}

/// A number that changes when a cell cracks or goes, or a bearing lets go: only then pieces can come off.
long Pieces::count_cuts() const {
  long cuts = body_.lost.breaks * 1'000'000'000L;  // apart from the count: an eroded cell leaves it
  double cracked = 0;
  if (body_.damage)
    for (int cell : body_.damage->cells())
      if (body_.own_cell(cell) && body_.damage->tension_least(cell) > cut_damage)
        cracked += parted(cell) ? 2 : 1;
  body_.sum({&cracked, 1});
  cuts += static_cast<long>(cracked);
  if (body_.bearings)
    for (std::size_t i = 0; i < body_.bearings->sites().size(); ++i) cuts += body_.bearings->holds(i) ? 0 : 1;
  return cuts;
}

/// How far the two halves beside a face have moved apart along its normal [m].
double Pieces::face_opening(int a, int b, int face) const {
  const int* f = hex_faces[face];
  const auto& hex = body_.mesh.hexes[a];
  const Vec3 normal = (body_.mesh.nodes[hex[f[2]]] - body_.mesh.nodes[hex[f[0]]])
                          .cross(body_.mesh.nodes[hex[f[3]]] - body_.mesh.nodes[hex[f[1]]])
                          .normalized();
  double sum = 0;
  for (int cell : {a, b}) {
    const Mat3 h = stresses_.gradient(cell);
    const double extent =
        2 * (jacobian(body_.mesh, cell, Vec3::Zero()).transpose() * normal).cwiseAbs().sum();
    sum += 0.5 * extent * (normal.dot(h * normal) + 0.5 * (h * normal).squaredNorm());
  }
  return sum;
}

/// Of each cell here the lowest number, in the whole mesh, of those that it hangs together with: by faces
/// that no crack cuts, and by bars. -1: it is gone, parted, or not computed here.
std::vector<int> Pieces::labels() const {
  const int cells = static_cast<int>(body_.mesh.hexes.size());
  std::vector<char> solid(body_.live.begin(), body_.live.end());
  if (body_.damage)
    for (const int cell : body_.damage->cells())
      solid[static_cast<std::size_t>(cell)] = body_.live[cell] && !parted(cell);
  const auto counts = [&](int cell) {
    return solid[static_cast<std::size_t>(cell)] &&
           (!body_.partition || body_.partition->local_cells()[cell]);
  };
  DisjointSets sets(cells);
  for (int cell = 0; cell < cells; ++cell) {
    if (!counts(cell)) continue;
    for (int face = 0; face < 6; ++face) {
      const int other = body_.mesh.across[cell][face];
      if (other < 0 || !counts(other)) continue;
      if (const auto& back = body_.mesh.across[other];
          other < cell && std::find(back.begin(), back.end(), cell) != back.end())
        continue;  // seen from there
      const bool cut = body_.damage && body_.damage->has(cell) && body_.damage->has(other) &&
                       body_.damage->tension_least(cell) > cut_damage &&
                       body_.damage->tension_least(other) > cut_damage &&
                       face_opening(cell, other, face) > cut_opening;
      if (!cut) sets.join(cell, other);
    }
  }
  std::vector<int> label(static_cast<std::size_t>(cells), -1);
  if (!body_.partition) {
    if (body_.bars)
      body_.bars->ties().visit([&](int, int a, int b) {
        if (body_.live[a] && body_.live[b]) sets.join(a, b);
      });
    for (int cell = 0; cell < cells; ++cell)
      if (solid[static_cast<std::size_t>(cell)]) label[static_cast<std::size_t>(cell)] = sets.root(cell);
    return label;
  }
  // What each rank calls the sets of those cells that others know, too, and of those that bars tie to others.
  std::vector<double> mine;
  const auto name = [&](int cell) { return body_.partition->whole_cell(sets.root(cell)); };
  const auto tell = [&](std::size_t of, int cell) {
    mine.insert(mine.end(), {static_cast<double>(of), static_cast<double>(name(cell))});
  };
  for (int cell = 0; cell < cells; ++cell) {
    if (!counts(cell)) continue;
    label[static_cast<std::size_t>(cell)] = name(cell);
    const auto& hex = body_.mesh.hexes[cell];
    if (std::any_of(hex.begin(), hex.end(), [&](int n) { return !body_.own_node(n); }))
      tell(static_cast<std::size_t>(body_.partition->whole_cell(cell)), cell);
  }
  if (body_.bars)
    body_.bars->ties().visit(
        [&](int tie, int a, int b) {  // of which both cells are told of if both are there
          for (const int cell : {a, b})
            if (cell >= 0 && body_.own_cell(cell) && body_.live[cell])
              tell(body_.partition->cells_in_all() + static_cast<std::size_t>(tie), cell);
        });
  const std::vector<double> all = body_.partition->records(2, mine);
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
std::set<int> Pieces::held(const std::vector<int>& label) const {
  std::set<int> held;
  std::map<int, double> mass;
  for (std::size_t cell = 0; cell < label.size(); ++cell) {
    if (label[cell] < 0 || !body_.own_cell(static_cast<int>(cell))) continue;
    if (body_.supports.none) mass[label[cell]] += body_.cell_mass[cell];
    for (int n : body_.mesh.hexes[cell])
      if (body_.supports.held[n][0] || body_.supports.held[n][1] || body_.supports.held[n][2])
        held.insert(label[cell]);
  }
  if (body_.partition) {
    std::vector<double> mine;
    for (const auto& [piece, of] : mass) mine.insert(mine.end(), {static_cast<double>(piece), of});
    for (const int piece : held) mine.insert(mine.end(), {static_cast<double>(piece), 0.0});
    const std::vector<double> all = body_.partition->records(2, mine);
    mass.clear();
    for (std::size_t at = 0; at < all.size(); at += 2)
      body_.supports.none ? void(mass[static_cast<int>(all[at])] += all[at + 1])
                          : void(held.insert(static_cast<int>(all[at])));
  }
  if (body_.supports.none) {
    const auto heaviest = std::max_element(mass.begin(), mass.end(),
                                           [](const auto& a, const auto& b) { return a.second < b.second; });
    if (heaviest != mass.end()) held.insert(heaviest->first);
    return held;
  }
  if (!body_.bearings) return held;
  std::vector<int> cells;  // of each site, below and above
  for (std::size_t i = 0; i < body_.bearings->sites().size(); ++i)
    for (const int cell : {body_.bearings->cap_cell(i), body_.bearings->sites()[i].deck_cell})
      cells.push_back(body_.whole_cell(cell));
  const std::vector<double> piece =
      body_.of_cells(cells, 1, [&](int cell, double* to) { *to = label[static_cast<std::size_t>(cell)]; });
  std::map<int, std::array<bool, 2>> seated;  // piece of a deck -> its ends
  for (std::size_t i = 0; i < body_.bearings->sites().size(); ++i) {
    const Bearings::Site& site = body_.bearings->sites()[i];
    if (body_.bearings->holds(i) && body_.live[site.deck_cell] && body_.live[body_.bearings->cap_cell(i)] &&
        held.count(static_cast<int>(piece[2 * i])) > 0)
      seated[static_cast<int>(piece[2 * i + 1])][site.end] = true;
  }
  for (const auto& [of, ends] : seated)
    if (ends[0] && ends[1]) held.insert(of);
  return held;
}

/// The cells of each piece that nothing holds, by their numbers in the whole mesh, in the order of their
/// lowest cells.
std::vector<std::vector<int>> Pieces::loose() const {
  const std::vector<int> label = labels();
  const std::set<int> kept = held(label);
  std::map<int, std::vector<int>> pieces;
  for (std::size_t cell = 0; cell < label.size(); ++cell)
    if (label[cell] >= 0 && body_.own_cell(static_cast<int>(cell)) && kept.count(label[cell]) == 0)
      pieces[label[cell]].push_back(body_.whole_cell(static_cast<int>(cell)));
  if (body_.partition) {
    std::vector<double> mine;
    for (const auto& [piece, cells] : pieces)
      for (const int cell : cells)
        mine.insert(mine.end(), {static_cast<double>(cell), static_cast<double>(piece)});
    const std::vector<double> all = body_.partition->records(2, mine);
    pieces.clear();
    for (std::size_t at = 0; at < all.size(); at += 2)
      pieces[static_cast<int>(all[at + 1])].push_back(static_cast<int>(all[at]));
  }
  std::vector<std::vector<int>> list;
  for (auto& [first, cells] : pieces) list.push_back(std::move(cells));
  return list;
}

}  // namespace talus::fem
