/// Which rank holds and computes which part of a structure.
///
/// Nodes are divided among the ranks by recursive bisection of their coordinates, each half with its share of
/// the cost. A rank computes every cell that touches a node of its own: those at the border are computed on
/// both sides. All forces on an own node are then summed here, in the order of the whole mesh, with the same
/// bits on any number of ranks. What is exchanged in a step is the motion of the border nodes, those of
/// others that computed cells touch.
///
/// A rank holds a part of the mesh, the cells that it computes and their nodes, numbered anew in the order of
/// the whole. Common cells, those at bearings, are held by every rank, which is told of the motion of their
/// nodes. Where the rest is needed on every rank (factors, modes) the part is the whole.
#pragma once
#include <algorithm>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "core/ranks.hpp"
#include "fem/discretisation/hex_mesh.hpp"
#include "fem/kernels/aligned.hpp"

namespace talus::fem {

using NodeRange = std::pair<int, int>;  // [first, last)

/// Ranges of the numbers n with in[n] != 0, ascending.
std::vector<NodeRange> ranges_of(const std::vector<char>& in);

enum class Of { nodes, cells };  // whose table it is

/// Rows of a table: one written by whoever has it; some thousand taken, in order.
using WriteRow = std::function<void(int, double*)>;
using TakeRows = std::function<void(std::span<const double>)>;
constexpr std::size_t rows_at_once = 8192;

/// Takes `count` rows of this process.
void rows_of(std::size_t count, int width, const WriteRow& write, const TakeRows& take);

/// What all ranks say together; all of them call these alike.
class RankTables {
 public:
  explicit RankTables(Ranks& ranks) : ranks_(&ranks) {}
  int size() const { return ranks_->size(); }
  int rank() const { return ranks_->rank(); }
  bool first_rank() const { return rank() == 0; }
  /// Sums each entry over the ranks, in their order: the same bits everywhere.
  void sum(std::span<double> values);
  /// Greatest over the ranks.
  double largest(double value);
  /// The records of all ranks one after the other.
  std::vector<double> collect(std::span<const double> mine) { return ranks_->gather(mine); }
  /// Empty but on the first rank.
  std::vector<double> collect_at_first(std::span<const double> mine);
  /// The same where it is known how much each rank has.
  void collect(std::span<const double> mine, std::span<const int> count, double* all) {
    ranks_->gather(mine, count, all);
  }
  /// Records of `width` numbers from all ranks, ascending by the first one; only the first rank is given them
  /// where the others have no use for them.
  enum class For { all, first };
  std::vector<double> records(int width, std::span<const double> mine, For whom = For::all);
  /// Every rank takes `width` numbers of anything that has `numbers` among `in_all`, ascending, and one
  /// owner, who writes them: some thousand rows at a time.
  void each(const std::vector<int>& numbers, std::size_t in_all, const std::function<bool(int)>& own,
            int width, const WriteRow& write, const TakeRows& take);

 protected:
  Ranks* ranks_;
};

class Partition : public RankTables {
 public:
  /// `common`: cells that every rank holds. `cost`: of a node; shares are equal in its sum.
  /// `everywhere`: every rank keeps the whole mesh.
  Partition(const HexMesh& whole, const std::vector<int>& common, const std::vector<double>& cost,
            bool everywhere, Ranks& ranks);

  /// The part of the mesh that this rank holds.
  HexMesh part_of(const HexMesh& whole) const;
  bool holds_all() const { return node_number_.size() == nodes_in_all_; }
  std::size_t nodes_in_all() const { return nodes_in_all_; }
  std::size_t cells_in_all() const { return cells_in_all_; }
  /// Number in the whole mesh, ascending with the number here; and the number here, -1: not held.
  int whole_node(int n) const { return node_number_[n]; }
  int whole_cell(int cell) const { return cell_number_[cell]; }
  int node_here(int whole) const { return here(node_number_, whole); }
  int cell_here(int whole) const { return here(cell_number_, whole); }
  /// Those of a list of the whole mesh that are held, by their numbers here.
  std::vector<int> nodes_here(const std::vector<int>& whole) const;
  std::vector<int> cells_here(const std::vector<int>& whole) const;

  bool owns_node(int n) const { return owner_[n] == me_; }
  /// One rank only: that of the cell's first node.
  bool owns_cell(int cell) const { return own_cells_[cell] != 0; }
  const std::vector<char>& own_cells() const { return own_cells_; }
  /// Cells that touch a node of this rank.
  const std::vector<char>& local_cells() const { return local_cells_; }
  const std::vector<NodeRange>& own_nodes() const { return own_nodes_; }
  /// Those of others whose motion is known here.
  const std::vector<NodeRange>& border_nodes() const { return border_nodes_; }

  /// Refreshes a field (four numbers per node) at the border nodes.
  void exchange(AlignedVector& field);
  /// The same with one number per node.
  template <class Number>
  void exchange_numbers(std::vector<Number>& field) {
    exchange(
        1, [&](int n, double* to) { *to = static_cast<double>(field[n]); },
        [&](int n, const double* from) { field[n] = static_cast<Number>(*from); });
  }
  /// Every rank takes `width` numbers of every node or cell of the whole mesh, in its order, which the owner
  /// writes: some thousand rows at a time.
  using RankTables::each;
  void each(Of of, int width, const WriteRow& write, const TakeRows& take);

  /// Cells that each rank computes.
  std::vector<long> cells_per_rank() const { return cells_per_rank_; }
  std::size_t memory_consumption() const;  // [bytes]

 private:
  static int here(const std::vector<int>& numbers, int whole);
  template <class Write, class Read>
  void exchange(std::size_t width, Write&& write, Read&& read) {
    for (std::size_t r = 0; r < send_.size(); ++r) {
      outgoing_[r].resize(width * send_[r].size());
      incoming_[r].resize(width * receive_[r].size());
      for (std::size_t i = 0; i < send_[r].size(); ++i) write(send_[r][i], &outgoing_[r][width * i]);
    }
    ranks_->exchange(outgoing_, incoming_);
    for (std::size_t r = 0; r < receive_.size(); ++r)
      for (std::size_t i = 0; i < receive_[r].size(); ++i) read(receive_[r][i], &incoming_[r][width * i]);
  }

  int me_;
  std::size_t nodes_in_all_, cells_in_all_;
  std::vector<int> node_number_, cell_number_;  // in the whole mesh
  std::vector<int> owner_;                      // per node
  std::vector<char> own_cells_, local_cells_;
  std::vector<NodeRange> own_nodes_, border_nodes_;
  std::vector<std::vector<int>> send_, receive_;  // nodes, per rank
  std::vector<std::vector<double>> outgoing_, incoming_;
  std::vector<long> cells_per_rank_;  // local ones
};

/// Nodes of the whole mesh that every rank asks for, and how their owners tell of them.
class WatchedNodes {
 public:
  WatchedNodes() = default;
  WatchedNodes(std::vector<int> nodes, Partition& partition);  // ascending
  const std::vector<int>& nodes() const { return nodes_; }
  /// -1: not among them.
  int place(int whole) const;
  /// Three numbers of each, of fields with four per node; `values`: 3 x fields for each node.
  void gather(std::span<const AlignedVector* const> fields, std::vector<double>& values) const;
  std::size_t memory_consumption() const {
    return (nodes_.capacity() + own_.capacity() + place_.capacity() + place_of_.capacity()) * sizeof(int);
  }

 private:
  Partition* partition_ = nullptr;
  std::vector<int> nodes_;
  std::vector<int> own_;  // those owned here, by their numbers here
  std::vector<int> place_,
      count_;  // of what the ranks send, one after the other: place in nodes_; how many each sends
  std::vector<int> place_of_;  // in nodes_, of a node of the whole: asked for thrice a node and sub-step
};

}  // namespace talus::fem
