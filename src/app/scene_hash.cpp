#include "app/scene_hash.hpp"

#include <nlohmann/json.hpp>

#include "core/sha256.hpp"

namespace talus::app {

std::string scene_hash(const std::string& resolved) {
  std::string text = resolved;
  // Where the files are does not matter, but what they hold: a run goes on in a directory that was moved.
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_object() && json.contains("resolved")) {
    const auto& header = json["resolved"];
    const auto put = [&](const nlohmann::json& path, const std::string& in_place) {
      const std::string old = path.dump();
      for (auto at = text.find(old); at != std::string::npos; at = text.find(old, at + in_place.size()))
        text.replace(at, old.size(), in_place);
    };
    if (header.contains("scene")) put(header["scene"], "scene");
    if (header.contains("file"))
      for (const auto& file : header["file"]) put(file["path"], file["sha256"].get<std::string>());
  }
  // Threads change no bit, and where no step was short enough a run goes on with a shorter one.
  for (const char* free : {"\"threads\":", "\"min_step\":"})
    if (const auto at = text.find(free); at != std::string::npos) text.erase(at, text.find('\n', at) - at);
  return sha256(text);
}

}  // namespace talus::app
