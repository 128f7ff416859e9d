/// Writes the output directory of a run: journal, results.h5, fields for ParaView, log, summary.
///
/// How the pieces share the work: rows go to an append-only journal with checksums (journal.hpp); results.h5
/// is built from it when the journal has grown by half since the last time (a large one: to the fourfold),
/// and at the end, and swapped in by rename. It is therefore readable at any moment, and all rebuilding
/// together costs at most three times the last one. Field files for ParaView are written as they come, each
/// whole or absent.
///
/// A run calls, in this order of time: history (t = 0, every history interval, the end), contacts (of the
/// coupled steps since), field (t = 0, every output interval, the end), extend (before the first row with
/// fragments), checkpoint, finish.
#pragma once
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "io/field_columns.hpp"
#include "io/files.hpp"
#include "io/line_rows.hpp"
#include "io/summary.hpp"
#include "sim/final_state.hpp"
#include "sim/frame.hpp"

namespace talus::io {

struct RecorderOptions {
  std::filesystem::path directory;
  std::string scene_file;     // copied to scene.toml if it is a file; may be empty
  std::string resolved_json;  // scene.resolved.json; may be empty
  bool paraview = true;       // .vtu, .pvd
};

class Recorder {
 public:
  /// A new run. The directory must be absent, empty or ours: InputError otherwise, before anything is
  /// written.
  Recorder(RecorderOptions options, const sim::RunHeader& header);
  /// Goes on with a run that was cut off: the journal is cut back to `position`, which the checkpoint holds.
  /// Throws InputError if the journal does not reach that far.
  Recorder(RecorderOptions options, std::uint64_t position);
  ~Recorder();
  Recorder(Recorder&&) noexcept;

  void history(const sim::HistoryRow& row);
  void contacts(std::span<const sim::ContactRow> rows);
  /// Poses of all present blocks and the fields of each structure, in the header's order.
  void field(double time, std::span<const Pose> poses, std::span<const Structure::Fields> structures);
  /// Names of the lines whose crossings are recorded; once, before the first.
  void lines(std::span<const std::string> names);
  void crossings(std::span<const LineRow> rows);
  /// Fragments are appended to the blocks; rows before read NaN for them.
  void extend(std::span<const sim::RunHeader::BlockInfo> fragments);
  /// What the run warns of while it goes on; goes into the summary after those of the header.
  void warning(const std::string& text);
  /// Those of the header, and of the run so far; of a run that goes on, from its start.
  const std::vector<std::string>& warnings() const;

  /// Makes everything recorded so far durable and returns the journal's position, to be stored in the
  /// checkpoint.
  std::uint64_t checkpoint();
  /// Builds results.h5, .xdmf, .pvd, summary.json. A status that is no end (has_ended) keeps the journal, so
  /// that the run can be resumed. `state` goes into results.h5, for a later run to start from. summary.json
  /// is swapped in last: once it shows the end, all else is there. Returns its text.
  std::string finish(const Outcome& outcome, const sim::FinalState* state = nullptr);

  JsonLog& log();  // log.jsonl
  const std::filesystem::path& directory() const;
  const sim::RunHeader& header() const;  // fragments included

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Builds results.h5 and summary.json of a directory whose run was cut off (kill, power). False if it has no
/// journal, that is, if the run finished.
bool recover(const std::filesystem::path& directory);

}  // namespace talus::io
