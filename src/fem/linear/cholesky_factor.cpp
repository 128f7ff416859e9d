#include "core/module.hpp"
#include "fem/linear/cholmod/factorization.hpp"

namespace talus::fem {

CholeskyFactor::CholeskyFactor(const SymmetricMatrix& a, double shift, const std::vector<double>& d, std::vector<std::int64_t>* ordering) { again(a, shift, d, ordering); }

void CholeskyFactor::again(const SymmetricMatrix& a, double shift, const std::vector<double>& d, std::vector<std::int64_t>* ordering) {
  using Factorize = void (*)(std::unique_ptr<Factorization>&, const SymmetricMatrix&, double, const std::vector<double>&, std::vector<std::int64_t>*);
  static const auto factorize = reinterpret_cast<Factorize>(
      module_symbol("libtalus_cholmod.so", "talus_factorize", "structure", "build the target talus_cholmod (it needs SuiteSparse: make setup)"));
  factorize(factorization_, a, shift, d, ordering);
}

CholeskyFactor::~CholeskyFactor() = default;

std::size_t CholeskyFactor::bytes() const { return factorization_->bytes(); }

HalfColumn CholeskyFactor::half_column(int dof) const { return factorization_->half_column(dof); }

double CholeskyFactor::product(const HalfColumn& a, const HalfColumn& b) const { return factorization_->product(a, b); }

void CholeskyFactor::add(const HalfColumn& column, double factor, double* z) const { factorization_->add(column, factor, z); }

void CholeskyFactor::back(const double* z, double* x) const { factorization_->back(z, x); }

void CholeskyFactor::solve(const double* b, double* x, int columns) const { factorization_->solve(b, x, columns); }

}  // namespace talus::fem
