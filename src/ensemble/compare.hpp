/// Options side by side: differences of probabilities, percentiles, classes and forces between ensembles,
/// with intervals.
///
/// Ensembles are independent: half the width of the 95 % interval of a difference is the root of the sum of
/// squares of both half-widths, upper and lower taken each by itself [Zou & Donner 2008].
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace talus::ensemble {

/// Writes compare.json and compare.html into `output`. The first directory is what the others are held
/// against. Returns lines to print. Throws InputError.
std::vector<std::string> write_comparison(const std::vector<std::filesystem::path>& directories,
                                          const std::filesystem::path& output);

}  // namespace talus::ensemble
