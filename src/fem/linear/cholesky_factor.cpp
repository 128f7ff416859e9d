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

struct CholeskyFactor::Cholmod {
  Cholmod() {
    // CHOLMOD itself shares loops among threads that are too short for it, which then wait for each other at
    // full load.
    if (omp_set_max_active_levels) omp_set_max_active_levels(0);
    cholmod_l_start(&common);
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.nmethods = 1;
    common.postorder = 1;
    common.print = 0;
  }
  ~Cholmod() {
    cholmod_l_free_dense(&solution, &common);
    cholmod_l_free_dense(&y, &common);
    cholmod_l_free_dense(&e, &common);
    cholmod_l_free_factor(&factor, &common);
    cholmod_l_finish(&common);
  }
  Cholmod(const Cholmod&) = delete;
  Cholmod& operator=(const Cholmod&) = delete;

  cholmod_common common;
  cholmod_factor* factor = nullptr;
  cholmod_dense *solution = nullptr, *y = nullptr, *e = nullptr;
  // The elimination tree: place of a degree of freedom in the factor's order; supernode of a column; of a
  // supernode the next one on the way to the root, -1: none, and the columns on it.
  std::vector<int> place, supernode, parent, way;
  VecX work, pushed;  // zero between calls; of the rows below a supernode
};

CholeskyFactor::CholeskyFactor(const SymmetricMatrix& a, double shift, const std::vector<double>& d,
                               std::vector<std::int64_t>* ordering)
    : c_(std::make_unique<Cholmod>()), n_(a.n) {
  c_->common.method[0].ordering = a.n > 2000 ? CHOLMOD_METIS : CHOLMOD_AMD;
  again(a, shift, d, ordering);
}

CholeskyFactor::~CholeskyFactor() = default;

/// Where the pattern is the last one's, what was found out about it and the room of the factor serve again.
void CholeskyFactor::again(const SymmetricMatrix& a, double shift, const std::vector<double>& d,
                           std::vector<std::int64_t>* ordering) {
  const bool known = c_->factor != nullptr && a.n == n_ && a.column == column_ && a.row == row_;
  if (!known) {
    cholmod_l_free_factor(&c_->factor, &c_->common);
    c_->parent.clear();
    n_ = a.n, column_ = a.column, row_ = a.row;
  }
  factorize(a, shift, d, ordering);
  if (c_->common.status < CHOLMOD_OK || c_->factor == nullptr) fail(0);
  if (c_->common.status == CHOLMOD_OK && c_->factor->minor == static_cast<std::size_t>(n_)) return;
  throw NumericalFailure(
      fmt::format("The stiffness of the structure is not positive definite (degree of freedom {} of {}): "
                  "are the supports enough?",
                  c_->factor->minor, n_));
}

void CholeskyFactor::solve(const double* b, double* x, int columns) const { solve(CHOLMOD_A, b, x, columns); }

void CholeskyFactor::back(const double* z, double* x) const {
  solve(CHOLMOD_Lt, z, x, 1);
  solve(CHOLMOD_Pt, x, x, 1);
}

HalfColumn CholeskyFactor::half_column(int dof) const {
  if (c_->parent.empty()) find_ways();
  HalfColumn y;
  y.supernode = c_->supernode[static_cast<std::size_t>(c_->place[static_cast<std::size_t>(dof)])];
  y.value.resize(static_cast<std::size_t>(c_->way[static_cast<std::size_t>(y.supernode)]));
  c_->work[c_->place[static_cast<std::size_t>(dof)]] = 1;
  double* value = y.value.data();
  for (int s = y.supernode; s >= 0; s = c_->parent[static_cast<std::size_t>(s)]) {
    const SuiteSparse_long first = longs(c_->factor->super)[s],
                           columns = longs(c_->factor->super)[s + 1] - first;
    const SuiteSparse_long* rows = longs(c_->factor->s) + longs(c_->factor->pi)[s];
    const SuiteSparse_long height = longs(c_->factor->pi)[s + 1] - longs(c_->factor->pi)[s],
                           below = height - columns;
    const Eigen::Map<const MatX> block(static_cast<const double*>(c_->factor->x) + longs(c_->factor->px)[s],
                                       height, columns);
    Eigen::Map<VecX> x(c_->work.data() + first, columns);
    block.topRows(columns).triangularView<Eigen::Lower>().solveInPlace(x);
    c_->pushed.head(below).noalias() = block.bottomRows(below) * x;
    for (SuiteSparse_long i = 0; i < below; ++i) c_->work[rows[columns + i]] -= c_->pushed[i];
    value = std::copy_n(x.data(), columns, value);
    x.setZero();
  }
  return y;
}

double CholeskyFactor::product(const HalfColumn& a, const HalfColumn& b) const {
  int s = a.supernode, t = b.supernode;  // until they meet; parents have the larger number
  while (s != t && s >= 0 && t >= 0) (s < t ? s : t) = c_->parent[static_cast<std::size_t>(s < t ? s : t)];
  if (s != t || s < 0) return 0;
  const int common = c_->way[static_cast<std::size_t>(s)];
  return Eigen::Map<const VecX>(a.value.data() + a.value.size() - common, common)
      .dot(Eigen::Map<const VecX>(b.value.data() + b.value.size() - common, common));
}

void CholeskyFactor::add(const HalfColumn& y, double factor, double* z) const {
  const double* value = y.value.data();
  for (int s = y.supernode; s >= 0; s = c_->parent[static_cast<std::size_t>(s)])
    for (SuiteSparse_long c = longs(c_->factor->super)[s]; c < longs(c_->factor->super)[s + 1]; ++c)
      z[c] += factor * *value++;
}

std::size_t CholeskyFactor::bytes() const {
  return sizeof(double) * c_->factor->xsize + sizeof(std::int64_t) * column_.size() +
         sizeof(int) * row_.size() +
         sizeof(SuiteSparse_long) * (c_->factor->ssize + 3 * c_->factor->nsuper + 3 * c_->factor->n);
}

void CholeskyFactor::solve(int system, const double* b, double* x, int columns) const {
  const BlasInUse blas_in_use;
  cholmod_dense rhs{};  // a view of the caller's numbers
  rhs.nrow = rhs.d = static_cast<std::size_t>(n_);
  rhs.ncol = static_cast<std::size_t>(columns);
  rhs.nzmax = rhs.nrow * rhs.ncol;
  rhs.x = const_cast<double*>(b);
  rhs.xtype = CHOLMOD_REAL;
  rhs.dtype = CHOLMOD_DOUBLE;
  if (cholmod_l_solve2(system, c_->factor, &rhs, nullptr, &c_->solution, nullptr, &c_->y, &c_->e,
                       &c_->common) == 0 ||
      c_->solution == nullptr)
    fail(8.0 * n_ * (columns + 8));
  std::memcpy(x, c_->solution->x, sizeof(double) * rhs.nzmax);
}

/// The elimination tree by supernodes, and how many columns lie on the way from each to its root.
void CholeskyFactor::find_ways() const {
  const auto supernodes = static_cast<std::size_t>(c_->factor->nsuper);
  c_->supernode.resize(static_cast<std::size_t>(n_));
  c_->place.resize(static_cast<std::size_t>(n_));
  c_->parent.assign(supernodes, -1);
  c_->way.resize(supernodes);
  c_->work.setZero(n_);
  SuiteSparse_long highest = 0;
  for (int i = 0; i < n_; ++i) c_->place[static_cast<std::size_t>(longs(c_->factor->Perm)[i])] = i;
  for (std::size_t s = 0; s < supernodes; ++s)
    for (SuiteSparse_long c = longs(c_->factor->super)[s]; c < longs(c_->factor->super)[s + 1]; ++c)
      c_->supernode[static_cast<std::size_t>(c)] = static_cast<int>(s);
  for (std::size_t s = supernodes; s-- > 0;) {
    const SuiteSparse_long columns = longs(c_->factor->super)[s + 1] - longs(c_->factor->super)[s],
                           height = longs(c_->factor->pi)[s + 1] - longs(c_->factor->pi)[s];
    highest = std::max(highest, height);
    c_->way[s] = static_cast<int>(columns);
    if (height == columns) continue;
    c_->parent[s] =
        c_->supernode[static_cast<std::size_t>(longs(c_->factor->s)[longs(c_->factor->pi)[s] + columns])];
    c_->way[s] += c_->way[static_cast<std::size_t>(c_->parent[s])];
  }
  c_->pushed.resize(highest);
}

void CholeskyFactor::factorize(const SymmetricMatrix& a, double shift, const std::vector<double>& d,
                               std::vector<std::int64_t>* ordering) {
  const BlasInUse blas_in_use;
  cholmod_sparse* s = cholmod_l_allocate_sparse(a.n, a.n, a.row.size(), 1, 1, -1, CHOLMOD_REAL, &c_->common);
  if (s == nullptr) fail(16.0 * static_cast<double>(a.row.size()));
  auto* value = static_cast<double*>(s->x);
  for (int c = 0; c <= a.n; ++c) longs(s->p)[c] = a.column[c];
  for (std::size_t k = 0; k < a.row.size(); ++k) longs(s->i)[k] = a.row[k], value[k] = a.value[k];
  if (shift != 0)
    for (int c = 0; c < a.n; ++c)
      value[a.column[c]] += shift * d[c];  // the diagonal comes first in its column
  static_assert(sizeof(SuiteSparse_long) == sizeof(std::int64_t));
  if (c_->factor != nullptr) {
    // Its pattern is known.
  } else if (ordering != nullptr && a.n > 2000) {
    if (ordering->empty()) {
      ordering->resize(static_cast<std::size_t>(a.n));
      cholmod_l_metis(s, nullptr, 0, 1, longs(ordering->data()), &c_->common);
    }
    c_->common.method[0].ordering = CHOLMOD_GIVEN;
    c_->factor = cholmod_l_analyze_p(s, longs(ordering->data()), nullptr, 0, &c_->common);
  } else {
    c_->factor = cholmod_l_analyze(s, &c_->common);
  }
  // The analysis says how large the factor becomes: what is not there is not asked for.
  const double wanted =
      c_->factor != nullptr && c_->factor->x == nullptr ? 8.0 * static_cast<double>(c_->factor->xsize) : 0;
  if (c_->factor != nullptr && wanted < available_memory())
    cholmod_l_factorize(s, c_->factor, &c_->common);
  else if (c_->common.status == CHOLMOD_OK)
    c_->common.status = CHOLMOD_OUT_OF_MEMORY;
  cholmod_l_free_sparse(&s, &c_->common);
  if (c_->common.status == CHOLMOD_OUT_OF_MEMORY || c_->common.status == CHOLMOD_TOO_LARGE) fail(wanted);
}

/// `wanted`: what was to be had at least [bytes].
void CholeskyFactor::fail(double wanted) const {
  if (c_->common.status == CHOLMOD_TOO_LARGE)
    throw NotEnoughMemory(fmt::format(
        "the factor of its stiffness ({} degrees of freedom) is larger than its numbers can count", n_));
  if (c_->common.status != CHOLMOD_OUT_OF_MEMORY)
    throw NumericalFailure(
        fmt::format("The factor of the stiffness of the structure cannot be made or used (CHOLMOD status {})",
                    c_->common.status));
  throw NotEnoughMemory(
      fmt::format("the factor of its stiffness ({} degrees of freedom) takes {:.3g} GB, {:.3g} GB are free",
                  n_, wanted / 1e9, available_memory() / 1e9));
}

}  // namespace talus::fem
