/// Design formulas beside computed impacts: for each structure that was hit, the impact with the most energy
/// along the contact normal, with the mass, that speed and the diameter of the block that the run had
/// (formulas/formulas.hpp has the equations). What broke off the structure itself is no impact in their
/// sense.
///
/// What the run does not know (cushion, reinforcement, effective depth) keeps the formulas' defaults, and
/// says so.
#pragma once
#include <nlohmann/json.hpp>
#include <vector>

#include "io/summary.hpp"

namespace talus::io {

/// One object per impact and formula: keys in docs/output.md under `formulas[]`.
nlohmann::ordered_json design_checks(const sim::RunHeader& header, const std::vector<Impact>& impacts);

}  // namespace talus::io
