/// Block-sparse direct solver for  H x = f  with H = A + sum J^T D J: symmetric pattern, unsymmetric values
/// (friction couples the tangential to the normal impulse, not the other way round).
///
/// Multifrontal LU [duff1983]: approximate minimum degree on the graph of bodies [amestoy1996], relaxed
/// supernodes, row pivoting within a front's own pivots. Small systems are one dense front.
///
/// symbol     meaning                                  shape
/// n_a        degrees of freedom of body a             1
/// H_aa       diagonal block, column major             n_a x n_a
/// H_ab, H_ba blocks of a pair a < b, column major     n_a x n_b, n_b x n_a
#pragma once
#include <Eigen/Core>
#include <utility>
#include <vector>

namespace talus::contact::detail {

class BlockLU {
 public:
  /// Pattern of the matrix. Keeps the symbolic factor if the pattern is the one it has. Pairs: a < b, sorted,
  /// unique.
  void analyse(const std::vector<int>& sizes, const std::vector<std::pair<int, int>>& pairs);
  double* diagonal(int body) { return values_.data() + diagonal_[body]; }
  double* upper(int pair) { return values_.data() + upper_[pair]; }
  double* lower(int pair) { return values_.data() + lower_[pair]; }
  void set_zero();
  /// False if a pivot vanishes.
  bool factor();
  /// x: in the right-hand side, out the solution; stacked in the order of the bodies.
  void solve(double* x) const;
  int size() const { return n_; }
  /// How many fronts wait for each other at the top of the tree, at most; 0: none is shared.
  int levels() const { return static_cast<int>(levels_.size()); }
  /// Entries of the factor, for reports.
  std::size_t factor_entries() const { return factor_.size(); }

 private:
  struct Front {
    int first_body = 0, bodies = 0, pivot_bodies = 0;  // into front_body_: pivots first, then the rest
    int pivots = 0, size = 0;                          // scalar dimensions
    int parent = -1;
    std::size_t factor = 0;            // into factor_: size x pivots panel, then pivots x (size - pivots)
    int pivot_row = 0;                 // into pivot_rows_
    int first_entry = 0, entries = 0;  // into entries_
    int children = 0;
  };
  struct Entry {
    std::size_t value;
    int rows, cols, row, col;
  };  // block of H into a place of the front
  struct Update {
    int front, part;
    std::size_t at;
  };  // what a front leaves to its parent, on the stack of a part
  // Aligned, so that the order in which packets sum never depends on where the buffer happens to lie.
  using Buffer = std::vector<double, Eigen::aligned_allocator<double>>;
  /// A range of fronts, children first. Shared parts wait for no other, and threads take them in any order;
  /// every other part is one front, which waits for those below it, and threads share those of a level. Which
  /// they are depends on the pattern alone, and so do all sums.
  struct Part {
    int first = 0, last = 0;
    bool shared = false;
    int largest = 0;           // size of its fronts
    int level = 0;             // 0: it waits for none
    std::vector<int> below;    // fronts of other parts whose parent it is, ascending
    std::vector<int> outside;  // bodies of its fronts that others eliminate
    Buffer stack, front, upper, local, left;
    std::size_t top = 0;  // of the stack
    std::vector<Update> updates;
    std::vector<int> place;  // of every body in the front at hand
  };
  void order(std::vector<int>& permutation) const;
  void symbolic(const std::vector<int>& permutation);
  struct Columns;
  Columns columns_of(const std::vector<int>& permutation) const;
  static void order_by_children(Columns& c);
  void join_columns(const std::vector<int>& permutation, Columns& c) const;
  void place_fronts(const std::vector<int>& permutation, const Columns& c);
  void place_entries(const Columns& c);
  void part();
  void gather_front(const Front& front, Part& part);
  void add_child(const Front& kid, const double* U, const std::vector<int>& place, int m, double* F) const;
  bool factor_part(int number);
  void forward(Part& part, int number, double* x) const;
  void backward(Part& part, double* x) const;

  int n_ = 0;
  std::vector<int> sizes_, offsets_;
  std::vector<std::pair<int, int>> pairs_;
  std::vector<std::size_t> diagonal_, upper_, lower_;
  Buffer values_, factor_;
  mutable std::vector<Part> parts_;  // with their buffers
  std::vector<int> shared_, part_of_body_;
  std::vector<std::vector<int>> levels_;  // parts that are not shared, by level
  std::vector<Update> left_;  // of the last front of a part's subtrees: what it leaves to other parts
  std::vector<Front> fronts_;
  std::vector<int> front_body_, front_offset_, pivot_rows_;
  std::vector<Entry> entries_;
};

}  // namespace talus::contact::detail
