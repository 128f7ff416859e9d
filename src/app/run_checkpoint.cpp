#include "app/run_checkpoint.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/scene_hash.hpp"
#include "app/tell.hpp"
#include "io/checkpoint.hpp"

namespace talus::app {

namespace fs = std::filesystem;

namespace {

constexpr const char* journal_position = "recorder.journal_position";
constexpr const char* fragment_names = "recorder.fragment_names";

/// Names as whole numbers, byte by byte, since a checkpoint holds nothing else.
std::vector<std::int64_t> packed(const std::vector<std::string>& names) {
  std::vector<std::int64_t> out;
  for (const std::string& name : names) {
    for (const char c : name) out.push_back(static_cast<unsigned char>(c));
    out.push_back(0);
  }
  return out;
}

std::vector<std::string> unpacked(const std::vector<std::int64_t>& bytes) {
  std::vector<std::string> names;
  std::string name;
  for (const std::int64_t c : bytes) {
    if (c != 0) {
      name += static_cast<char>(c);
      continue;
    }
    names.push_back(name);
    name.clear();
  }
  return names;
}

}  // namespace

void RecordingSink::extend(std::span<const sim::RunHeader::BlockInfo> fragments) {
  recorder_.extend(fragments);
  for (const auto& fragment : fragments)
    recorder_.log().info("fragment", {{"name", fragment.name}, {"mass", fragment.mass}});
}

void RecordingSink::warning(const std::string& text) {
  line_.clear();
  tell("warning: {}\n", text);
  recorder_.warning(text);
}

void RecordingSink::checkpoint(const sim::Checkpoint& state) {
  io::Checkpoint out;
  out.scene_hash = hash_;
  out.version = TALUS_VERSION;
  out.numbers = state.numbers;
  out.integers = state.integers;
  out.integers[fragment_names] = packed(state.fragment_names);
  out.integers[journal_position] = {static_cast<std::int64_t>(recorder_.checkpoint())};
  io::save_checkpoint(recorder_.directory() / checkpoint_name, out);
  recorder_.log().info("checkpoint");
}

StoredRun load_run(const fs::path& file, const std::string& hash) {
  const io::Checkpoint stored = io::load_checkpoint(file, hash, TALUS_VERSION);
  StoredRun run;
  run.state.numbers = stored.numbers;
  run.state.integers = stored.integers;
  auto& integers = run.state.integers;
  const auto names = integers.find(fragment_names), journal = integers.find(journal_position);
  if (names == integers.end() || journal == integers.end() || journal->second.size() != 1)
    throw io::bad_file(file, "checkpoint", "lacks the recorder's part",
                       "run from the start, without --resume");
  run.state.fragment_names = unpacked(names->second);
  run.journal_position = static_cast<std::uint64_t>(journal->second[0]);
  integers.erase(fragment_names);
  integers.erase(journal_position);
  return run;
}

void require_same_scene(const fs::path& directory, const std::string& hash) {
  const fs::path file = directory / "scene.resolved.json";
  if (fs::exists(file) && scene_hash(io::read_file(file)) != hash)
    throw io::bad_file(
        file, "--resume", "the directory holds a run of another scene, or of this one with other values",
        "resume with the scene and the --set that it was started with, or leave --resume out to start anew");
}

std::optional<std::string> finished(const fs::path& directory) {
  const fs::path file = directory / "summary.json";  // the last thing that a run swaps in
  if (!fs::exists(file) || !fs::exists(directory / "scene.resolved.json")) return {};
  const auto summary = nlohmann::json::parse(io::read_file(file), nullptr, false);
  const auto text = [&](const char* key) {
    return summary.is_object() && summary.contains(key) && summary[key].is_string()
               ? summary[key].get<std::string>()
               : std::string();
  };
  if (!io::has_ended(text("status"))) return {};
  return text("message");
}

}  // namespace talus::app
