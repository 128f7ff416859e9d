#include "dda/shi1988_system.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>

#include "core/disjoint_sets.hpp"
#include "core/error.hpp"

namespace talus::dda::shi1988 {
namespace {
constexpr int dense_limit = 8;  // blocks: a dense 96 x 96 factorisation beats the sparse one's bookkeeping
constexpr double pcg_tolerance = 1e-13;  // relative residual, in the norm of the preconditioner
constexpr int pcg_cap = 400;

[[noreturn]] void not_spd() {
  throw NumericalFailure(
      "dda-1988: the equivalent stiffness of Eq. (9) is not positive definite (flat or inverted block?)");
}
}  // namespace

struct BlockSystem::Sparse {
  Eigen::SparseMatrix<double> matrix;  // lower triangle
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor;
};

BlockSystem::BlockSystem() = default;
BlockSystem::~BlockSystem() = default;

void BlockSystem::set_pattern(int blocks, std::vector<std::pair<int, int>> pairs, int direct_limit) {
  const auto n = static_cast<std::size_t>(blocks);
  pairs_ = std::move(pairs);
  direct_limit_ = direct_limit;
  diagonal.resize(n);
  rhs.resize(n);
  solution.resize(n);
  coupling.resize(pairs_.size());

  DisjointSets sets(blocks);
  for (const auto& [i, j] : pairs_) sets.join(i, j);
  block_island_.assign(n, -1);
  local_.assign(n, 0);
  island_.clear();
  for (std::size_t i = 0; i < n; ++i) {
    const auto r = static_cast<std::size_t>(sets.root(static_cast<int>(i)));
    if (block_island_[r] < 0) {
      block_island_[r] = static_cast<int>(island_.size());
      island_.emplace_back();
    }
    block_island_[i] = block_island_[r];
    auto& island = island_[static_cast<std::size_t>(block_island_[i])];
    local_[i] = static_cast<int>(island.blocks.size());
    island.blocks.push_back(static_cast<int>(i));
  }
  for (std::size_t p = 0; p < pairs_.size(); ++p)
    island_[static_cast<std::size_t>(block_island_[static_cast<std::size_t>(pairs_[p].first)])]
        .pairs.push_back(static_cast<int>(p));
}

void BlockSystem::solve(int k) {
  Island& island = island_[static_cast<std::size_t>(k)];
  const int n = static_cast<int>(island.blocks.size());
  if (n == 1) {
    const auto i = static_cast<std::size_t>(island.blocks[0]);
    const Eigen::LLT<Mat12> llt(diagonal[i]);
    if (llt.info() != Eigen::Success) not_spd();
    solution[i] = llt.solve(rhs[i]);
  } else if (n <= dense_limit) {
    solve_dense(island);
  } else if (n <= direct_limit_ || !solve_pcg(island)) {
    solve_sparse(island);
  }
}

void BlockSystem::solve_dense(Island& island) {
  const auto n = static_cast<Eigen::Index>(island.blocks.size()) * 12;
  MatX K = MatX::Zero(n, n);
  VecX f(n);
  for (const int b : island.blocks) {
    const auto i = static_cast<std::size_t>(b);
    const Eigen::Index o = 12 * local_[i];
    K.block<12, 12>(o, o) = diagonal[i];
    f.segment<12>(o) = rhs[i];
  }
  for (const int p : island.pairs) {
    const auto& [i, j] = pairs_[static_cast<std::size_t>(p)];
    K.block<12, 12>(12 * local_[static_cast<std::size_t>(j)], 12 * local_[static_cast<std::size_t>(i)]) =
        coupling[static_cast<std::size_t>(p)].transpose();
  }
  const Eigen::LLT<Eigen::Ref<MatX>> llt(K);  // in place, lower triangle
  if (llt.info() != Eigen::Success) not_spd();
  const VecX d = llt.solve(f);
  for (const int b : island.blocks)
    solution[static_cast<std::size_t>(b)] = d.segment<12>(12 * local_[static_cast<std::size_t>(b)]);
}

void BlockSystem::solve_sparse(Island& island) {
  const auto n = static_cast<Eigen::Index>(island.blocks.size()) * 12;
  const bool first = !island.sparse;
  if (first) {
    island.sparse = std::make_unique<Sparse>();
    auto& m = island.sparse->matrix;
    m.resize(n, n);
    std::vector<Eigen::Triplet<double>> t;
    for (Eigen::Index o = 0; o < n; o += 12)
      for (int c = 0; c < 12; ++c)
        for (int r = c; r < 12; ++r) t.emplace_back(o + r, o + c, 1.0);
    for (const int p : island.pairs) {
      const auto& [i, j] = pairs_[static_cast<std::size_t>(p)];
      const int oi = 12 * local_[static_cast<std::size_t>(i)], oj = 12 * local_[static_cast<std::size_t>(j)];
      for (int c = 0; c < 12; ++c)
        for (int r = 0; r < 12; ++r) t.emplace_back(oj + r, oi + c, 1.0);  // i < j: below the diagonal
    }
    m.setFromTriplets(t.begin(), t.end());
    m.makeCompressed();
    island.sparse->factor.analyzePattern(m);
  }
  auto& m = island.sparse->matrix;
  for (const int b : island.blocks) {
    const auto i = static_cast<std::size_t>(b);
    const int o = 12 * local_[i];
    for (int c = 0; c < 12; ++c) {
      double* v = m.valuePtr() + m.outerIndexPtr()[o + c];  // the diagonal block comes first in its columns
      for (int r = c; r < 12; ++r) *v++ = diagonal[i](r, c);
    }
  }
  for (const int p : island.pairs) {
    const auto& [i, j] = pairs_[static_cast<std::size_t>(p)];
    const int oi = 12 * local_[static_cast<std::size_t>(i)], oj = 12 * local_[static_cast<std::size_t>(j)];
    const Mat12 k = coupling[static_cast<std::size_t>(p)].transpose();
    for (int c = 0; c < 12; ++c) {
      const auto begin = m.innerIndexPtr() + m.outerIndexPtr()[oi + c],
                 end = m.innerIndexPtr() + m.outerIndexPtr()[oi + c + 1];
      double* v = m.valuePtr() + (std::lower_bound(begin, end, oj) - m.innerIndexPtr());
      for (int r = 0; r < 12; ++r) v[r] = k(r, c);
    }
  }
  island.sparse->factor.factorize(m);
  if (island.sparse->factor.info() != Eigen::Success || (island.sparse->factor.vectorD().array() <= 0).any())
    not_spd();
  VecX f(n);
  for (const int b : island.blocks)
    f.segment<12>(12 * local_[static_cast<std::size_t>(b)]) = rhs[static_cast<std::size_t>(b)];
  VecX d = island.sparse->factor.solve(f);
  d += island.sparse->factor.solve(f - m.selfadjointView<Eigen::Lower>() * d);  // one refinement
  for (const int b : island.blocks)
    solution[static_cast<std::size_t>(b)] = d.segment<12>(12 * local_[static_cast<std::size_t>(b)]);
}

bool BlockSystem::solve_pcg(Island& island) {
  const std::size_t n = island.blocks.size();
  std::vector<Eigen::LLT<Mat12>> inverse(n);
  std::vector<Vec12> x(n, Vec12::Zero()), r(n), z(n), p(n), q(n);
  double rz = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(island.blocks[k]);
    inverse[k].compute(diagonal[i]);
    if (inverse[k].info() != Eigen::Success) not_spd();
    r[k] = rhs[i];
    z[k] = inverse[k].solve(r[k]);
    p[k] = z[k];
    rz += r[k].dot(z[k]);
  }
  const double goal = rz * pcg_tolerance * pcg_tolerance;
  for (int it = 0; it < pcg_cap && rz > goal; ++it) {
    for (std::size_t k = 0; k < n; ++k)
      q[k].noalias() = diagonal[static_cast<std::size_t>(island.blocks[k])] * p[k];
    for (const int e : island.pairs) {
      const auto& [i, j] = pairs_[static_cast<std::size_t>(e)];
      const auto li = static_cast<std::size_t>(local_[static_cast<std::size_t>(i)]);
      const auto lj = static_cast<std::size_t>(local_[static_cast<std::size_t>(j)]);
      const Mat12& k = coupling[static_cast<std::size_t>(e)];
      q[li].noalias() += k * p[lj];
      q[lj].noalias() += k.transpose() * p[li];
    }
    double pq = 0;
    for (std::size_t k = 0; k < n; ++k) pq += p[k].dot(q[k]);
    if (!(pq > 0)) return false;
    const double alpha = rz / pq;
    double rz_next = 0;
    for (std::size_t k = 0; k < n; ++k) {
      x[k] += alpha * p[k];
      r[k] -= alpha * q[k];
      z[k] = inverse[k].solve(r[k]);
      rz_next += r[k].dot(z[k]);
    }
    const double beta = rz_next / rz;
    rz = rz_next;
    for (std::size_t k = 0; k < n; ++k) p[k] = z[k] + beta * p[k];
  }
  if (!(rz <= goal)) return false;
  for (std::size_t k = 0; k < n; ++k) solution[static_cast<std::size_t>(island.blocks[k])] = x[k];
  return true;
}

}  // namespace talus::dda::shi1988
