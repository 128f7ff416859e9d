/// Which rank computes which part of a structure.
///
/// Nodes are divided among the ranks by recursive bisection of their coordinates, each half with its share of the cost. A rank
/// computes every cell that touches a node of its own: those at the border are computed on both sides. All forces on an own node are
/// then summed here, in the order of the whole mesh, with the same bits on any number of ranks. What is exchanged in a step is the
/// motion of the border nodes, those of others that local cells touch.
#pragma once
#include <span>
#include <utility>
#include <vector>

#include "core/ranks.hpp"
#include "fem/kernels/aligned.hpp"
#include "fem/discretisation/hex_mesh.hpp"

namespace talus::fem {

using NodeRange = std::pair<int, int>;   // [first, last)

/// Ranges of the numbers n with in[n] != 0, ascending.
std::vector<NodeRange> ranges_of(const std::vector<char>& in);

class Partition {
 public:
  /// `common`: nodes whose motion every rank needs. `cost`: of a node; shares are equal in its sum.
  Partition(const HexMesh& mesh, const std::vector<int>& common, const std::vector<double>& cost, Ranks& ranks);

  bool owns_node(int n) const { return owner_[n] == me_; }
  /// One rank only: that of the cell's first node.
  bool owns_cell(int cell) const { return own_cells_[cell] != 0; }
  const std::vector<char>& own_cells() const { return own_cells_; }
  /// Cells that touch a node of this rank.
  const std::vector<char>& local_cells() const { return local_cells_; }
  const std::vector<NodeRange>& own_nodes() const { return own_nodes_; }
  /// Those of others whose motion is known here.
  const std::vector<NodeRange>& border_nodes() const { return border_nodes_; }
  bool first_rank() const { return me_ == 0; }

  /// Refreshes a field (four numbers per node) at the border nodes.
  void exchange(AlignedVector& field);
  /// Makes fields (four numbers per node) current on every rank at the nodes of `subset`.
  void gather(std::span<AlignedVector* const> fields, const std::vector<int>& subset);
  /// Sums each entry over the ranks, in their order: the same bits everywhere.
  void sum(std::span<double> values);
  /// Greatest over the ranks.
  double largest(double value);
  /// The records of all ranks one after the other.
  std::vector<double> collect(std::span<const double> mine) { return ranks_->gather(mine); }
  int size() const { return ranks_->size(); }

  /// For the plan: cells of each rank, and the share of all cells that is computed more than once.
  std::vector<long> cells_per_rank() const { return cells_per_rank_; }
  double repeated_share() const;

 private:
  Ranks* ranks_;
  int me_;
  std::vector<int> owner_;                       // per node
  std::vector<char> own_cells_, local_cells_;
  std::vector<NodeRange> own_nodes_, border_nodes_;
  std::vector<std::vector<int>> send_, receive_;  // nodes, per rank
  std::vector<std::vector<double>> outgoing_, incoming_;
  std::vector<long> cells_per_rank_;             // local ones
};

}  // namespace talus::fem
