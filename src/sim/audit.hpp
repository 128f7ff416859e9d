/// Gates of the interface audit (interface.md): what `audit = "strict"` fails a run for.
///
///   |F_blocks + F_structure| / |F|, the same of moments      1e-12
///   |impulse + momentum change| / |impulse|                  1e-9
///   |energy residual|, energy made by the scheme             1 % of the largest kinetic energy
#pragma once
#include <string>

#include "sim/frame.hpp"

namespace talus::sim {

/// What is wrong; empty if nothing. `residual` of the ledger and what the scheme has made (`made`, > 0), both over the largest kinetic energy.
std::string audit_failure(const InterfaceAudit& audit, double residual, double made);

}  // namespace talus::sim
