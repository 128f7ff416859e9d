/// The state of a run as named arrays in one HDF5 file, whole or absent, guarded by a checksum over every
/// byte.
///
///   file = user block of 512 bytes ("TALUSCK1", length u64, crc64 u64, zeros), then HDF5
///   HDF5 = /numbers/NAME [n] float64, /integers/NAME [n] int64, attributes scene_hash, version
///
/// The checksum is verified before HDF5 sees the file, so that a damaged file is named as such and never
/// interpreted. What is stored comes back bit for bit.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace talus::io {

struct Checkpoint {
  std::string scene_hash;  // of scene.resolved.json
  std::string version;     // of the program: another one may arrange its state differently
  std::map<std::string, std::vector<double>> numbers;
  std::map<std::string, std::vector<std::int64_t>> integers;
};

/// Throws WriteError.
void save_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint);

/// Throws InputError that says why: missing, no checkpoint, cut short, damaged, of another scene, of another
/// version.
Checkpoint load_checkpoint(const std::filesystem::path& path, const std::string& scene_hash,
                           const std::string& version);

}  // namespace talus::io
