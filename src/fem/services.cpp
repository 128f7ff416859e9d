#include "fem/services.hpp"

#include "core/module.hpp"

namespace talus::fem {

const Services& services() {
  using Give = const Services* (*)();
  static const Services& loaded = *reinterpret_cast<Give>(
      module_symbol("libtalus_dealii.so", "talus_dealii_services", "structure", "build the target talus_dealii (it needs deal.II: make setup)"))();
  return loaded;
}

std::unique_ptr<LinearSolver> make_multigrid(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction) {
  return services().multigrid(std::move(a), position, direction, {});
}

std::unique_ptr<LinearSolver> make_multigrid(SymmetricMatrix&& a, const std::vector<Vec3>& position, const std::vector<int>& direction, const std::vector<int>& body) {
  return services().multigrid(std::move(a), position, direction, body);
}

}  // namespace talus::fem
