/// The motion of the last stretch, which rows are read off.
#pragma once
#include <span>
#include <vector>

#include "coupling/system/system_state.hpp"

namespace talus::coupling {

class RecordedMotion {
 public:
  void clear() { motion_.clear(); }
  /// Takes what the islands did; `state`: at the end of the stretch, with the works as it began. The contact
  /// memory is that of its end.
  void keep(std::span<IslandReport> reports, const dda::Model& model, const SystemState& state);
  /// Blocks and works at time t within the stretch, or now [s].
  Moment at(double t, const dda::Model& model, const SystemState& state) const;

 private:
  std::vector<IslandMotion> motion_;
  Ledger works_before_;  // as it began; `contact`: of the springs of blocks that were in none of its islands
};

}  // namespace talus::coupling
