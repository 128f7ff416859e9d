#include <cholmod.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "core/error.hpp"
#include "core/memory.hpp"
#include "core/types.hpp"
#include "fem/linear/linear_system.hpp"
#include "fem/not_enough_memory.hpp"

extern "C" void openblas_set_num_threads(int) __attribute__((weak));
extern "C" void omp_set_max_active_levels(int) __attribute__((weak));

namespace talus::fem {
namespace {

SuiteSparse_long* longs(void* p) { return static_cast<SuiteSparse_long*>(p); }

std::mutex blas;

}  // namespace

BlasInUse::BlasInUse() : lock_(blas) {
  [[maybe_unused]] static const bool told = [] {
    if (openblas_set_num_threads) openblas_set_num_threads(1);
    return true;
  }();
}

class Factorization {
 public:
  Factorization(const SymmetricMatrix& a, double shift, const std::vector<double>& d,
                std::vector<std::int64_t>* ordering)
      : n_(a.n) {
    // CHOLMOD itself shares loops among threads that are too short for it, which then wait for each other at
    // full load.
    if (omp_set_max_active_levels) omp_set_max_active_levels(0);
    cholmod_l_start(&common_);
    common_.supernodal = CHOLMOD_SUPERNODAL;
    common_.nmethods = 1;
    common_.method[0].ordering = a.n > 2000 ? CHOLMOD_METIS : CHOLMOD_AMD;
    common_.postorder = 1;
    common_.print = 0;
    try {
      again(a, shift, d, ordering);
    } catch (const std::exception&) {
      release();
      throw;
    }
  }
  ~Factorization() { release(); }
  Factorization(const Factorization&) = delete;
  Factorization& operator=(const Factorization&) = delete;

  /// Where the pattern is the last one's, what was found out about it and the room of the factor serve again.
  void again(const SymmetricMatrix& a, double shift, const std::vector<double>& d,
             std::vector<std::int64_t>* ordering) {
    const bool known = factor_ != nullptr && a.n == n_ && a.column == column_ && a.row == row_;
    if (!known) {
      cholmod_l_free_factor(&factor_, &common_);
      parent_.clear();
      n_ = a.n, column_ = a.column, row_ = a.row;
    }
    factorize(a, shift, d, ordering);
    if (common_.status == CHOLMOD_OK && factor_ && factor_->minor == static_cast<std::size_t>(n_)) return;
    throw NumericalFailure(
        fmt::format("The stiffness of the structure is not positive definite (degree of freedom {} of {}): "
                    "are the supports enough?",
                    factor_ ? static_cast<int>(factor_->minor) : -1, n_));
  }

  void solve(const double* b, double* x, int columns) { solve(CHOLMOD_A, b, x, columns); }

  void back(const double* z, double* x) {
    solve(CHOLMOD_Lt, z, x, 1);
    solve(CHOLMOD_Pt, x, x, 1);
  }

  HalfColumn half_column(int dof) {
    if (parent_.empty()) find_ways();
    HalfColumn y;
    y.supernode = supernode_[static_cast<std::size_t>(place_[static_cast<std::size_t>(dof)])];
    y.value.resize(static_cast<std::size_t>(way_[static_cast<std::size_t>(y.supernode)]));
    work_[place_[static_cast<std::size_t>(dof)]] = 1;
    double* value = y.value.data();
    for (int s = y.supernode; s >= 0; s = parent_[static_cast<std::size_t>(s)]) {
      const SuiteSparse_long first = longs(factor_->super)[s], columns = longs(factor_->super)[s + 1] - first;
      const SuiteSparse_long* rows = longs(factor_->s) + longs(factor_->pi)[s];
      const SuiteSparse_long height = longs(factor_->pi)[s + 1] - longs(factor_->pi)[s],
                             below = height - columns;
      const Eigen::Map<const MatX> block(static_cast<const double*>(factor_->x) + longs(factor_->px)[s],
                                         height, columns);
      Eigen::Map<VecX> x(work_.data() + first, columns);
      block.topRows(columns).triangularView<Eigen::Lower>().solveInPlace(x);
      pushed_.head(below).noalias() = block.bottomRows(below) * x;
      for (SuiteSparse_long i = 0; i < below; ++i) work_[rows[columns + i]] -= pushed_[i];
      value = std::copy_n(x.data(), columns, value);
      x.setZero();
    }
    return y;
  }

  double product(const HalfColumn& a, const HalfColumn& b) const {
    int s = a.supernode, t = b.supernode;  // until they meet; parents have the larger number
    while (s != t && s >= 0 && t >= 0) (s < t ? s : t) = parent_[static_cast<std::size_t>(s < t ? s : t)];
    if (s != t || s < 0) return 0;
    const int common = way_[static_cast<std::size_t>(s)];
    return Eigen::Map<const VecX>(a.value.data() + a.value.size() - common, common)
        .dot(Eigen::Map<const VecX>(b.value.data() + b.value.size() - common, common));
  }

  void add(const HalfColumn& y, double factor, double* z) const {
    const double* value = y.value.data();
    for (int s = y.supernode; s >= 0; s = parent_[static_cast<std::size_t>(s)])
      for (SuiteSparse_long c = longs(factor_->super)[s]; c < longs(factor_->super)[s + 1]; ++c)
        z[c] += factor * *value++;
  }

  std::size_t bytes() const {
    return sizeof(double) * factor_->xsize + sizeof(std::int64_t) * column_.size() +
           sizeof(int) * row_.size() +
           sizeof(SuiteSparse_long) * (factor_->ssize + 3 * factor_->nsuper + 3 * factor_->n);
  }

 private:
  void solve(int system, const double* b, double* x, int columns) {
    const BlasInUse blas_in_use;
    cholmod_dense rhs{};  // a view of the caller's numbers
    rhs.nrow = rhs.d = static_cast<std::size_t>(n_);
    rhs.ncol = static_cast<std::size_t>(columns);
    rhs.nzmax = rhs.nrow * rhs.ncol;
    rhs.x = const_cast<double*>(b);
    rhs.xtype = CHOLMOD_REAL;
    rhs.dtype = CHOLMOD_DOUBLE;
    if (cholmod_l_solve2(system, factor_, &rhs, nullptr, &solution_, nullptr, &y_, &e_, &common_) == 0 ||
        solution_ == nullptr)
      fail(8.0 * n_ * (columns + 8));
    std::memcpy(x, solution_->x, sizeof(double) * rhs.nzmax);
  }
  /// The elimination tree by supernodes, and how many columns lie on the way from each to its root.
  void find_ways() {
    const auto supernodes = static_cast<std::size_t>(factor_->nsuper);
    supernode_.resize(static_cast<std::size_t>(n_));
    place_.resize(static_cast<std::size_t>(n_));
    parent_.assign(supernodes, -1);
    way_.resize(supernodes);
    work_.setZero(n_);
    SuiteSparse_long highest = 0;
    for (int i = 0; i < n_; ++i) place_[static_cast<std::size_t>(longs(factor_->Perm)[i])] = i;
    for (std::size_t s = 0; s < supernodes; ++s)
      for (SuiteSparse_long c = longs(factor_->super)[s]; c < longs(factor_->super)[s + 1]; ++c)
        supernode_[static_cast<std::size_t>(c)] = static_cast<int>(s);
    for (std::size_t s = supernodes; s-- > 0;) {
      const SuiteSparse_long columns = longs(factor_->super)[s + 1] - longs(factor_->super)[s],
                             height = longs(factor_->pi)[s + 1] - longs(factor_->pi)[s];
      highest = std::max(highest, height);
      way_[s] = static_cast<int>(columns);
      if (height == columns) continue;
      parent_[s] = supernode_[static_cast<std::size_t>(longs(factor_->s)[longs(factor_->pi)[s] + columns])];
      way_[s] += way_[static_cast<std::size_t>(parent_[s])];
    }
    pushed_.resize(highest);
  }
  void factorize(const SymmetricMatrix& a, double shift, const std::vector<double>& d,
                 std::vector<std::int64_t>* ordering) {
    const BlasInUse blas_in_use;
    cholmod_sparse* s = cholmod_l_allocate_sparse(a.n, a.n, a.row.size(), 1, 1, -1, CHOLMOD_REAL, &common_);
    if (s == nullptr) fail(16.0 * static_cast<double>(a.row.size()));
    auto* value = static_cast<double*>(s->x);
    for (int c = 0; c <= a.n; ++c) longs(s->p)[c] = a.column[c];
    for (std::size_t k = 0; k < a.row.size(); ++k) longs(s->i)[k] = a.row[k], value[k] = a.value[k];
    if (shift != 0)
      for (int c = 0; c < a.n; ++c)
        value[a.column[c]] += shift * d[c];  // the diagonal comes first in its column
    static_assert(sizeof(SuiteSparse_long) == sizeof(std::int64_t));
    if (factor_ != nullptr) {
      // Its pattern is known.
    } else if (ordering != nullptr && a.n > 2000) {
      if (ordering->empty()) {
        ordering->resize(static_cast<std::size_t>(a.n));
        cholmod_l_metis(s, nullptr, 0, 1, longs(ordering->data()), &common_);
      }
      common_.method[0].ordering = CHOLMOD_GIVEN;
      factor_ = cholmod_l_analyze_p(s, longs(ordering->data()), nullptr, 0, &common_);
    } else {
      factor_ = cholmod_l_analyze(s, &common_);
    }
    // The analysis says how large the factor becomes: what is not there is not asked for.
    const double wanted =
        factor_ != nullptr && factor_->x == nullptr ? 8.0 * static_cast<double>(factor_->xsize) : 0;
    if (factor_ != nullptr && wanted < available_memory())
      cholmod_l_factorize(s, factor_, &common_);
    else if (common_.status == CHOLMOD_OK)
      common_.status = CHOLMOD_OUT_OF_MEMORY;
    cholmod_l_free_sparse(&s, &common_);
    if (common_.status == CHOLMOD_OUT_OF_MEMORY || common_.status == CHOLMOD_TOO_LARGE) fail(wanted);
  }
  /// `wanted`: what was to be had at least [bytes].
  [[noreturn]] void fail(double wanted) const {
    if (common_.status == CHOLMOD_TOO_LARGE)
      throw NotEnoughMemory(fmt::format(
          "the factor of its stiffness ({} degrees of freedom) is larger than its numbers can count", n_));
    if (common_.status != CHOLMOD_OUT_OF_MEMORY)
      throw NumericalFailure(fmt::format(
          "The factor of the stiffness of the structure cannot be made or used (CHOLMOD status {})",
          common_.status));
    throw NotEnoughMemory(
        fmt::format("the factor of its stiffness ({} degrees of freedom) takes {:.3g} GB, {:.3g} GB are free",
                    n_, wanted / 1e9, available_memory() / 1e9));
  }
  void release() {
    cholmod_l_free_dense(&solution_, &common_);
    cholmod_l_free_dense(&y_, &common_);
    cholmod_l_free_dense(&e_, &common_);
    cholmod_l_free_factor(&factor_, &common_);
    cholmod_l_finish(&common_);
  }

  cholmod_common common_;
  cholmod_factor* factor_ = nullptr;
  cholmod_dense *solution_ = nullptr, *y_ = nullptr, *e_ = nullptr;
  int n_;
  std::vector<std::int64_t> column_;  // the pattern of the matrix
  std::vector<int> row_;
  std::vector<int> place_, supernode_, parent_,
      way_;  // of a degree of freedom in the factor's order; of a column its supernode; of a supernode the
             // next one on the way to the root, -1: none, and the columns on it
  VecX work_, pushed_;  // zero between calls; of the rows below a supernode
};

CholeskyFactor::CholeskyFactor(const SymmetricMatrix& a, double shift, const std::vector<double>& d,
                               std::vector<std::int64_t>* ordering)
    : factorization_(std::make_unique<Factorization>(a, shift, d, ordering)) {}

CholeskyFactor::~CholeskyFactor() = default;

void CholeskyFactor::again(const SymmetricMatrix& a, double shift, const std::vector<double>& d,
                           std::vector<std::int64_t>* ordering) {
  factorization_->again(a, shift, d, ordering);
}
void CholeskyFactor::solve(const double* b, double* x, int columns) const {
  factorization_->solve(b, x, columns);
}
HalfColumn CholeskyFactor::half_column(int dof) const { return factorization_->half_column(dof); }
double CholeskyFactor::product(const HalfColumn& a, const HalfColumn& b) const {
  return factorization_->product(a, b);
}
void CholeskyFactor::add(const HalfColumn& column, double factor, double* z) const {
  factorization_->add(column, factor, z);
}
void CholeskyFactor::back(const double* z, double* x) const { factorization_->back(z, x); }
std::size_t CholeskyFactor::bytes() const { return factorization_->bytes(); }

}  // namespace talus::fem
