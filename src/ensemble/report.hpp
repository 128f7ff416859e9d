/// report.html of an ensemble: one page that opens offline, without scripts.
#pragma once
#include <filesystem>

#include "ensemble/ensemble.hpp"

namespace talus::ensemble {

/// From ensemble.h5, summary.json, details.json, maps/ and fragility.json of the directory. Returns the page.
/// Throws InputError.
std::filesystem::path write_report(const Ensemble& ensemble, const std::filesystem::path& directory);

}  // namespace talus::ensemble
