#include "sim/audit.hpp"

#include <array>

#include <fmt/format.h>

namespace talus::sim {

std::string audit_failure(const InterfaceAudit& audit, double residual, double made, double in_one_step) {
  struct Gate {
    const char* what;
    double value, limit;
  };
  const std::array gates{
      Gate{"force imbalance", audit.worst_force_imbalance, 1e-12},
      Gate{"moment imbalance", audit.worst_moment_imbalance, 1e-12},
      Gate{"impulse defect", audit.impulse_defect, 1e-9},
      Gate{"energy residual over the largest kinetic energy", residual, 0.01},
      Gate{"numerical energy gain over the largest kinetic energy", made, 0.01},
      Gate{"numerical energy gain of one step over the largest kinetic energy", in_one_step, 0.01}};
  std::string failure;
  for (const Gate& gate : gates)
    if (!(gate.value <= gate.limit))
      failure += fmt::format("{}{} {:.3g} (limit {:g})", failure.empty() ? "audit: " : ", ", gate.what,
                             gate.value, gate.limit);
  return failure;
}

}  // namespace talus::sim
