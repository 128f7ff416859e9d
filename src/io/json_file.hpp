/// JSON files of an output directory, which may have been cut or edited since they were written.
#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "io/files.hpp"

namespace talus::io {

/// What the JSON library found wrong, as a fault of `file`. Its messages begin with
/// "[json.exception.type_error.302] ", which no user asked for.
inline InputError bad_json(const std::filesystem::path& file, const nlohmann::json::exception& error,
                           std::string remedy) {
  const std::string what = error.what();
  const std::size_t code = what.find("] ");
  return bad_file(
      file, {},
      "is not as the program wrote it: " + (code == std::string::npos ? what : what.substr(code + 2)),
      std::move(remedy));
}

/// The object in `file`. Throws InputError naming the file if it cannot be read, is no JSON, or no object.
inline nlohmann::ordered_json read_json(const std::filesystem::path& file, const std::string& remedy) {
  try {
    auto root = nlohmann::ordered_json::parse(read_file(file));
    if (!root.is_object()) throw bad_file(file, {}, "is not as the program wrote it: no JSON object", remedy);
    return root;
  } catch (const nlohmann::json::exception& error) { throw bad_json(file, error, remedy); }
}

}  // namespace talus::io
