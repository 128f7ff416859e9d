#include "fem/linear/mechanism.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/disjoint_sets.hpp"

namespace talus::fem {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;

/// The direction of a vector, its largest component positive.
std::string direction(Vec3 v) {
  Eigen::Index most = 0;
  v.cwiseAbs().maxCoeff(&most);
  v /= v[most] < 0 ? -v.norm() : v.norm();
  for (double& x : v) x = std::abs(x) < 5e-4 ? 0.0 : x;
  return fmt::format("[{:.3g}, {:.3g}, {:.3g}]", v.x(), v.y(), v.z());
}

/// A rigid motion in words; `length` turns the rotation's part into one.
std::string in_words(const Vec6& motion) {
  const Vec3 move = motion.head<3>(), turn = motion.tail<3>();
  return turn.norm() < 1e-3 * move.norm() ? "move along " + direction(move)
                                          : "turn about an axis along " + direction(turn);
}

/// Cells that move as one, and the rows of displacements that their rigid motion (translation, rotation times
/// `length`) about their centre gives.
struct Piece {
  std::vector<int> nodes;
  int cells = 0, first = 0;
  Vec3 centre = Vec3::Zero();
  double length = 0;

  void measure(const HexMesh& mesh) {
    const auto count = static_cast<double>(nodes.size());
    for (const int n : nodes) centre += mesh.nodes[static_cast<std::size_t>(n)] / count;
    for (const int n : nodes)
      length += (mesh.nodes[static_cast<std::size_t>(n)] - centre).squaredNorm() / count;
    length = std::sqrt(length);
  }
  Vec6 row(const Vec3& at, int direction) const {
    const Vec3 axis = Vec3::Unit(direction);
    Vec6 row;
    row << axis, (at - centre).cross(axis) / length;
    return row;
  }
};

/// Pieces of a part by the name of the set that each cell is in, ascending.
std::map<int, Piece> pieces_of(const HexMesh& mesh, const std::vector<int>& cells, DisjointSets& sets) {
  std::map<int, Piece> pieces;
  for (const int cell : cells) {
    const auto [at, fresh] = pieces.try_emplace(sets.root(cell));
    if (fresh) at->second.first = cell;
    ++at->second.cells;
    const auto& hex = mesh.hexes[static_cast<std::size_t>(cell)];
    at->second.nodes.insert(at->second.nodes.end(), hex.begin(), hex.end());
  }
  for (auto& [set, piece] : pieces) {
    std::sort(piece.nodes.begin(), piece.nodes.end());
    piece.nodes.erase(std::unique(piece.nodes.begin(), piece.nodes.end()), piece.nodes.end());
    piece.measure(mesh);
  }
  return pieces;
}

constexpr std::size_t most_pieces = 100;  // six unknowns each, of a dense problem

/// Sets of cells joined by faces. Cells of two sizes that meet, and what springs tie, count as joined;
/// without the table of faces all that share a node do.
DisjointSets joined_by_faces(const HexMesh& mesh, const std::vector<Spring>& springs) {
  DisjointSets sets(static_cast<int>(mesh.hexes.size()));
  std::vector<std::vector<int>> tied;  // nodes
  for (const HangingNode& h : mesh.hanging) {
    tied.push_back({h.node});
    for (const auto& [master, weight] : h.masters) tied.back().push_back(master);
  }
  for (const Spring& spring : springs) tied.emplace_back(spring.node.begin(), spring.node.end());
  std::vector<int> first(mesh.nodes.size(), -1), group(mesh.nodes.size(), -1);
  DisjointSets groups(static_cast<int>(tied.size()));
  for (std::size_t k = 0; k < tied.size(); ++k)
    for (const int n : tied[k]) {
      int& of = group[static_cast<std::size_t>(n)];
      of < 0 ? void(of = static_cast<int>(k)) : groups.join(of, static_cast<int>(k));
    }
  std::vector<int> cell_of(tied.size(), -1);
  for (std::size_t cell = 0; cell < mesh.hexes.size(); ++cell) {
    const int number = static_cast<int>(cell);
    if (!mesh.across.empty())
      for (const int other : mesh.across[cell])
        if (other >= 0) sets.join(number, other);
    for (const int n : mesh.hexes[cell]) {
      const auto node = static_cast<std::size_t>(n);
      if (group[node] < 0 && !mesh.across.empty()) continue;
      int& same = group[node] < 0 ? first[node] : cell_of[static_cast<std::size_t>(groups.root(group[node]))];
      same < 0 ? void(same = number) : sets.join(same, number);
    }
  }
  return sets;
}

/// A piece of these, which share nodes, that can move with respect to what holds them.
std::optional<LoosePart> loose_of(const HexMesh& mesh, const Supports& supports,
                                  const std::vector<Piece>& pieces) {
  const auto size = static_cast<Eigen::Index>(6 * pieces.size());
  MatX form = MatX::Zero(size, size);
  std::map<int, std::size_t> first_at;  // node: the first piece that has it
  bool held = false;
  for (std::size_t k = 0; k < pieces.size(); ++k)
    for (const int n : pieces[k].nodes) {
      const Vec3& at = mesh.nodes[static_cast<std::size_t>(n)];
      const auto block = static_cast<Eigen::Index>(6 * k);
      const auto [other, fresh] =
          pieces.size() > 1 ? first_at.try_emplace(n, k) : std::pair(first_at.end(), true);
      for (int c = 0; c < 3; ++c) {
        const Vec6 row = pieces[k].row(at, c);
        if (supports.held[static_cast<std::size_t>(n)][static_cast<std::size_t>(c)])
          form.block<6, 6>(block, block) += row * row.transpose(), held = true;
        if (fresh) continue;
        const auto block0 = static_cast<Eigen::Index>(6 * other->second);
        const Vec6 row0 = pieces[other->second].row(at, c);
        form.block<6, 6>(block, block) += row * row.transpose();
        form.block<6, 6>(block0, block0) += row0 * row0.transpose();
        form.block<6, 6>(block, block0) -= row * row0.transpose();
        form.block<6, 6>(block0, block) -= row0 * row.transpose();
      }
    }
  const Eigen::SelfAdjointEigenSolver<MatX> motions(form);
  if (motions.eigenvalues()[0] > 1e-12 * motions.eigenvalues()[size - 1]) return std::nullopt;
  const VecX motion = motions.eigenvectors().col(0);
  std::size_t most = 0;
  const auto of = [&](std::size_t k) -> Vec6 { return motion.segment<6>(static_cast<Eigen::Index>(6 * k)); };
  for (std::size_t k = 1; k < pieces.size(); ++k)
    if (of(k).norm() > of(most).norm()) most = k;
  LoosePart loose{pieces[most].cells, pieces[most].first, held, held && pieces.size() > 1,
                  in_words(of(most))};
  if (!held)  // all of them
    loose.cells = std::accumulate(pieces.begin(), pieces.end(), 0,
                                  [](int sum, const Piece& piece) { return sum + piece.cells; });
  return loose;
}

}  // namespace

std::optional<LoosePart> loose_part(const HexMesh& mesh, const Supports& supports,
                                    const std::vector<Spring>& springs) {
  DisjointSets sets(static_cast<int>(mesh.nodes.size()));
  for (const auto& hex : mesh.hexes)
    for (const int n : hex) sets.join(hex[0], n);
  for (const HangingNode& h : mesh.hanging)
    for (const auto& [master, weight] : h.masters) sets.join(h.node, master);
  for (const Spring& spring : springs)
    for (const int n : spring.node) sets.join(spring.node.front(), n);
  std::map<int, std::vector<int>> parts;  // cells
  for (int cell = 0; cell < static_cast<int>(mesh.hexes.size()); ++cell)
    parts[sets.root(mesh.hexes[static_cast<std::size_t>(cell)][0])].push_back(cell);
  DisjointSets stiff = joined_by_faces(mesh, springs);
  for (const auto& [root, cells] : parts) {
    std::vector<Piece> pieces;
    for (auto& [set, piece] : pieces_of(mesh, cells, stiff)) pieces.push_back(std::move(piece));
    if (pieces.size() > most_pieces) {  // as one, which finds less
      DisjointSets one(static_cast<int>(mesh.hexes.size()));
      for (const int cell : cells) one.join(cells.front(), cell);
      pieces = {pieces_of(mesh, cells, one).begin()->second};
    }
    if (const auto loose = loose_of(mesh, supports, pieces)) return loose;
  }
  return std::nullopt;
}

}  // namespace talus::fem
