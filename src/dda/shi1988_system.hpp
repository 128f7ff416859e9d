/// Eq. (9): the equivalent stiffness of many blocks, solved island by island.
///
///   sum_j K^_ij D_j = F^_i
///
/// symbol   meaning                               shape
/// K^_ii    diagonal sub-matrix of block i         12 x 12, SPD
/// K^_ij    i < j, only for pairs with a contact   12 x 12
///
/// Single blocks and small islands are factorised densely, larger ones by a sparse LDL^T whose pattern is
/// analysed once a step, still larger ones by conjugate gradients with the 12 x 12 diagonal blocks as
/// preconditioner (2 M / dt^2 dominates when dt is small), falling back on LDL^T where those do not reach
/// 1e-13.
#pragma once
#include <memory>
#include <utility>
#include <vector>

#include "core/types.hpp"

namespace talus::dda::shi1988 {

class BlockSystem {
 public:
  BlockSystem();
  ~BlockSystem();
  /// `pairs`: sorted (i, j), i < j, without repetition. Finds the islands.
  void set_pattern(int blocks, std::vector<std::pair<int, int>> pairs, int direct_limit);

  int islands() const { return static_cast<int>(island_.size()); }
  int island_of(int block) const { return block_island_[static_cast<std::size_t>(block)]; }
  const std::vector<int>& island_blocks(int k) const { return island_[static_cast<std::size_t>(k)].blocks; }
  const std::vector<int>& island_pairs(int k) const { return island_[static_cast<std::size_t>(k)].pairs; }

  /// Solves one island: reads diagonal, coupling, rhs; writes solution. Throws NumericalFailure if the matrix
  /// is not SPD.
  void solve(int island);

  std::vector<Mat12> diagonal;       // per block
  std::vector<Mat12> coupling;       // per pair
  std::vector<Vec12> rhs, solution;  // per block

 private:
  struct Sparse;
  struct Island {
    std::vector<int> blocks, pairs;
    std::unique_ptr<Sparse> sparse;
  };
  void solve_dense(Island& island);
  void solve_sparse(Island& island);
  bool solve_pcg(Island& island);

  std::vector<std::pair<int, int>> pairs_;
  std::vector<int> block_island_, local_;
  std::vector<Island> island_;
  int direct_limit_ = 40;
};

}  // namespace talus::dda::shi1988
