/// Which nodes and cells of a structure are this rank's to count, and what all ranks say together. Of one
/// process all of them are. Functions that ask the others are called by all ranks alike. Cells and nodes have
/// the numbers of this rank's part of the mesh; where it is said, those of the whole.
#pragma once
#include <memory>

#include "fem/discretisation/partition.hpp"
#include "fem/state_reader.hpp"

namespace talus::fem {

struct Division {
  std::unique_ptr<Partition> partition;  // null: all on this process
  std::vector<NodeRange> own, touched;   // nodes of this rank; those that forces are added to

  std::size_t nodes = 0, cells = 0;  // of this rank's part

  std::size_t held(Of of) const { return of == Of::nodes ? nodes : cells; }
  std::size_t nodes_in_all() const { return partition ? partition->nodes_in_all() : nodes; }
  std::size_t cells_in_all() const { return partition ? partition->cells_in_all() : cells; }
  bool divided() const { return partition && !partition->holds_all(); }  // memory, too
  bool first_rank() const { return !partition || partition->first_rank(); }
  bool own_node(int n) const { return !partition || partition->owns_node(n); }
  bool own_cell(int cell) const { return !partition || partition->owns_cell(cell); }
  /// From numbers in the whole mesh, -1: not held; and to them.
  int node_here(int whole) const { return partition ? partition->node_here(whole) : whole; }
  int cell_here(int whole) const { return partition ? partition->cell_here(whole) : whole; }
  int whole_node(int n) const { return partition ? partition->whole_node(n) : n; }
  int whole_cell(int cell) const { return partition ? partition->whole_cell(cell) : cell; }

  void sum(std::span<double> values) const {
    if (partition) partition->sum(values);
  }
  long count_of(long count) const;
  double largest(double value) const { return partition ? partition->largest(value) : value; }
  /// Lists of own cells of all ranks, by their numbers in the whole mesh, ascending.
  std::vector<int> joined(const std::vector<int>& cells) const;
  /// `width` numbers of each of these cells of the whole mesh, from its owner.
  std::vector<double> of_cells(const std::vector<int>& cells, std::size_t width,
                               const std::function<void(int, double*)>& write) const;
  /// Every rank takes `width` numbers of every node or cell of the whole mesh, in its order, which the owner
  /// writes: some thousand rows at a time.
  void each(Of of, int width, const WriteRow& write, const TakeRows& take) const;
  /// Appends `width` numbers of every node or cell, as they are held `here`, or on the first rank of the
  /// whole; and where they are in such a state, by the numbers here.
  void save(std::vector<double>& state, bool here, Of of, int width, const WriteRow& write) const;
  using Saved = std::function<const double*(int)>;
  Saved saved(StateReader& state, bool here, Of of, std::size_t width) const;
  /// Makes fields current everywhere, of a structure that every rank holds whole.
  void share(AlignedVector& u, AlignedVector& v);
};

}  // namespace talus::fem
