/// Whether summary.json has what the report's page takes for granted.
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>

namespace talus::io {

/// Throws InputError naming the file and the key that is missing or of another kind than a run writes. Keys
/// that earlier versions did not write may be missing.
void check_summary(const nlohmann::ordered_json& summary, const std::filesystem::path& file);

}  // namespace talus::io
