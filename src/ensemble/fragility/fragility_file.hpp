/// fragility.json: figures of damage, of every structure for which they were computed.
#pragma once
#include <filesystem>
#include <vector>

#include <nlohmann/json.hpp>

namespace talus::ensemble {

/// Of each structure, the one that was asked for last before the others; empty if there is no such file.
/// Throws InputError if it is not as the program wrote it.
std::vector<nlohmann::ordered_json> read_fragility(const std::filesystem::path& directory);

/// Writes `figures` of a structure, with those that are there of other structures as `others`.
void keep_fragility(const std::filesystem::path& directory, nlohmann::ordered_json figures);

}  // namespace talus::ensemble
