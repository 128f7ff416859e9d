/// A run's checkpoint on disk: the state of the simulation and how far its records had come.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "app/progress.hpp"
#include "io/recorder.hpp"
#include "sim/simulation.hpp"

namespace talus::app {

inline constexpr const char* checkpoint_name = "checkpoint.h5";

/// Records a run and its checkpoints, and shows its progress.
class RecordingSink : public sim::Sink {
 public:
  /// `hash` of the resolved scene stands in every checkpoint.
  RecordingSink(io::Recorder& recorder, std::string hash) : recorder_(recorder), hash_(std::move(hash)) {}

  void history(const sim::HistoryRow& row) override { recorder_.history(row); }
  void contacts(std::span<const sim::ContactRow> rows) override { recorder_.contacts(rows); }
  void field(double time, std::span<const Pose> poses,
             std::span<const Structure::Fields> structures) override {
    recorder_.field(time, poses, structures);
  }
  void extend(std::span<const sim::RunHeader::BlockInfo> fragments) override;
  void warning(const std::string& text) override;
  void checkpoint(const sim::Checkpoint& state) override;
  void progress(double time, double duration, const sim::RunCounters& counters, double residual) override {
    line_.show(time, duration, counters, residual);
  }
  void end_line() { line_.clear(); }

 private:
  io::Recorder& recorder_;
  std::string hash_;
  ProgressLine line_;
};

struct StoredRun {
  sim::Checkpoint state;
  std::uint64_t journal_position = 0;  // of the recorder
};

/// Throws InputError if the file is damaged, of another scene or another version.
StoredRun load_run(const std::filesystem::path& file, const std::string& hash);

/// Refuses to go on in a directory that another scene wrote: throws InputError.
void require_same_scene(const std::filesystem::path& directory, const std::string& hash);

/// The message of the directory's run if it came to its end.
std::optional<std::string> finished(const std::filesystem::path& directory);

}  // namespace talus::app
