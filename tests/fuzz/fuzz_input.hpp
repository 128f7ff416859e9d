/// What the fuzz targets share: the first byte chooses, the rest is the file; a private directory in memory
/// for readers of files.
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "core/error.hpp"

namespace talus::fuzz {

struct Input {
  unsigned choice = 0;
  std::string_view bytes;
  Input(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return;
    choice = data[0];
    bytes = {reinterpret_cast<const char*>(data) + 1, size - 1};
  }
};

/// A violated property is a finding like a crash.
inline void require(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "property violated: %s\n", what);
  std::abort();
}

/// What is read is read, or refused with InputError that names a problem.
template <class F>
void read_or_refuse(F&& read) {
  try {
    read();
  } catch (const InputError& e) { require(!e.problems().empty(), "a refusal names a problem"); }
}

/// Made on first use, removed at the end of the program.
inline const std::filesystem::path& directory() {
  static const struct Directory {
    std::filesystem::path path;
    Directory() {
      const bool memory = std::filesystem::is_directory("/dev/shm");
      std::string name =
          ((memory ? std::filesystem::path("/dev/shm") : std::filesystem::temp_directory_path()) /
           "talus-fuzz-XXXXXX")
              .string();
      require(::mkdtemp(name.data()) != nullptr, "a temporary directory can be made");
      path = name;
    }
    ~Directory() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  } one;
  return one.path;
}

inline std::string file(const char* name, std::string_view bytes) {
  const std::filesystem::path path = directory() / name;
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return path.string();
}

}  // namespace talus::fuzz
