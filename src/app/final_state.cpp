#include "app/final_state.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <utility>

#include "core/sha256.hpp"
#include "io/files.hpp"

namespace talus::app {

namespace {
constexpr const char* file_name = "final_state.h5";
constexpr const char* places = "struck_places";  // where cells were halved
std::string key_of(int structure) { return fmt::format("structure{}", structure); }
}  // namespace

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

std::span<const double> FinalState::of(int structure) const {
  const auto found = arrays.numbers.find(key_of(structure));
  if (found == arrays.numbers.end())
    throw io::bad_file(file_name, key_of(structure), "the final state lacks this structure",
                       "run the scene again");
  return found->second;
}

std::vector<double> FinalState::struck_places() const {
  const auto found = arrays.numbers.find(places);
  return found == arrays.numbers.end() ? std::vector<double>{} : found->second;
}

void save_final_state(const std::filesystem::path& directory, sim::Checkpoint state, double time,
                      const std::string& hash) {
  io::Checkpoint out;
  out.scene_hash = hash;
  out.version = TALUS_VERSION;
  for (auto& [key, values] : state.numbers)
    if (key.rfind("structure", 0) == 0) out.numbers[key] = std::move(values);
  if (out.numbers.empty()) return;
  out.numbers[places] = std::move(state.numbers[places]);
  out.numbers["time"] = {time};
  io::save_checkpoint(directory / file_name, out);
}

FinalState load_final_state(const std::filesystem::path& directory) {
  if (!std::filesystem::exists(directory / io::marker_name))
    throw io::bad_file(directory, "DIR", "is no output directory of Talus",
                       "name the directory of a finished run");
  if (!std::filesystem::exists(directory / file_name))
    throw io::bad_file(directory, file_name, "the run has no final state of a structure",
                       "it needs a [[structure]] with two-way coupling, run to its end");
  FinalState out;
  out.scene = scene::read_scene((directory / "scene.resolved.json").string());
  out.arrays = io::load_checkpoint(
      directory / file_name, scene_hash(io::read_file(directory / "scene.resolved.json")), TALUS_VERSION);
  out.time = out.arrays.numbers.at("time").at(0);
  return out;
}

}  // namespace talus::app
