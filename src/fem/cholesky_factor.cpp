#include "core/module.hpp"
#include "fem/cholmod/factorization.hpp"

namespace talus::fem {

CholeskyFactor::CholeskyFactor(const SymmetricMatrix& a, double shift, const std::vector<double>& d) {
  using Factorize = void (*)(std::unique_ptr<Factorization>&, const SymmetricMatrix&, double, const std::vector<double>&);
  static const auto factorize = reinterpret_cast<Factorize>(
      module_symbol("libtalus_cholmod.so", "talus_factorize", "structure", "build the target talus_cholmod (it needs SuiteSparse: make setup)"));
  factorize(factorization_, a, shift, d);
}

CholeskyFactor::~CholeskyFactor() = default;

std::size_t CholeskyFactor::bytes() const { return factorization_->bytes(); }

void CholeskyFactor::solve(const double* b, double* x, int columns) const { factorization_->solve(b, x, columns); }

}  // namespace talus::fem
