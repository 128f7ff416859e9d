/// Why an island cannot go on.
#pragma once
#include "coupling/drift/drift_guard.hpp"
#include "coupling/step/step.hpp"

namespace talus::coupling {

/// The report says why: no solution of the contact problem, or a correction of overlaps that no motion
/// explains.
void fail_at_smallest_step(const IslandContext& in, const Step& step, IslandReport& report);
void fail_at_drift(const IslandContext& in, IslandReport& report, const DriftGuard::Worst& worst);

}  // namespace talus::coupling
