/// What libtalus_cholmod.so gives: a factor of a matrix, and its solutions. CHOLMOD maps OpenBLAS, the largest library but those of deal.II, for
/// which a structure that is stepped explicitly has no use, so it is a module of its own, loaded by the first factor.
#pragma once
#include "fem/linear/linear_system.hpp"

namespace talus::fem {

class Factorization {
 public:
  virtual ~Factorization() = default;
  virtual void solve(const double* b, double* x, int columns) = 0;
  virtual HalfColumn half_column(int dof) = 0;
  virtual double product(const HalfColumn& a, const HalfColumn& b) const = 0;
  virtual void add(const HalfColumn& column, double factor, double* z) const = 0;
  virtual void back(const double* z, double* x) = 0;
  virtual std::size_t bytes() const = 0;
};

}  // namespace talus::fem
