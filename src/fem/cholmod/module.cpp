#include <cholmod.h>
#include <fmt/format.h>

#include <cstring>

#include "core/error.hpp"
#include "fem/cholmod/factorization.hpp"

extern "C" void openblas_set_num_threads(int) __attribute__((weak));
extern "C" void omp_set_max_active_levels(int) __attribute__((weak));

namespace talus::fem {
namespace {

SuiteSparse_long* longs(void* p) { return static_cast<SuiteSparse_long*>(p); }

}  // namespace

class Supernodal : public Factorization {
 public:
  Supernodal(const SymmetricMatrix& a, double shift, const std::vector<double>& d) : n_(a.n) {
    // BLAS with several threads may sum in another order: results must not depend on the machine's load. CHOLMOD itself shares loops among threads
    // that are too short for it, which then wait for each other at full load.
    if (openblas_set_num_threads) openblas_set_num_threads(1);
    if (omp_set_max_active_levels) omp_set_max_active_levels(0);
    cholmod_l_start(&common_);
    common_.supernodal = CHOLMOD_SUPERNODAL;
    common_.nmethods = 1;
    common_.method[0].ordering = a.n > 2000 ? CHOLMOD_METIS : CHOLMOD_AMD;
    common_.postorder = 1;
    common_.print = 0;
    factorize(a, shift, d);
    if (common_.status == CHOLMOD_OK && factor_ && factor_->minor == static_cast<std::size_t>(n_)) return;
    const int column_bad = factor_ ? static_cast<int>(factor_->minor) : -1;
    release();
    throw NumericalFailure(fmt::format("The stiffness of the structure is not positive definite (degree of freedom {} of {}): are the supports enough?",
                                       column_bad, n_));
  }
  ~Supernodal() override { release(); }

  void solve(const double* b, double* x, int columns) override {
    cholmod_dense rhs{};  // a view of the caller's numbers
    rhs.nrow = rhs.d = static_cast<std::size_t>(n_);
    rhs.ncol = static_cast<std::size_t>(columns);
    rhs.nzmax = rhs.nrow * rhs.ncol;
    rhs.x = const_cast<double*>(b);
    rhs.xtype = CHOLMOD_REAL;
    rhs.dtype = CHOLMOD_DOUBLE;
    cholmod_l_solve2(CHOLMOD_A, factor_, &rhs, nullptr, &solution_, nullptr, &y_, &e_, &common_);
    std::memcpy(x, solution_->x, sizeof(double) * rhs.nzmax);
  }

  std::size_t bytes() const override {
    return sizeof(double) * factor_->xsize + sizeof(SuiteSparse_long) * (factor_->ssize + 3 * factor_->nsuper + 3 * factor_->n);
  }

 private:
  void factorize(const SymmetricMatrix& a, double shift, const std::vector<double>& d) {
    cholmod_sparse* s = cholmod_l_allocate_sparse(a.n, a.n, a.row.size(), 1, 1, -1, CHOLMOD_REAL, &common_);
    auto* value = static_cast<double*>(s->x);
    for (int c = 0; c <= a.n; ++c) longs(s->p)[c] = a.column[c];
    for (std::size_t k = 0; k < a.row.size(); ++k) longs(s->i)[k] = a.row[k], value[k] = a.value[k];
    if (shift != 0)
      for (int c = 0; c < a.n; ++c) value[a.column[c]] += shift * d[c];  // the diagonal comes first in its column
    factor_ = cholmod_l_analyze(s, &common_);
    cholmod_l_factorize(s, factor_, &common_);
    cholmod_l_free_sparse(&s, &common_);
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
};

}  // namespace talus::fem

/// `factor` is given the factorization of A + shift * diag(d). Throws NumericalFailure if that is not positive definite.
extern "C" __attribute__((visibility("default"))) void talus_factorize(std::unique_ptr<talus::fem::Factorization>& factor, const talus::fem::SymmetricMatrix& a,
                                                                       double shift, const std::vector<double>& d) {
  factor = std::make_unique<talus::fem::Supernodal>(a, shift, d);
}
