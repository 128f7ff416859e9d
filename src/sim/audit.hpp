/// Gates of the interface audit (interface.md): what `audit = "strict"` fails a run for.
///
///   |F_blocks + F_structure| / |F|, the same of moments      1e-12
///   |impulse + momentum change| / |impulse|                  1e-9
///   |energy residual|, numerical gain in all, in one step    1 % of the largest kinetic energy
#pragma once
#include <string>

#include "sim/frame.hpp"

namespace talus::sim {

/// What is wrong; empty if nothing. `residual` of the ledger, energy that the scheme has made in all (`made`,
/// > 0) and in its worst step, over the largest kinetic energy, at least the potential energy of blocks that
/// fall by the accuracy.
std::string audit_failure(const InterfaceAudit& audit, double residual, double made, double in_one_step);

}  // namespace talus::sim
