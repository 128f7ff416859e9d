#include "fem/services.hpp"

#include "core/module.hpp"

namespace talus::fem {

const Services& services() {
  using Give = const Services* (*)();
  static const Services& loaded = *reinterpret_cast<Give>(
      module_symbol("libtalus_dealii.so", "talus_dealii_services", "structure", "build the target talus_dealii (it needs deal.II: make setup)"))();
  return loaded;
}

int solve_by_multigrid(const SymmetricMatrix& a, const std::vector<Vec3>& position, const std::vector<int>& direction, const double* b,
                       double* x, double tolerance) {
  return services().multigrid(a, position, direction, b, x, tolerance);
}

}  // namespace talus::fem
