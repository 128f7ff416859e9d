/// report.html: one self-contained file, opened without a network, from results.h5 and summary.json.
///
/// The page itself (report/) is bundled when Talus is built and lies in the program; what is added here is
/// the data, decimated to a budget so that the file stays below 20 MB whatever the run: poses of the blocks
/// at up to 3000 instants (denser around impacts), the surface of each structure, terrain of at most some
/// 150,000 triangles, histories by minimum and maximum per interval.
#pragma once
#include <filesystem>
#include <string>

namespace talus::io {

/// Writes DIR/report.html and returns its path. Recovers the results first if the run was cut off. Throws
/// InputError if the directory holds no results.
std::filesystem::path write_report(const std::filesystem::path& directory);

}  // namespace talus::io
